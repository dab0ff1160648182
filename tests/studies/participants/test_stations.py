"""Several processes take people in at once: no row twice, none left out, whatever the database."""

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from palpate.studies.participants.allocations import every_allocation
from palpate.studies.participants.lab_template import make_lab
from palpate.studies.participants.registry import open_registry
from tests.studies.participants.labs import postgres_schema

ROOT = Path(__file__).resolve().parents[3]
STATIONS, PEOPLE = 6, 10


def arrive(lab):
    command = [sys.executable, "-m", "tests.studies.participants.arrivals", str(lab), str(STATIONS), str(PEOPLE)]
    done = subprocess.run(command, check=False, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return [tuple(line) for line in json.loads(done.stdout)]


@pytest.fixture(params=["sqlite", pytest.param("postgres", marks=pytest.mark.needs("psycopg", "postgres"))])
def lab(request, tmp_path):
    """A lab whose registry has never been opened: creating its tables is part of the race."""
    make_lab(tmp_path / "lab")
    if request.param == "sqlite":
        yield tmp_path / "lab"
        return
    with postgres_schema() as url:
        (tmp_path / "lab" / "lab.yaml").write_text(f"registry: {url}\n")
        yield tmp_path / "lab"


def test_stations_that_take_people_in_at_once_give_no_row_twice_and_leave_none_out(lab):
    people = arrive(lab)
    assert sorted(who for who, *_ in people) == [f"P{n:03d}" for n in range(1, STATIONS * PEOPLE + 1)]
    allocations = {allocation.participant: allocation for allocation in every_allocation(open_registry(lab))}
    assert {who: (group, row, not dropped) for who, group, row, dropped in people} == {
        who: (*allocation.place, allocation.holds) for who, allocation in allocations.items()
    }
    held = [allocation for allocation in allocations.values() if allocation.holds]
    stayed = STATIONS * PEOPLE * 4 // 5
    assert len(held) == len({allocation.place for allocation in held}) == stayed
    given = {
        group: sorted({allocation.row for allocation in allocations.values() if allocation.group == group})
        for group in ("x", "y")
    }
    assert all(rows == list(range(len(rows))) for rows in given.values())
    counts = Counter(allocation.group for allocation in held)
    assert abs(counts["x"] - counts["y"]) <= STATIONS
