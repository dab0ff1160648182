from pathlib import Path

import pytest

from palpate.devices.window.build import SCREEN_PLACES
from palpate.devices.window.pictures import pictures
from palpate.devices.window.screens.specimens import FOLDER, specimens
from palpate.devices.window.texts import SHIPPED, languages, read_words
from palpate.protocols.events import Ask
from palpate.protocols.forms import FORMS

DOCS = Path(__file__).parents[3] / "docs" / "pictures"
WAITING = {"changing_sample", "feel_now", "recording", "interval 2", "right_answer", "wrong_answer"}


def test_the_documentation_shows_every_kind_of_screen():
    assert {path.name for path in DOCS.glob("screen-*.png")} == {f"screen-{name}.png" for name in specimens()}
    assert all(path.stat().st_size < 60_000 for path in DOCS.glob("screen-*.png"))


def test_there_is_a_specimen_of_every_form_and_every_page():
    requests = [specimen.request for specimen in specimens().values()]
    assert {request.form.name for request in requests if isinstance(request, Ask)} == {*FORMS} >= {*SCREEN_PLACES}
    titled = {key.removesuffix("_text") for key in read_words(SHIPPED / "en.yaml") if key.endswith("_text")}
    assert {request for request in requests if isinstance(request, str)} == (titled - {"rest", "calibration"}) | WAITING
    assert {path.stem for path in FOLDER.glob("*.yaml")} == set(languages())


@pytest.mark.needs("fonts")
def test_pictures_are_painted_at_any_size_and_in_any_language(tmp_path):
    files = pictures(tmp_path / "new", (1366, 768), "ko")
    assert [file.name for file in files] == [f"screen-{name}.png" for name in specimens()]
    assert all(file.read_bytes().startswith(b"\x89PNG") for file in files)
