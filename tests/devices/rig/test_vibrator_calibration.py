"""A vibrator's twin, calibrated by an accelerometer's twin on it, has the response of its equation."""

import numpy as np
import pytest
from scipy.signal import freqz

from palpate.devices.device import DeviceError
from palpate.devices.rig.calibration import CalibrationJob, UnfitMeasurement
from palpate.devices.rig.file import read_rig
from palpate.devices.rig.vibrator_calibration import bench_of, calibrate_vibrator
from palpate.devices.vibrator.calibration import load
from palpate.devices.vibrator.outputs import TWIN_COIL

RIG = """rig: twins
devices:
  acc: {{kind: accelerometer, driver: twin, rate_hz: 3000, noise_V: 0.0005}}
  other: {{kind: accelerometer, driver: twin, rate_hz: 500}}
  shaker: {{kind: vibrator, driver: twin, rate_hz: 12000, bits: 24{more}}}
"""


def job_for(folder, more=""):
    path = folder / "rig.yaml"
    path.write_text(RIG.format(more=more))
    return CalibrationJob(read_rig(path), "shaker", "2026-11-28", lambda _text: None, lambda _text: None)


def test_the_calibration_is_the_response_of_the_twin_within_half_a_db_and_its_delay(tmp_path):
    result = calibrate_vibrator(job_for(tmp_path, ", delay_ms: 6"), "acc", None, 4, False)
    calibration = load(tmp_path / "shaker-2026-11-28.json")
    assert result.settings == {"calibration": "shaker-2026-11-28.json", "calibrated": "2026-11-28"}
    b, a = TWIN_COIL.__class__(**{**vars(TWIN_COIL), "rate_hz": 12000.0}).weights()
    hz = np.array(calibration.hz)
    _, truth = freqz(b, a, worN=hz, fs=12000)
    error_dB = 20 * np.log10(np.abs(calibration.response) / np.abs(truth))
    assert hz[0] == 20 and hz[-1] == 1000 and np.abs(error_dB[hz <= 500]).max() < 0.5 and np.abs(error_dB).max() < 1.0
    assert np.sqrt(np.mean(error_dB[hz <= 500] ** 2)) < 0.15
    assert calibration.delay_ms == pytest.approx(6.0, abs=0.5) and calibration.linear_dB < 0.2
    assert 2.0 < calibration.most_V * 400 < 30.0, "as loud as the sensor bears"


@pytest.mark.parametrize(
    ("sensor", "level_V", "seconds", "message"),
    [
        ("other", None, None, "other samples at 500 Hz; to measure shaker a whole number of Hz, 1000 at least"),
        (None, None, None, "shaker is calibrated with an accelerometer on it: give --with NAME"),
        ("acc", 2.0, None, r"--level 2: shaker bears 1 V \(`limits.peak_V`\)"),
        ("acc", None, 2.0, "--seconds 2: 4 at least are needed"),
    ],
)
def test_a_calibration_that_cannot_be_is_refused_before_anything_moves(tmp_path, sensor, level_V, seconds, message):
    with pytest.raises(DeviceError, match=message):
        calibrate_vibrator(job_for(tmp_path), sensor, level_V, seconds, False)


def test_a_level_beyond_the_sensor_calibrates_nothing(tmp_path):
    with pytest.raises(UnfitMeasurement, match="of the samples of acc are clipped: give a lower --level"):
        calibrate_vibrator(job_for(tmp_path), "acc", 0.3, 4, False)
    assert not list(tmp_path.glob("*.json"))


def test_the_bench_ends_silent(tmp_path):
    job = job_for(tmp_path)
    with bench_of(job, "acc", job.file.devices["shaker"]) as bench:
        bench.shaken(0.01 * np.sin(np.arange(6000)))
    assert not bench.vibrator.player.busy
