"""palpate rig: what is checked, what a twin rig holds, what a kind's settings are, and what is told of mistakes."""

import json
from pathlib import Path

import pytest

from palpate.command_line import _status
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
def said(tmp_path, capsys):
    """Call `palpate rig ...`; what it says on the stream that its exit code goes with."""

    def call(*arguments, status=0):
        assert _status(["rig", *map(str, arguments)]) == status
        caught = capsys.readouterr()
        assert "Traceback" not in caught.err
        return caught.err if status == 2 else caught.out

    return call


@pytest.fixture
def lab(tmp_path):
    path = rig_path(tmp_path)
    path.parent.mkdir(parents=True)
    path.write_text(RIG, encoding="utf-8")
    return tmp_path


def test_a_device_is_read_and_told_with_rate_mean_noise_and_calibration(said, lab):
    text = said("check", "vibration", "--seconds", 0.2, "--lab", lab)
    assert "ok     vibration (accelerometer, twin): " in text and "calibrated 2026-03-01" in text
    assert "Hz measured, 3000 Hz nominal" in text
    assert "by ADXL335, typical values of the data sheet" in text
    az = next(line.split() for line in text.splitlines() if line.split()[:1] == ["az"])
    assert abs(float(az[1]) - 9.81) < 0.1 and az[2:4] == ["m/s^2", "noise"] and 0 < float(az[4]) < 0.5
    assert "noise (" not in text, "only what is named is looked at"


@pytest.mark.needs("serial")
def test_what_cannot_be_opened_is_told_beside_what_can_and_the_exit_code_says_so(said, lab):
    text = said("check", "--seconds", 0.2, "--lab", lab, status=1)
    assert "ok     noise" in text and "ok     vibration" in text
    assert "NOT OK camera (camera): camera: the camera's folder" in text and "cannot be read" in text
    assert "NOT OK scanner (stage): scanner: the scanner's port /dev/no-such-port cannot be opened" in text


def test_as_json_the_same_is_data_without_nan(said, lab):
    told = json.loads(
        said("check", "noise", "vibration", "camera", "--seconds", 0.2, "--lab", lab, "--json", status=1),
        parse_constant=pytest.fail,
    )
    assert [told[name]["ok"] for name in ("noise", "vibration", "camera")] == [True, True, False]
    [reading] = told["vibration"]["readings"]
    assert reading["nominal_hz"] == 3000 and reading["units"] == ["m/s^2"] * 3 and len(reading["noise"]) == 3
    assert told["vibration"]["calibrated"] == "2026-03-01" and told["vibration"]["twin"] and not told["camera"]["twin"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("check", "vibratoin"), "names no device 'vibratoin'; did you mean 'vibration'?"),
        (("check", "--seconds", "0"), "0.2<=x<=60"),
        (("check", "--rig", "nowhere.yaml"), "nowhere.yaml: no rig file there; write one of twins"),
        (("kinds", "acelerometer"), "no kind 'acelerometer'; did you mean 'accelerometer'?"),
        (("simulate",), "exists; give another --out, or --force"),
    ],
)
def test_a_mistake_is_told_with_what_to_do(said, lab, words, told):
    where = () if words[0] == "kinds" else ("--lab", lab)
    assert told in said(*words, *where, status=2)


def test_without_a_rig_file_the_way_to_one_is_told(said, tmp_path):
    assert f"palpate rig simulate --out {rig_path(tmp_path)}" in said("check", "--lab", tmp_path, status=2)


def test_a_mistake_in_the_file_is_told_with_its_line(said, lab):
    rig_path(lab).write_text(RIG.replace("driver: folder", "driver: folders"), encoding="utf-8")
    assert "line 5: devices.camera.driver: found 'folders'" in said("check", "--lab", lab, status=2)


def test_a_rig_of_twins_serves_every_need_of_the_shipped_studies_but_samples(said, tmp_path):
    assert "palpate rig check --rig" in said("simulate", "--lab", tmp_path)
    rig = read_rig(rig_path(tmp_path))
    assert {rig.kind(name) for name in rig.devices} == {*KINDS.places} and all(map(rig.is_twin, rig.devices))
    needs = {need for study in SHIPPED.glob("*/study.yaml") for need in read_study(study).study.needs}
    assert (needs & {*TAKES}) - {*rig.needs} == {"samples"}, "samples are mounted by hand unless a lab says otherwise"
    rig_path(tmp_path).write_text("mine")
    said("simulate", "--lab", tmp_path, status=2)
    assert rig_path(tmp_path).read_text() == "mine"
    said("simulate", "--force", "--out", rig_path(tmp_path))
    assert read_rig(rig_path(tmp_path)).name == "twins"


def test_kinds_are_listed_with_the_needs_that_take_them(said):
    lines = said("kinds").splitlines()
    assert [line.split()[0] for line in lines] == [*KINDS]
    assert all(need in next(line for line in lines if line.startswith(kind)) for need in TAKES for kind in TAKES[need])


@pytest.mark.parametrize("kind", KINDS)
def test_every_setting_is_told_with_what_it_takes_its_default_and_what_it_means(said, kind):
    settings = settings_of_kind(KINDS[kind])
    assert {each.name.partition(".")[0] for each in settings} == {*KINDS[kind].settings.model_fields}
    text = said("kinds", kind)
    for each in settings:
        assert each.meaning, f"MEANINGS of the kind {kind} says nothing of {each.name}"
        assert f"{each.takes}; " in text and each.meaning in text


def row(each):
    default = each.default if each.default == "required" else f"`{each.default}`"
    return f"| `{each.name}` | {each.takes} | {default} | {each.meaning} |"


@pytest.mark.parametrize("kind", KINDS)
def test_the_page_of_the_rig_file_has_every_setting_of_every_kind(kind):
    section = PAGE.read_text(encoding="utf-8").partition(f"\n### `{kind}`\n")[2].partition("\n### ")[0]
    shared = {"kind", "calibrated"}
    wanted = [row(each) for each in settings_of_kind(KINDS[kind]) if each.name not in shared]
    assert [line for line in section.splitlines() if line.startswith("| `")] == wanted


def test_the_page_of_the_rig_file_has_every_need():
    text = PAGE.read_text(encoding="utf-8")
    for need, kinds in TAKES.items():
        assert f"| `{need}` | {', '.join(f'`{kind}`' for kind in kinds)} |" in text
