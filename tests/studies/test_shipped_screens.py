"""Every shipped study can be shown, in English and in Korean, on the smallest screen: nothing overlaps or is cut."""

from functools import cache

import pytest

from palpate.devices.window import texts
from palpate.devices.window.build import screen_for
from palpate.devices.window.calibration import Calibration
from palpate.devices.window.geometry import problems
from palpate.devices.window.presenter_page import prepare
from palpate.protocols.events import Ask, Instruct
from tests.studies.shipped import ALL, plan_for, read_shipped

SMALLEST = Calibration((1280, 720), 3.4, 0, "2026-01-01T00:00:00+00:00")


@pytest.fixture(scope="module", autouse=True)
def texts_read_once():
    """Read each shipped file of texts once."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(texts, "read_words", cache(texts.read_words))
        yield


def requests_of(plan):
    yield Instruct("instructions")
    yield from (Ask(form) for form in (*plan.opening, *plan.closing))
    yield from (Ask(t.form, t) for t in (plan.trials[0], plan.trials[-1]) if t.form is not None)


@pytest.mark.parametrize("language", ["en", pytest.param("ko", marks=pytest.mark.needs("fonts"))])
@pytest.mark.parametrize("name", ALL)
def test_a_study_s_screens_are_clear(name, language):
    plan, folder = plan_for(name), read_shipped(name).folder
    page = prepare(plan.study, SMALLEST, language, folder, plan=plan)
    for request in requests_of(plan):
        screen = screen_for(request, page, 0)
        assert problems(screen.placed(), page.metrics) == [], request.body()


@pytest.mark.parametrize("name", ALL)
def test_a_translation_leaves_no_word_of_the_study_in_english(name):
    from palpate.devices.window.texts_study import load_study_texts, study_texts

    study, folder = read_shipped(name).study, read_shipped(name).folder
    words = load_study_texts(study, folder, "ko")
    assert len(words) == len({" ".join(text.split()) for text in study_texts(study)})
    assert all(any("가" <= letter <= "힣" for letter in translation) for translation in words.values())
    labels = [words[word.word] for word in study.adjectives.words] if study.adjectives else []
    assert len(set(labels)) == len(labels), "two words share a translation"
