"""Settings put into a rig file: however an entry is written, everything else stays, or nothing is touched."""

import pytest

from palpate.devices.rig.calibration import write_settings
from palpate.devices.rig.file import RigFileError, read_rig

DAY = "2026-11-21"
NEW = {"sensitivity_V_per_g": [0.3, 0.31, 0.32], "calibrated": DAY}
LAYOUTS = {
    "braces": "  it: {kind: accelerometer, driver: twin}  # mine\n  noise: {kind: masking_noise, driver: twin}\n",
    "braces with a comma at the end": "  it: {kind: accelerometer, driver: twin,}\n",
    "lines": "  it:\n    kind: accelerometer\n    # typical values\n    driver: twin # soon real\n\n  # next\n"
    "  noise: {kind: masking_noise, driver: twin}\n",
    "quoted": "  \"it\": {kind: 'accelerometer', driver: \"twin\", calibrated: '2020-01-01'}\n",
    "an empty value": "  it:\n    calibrated:\n    kind: accelerometer\n    driver: twin",
    "a value over lines of its own": "  it:\n    kind: accelerometer\n    driver: twin\n    zero_g_V:\n      - 1.5\n"
    "      - 1.5\n      - 1.5\nneeds: {}\n",
    "json": '  "it": {"kind": "accelerometer", "driver": "twin", "sensitivity_V_per_g": [0.3,0.3,0.3]}\n',
}


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_however_an_entry_is_written_only_its_settings_change(tmp_path, layout, newline, mark):
    path = tmp_path / "rig.yaml"
    text = "# ours: ü\nrig: booth\ndevices:\n" + LAYOUTS[layout]
    path.write_bytes(mark + text.replace("\n", newline).encode())
    before = read_rig(path).devices
    write_settings(path, "it", NEW)
    after = read_rig(path).devices
    new = {"sensitivity_V_per_g": tuple(NEW["sensitivity_V_per_g"]), "calibrated": DAY}
    assert after["it"] == before["it"].model_copy(update=new)
    assert {**after, "it": None} == {**before, "it": None}
    written = path.read_bytes()
    assert written.startswith(mark) and (newline == "\n") == (b"\r" not in written)
    comments = [line.partition("#")[2].strip() for line in text.splitlines() if "#" in line]
    assert [x.partition("#")[2].strip() for x in written.decode().splitlines() if "#" in x] == comments
    assert [path.name for path in tmp_path.iterdir()] == ["rig.yaml"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("  it:\n    kind: accelerometer\n    driver: twin\n    sensitivity_V_per_g:\n    - 0.3\n    - 0.3\n    - .3\n",
         "line 7: a value over lines of its own"),
        ("  other: {kind: accelerometer, driver: twin}\n", "it is not there any more"),
        ("  it: {kind: accelerometer, driver: twin\n", "while parsing a flow mapping"),
        ("  it: {kind: accelerometer, driver: twin, supply_V: 9}\n", "supply_V"),
    ],
)  # fmt: skip
def test_an_entry_that_cannot_be_edited_safely_stays_and_the_text_to_paste_is_printed(tmp_path, text, message):
    path = tmp_path / "rig.yaml"
    path.write_text("rig: booth\ndevices:\n" + text)
    before = path.read_bytes()
    with pytest.raises(RigFileError) as refused:
        write_settings(path, "it", NEW)
    assert "was not changed" in str(refused.value) and message in str(refused.value)
    assert str(refused.value).endswith(f"  sensitivity_V_per_g: [0.3, 0.31, 0.32]\n  calibrated: {DAY}")
    assert path.read_bytes() == before and len([*tmp_path.iterdir()]) == 1


def test_a_link_to_the_rig_file_stays_a_link(tmp_path):
    real, link = tmp_path / "shared.yaml", tmp_path / "rig.yaml"
    real.write_text("rig: booth\ndevices:\n" + LAYOUTS["braces"])
    link.symlink_to(real)
    write_settings(link, "it", NEW)
    assert link.is_symlink() and DAY in real.read_text()
