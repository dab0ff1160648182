"""A process of its own that runs a session of the toy study, each question only when LAB/gate/N is there.

Run as: python -m tests.analysis.monitoring.gated_session LAB PARTICIPANT
"""

from __future__ import annotations

import sys
from pathlib import Path

from tests.analysis.monitoring.people_for_tests import gate, run
from tests.studies.labs import Lab


def main() -> None:
    lab, participant = Path(sys.argv[1]), sys.argv[2]
    run(Lab(lab), participant, before=gate(lab / "gate"))


if __name__ == "__main__":
    main()
