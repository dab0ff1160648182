"""Every shipped study can be shown, in every language that it is written in, on the smallest and largest screens."""

from pathlib import Path

import pytest

from palpate.devices.window.build import screen_for
from palpate.devices.window.geometry import problems
from palpate.devices.window.texts_study import check_study_texts, load_study_texts
from palpate.protocols.events import Ask, Instruct
from palpate.protocols.plan import compile_plan
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import SHIPPED, names, read_study
from tests.devices.window.screens.pages import SIZES, page

STUDIES = {name: path for name, path in names(Path("no-lab")).items() if SHIPPED in path.parents}


def requests(study):
    group = next(iter(study.groups), None)
    plan = compile_plan(study, ParticipantRow("P001", group))
    yield from ([Instruct("instructions")] if study.instructions else [])
    yield from (Ask(form) for form in plan.closing)
    yield from (Ask(trial.form, trial) for trial in plan.trials[:1] if trial.form is not None)


@pytest.mark.needs("fonts")
@pytest.mark.parametrize("size", ["1280x720 at 3.2", "1280x720 at 4", "3840x2160 at 7"])
@pytest.mark.parametrize("name", STUDIES)
def test_every_study_can_be_shown(name, size):
    study, folder = read_study(STUDIES[name]).study, STUDIES[name].parent
    for language in ("en", *(path.stem for path in sorted((folder / "texts").glob("*.yaml")))):
        words = load_study_texts(study, folder, language)
        on = page(SIZES[size], language, words=words, pages={"instructions": study.instructions or ""})
        for request in requests(study):
            screen = screen_for(request, on, 0)
            for sheet in range(screen.sheets):
                screen._turn(sheet)
                assert problems(screen.placed(), on.metrics) == [], (language, request)


@pytest.mark.parametrize("name", STUDIES)
def test_translations_of_studies_are_whole(name):
    assert check_study_texts(read_study(STUDIES[name]).study, STUDIES[name].parent) == []
