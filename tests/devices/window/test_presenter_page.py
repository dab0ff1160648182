"""What every screen of a session shares is made from the study, the calibration and the language."""

import pytest

from palpate.devices.window.build import screen_for
from palpate.devices.window.calibration import Calibration
from palpate.devices.window.geometry import WindowError
from palpate.devices.window.presenter_page import describe, prepare
from palpate.devices.window.screens.sliders import Track
from palpate.protocols.events import Ask, Instruct
from palpate.protocols.plan import block_page, compile_plan
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from tests.protocols.studies_for_tests import toy

SCREEN = Calibration((1280, 720), 3.6, 0, "2026-01-01")


def lines(study, tmp_path):
    page = prepare(study, SCREEN, "en", tmp_path)
    trial = compile_plan(study, ParticipantRow("P001")).trials[0]
    screen = screen_for(Ask(trial.form, trial), page, 0)
    return [element.line.width for element in screen.scene() if isinstance(element, Track)]


def test_a_line_is_127_mm_long_unless_the_study_says_otherwise(tmp_path):
    assert lines(toy(), tmp_path) == [round(127 * 3.6)] * 2
    assert lines(toy(scale={"from": 0, "to": 100, "length_mm": 100}), tmp_path) == [360] * 2


def test_a_line_that_the_screen_is_too_narrow_for_is_refused_before_a_window_opens(tmp_path):
    study = toy(scale={"from": 0, "to": 100, "length_mm": 340})
    plan = compile_plan(study, ParticipantRow("P001"))
    with pytest.raises(WindowError, match=r"a line of 340 mm with its words needs a screen at least"):
        prepare(study, SCREEN, "en", tmp_path, plan=plan)


def test_a_translation_that_is_missing_is_refused_by_its_file(tmp_path):
    with pytest.raises(WindowError, match=r"texts/ko\.yaml: missing"):
        prepare(toy(), SCREEN, "ko", tmp_path)


def test_characters_that_no_font_has_are_refused_by_name(tmp_path):
    study = toy(attributes=[["Soft", "\U0001f9e8\U0001faa9"], ["Cold", "Warm"]])
    with pytest.raises(WindowError, match="no font"):
        prepare(study, SCREEN, "en", tmp_path)


def test_the_ledger_can_tell_which_texts_were_read(tmp_path):
    one, other = (describe(prepare(toy(title=title), SCREEN, "en", tmp_path)) for title in ("a", "b"))
    assert one["size_px"] == [1280, 720] and one["language"] == "en"
    changed = describe(prepare(toy(instructions="Feel it."), SCREEN, "en", tmp_path))
    assert one["texts"] == other["texts"] != changed["texts"]


@pytest.mark.parametrize(
    ("instructions", "says"),
    [("Feel\n\n" + "on" * 400, "does not fit"), ("<!-- to be written -->", "no words to read")],
)
def test_instructions_that_cannot_be_shown_are_refused_before_a_window_opens(tmp_path, instructions, says):
    study = toy(instructions=instructions)
    with pytest.raises(WindowError, match=says):
        prepare(study, SCREEN, "en", tmp_path, plan=compile_plan(study, ParticipantRow("P001")))


def intervals(**changes):
    """A study with intervals and with instructions before one of its two blocks."""
    stimuli = [{"id": name, "columns": {"hand": hand}} for name, hand in (("A", "left"), ("B", "right"))]
    blocks = {"by": "hand", "instructions": {"left": "Now with your left hand."}}
    return Study.model_validate(
        {
            "study": "toy", "task": "intervals", "stimuli": stimuli, "intervals": {}, "instructions": "Feel it.",
            "procedure": {"kind": "constant", "level": {"column": "level_db", "values": [0, 1]}, "repeats": 1},
            "order": {"design": "random", "within": "block", "blocks": blocks}, **changes,
        }
    )  # fmt: skip


def test_instructions_before_a_block_are_a_page_of_their_own(tmp_path):
    study = intervals()
    page = prepare(study, SCREEN, "en", tmp_path, plan=compile_plan(study, ParticipantRow("P001")))
    shown = screen_for(Instruct(block_page("left")), page, 0).placed()
    assert set(page.pages) == {"instructions", "block left"}
    assert "Now with your left hand." in {element.text for element in shown}


def test_a_question_that_cannot_be_shown_is_refused_before_a_window_opens(tmp_path):
    study = intervals(ask=[{"name": "chosen", "kind": "choice", "of": "intervals", "text": "y" * 200}])
    with pytest.raises(WindowError, match="does not fit"):
        prepare(study, SCREEN, "en", tmp_path, plan=compile_plan(study, ParticipantRow("P001")))
