"""A twin's known delay and jitter are recovered within a sample of the sensor, and a study's bound is kept."""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from palpate.devices.device import DeviceError
from palpate.devices.rig.calibration import UnfitMeasurement
from palpate.devices.rig.certification import certify, demand_certified, measure, onsets
from palpate.devices.rig.commands import rig
from palpate.devices.rig.file import read_rig
from palpate.devices.rig.vibrator_calibration import bench_of
from palpate.devices.vibrator.device import make
from tests.devices.rig.test_vibrator_calibration import job_for

SAMPLE_MS = 1000 / 3000


def test_every_delay_of_the_twin_is_recovered_within_a_sample_of_the_sensor(tmp_path):
    job = job_for(tmp_path, ", delay_ms: 7, jitter_ms: 0.5")
    with bench_of(job, "acc", job.file.devices["shaker"]) as bench:
        result = measure(bench, 30)
        truth = np.array(bench.vibrator.output.delays) / 12
    assert len(truth) == 30 and truth.std() > 0.3
    assert np.abs(result.onset_ms - truth).max() < SAMPLE_MS
    assert abs((result.onset_ms - truth).mean()) < 0.1 and (result.onset_ms - truth).std() < 0.05
    assert np.abs(result.level_dB).max() < 0.2
    assert np.abs(result.late_ms - truth).max() < 1.5 * SAMPLE_MS, "the twin reports when its output plays"


def test_the_command_writes_a_certificate_that_holds_for_these_settings_only(tmp_path):
    job = job_for(tmp_path, ", delay_ms: 4")
    words = ["certify", "shaker", "--sensor", "acc", "--bursts", "20", "--date", "2026-11-28", "--write", "--yes"]
    done = CliRunner().invoke(rig, [*words, "--rig", str(job.file.path), "--json"])
    assert done.exit_code == 0, done.output
    figures = json.loads(done.stdout)["figures"]
    settings = read_rig(job.file.path).devices["shaker"]
    assert settings.certificate.p50_ms == pytest.approx(4.0, abs=SAMPLE_MS) == figures["p50_ms"]
    assert settings.certificate.p50_ms <= settings.certificate.p99_ms <= settings.certificate.most_ms < 4.5

    def demand(onset_ms, **changes):
        shaker = make("shaker", settings.model_copy(update=changes), tmp_path)
        shaker.open()
        demand_certified(shaker, onset_ms)
        return shaker

    shaker = demand({"p99": 5.0, "max": 5.0})
    assert "ms (p99)" in shaker.health(0.0).facts["onset"] and "other settings" not in shaker.health(0.0).facts["onset"]
    with pytest.raises(DeviceError, match=r"shaker: onset p99 is [34].\d+ ms .* at most 2 ms"):
        demand({"p99": 2.0})
    with pytest.raises(DeviceError, match="its settings have changed since it was certified on 2026-11-28"):
        demand({"p99": 5.0}, delay_ms=30.0)
    with pytest.raises(DeviceError, match="never certified: palpate rig certify shaker --sensor NAME --write"):
        demand({"p99": 5.0}, certificate=None)
    shaker.calibration = shaker.calibration.model_copy(update={"linear_dB": 1.0})
    with pytest.raises(DeviceError, match="its settings have changed"):  # another calibration under the same name
        demand_certified(shaker, {"p99": 5.0})


def test_a_sensor_that_feels_nothing_certifies_nothing():
    chance = np.random.default_rng(1)
    noise, template = chance.standard_normal(3000), np.sin(np.arange(120) / 3) * np.hanning(120)
    with pytest.raises(UnfitMeasurement, match=r"burst 1 of 1 was not found \(correlation 0.\d+; 0.7 is needed\)"):
        onsets(noise, 3000, template, [0.1])
    with pytest.raises(UnfitMeasurement, match="burst 1 is not in the recording"):
        onsets(noise[:100], 3000, template, [0.1])
    noise[400:520] += 50 * -template
    flipped = onsets(noise, 3000, template, [0.1])
    assert flipped[0][0] == pytest.approx(1000 * (400 / 3000 - 0.1), abs=0.1)


def test_only_a_vibrator_is_certified(tmp_path):
    job = job_for(tmp_path)
    with pytest.raises(DeviceError, match="acc: it is of kind accelerometer, and only a vibrator is certified"):
        certify(replace(job, name="acc"), "acc", 20)
