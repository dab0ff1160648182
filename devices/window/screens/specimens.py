"""A specimen of every kind of screen, half way through its answers: for pictures and checks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from palpate.protocols.events import Ask, Confirm, Instruct, Present, Rest
from palpate.protocols.fields import Fields, questions_from
from palpate.protocols.forms import (
    AnchorForm,
    Consent,
    Demographics,
    Eligibility,
    Form,
    Interview,
    Lexicon,
    Likert,
    Question,
    Sliders,
    Words,
)
from palpate.protocols.known_tasks import FORM_PLACES
from palpate.protocols.registry import load_object, place_in
from palpate.protocols.study import Anchor, Attribute, Criterion, Item, Questionnaire, Scale, Stimulus
from palpate.protocols.trial import Trial
from palpate.protocols.yaml_text import load

SCREENS = "palpate.devices.window.screens"
TRIALS = 45
RATED = Scale.model_validate({"from": 0, "to": 100})
FOLDER = Path(__file__).resolve().parents[1] / "texts" / "specimens"


@dataclass(frozen=True)
class Specimen:
    """A request, or the key of a page, with the answers so far."""

    request: Ask | Instruct | Rest | Confirm | Present | str
    answers: Mapping[str, Any] = field(default_factory=dict)


def specimens(words: Wording | None = None) -> dict[str, Specimen]:
    """Return a specimen of every kind of screen by name, in English or with another wording.

    Forms of a single task have their `SPECIMEN` beside their screens.
    """
    words = words or wording()
    keys = ("changing_sample", "feel_now", "interval 2", "recording", "right_answer", "wrong_answer", "pause", "end",
            "thanks", "ineligible", "aborted")  # fmt: skip
    return {
        **_trials(words),
        **{name: load_object(place_in(SCREENS, name, "SPECIMEN"))(words) for name in FORM_PLACES},
        **_fields(words),
        **_questions(words),
        "rest": Specimen(Rest(15, TRIALS)),
        "calibration": Specimen(Confirm("calibration")),
        **{key.replace("_", "-").replace(" ", "-"): Specimen(key) for key in keys},
    }


def _trials(words: Wording) -> dict[str, Specimen]:
    seven, four = _sliders(words.seven), _sliders(words.four)
    alike = Sliders((Attribute(low=words.alike[0], high=words.alike[1]),), RATED, sides=words.sides)
    tries = Sliders(seven.attributes, RATED, tries=True)
    live = replace(tries, live=True, shows_force=True)
    ticks = Words(words.words, further=True)
    marked = tuple(zip((0, 25, 50, 75, 100), words.labels, strict=True))
    labelled = replace(four, scale=RATED.model_copy(update={"labels": marked, "ticks": "labels"}))
    return {
        "sliders": Specimen(_ask(seven), _some(seven, (23, 64, 41, 82, 12))),
        "sliders-four": Specimen(_ask(four), _some(four, (31, 58))),
        "sliders-labelled": Specimen(_ask(labelled), _some(labelled, (62,))),
        "similarity": Specimen(_ask(alike), _some(alike, (72,))),
        "anchor": Specimen(_ask(AnchorForm(Anchor(id="1", label=words.anchor), "1", 1, 2), former={"felt": 1})),
        "authoring": Specimen(_ask(tries, former=_some(tries, (90, 50, 20, 35, 60, 45, 50)))),
        "authoring-live": Specimen(_ask(live, former=_some(live, (90, 50, 20, 35, 60, 45, 50)))),
        "authoring-felt": Specimen(
            Present(replace(_trial(live), may_go_back=False), _some(live, (90, 50, 20, 35, 60, 45, 50)))
        ),
        "adjectives": Specimen(_ask(ticks), {"ticked": [words.words[n] for n in (1, 8, 11, 24, 40)], "further": []}),
        "lexicon": Specimen(_ask(Lexicon(2)), {"words": list(words.own)}),
    }


def _questions(words: Wording) -> dict[str, Specimen]:
    items = tuple(Item(name=f"item{n}", text=text) for n, text in enumerate(words.items))
    interview = Interview((Item(name="item0", text=words.free),))
    likert = Likert(Questionnaire(items=items, ends=words.ends))
    person = Demographics(tuple(_question(n, *question) for n, question in enumerate(words.person)))
    criteria = tuple(Criterion(name=f"criterion{n}", text=text, answer="yes") for n, text in enumerate(words.fit))
    return {
        "suggestions": Specimen(Ask(Lexicon(0, "suggestions")), {"words": []}),
        "likert": Specimen(Ask(likert), {"item0": 6, "item1": 5, "item2": 3}),
        "interview": Specimen(Ask(interview), {"item0": words.own[1]}),
        "demographics": Specimen(Ask(person), {"q0": 34, "q1": person.questions[1].levels[0][0], "q3": None}),
        "eligibility": Specimen(Ask(Eligibility(criteria))),
        "consent": Specimen(Ask(Consent(words.consent))),
        "instructions": Specimen(Instruct("instructions")),
    }


def _fields(words: Wording) -> dict[str, Specimen]:
    (which, options), (how, ends), (strong, unit), remind = words.fields
    choice = {"kind": "choice", "name": "which", "text": which, "options": options}
    asked = [
        choice,
        {"kind": "scale", "name": "pleasant", "text": how, "ends": ends, "from": 0, "to": 100},
        {"kind": "confidence", "name": "sure", "points": 5},
        {"kind": "number", "name": "strength", "text": strong, "unit": unit, "above": 0},
        {"kind": "text", "name": "reminds", "text": remind, "optional": True},
    ]
    return {
        "fields": Specimen(_ask(Fields(questions_from(asked))), {"which": options[1], "pleasant": 71, "sure": 2}),
        "fields-choice": Specimen(_ask(Fields(questions_from([choice])))),
    }


def _sliders(pairs: tuple[tuple[str, str, str], ...]) -> Sliders:
    return Sliders(
        tuple(Attribute(low=low, high=high, explanation=explanation) for low, high, explanation in pairs), RATED
    )


def _some(form: Sliders, values: tuple[float, ...]) -> dict[str, float]:
    return dict(zip(form.items(), map(float, values), strict=False))


def _ask(form: Form, former: Mapping[str, Any] | None = None) -> Ask:
    return Ask(form, _trial(form), former)


def _trial(form: Form) -> Trial:
    return Trial(15, "1", False, Stimulus(id="1"), form, may_go_back=True, rest_before=False)


def _question(number: int, text: str, answers: tuple[str, ...] | str) -> Question:
    """Return a question with its answers to choose from, or the unit of a number."""
    if isinstance(answers, str):
        return Question(f"q{number}", text, "number", unit=answers, low=0, high=120)
    return Question(f"q{number}", text, "choice", tuple((str(n), label) for n, label in enumerate(answers)))


@dataclass(frozen=True)
class Wording:
    """The study's texts for the specimens in one language; `person` are questions with their answers or their unit.

    `fields` are a choice with its options, a scale with its ends, a number with its unit, and a text.
    """

    seven: tuple[tuple[str, str, str], ...]
    four: tuple[tuple[str, str, str], ...]
    labels: tuple[str, ...]
    alike: tuple[str, str]
    sides: tuple[str, ...]
    words: tuple[str, ...]
    own: tuple[str, ...]
    items: tuple[str, ...]
    ends: tuple[str, str]
    person: tuple[tuple[str, tuple[str, ...] | str], ...]
    fields: tuple[Any, ...]
    free: str
    anchor: str
    fit: tuple[str, ...]
    consent: str
    instructions: str


def wording(language: str = "en") -> Wording:
    """Return the specimens' texts in a language, or in English if they are not translated."""
    file = FOLDER / f"{language}.yaml"
    return read_wording(file if file.is_file() else FOLDER / "en.yaml")


def read_wording(file: Path) -> Wording:
    """Return the texts of a file: the fields of Wording."""
    return Wording(**{key: _frozen(value) for key, value in load(file.read_bytes(), str(file)).data.items()})


def _frozen(value: Any) -> Any:
    return tuple(_frozen(item) for item in value) if isinstance(value, list) else value
