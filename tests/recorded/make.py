"""Record the sessions of this folder again: `python -m tests.recorded.make`.

Only for a new study or a new ledger format beside the old one: a recorded session is there to stay as it is.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from palpate.protocols.plan import compile_plan
from palpate.studies.catalogue import read_study
from palpate.studies.participants.row_assignment import allocate
from palpate.studies.sessions.session import resume, start
from palpate.studies.simulation.rig import simulated
from tests.studies.labs import stopping

HERE = Path(__file__).resolve().parent
STUDY = HERE / "doors_small"
PEOPLE = tuple(f"P{number:03d}" for number in range(1, 13))
INTERRUPTED = "P002"


def main() -> None:
    """Run every participant's session and put the ledgers here."""
    study = read_study(STUDY / "study.yaml").study
    with tempfile.TemporaryDirectory() as lab:
        for who in PEOPLE:
            plan = compile_plan(study, allocate(study, who), seed=3)
            rig = simulated(study, STUDY)
            result = start(Path(lab), plan, stopping(rig, 7) if who == INTERRUPTED else rig)
            if not result.complete:
                resume(result.path, rig)
            shutil.copy(result.path, HERE / "sessions" / result.path.name)


if __name__ == "__main__":
    main()
