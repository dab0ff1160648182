"""palpate rig calibrate: it finds the true settings, repeats bad positions, and leaves the rest of the rig file."""

import io
import json
import subprocess
import sys
from itertools import pairwise, repeat

import click
import numpy as np
import pytest

from palpate.command_line import _status, cli
from palpate.devices.actuator.calibration import load
from palpate.devices.daq.adxl335 import POSITIONS
from palpate.devices.kinds import KINDS, CalibrationMethod
from palpate.devices.rig.calibration import CalibrationJob, UnfitMeasurement
from palpate.devices.rig.commands_calibrate import calibrate
from palpate.devices.rig.file import read_rig
from palpate.devices.rig.opened import check_device, opened_device
from palpate.devices.rig.vibration_calibration import Bench, Fastened, Hastened, Lying
from palpate.signals import GRAVITY_M_S2

RIG = """# Booth 2, moved in March.
rig: booth
devices:
  vibration: {kind: accelerometer, driver: twin, sensitivity_V_per_g: [0.34, 0.31, 0.29], supply_V: 3.3,  # at the door
              zero_g_V: [1.70, 1.41, 1.62], scaled_at_V: 3.3}
  bare: {kind: accelerometer, driver: nidaqmx}
  actuator:   # the small one
    kind: voice_coil
    driver: twin  # until the amplifier is back
  stylus: {kind: tablet, driver: twin}
  force: {kind: force_torque, driver: twin}
  tracker: {kind: tracker, driver: twin}
  door: {kind: door, driver: twin}
  noise: {kind: masking_noise, driver: twin}
  camera: {kind: camera, driver: twin}
  stage: {kind: stage, driver: twin}
"""
DAY = "2026-11-21"


@pytest.fixture
def rig(tmp_path):
    path = tmp_path / "rig.yaml"
    path.write_text(RIG, encoding="utf-8")
    return path


@pytest.fixture
def run(rig, monkeypatch, capsys):
    """Call `palpate rig calibrate ...` with these lines typed; standard output, standard error."""
    monkeypatch.setitem(cli.get_command(None, "rig").commands, "calibrate", calibrate)

    def call(*arguments, status=0, typed=""):
        monkeypatch.setattr("sys.stdin", io.StringIO(typed))
        assert _status(["rig", "calibrate", *map(str, arguments), "--rig", str(rig), "--date", DAY]) == status
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        return out, err

    return call


def changed_lines(path):
    return [line for line in path.read_text(encoding="utf-8").splitlines() if line not in RIG.splitlines()]


def test_six_positions_find_the_true_sensitivity_and_zero_of_the_twin_and_say_how_well_they_fit(run, rig):
    out, err = run("vibration", typed="\n" * 6)
    assert [line.split(":")[0] for line in err.splitlines() if ": lay" in line] == [*POSITIONS]
    assert f"  calibrated: {DAY}" in out.splitlines() and "--write puts it there" in out
    assert rig.read_text() == RIG, "nothing is written unless it is asked for"
    report = json.loads(run("vibration", "--yes", "--json")[0])
    assert np.allclose(report["settings"]["sensitivity_V_per_g"], [0.34, 0.31, 0.29], atol=2e-4)
    assert np.allclose(report["settings"]["zero_g_V"], [1.70, 1.41, 1.62], atol=2e-4)
    assert report["settings"]["scaled_at_V"] == 3.3 and report["twin"] and not report["written"]
    assert set(report["figures"]["residual_g"]) == {*POSITIONS} and 0 < report["figures"]["worst_g"] < 0.002


def test_write_changes_the_entry_and_no_other_character(run, rig):
    run("vibration", "--yes", "--write")
    [sensitivity, zero] = changed_lines(rig)
    assert sensitivity.endswith("], supply_V: 3.3,  # at the door")
    assert zero.startswith("              zero_g_V: [1.7") and zero.endswith(f"scaled_at_V: 3.3, calibrated: {DAY}}}")
    health = check_device(read_rig(rig), "vibration", 0.2)
    assert health.ok and health.calibrated == DAY and "six positions" in health.readings[0].signal.calibration


def test_a_real_one_is_read_in_real_time_after_an_enter_for_each_position(run, monkeypatch):
    from palpate.devices.daq import accelerometer

    daq_of = accelerometer._daq
    monkeypatch.setattr(accelerometer, "_daq", lambda name, settings, *rest: daq_of(
        name, settings.model_copy(update={"driver": "twin"}), *rest))  # fmt: skip
    out, err = run("bare", "--seconds", 0.2, typed="\n" * 6)
    assert "bare (accelerometer):" in out and err.count("Enter: done") == 6
    assert "nobody answered: run this at a terminal\n" in run("bare", typed="\n" * 2, status=2)[1]


class Hand:
    """Lays the sensor in the given positions first, whatever is asked for; then as asked."""

    def __init__(self, *scenes):
        self.scenes = list(scenes)

    def lays(self, sensor):
        class Laid(Hastened):
            def expect(laid, scene):
                super().expect(self.scenes.pop(0) if self.scenes else scene)

        return Laid(sensor.name, sensor.kind, sensor.driver, sensor.daq, sensor.transducer)


class Dropped(Lying):
    def acceleration_m_s2(self, rate_hz):
        yield next(super().acceleration_m_s2(rate_hz))
        yield from Lying("+z").acceleration_m_s2(rate_hz)


class Tilted(Lying):
    """By 15 degrees: 0.26 g on an axis that should feel nothing."""

    def acceleration_m_s2(self, rate_hz):
        axis = "xyz".index(self.up[1])
        leaning = np.roll([np.cos(np.radians(15)), np.sin(np.radians(15)), 0.0], axis)
        return repeat(np.tile((1 if self.up[0] == "+" else -1) * GRAVITY_M_S2 * leaning, (512, 1)))


@pytest.fixture
def bench(rig):
    """A bench on which a hand lays the sensor; what it asks and says."""
    prompts, lines = [], []
    file = read_rig(rig)
    with opened_device(file, "vibration") as sensor:

        def laid(*scenes):
            job = CalibrationJob(file, "vibration", DAY, prompts.append, lines.append)
            hastened = Hand(*scenes).lays(sensor)
            return Bench(job, hastened, sensor.transducer.scaling, 3000, hastened.clock.ns), prompts, lines

        yield laid


def test_a_wrong_axis_and_a_sensor_that_moved_are_asked_for_again_by_name(bench):
    laid, prompts, lines = bench(Lying("-y"), Lying("-x"), Dropped("+x"))
    volts = laid.measured("+x")
    assert np.allclose(volts, [1.70 + 0.34, 1.41, 1.62], atol=1e-3)
    assert len(prompts) == 4
    assert prompts[0].startswith("+x: lay")
    assert all(prompt.startswith("+x again") for prompt in prompts[1:])
    assert "+x is requested and -y seems to be up: x -0.000 g, y -1.000 g" in lines[0].replace("+0.000", "-0.000")
    assert "-x seems to be up" in lines[1] and "+x moved while it was read: " in lines[2]
    assert "wandered by 1.0" in lines[2]


def test_a_tilted_position_is_found_by_the_fit_and_only_that_one_is_asked_for_again(bench):
    laid, prompts, lines = bench(*map(Lying, POSITIONS[:2]), Tilted("+y"))
    fit = laid.fitted({position: laid.measured(position) for position in POSITIONS})
    assert [prompt.split(":")[0] for prompt in prompts] == [*POSITIONS, "+y again"]
    assert any("+y is off by" in line for line in lines) and fit.worst_g < 0.002


def test_five_bad_readings_of_a_position_end_it(bench):
    with pytest.raises(UnfitMeasurement, match=r"\+x: 5 attempts and none"):
        bench(*[Lying("-x")] * 5)[0].measured("+x")


@pytest.mark.parametrize(
    ("changed", "message"),
    [("noise_V: 0.1", "+x: 5 attempts and none that could be used"), ("noise_V: 0", "has stood at")],
)
def test_a_sensor_that_gives_nothing_usable_is_named_with_exit_code_1(run, rig, changed, message):
    rig.write_text(RIG.replace("scaled_at_V: 3.3}", f"scaled_at_V: 3.3, {changed}}}"))
    before = rig.read_text()
    assert message in run("vibration", "--yes", "--write", status=1)[1]
    assert rig.read_text() == before


def test_a_coil_is_identified_by_the_sensor_on_it_and_its_file_is_what_the_rig_then_plays_by(run, rig):
    out, err = run("actuator", "--with", "vibration", "--yes", "--write")
    assert "will shake at up to 0.5 V for some 12 s. Fasten vibration" in err
    assert all(f"  {word}: " in out for word in ("gain", "ripple", "delay", "coherence"))
    calibration = load(rig.parent / f"actuator-{DAY}.json")
    assert calibration.date == DAY
    assert calibration.ripple_dB < 1
    assert calibration.before_dB > 15
    assert 2 < calibration.delay_ms < 5
    new = [f"    calibration: actuator-{DAY}.json", f"    calibrated: {DAY}"]
    assert changed_lines(rig) == new
    health = check_device(read_rig(rig), "actuator", 0.2)
    assert health.ok and health.calibrated == DAY and "flat within" in health.summary
    assert "exists, and records may name it; give --force" in run("actuator", "--yes", "--with", "vibration",
                                                                             status=2)[1]  # fmt: skip


def test_a_calibration_that_is_named_before_it_is_there_does_not_stand_in_its_own_way(run, rig):
    rig.write_text(RIG.replace("driver: twin  # until", "calibration: coil.json\n    driver: twin  # until"))
    report = json.loads(run("actuator", "--with", "vibration", "--yes", "--seconds", 4, "--json")[0])
    assert report["settings"]["calibration"] == f"actuator-{DAY}.json"
    assert 0.9 < report["figures"]["coherence_median"] <= 1 and report["figures"]["ripple_dB"] < 1


@pytest.mark.long
@pytest.mark.parametrize(
    ("coil", "sensor", "options", "message"),
    [
        ("peak_V: 1", "noise_V: 0.1", ("--level", 0.001), "coherence below 0.8"),
        ("peak_V: 1", "sensitivity_V_per_g: [3, 0.3, 0.3]", (), "samples of on_it are clipped: give a lower"),
        ("peak_V: 1", "noise_V: 0", ("--level", 0.001), "has stood at"),
        ("rms_V: 0.05", "noise_V: 0.002", ("--level", 1), "samples were limited to what the coil bears"),
    ],
)
def test_a_recording_that_identifies_nothing_is_refused_by_name_and_leaves_no_file(
    run, rig, coil, sensor, options, message
):
    coil, sensor = f"{{kind: voice_coil, driver: twin, {coil}}}", f"{{kind: accelerometer, driver: twin, {sensor}}}"
    rig.write_text(f"rig: booth\ndevices:\n  coil: {coil}\n  on_it: {sensor}\n")
    assert message in run("coil", "--yes", "--seconds", 6, *options, status=1)[1]
    assert not [*rig.parent.glob("*.json")]


def test_what_is_felt_on_the_coil_is_what_it_does_at_any_rate_of_the_sensor(rig):
    class Coil:
        played, rate_hz = 0, 1000

        def advance(self):
            if self.played < 100:
                scene.fresh.append(np.arange(self.played, self.played + 3, dtype=float))
                self.played += 3

    for rate_hz in (1000.0, 3000.0, 4410.0, 700.0):
        scene, felt = Fastened(Coil()), []
        for piece in scene.acceleration_m_s2(rate_hz):
            felt += piece[:, 0].tolist()
            if len(felt) > 0.09 * rate_hz:
                break
        expected = np.floor(np.arange(len(felt)) * 1000 / rate_hz)
        assert np.abs(np.array(felt) - expected).max() <= 1e-9
        assert all(after >= before for before, after in pairwise(felt))


def test_a_tablets_pairs_give_the_curve_and_what_is_left_over(run, rig, tmp_path):
    pairs = tmp_path / "pairs.csv"
    rows = [f"{y / 10},{0.2 * np.exp(2.9 * y / 10):.4f}" for y in range(1, 11)]
    pairs.write_text("\n".join(["pressure,force_N", *rows]))
    out, _ = run("stylus", "--pairs", pairs, "--write", "--figure", tmp_path / "force.png")
    assert "residual of 10 pairs: " in out and "F = 0.2 exp(2.9 y) N" in out
    assert f"drawn: {tmp_path / 'force.csv'}" in out and (tmp_path / "force.png").is_file()
    force = read_rig(rig).devices["stylus"].force
    assert (force.a_N, force.b) == (pytest.approx(0.2, rel=1e-3), pytest.approx(2.9, rel=1e-3))
    pairs.write_text("pressure,force_N\n0.1,soft\n")
    assert "pairs.csv, line 2: two numbers are expected" in run("stylus", "--pairs", pairs, status=2)[1]
    pairs.write_text("pressure,force_N\n0.1,0.2\n")
    assert "pairs.csv: 1 pressures and 1 forces" in run("stylus", "--pairs", pairs, status=2)[1]


def test_every_kind_is_calibrated_here_or_says_where(run):
    measured = {name for name, kind in KINDS.items() if isinstance(kind.calibration, CalibrationMethod)}
    assert measured == {"accelerometer", "tablet", "vibrator", "voice_coil"}
    for name, word in [("force", ".cal"), ("tracker", "Motive"), ("door", "handle_radius_m"), ("noise", "sound level"),
                       ("camera", "focus"), ("stage", "nothing to calibrate")]:  # fmt: skip
        assert word in run(name, status=2)[1]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("vibratoin",), "names no device 'vibratoin'; did you mean 'vibration'?"),
        (("vibration", "--pairs", __file__), "--pairs is for tablet; vibration is of kind accelerometer"),
        (("vibration", "--with", "bare"), "--with is for voice_coil or vibrator"),
        (("bare", "--yes"), "--yes: bare is a real one, somebody has to turn it"),
        (("vibration", "--yes", "--seconds", "0.2", "--rate"), "No such option"),
        (("vibration",), "nobody answered: run this at a terminal, or give --yes"),
        (("actuator", "--yes"), "give --with NAME; "),
        (("actuator", "--with", "vibratoin"), "did you mean 'vibration'?"),
        (("actuator", "--with", "force"), "--with force: that is a force_torque; an accelerometer is expected"),
        (("actuator", "--with", "bare"), "actuator is a twin and bare is not"),
        (("actuator", "--with", "vibration", "--level", "3"), "actuator bears 1 V (`peak_V`); give a lower level"),
        (("actuator", "--with", "vibration", "--seconds", "2"), "4 at least are needed"),
        (("stylus",), "give --pairs FILE.csv with the columns pressure,force_N"),
        (("stylus", "--pairs", "nowhere.csv"), "'nowhere.csv' does not exist"),
    ],
)
def test_a_mistake_is_reported_with_what_to_do(run, rig, words, message):
    out, err = run(*words, status=2)
    assert message in " ".join(err.split()) and not out
    assert rig.read_text() == RIG


def test_a_sensor_too_slow_for_the_coil_or_for_so_few_seconds_is_refused(run, rig):
    rig.write_text(RIG.replace("supply_V: 3.3,  #", "supply_V: 3.3, rate_hz: 400,  #"))
    assert "vibration samples at 400 Hz" in run("actuator", "--with", "vibration", "--yes", status=2)[1]
    message = run("vibration", "--yes", "--seconds", 0.2, status=2)[1]
    assert "80 samples a position; 100 are needed: give --seconds 0.25 or more" in message


def test_the_command_is_light_until_it_is_called():
    heavy = {"numpy", "scipy", "yaml", "pydantic", "nidaqmx", "sounddevice"}
    loaded = f"import palpate.devices.rig.commands_calibrate, sys; print({heavy} & {{*sys.modules}} or 'none')"
    loaded_modules = subprocess.run(
        [sys.executable, "-c", loaded], capture_output=True, text=True, timeout=60, check=True
    )
    assert loaded_modules.stdout.strip() == "none"
    assert isinstance(calibrate, click.Command)
