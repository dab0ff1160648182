"""palpate rig: what is checked, what a twin rig holds, the settings of a kind, and the messages of mistakes."""

import json
from functools import partial
from pathlib import Path

import pytest

from palpate.devices.kinds import KINDS
from palpate.devices.rig.file import read_rig, rig_path
from palpate.devices.rig.meanings import settings_of_kind
from palpate.protocols.needs import NEEDS
from palpate.studies.catalogue import SHIPPED, read_study

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "rig-file.md"
TAKES = {name: need.takes for name, need in NEEDS.items() if need.takes}
RIG = """rig: booth
devices:
  noise: {kind: masking_noise, driver: twin}
  vibration: {kind: accelerometer, driver: twin, calibrated: 2026-03-01}
  camera: {kind: camera, driver: folder, folder: tethered}
  scanner: {kind: stage, driver: barcode, port: /dev/no-such-port}
"""


@pytest.fixture
def run(run_palpate):
    """Return a function that runs `palpate rig ...`."""
    return partial(run_palpate, "rig")


@pytest.fixture
def lab(tmp_path):
    path = rig_path(tmp_path)
    path.parent.mkdir(parents=True)
    path.write_text(RIG, encoding="utf-8")
    return tmp_path


def test_a_device_is_read_and_reported_with_rate_mean_noise_and_calibration(run, lab):
    text = run("check", "vibration", "--seconds", 0.2, "--lab", lab)
    assert "ok     vibration (accelerometer, twin): " in text and "calibrated 2026-03-01" in text
    assert "Hz measured, 3000 Hz nominal" in text
    assert "by ADXL335, typical values of the data sheet" in text
    az = next(line.split() for line in text.splitlines() if line.split()[:1] == ["az"])
    assert abs(float(az[1]) - 9.81) < 0.1 and az[2:4] == ["m/s^2", "noise"] and 0 < float(az[4]) < 0.5
    assert "noise (" not in text, "only what is named is looked at"


@pytest.mark.needs("serial")
def test_devices_that_cannot_be_opened_are_listed_beside_the_others_and_set_the_exit_code(run, lab):
    text = run("check", "--seconds", 0.2, "--lab", lab, status=1)
    assert "ok     noise" in text and "ok     vibration" in text
    assert "NOT OK camera (camera): camera: the camera's folder" in text and "cannot be read" in text
    assert "NOT OK scanner (stage): scanner: the scanner's port /dev/no-such-port cannot be opened" in text


def test_as_json_the_same_is_data_without_nan(run, lab):
    report = json.loads(
        run("check", "noise", "vibration", "camera", "--seconds", 0.2, "--lab", lab, "--json", status=1),
        parse_constant=pytest.fail,
    )
    assert [report[name]["ok"] for name in ("noise", "vibration", "camera")] == [True, True, False]
    [reading] = report["vibration"]["readings"]
    assert reading["nominal_hz"] == 3000 and reading["units"] == ["m/s^2"] * 3 and len(reading["noise"]) == 3
    assert report["vibration"]["calibrated"] == "2026-03-01"
    assert report["vibration"]["twin"]
    assert not report["camera"]["twin"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("check", "vibratoin"), "names no device 'vibratoin'; did you mean 'vibration'?"),
        (("check", "--seconds", "0"), "0.2<=x<=60"),
        (("check", "--rig", "nowhere.yaml"), "nowhere.yaml: no rig file there; write one of twins"),
        (("kinds", "acelerometer"), "no kind 'acelerometer'; did you mean 'accelerometer'?"),
        (("simulate",), "exists; give another --out, or --force"),
    ],
)
def test_a_mistake_is_reported_with_what_to_do(run, lab, words, message):
    where = () if words[0] == "kinds" else ("--lab", lab)
    assert message in run(*words, *where, status=2)


def test_without_a_rig_file_the_error_says_how_to_get_one(run, tmp_path):
    assert f"palpate rig simulate --out {rig_path(tmp_path)}" in run("check", "--lab", tmp_path, status=2)


def test_a_mistake_in_the_file_is_reported_with_its_line(run, lab):
    rig_path(lab).write_text(RIG.replace("driver: folder", "driver: folders"), encoding="utf-8")
    assert "line 5: devices.camera.driver: found 'folders'" in run("check", "--lab", lab, status=2)


def test_a_rig_of_twins_serves_every_need_of_the_shipped_studies_but_samples(run, tmp_path):
    assert "palpate rig check --rig" in run("simulate", "--lab", tmp_path)
    rig = read_rig(rig_path(tmp_path))
    assert {rig.kind(name) for name in rig.devices} == {*KINDS.places} and all(map(rig.is_twin, rig.devices))
    needs = {need for study in SHIPPED.glob("*/study.yaml") for need in read_study(study).study.needs}
    assert (needs & {*TAKES}) - {*rig.needs} == {"samples"}, "samples are mounted by hand unless a lab says otherwise"
    rig_path(tmp_path).write_text("mine")
    run("simulate", "--lab", tmp_path, status=2)
    assert rig_path(tmp_path).read_text() == "mine"
    run("simulate", "--force", "--out", rig_path(tmp_path))
    assert read_rig(rig_path(tmp_path)).name == "twins"


def test_kinds_are_listed_with_the_needs_that_take_them(run):
    lines = run("kinds").splitlines()
    assert [line.split()[0] for line in lines] == [*KINDS]
    assert all(need in next(line for line in lines if line.startswith(kind)) for need in TAKES for kind in TAKES[need])


@pytest.mark.parametrize("kind", KINDS)
def test_every_setting_is_listed_with_its_type_its_default_and_its_meaning(run, kind):
    settings = settings_of_kind(KINDS[kind])
    assert {setting.name.partition(".")[0] for setting in settings} == {*KINDS[kind].settings.model_fields}
    text = run("kinds", kind)
    for setting in settings:
        assert setting.meaning, f"MEANINGS of the kind {kind} says nothing of {setting.name}"
        assert f"{setting.takes}; " in text and setting.meaning in text


def row(setting):
    default = setting.default if setting.default == "required" else f"`{setting.default}`"
    return f"| `{setting.name}` | {setting.takes} | {default} | {setting.meaning} |"


@pytest.mark.parametrize("kind", KINDS)
def test_the_page_of_the_rig_file_has_every_setting_of_every_kind(kind):
    section = PAGE.read_text(encoding="utf-8").partition(f"\n### `{kind}`\n")[2].partition("\n### ")[0]
    shared = {"kind", "calibrated"}
    expected = [row(setting) for setting in settings_of_kind(KINDS[kind]) if setting.name not in shared]
    assert [line for line in section.splitlines() if line.startswith("| `")] == expected


def test_the_page_of_the_rig_file_has_every_need():
    text = PAGE.read_text(encoding="utf-8")
    for need, kinds in TAKES.items():
        assert f"| `{need}` | {', '.join(f'`{kind}`' for kind in kinds)} |" in text
