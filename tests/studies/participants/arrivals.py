"""People arriving at several stations at once: started as `python -m tests.studies.participants.arrivals ...`.

One process imports everything once and forks a station for each of STATIONS; they start together, and each adds PEOPLE
participants and allocates a row to each, with every fifth dropping out. Prints [pseudonym, group, row, dropped] lines.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

from palpate.studies.participants.people import add
from palpate.studies.participants.registry import open_registry
from palpate.studies.participants.rows import allocate_row, release
from tests.studies.participants.labs import grouped


def station(lab: Path, people: int, start: int, out: Path) -> None:
    """Wait for the gun, then take people in."""
    os.read(start, 1)
    study, lines = grouped(), []
    for number in range(people):
        registry = open_registry(lab)
        who = allocate_row(registry, study, add(registry))
        dropped = number % 5 == 4
        if dropped:
            release(registry, study, who.participant, "did not stay")
        lines.append([who.participant, who.group, who.row, dropped])
    out.write_text(json.dumps(lines))


def main(lab: Path, stations: int, people: int) -> None:
    """Fork the stations, let them go together, and print what each person got."""
    start, gun = os.pipe()
    outs = [lab / f"station{number}.json" for number in range(stations)]
    pids = []
    for out in outs:
        pid = os.fork()
        if pid == 0:
            status = 1
            try:
                os.close(gun)
                station(lab, people, start, out)
                status = 0
            finally:
                os._exit(status)
        pids.append(pid)
    os.close(gun)  # the end of the pipe is the gun: every station reads it
    failed = [pid for pid in pids if os.waitpid(pid, 0)[1] != 0]
    print(json.dumps([line for out in outs for line in json.loads(out.read_text())]))
    sys.exit(len(failed))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
