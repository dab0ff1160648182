"""Record the sessions of `many/` again: `python -m tests.recorded.make_many`, and what is regenerated from them.

Only for a new ledger format, a new study or a new statistic: a recorded session is there to stay as it is.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

from palpate.analysis.ratings.sources import DataRequest
from palpate.analysis.regenerating.outputs import file_texts
from palpate.analysis.regenerating.regeneration import regenerate
from palpate.protocols.files import write_texts
from palpate.protocols.plan import compile_plan
from palpate.studies.catalogue import SHIPPED, read_study
from palpate.studies.participants.lab_forms import lab_forms
from palpate.studies.participants.row_assignment import allocate
from palpate.studies.sessions.session import start
from palpate.studies.simulation.rig import simulated

HERE = Path(__file__).resolve().parent
MANY = HERE / "many"
EXPECTED = HERE / "expected" / "regenerated"
PEOPLE = {
    "texture_adjectives": 5,
    "texture_ratings": 6,
    "texture_similarity": 6,
    "door_lexicon": 4,
    "door_adjectives": 4,
    "door_ratings": 4,
    "door_matching": 4,
    "door_authoring": 6,
}
SEED = 11


def record() -> None:
    """Run every participant's session and put the ledgers into `many/sessions`."""
    (MANY / "sessions").mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        lab = Path(folder)
        for name, count in PEOPLE.items():
            study = read_study(SHIPPED / name / "study.yaml").study
            forms = lab_forms(study, lab, live=False)
            for number in range(1, count + 1):
                plan = compile_plan(study, allocate(study, f"P{number:03d}"), SEED, forms)
                result = start(lab, plan, simulated(study, SHIPPED / name))
                shutil.copy(result.path, MANY / "sessions" / result.path.name)


def texts_of(name: str) -> dict[str, str]:
    """Everything that is regenerated for a study, but times, pictures and pages: its statistics and all tables."""
    return file_texts(regenerate(DataRequest(name, MANY)), {})


def expect() -> None:
    """Write what is regenerated into `expected/regenerated`."""
    shutil.rmtree(EXPECTED, ignore_errors=True)
    for name in PEOPLE:
        write_texts(EXPECTED / name, texts_of(name))


if __name__ == "__main__":
    if "--expected-only" not in sys.argv:
        record()
    expect()
