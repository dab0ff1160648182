"""One small study for each task."""

from palpate.protocols.forms import LabForms, Question
from palpate.protocols.plan import compile_plan
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from tests.protocols.studies_for_tests import toy

WORDS = ["rough", "smooth", "sticky", "cold", "warm", "soft"]
SCALE = {"from": 0, "to": 100}
PARTS = {
    "slider_rating": {},
    "matching": {"scale": SCALE},
    "similarity": {"attributes": [["different", "same"]], "scale": SCALE, "sides": ["real", "virtual"]},
    "authoring": {"scale": SCALE, "navigation": "forward"},
    "adjective_selection": {"adjectives": {"words": WORDS, "order": "random", "further": True}},
    "free_lexicon": {"lexicon": {"at_least": 2}},
    "capture": {"capture": {"device": "tool", "seconds": 2.0}, "navigation": "forward"},
    "questions": {
        "ask": [
            {"name": "strength", "kind": "number", "above": 0},
            {"name": "pleasant", "kind": "scale", "from": 1, "to": 7, "step": 1},
            {"name": "remark", "kind": "text", "optional": True},
        ],
    },
    "ranking": {
        "attributes": [["Soft", "Hard"]],
        "order": {"design": "williams", "within": "block", "blocks": {"by": "kind"}, "repeats": 2},
        "settings": {"again": True},
    },
    "intervals": {
        "intervals": {"design": "forced_choice", "seconds": 0.5},
        "ask": [{"name": "chosen", "kind": "choice", "of": "intervals"}, {"name": "sure", "kind": "confidence"}],
        "procedure": {
            "kind": "staircase",
            "level": {"column": "level_db", "from": 0, "to": 9, "points": 10},
            "start": 5,
            "last": 2,
            "stop": {"trials": 1},
        },
        "navigation": "forward",
    },
}
UNRATED = ("adjective_selection", "free_lexicon", "capture", "intervals", "questions")
ITEMS = [{"name": "Realism", "text": "It felt real."}, {"name": "Ease", "text": "It was easy."}]
LAB = LabForms(
    "Do you agree?",
    (
        Question("age", "How old are you?", "number", low=18, high=99, optional=False),
        Question("handedness", "Which hand?", "choice", levels=(("left", "Left"), ("right", "Right"))),
        Question("remark", "Anything else?", "text"),
    ),
)


def study_of(task, **changes) -> Study:
    """The toy study with another task, everything before and after it included."""
    parts = {
        "task": task,
        "opening": ["consent", "demographics"],
        "closing": ["questionnaire", "suggestions"],
        "questionnaire": {"items": ITEMS},
        "simulation": {"latents": {}, "revise_rate": 0.2},
        **PARTS[task],
        **changes,
    }
    without = ("attributes", "scale") if task in UNRATED else ("scale",) if task == "ranking" else ()
    data = {key: value for key, value in {**toy().definition(), **parts}.items() if key not in without}
    return Study.model_validate(data)


def plan_of(task, participant="P001", seed=0, **changes):
    return compile_plan(study_of(task, **changes), ParticipantRow(participant, None, 0), seed, LAB)
