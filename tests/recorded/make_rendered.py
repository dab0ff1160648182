"""Records two sessions of texture_similarity with what was rendered in them: `python -m tests.recorded.make_rendered`.

Only for a new ledger format beside the old one: a recorded session is there to stay as it is, also when the shipped
models have changed. What was felt stands in the replies.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from palpate.studies.sessions.session import resume, start
from palpate.studies.simulation.rig import simulated
from tests.studies.labs import stopping
from tests.studies.shipped import plan_for, read_shipped
from tests.studies.simulation.small_textures import write_all

RENDERED = Path(__file__).resolve().parent / "rendered"
STUDY, SEED = "texture_similarity", 7
STOPPED = {"P001": None, "P002": 20}
"""The act at which a signal stops a session, which is then resumed."""
OWN = "P002"
"""Who feels small models of the lab's own, so that what is felt is not what the study's table says."""


def main() -> None:
    """Run the sessions and put the ledgers here."""
    study_files = read_shipped(STUDY)
    RENDERED.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as lab:
        for who, at in STOPPED.items():
            if who == OWN:
                write_all(Path(lab))
            rig = simulated(study_files.study, study_files.folder, Path(lab))
            result = start(Path(lab), plan_for(STUDY, who, SEED), rig if at is None else stopping(rig, at))
            shutil.copy((result if result.complete else resume(result.path, rig)).path, RENDERED)


if __name__ == "__main__":
    main()
