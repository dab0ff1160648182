"""Under X11, where no input method reaches the window, a Latin keyboard writes Hangul in it."""

import pytest

from benchmarks.window.stage import Setting
from palpate.studies.catalogue import SHIPPED, read_study
from tests.devices.window.real.conftest import CALIBRATION, theatre_of
from tests.devices.window.real.forms import KOREAN, ask

pytestmark = pytest.mark.needs("psychopy", "xvfb")


@pytest.fixture(scope="module")
def korean():
    study_files = read_study(SHIPPED / "door_lexicon" / "study.yaml")
    with theatre_of(Setting(study_files.study, CALIBRATION, "ko", study_files.folder, fullscreen=True)) as opened:
        yield opened


@pytest.mark.parametrize("switch", ["F9", "Alt_R"])
def test_latin_keys_write_syllables_and_a_key_switches(korean, switch):
    korean.put_on(ask("lexicon"))
    korean.keys(*((key,) for key in "rkqtdlt"), ("backspace",), ("shift", "t"), ("k",), ("enter",))
    korean.keys((switch,), ("o",), ("k",), (switch,), ("space",), *((key,) for key in "ekfr"), ("enter",))
    korean.hand.type(KOREAN[0])
    shown, painted, wrong = korean.picture()
    korean.keys(("tab",), ("enter",))

    assert korean.stage.result().value["answers"] == {"words": ["값이싸", "ok 닭", KOREAN[0]]}
    assert shown.tobytes() == painted.tobytes()
    assert wrong == []
