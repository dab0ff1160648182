"""A rig file says what it means, or what is wrong with it and where."""

import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.devices.rig.file import RigFileError, read_rig, rig_path
from palpate.protocols.needs import NEEDS

GOOD = """rig: booth
devices:
  vibration: {kind: accelerometer, driver: twin, rate_hz: 3000}
  force: {kind: force_torque, driver: twin, rate_hz: 8000, calibrated: 2026-03-01}
  tracker: {kind: tracker, driver: twin}
  noise: {kind: masking_noise, driver: twin}
needs:
  tool: [vibration, force, tracker]
  masking_noise: [noise]
"""


def written(tmp_path, text):
    path = tmp_path / "rig.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_rig_file_names_devices_and_what_they_serve(tmp_path):
    rig = read_rig(written(tmp_path, GOOD))
    assert rig.name == "booth" and list(rig.devices) == ["vibration", "force", "tracker", "noise"]
    assert rig.names_for("tool") == ("vibration", "force", "tracker") and rig.kind("force") == "force_torque"
    assert all(rig.is_twin(name) for name in rig.devices)
    assert rig.definition(["force"])["force"]["rate_hz"] == 8000
    with pytest.raises(RigFileError, match=r"'door' is not provided: needs: \{door: \[...\]\}"):
        rig.names_for("door")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("rig: booth", "rigg: booth", r"line 1: rigg: unknown key; .*'rig'"),
        ("rig: booth", "rig: 7", r"line 1: rig: a name for the rig is expected"),
        ("kind: tracker", "kind: trakker", r"line 5: devices.tracker.kind: no kind 'trakker'; .*'tracker'"),
        ("{kind: tracker, driver: twin}", "{driver: twin}", r"line 5: devices.tracker.kind: a kind is expected"),
        ("{kind: tracker, driver: twin}", "[twin]", r"line 5: devices.tracker: settings are expected"),
        ("rate_hz: 8000", "rate_khz: 8", r"line 4: devices.force.rate_khz: unknown key; .*'rate_hz'"),
        ("rate_hz: 8000", "rate_hz: fast", r"line 4: devices.force.rate_hz: found 'fast'"),
        ("rate_hz: 8000", "rate_hz: -1", r"line 4: devices.force.rate_hz: "),
        ("rate_hz: 8000", "rate_hz: .nan", r"line 4: "),
        ("driver: twin, rate_hz: 3000", "driver: nidaq", r"line 3: devices.vibration.driver: found 'nidaq', expected"),
        ("[vibration, force, tracker]", "[vibration, forc, tracker]", r"line 8: needs.tool\[1\]: no device 'forc'"),
        ("[vibration, force, tracker]", "[vibration, force]",
         r"takes one accelerometer, one force_torque, one tracker; found one accelerometer, one force_torque"),
        ("[noise]", "[[noise]]", r"line 9: needs.masking_noise\[0\]: no device \['noise'\]"),
        ("[noise]", "[{noise: 1}]", r"needs.masking_noise\[0\]: no device \{"),
        ("[noise]", "noise", r"line 9: needs.masking_noise: a list of devices is expected"),
        ("masking_noise: [noise]", "maskin_noise: [noise]", r"maskin_noise: no study needs this; .*'masking_noise'"),
        ("  force:", "  tracker:", r"line \d: .*tracker.*twice"),
        ("calibrated: 2026-03-01", "calibrated: last spring", r"line 4: devices.force.calibrated: found 'last spring'"),
    ],
)  # fmt: skip
def test_a_mistake_is_reported_with_its_line_and_the_nearest_name(tmp_path, old, new, message):
    path = written(tmp_path, GOOD.replace(old, new, 1))
    with pytest.raises(RigFileError, match=message) as caught:
        read_rig(path)
    assert str(path) in str(caught.value)


def test_a_file_that_a_setting_names_is_part_of_what_the_ledger_keeps(tmp_path):
    rig = read_rig(written(tmp_path, GOOD.replace("calibrated: 2026-03-01", "calibration: FT1.cal")))
    assert "calibration_sha256" not in rig.definition(["force"])["force"]
    parts = []
    for text in ("one", "other", "one"):
        (tmp_path / "FT1.cal").write_text(text)
        parts.append(rig.definition(["force"])["force"]["calibration_sha256"])
    assert parts[0] == parts[2] != parts[1]


def test_all_mistakes_are_reported_at_once(tmp_path):
    path = written(tmp_path, GOOD.replace("rate_hz: 8000", "rate: 1").replace("rate_hz: 3000", "rate: 2"))
    with pytest.raises(RigFileError) as caught:
        read_rig(path)
    assert len(str(caught.value).splitlines()) == 2


def test_the_error_without_a_rig_file_says_how_to_get_one(tmp_path):
    with pytest.raises(RigFileError, match="palpate rig simulate --out"):
        read_rig(rig_path(tmp_path, "booth-2.example.org"))
    assert rig_path(tmp_path, "booth-2.example.org") == tmp_path / "stations" / "booth-2" / "rig.yaml"


LINES = st.lists(
    st.one_of(
        st.sampled_from(GOOD.splitlines()),
        st.text(alphabet=string.printable, max_size=40),
        st.sampled_from(["devices:", "needs:", "  x: {kind: door}", "  - a", "rig: {}", "  tool: {}", "  1: 2", "? a"]),
    ),
    max_size=14,
)


@given(LINES)
def test_no_text_brings_anything_but_a_complaint_or_a_rig(tmp_path_factory, lines):
    path = tmp_path_factory.mktemp("rig") / "rig.yaml"
    path.write_text("\n".join(lines), encoding="utf-8")
    try:
        rig = read_rig(path)
    except RigFileError as error:
        assert str(error)
    else:
        for need, names in rig.needs.items():
            assert sorted(map(rig.kind, names)) == sorted(NEEDS[need].takes)
