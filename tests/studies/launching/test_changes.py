"""A study or a screen that changed since the participant began is refused by name, or accepted on record."""

from __future__ import annotations

import pytest

from palpate.devices.window.calibration import Calibration
from palpate.protocols.canonical import digest
from palpate.studies.launching.changes import (
    ScreenChanged,
    StudyChanged,
    demand_same_screen,
    demand_unchanged,
    differences,
    earlier_header,
    study_change,
)
from palpate.studies.sessions.session import start
from tests.studies.live.halls import Hall, sheets, sheets_plan

HEADER = {"study": sheets().definition(), "participant": "P001", "session": 1, "calibration": None}
SCREEN = Calibration((1920, 1080), 3.62, 0, "2026-01-01T10:00:00")


def stimuli(**of_t07):
    rows = [dict(s) for s in sheets().definition()["stimuli"]]
    rows[0] = {**rows[0], "columns": {**rows[0]["columns"], **of_t07}}
    return rows


@pytest.mark.parametrize(
    ("changes", "description"),
    [
        ({"scale": {"from": -10, "to": 12, "step": 1}}, "scale.high was 10 and is 12"),
        ({"stimuli": stimuli(material="cloth")}, 'stimuli.T07.columns.material was "sandpaper P60" and is "cloth"'),
        ({"stimuli": stimuli()[1:]}, "stimuli.T07 was {"),
        ({"attributes": [["Cold", "Warm"], ["Soft", "Hard"]]}, "attributes is in another order"),
        ({"attributes": [["Soft", "Tough"], ["Cold", "Warm"]]}, 'attributes.Soft.high was "Hard" and is "Tough"'),
        ({"instructions": "Feel."}, 'instructions is new: "Feel."'),
        ({"needs": ["window"]}, 'needs was ["samples","window"] and is ["window"]'),
    ],
)
def test_a_change_is_named_in_plain_words(changes, description):
    assert study_change(HEADER["study"], sheets(**changes)).startswith(description)


def test_the_same_study_has_not_changed():
    assert study_change(HEADER["study"], sheets()) is None
    assert demand_unchanged(HEADER, sheets(), accept=False) is None


def test_many_changes_are_counted():
    rows = stimuli()
    description = study_change(HEADER["study"], sheets(stimuli=[{**row, "columns": {}} for row in rows]))
    assert description.count(";") == 3 and description.endswith("and 9 more")


def test_whole_numbers_and_decimals_are_different_things():
    assert list(differences({"a": 1}, {"a": 1.0})) == ["a was 1 and is 1.0"]


def test_a_change_is_refused_with_what_to_do_or_accepted_on_record():
    now = sheets(instructions="Feel.")
    digests = rf"\(digest {digest(HEADER['study'])[:12]}, now {digest(now.definition())[:12]}\)"
    with pytest.raises(StudyChanged, match=rf"P001 began session 1 {digests}: instructions is new.*--accept"):
        demand_unchanged(HEADER, now, accept=False)
    accepted = demand_unchanged(HEADER, now, accept=True)
    assert accepted == {
        "since_participant": "P001", "since_session": 1, "differences": 'instructions is new: "Feel."',
        "study_before": digest(HEADER["study"]), "study_now": digest(now.definition()),
    }  # fmt: skip


def test_the_latest_earlier_session_is_what_counts(tmp_path):
    for number in (1, 2):
        start(tmp_path, sheets_plan(), Hall([(0.0, "confirm")] * 4).rig, number)
    assert earlier_header(tmp_path, "sheets", "P001", 1) is None
    assert earlier_header(tmp_path, "sheets", "P001", 3)["session"] == 2
    assert earlier_header(tmp_path, "sheets", "P002", 3) is None


@pytest.mark.parametrize(
    ("size", "px_per_mm", "same"),
    [((1920, 1080), 3.63, True), ((1920, 1080), 3.64, False), ((1680, 1050), 3.62, False)],
)
def test_a_screen_is_the_same_where_a_slider_stays_within_half_a_millimetre(size, px_per_mm, same):
    header = {**HEADER, "calibration": SCREEN.definition()}
    now = Calibration(size, px_per_mm, 1, "2026-01-02T10:00:00")
    if same:
        assert demand_same_screen(header, now, accept=False) is None
        return
    with pytest.raises(ScreenChanged, match=r"started on a screen of 1920x1080 px at 3\.620 px/mm"):
        demand_same_screen(header, now, accept=False)
    assert demand_same_screen(header, now, accept=True)["calibration_now"] == now.definition()


def test_a_session_without_a_window_has_no_screen_to_change():
    assert demand_same_screen(HEADER, SCREEN, accept=False) is None
