"""One request of every kind, and how it is answered with the keyboard alone."""

from pathlib import Path

from palpate.protocols.events import Ask, Confirm, Instruct, Rest
from palpate.protocols.fields import Fields, questions_from
from palpate.protocols.forms import Consent, Demographics, Lexicon, Likert, Question, Sliders, Words
from palpate.protocols.study import Attribute, Item, Order, Questionnaire, Scale, Stimulus, Study
from palpate.protocols.tasks.intervals import IntervalsForm
from palpate.protocols.tasks.ranking import Ranking
from palpate.protocols.trial import Trial

WORDS = tuple(f"{first} and {second}" for first in ("smooth", "rough", "soft", "stiff") for second in range(17))
POLES = ("Easy-to-pull", "Damped", "Consistent", "Pleasant", "New", "Comfort", "Luxurious")
ATTRIBUTES = tuple(
    Attribute(low=pole, high=f"Un{pole.lower()}", explanation=f"How {pole.lower()} it was to the hand.")
    for pole in POLES
)
SCALE = Scale(low=-10, high=10, step=1)
KOREAN = ("부드럽다", "거칠다")
STUDY = Study(
    study="window_test", title="A test of the window", task="slider_rating", attributes=ATTRIBUTES, scale=SCALE,
    instructions="\n\n".join(f"Paragraph {n}. " + "Feel the stimulus with your hand, then answer. " * 9
                             for n in range(1, 8)),
    stimuli=(Stimulus(id="T01"),), order=Order(design="as_listed"), needs=("window",),
)  # fmt: skip
LIKERT = Likert(
    Questionnaire(items=tuple(Item(name=f"item_{n}", text=f"The {n}. statement holds for me.") for n in range(1, 6)))
)
QUESTIONS = (
    Question("age", "How old are you?", "number", unit="years", low=16, high=99),
    Question("handedness", "Which hand do you write with?", "choice", (("left", "Left"), ("right", "Right"))),
    Question("country", "In which country do you live?", "text"),
)
CHOICE = {"kind": "choice", "name": "which", "options": ["first", "second"]}
NUMBER = {"kind": "number", "name": "strength", "above": 0}
FORMS = {
    "sliders": Sliders(ATTRIBUTES, SCALE),
    "similarity": Sliders(ATTRIBUTES[:1], Scale(low=0, high=100), sides=("real", "virtual")),
    "authoring": Sliders(ATTRIBUTES, Scale(low=0, high=100), tries=True),
    "adjectives": Words(WORDS, further=True),
    "lexicon": Lexicon(2),
    "suggestions": Lexicon(0, "suggestions"),
    "likert": LIKERT,
    "demographics": Demographics(QUESTIONS),
    "ranking": Ranking(("T01", "T02"), ATTRIBUTES[0]),
    "fields": Fields(questions_from([CHOICE, {"kind": "confidence", "name": "sure"}, NUMBER])),
    "intervals": IntervalsForm(questions_from([CHOICE])),
    "consent": Consent("\n\n".join(["**Taking part is voluntary.** " + "You can stop at any time. " * 40] * 4)),
}
FOLDER = Path(__file__).parent


def trial_of(form, number=2, back=False):
    return Trial(number, "main", False, Stimulus(id="T01"), form, back, False)


def ask(name, back=False):
    """The request for a form, within a trial where it belongs to one."""
    within = name not in ("suggestions", "likert", "demographics", "consent")
    return Ask(FORMS[name], trial_of(FORMS[name], back=back) if within else None)


REQUESTS = {
    **{name: ask(name) for name in FORMS},
    "instructions": Instruct("instructions"),
    "rest": Rest(15, 45),
    "confirm": Confirm("calibration"),
}


RIGHT_DOWN = (("right",), ("down",))
KEYS = {
    "similarity": [("1",), ("2",), ("right",), ("pagedown",), ("enter",)],
    "adjectives": [("right",), ("space",), ("right",), ("down",), ("space",), ("enter",)],
    "lexicon": [("w",), ("e",), ("t",), ("enter",), ("c",), ("o",), ("l",), ("d",), ("tab",), ("enter",)],
    "suggestions": [("tab",), ("enter",)],
    "likert": [*RIGHT_DOWN * 5, ("enter",)],
    "demographics": [("tab",), ("4",), ("2",), ("tab",), ("tab",), ("space",), ("right",), ("tab",), ("F",), ("r",),
                     ("enter",)],
    "ranking": [("right",), ("enter",)],
    "fields": [("2",), ("3",), ("4",), ("2",), ("enter",)],
    "intervals": [("2",)],
    "consent": [*[("enter",)] * 12, ("tab",), ("enter",)],
    "instructions": [("enter",)] * 12,
    "rest": [("enter",)],
}  # fmt: skip
"""Keys that answer a form without the mouse, those pressed together in one tuple. Too many pages turned do no harm."""


def keys_for(name, lines=7):
    """The keys that answer a form; `lines` where it is one of lines to rate on."""
    last = {"sliders": ("enter",), "authoring": ("t",)}
    return [*RIGHT_DOWN * lines, last[name]] if name in last else KEYS[name]
