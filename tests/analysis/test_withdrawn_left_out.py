"""Who withdrew is in no analysis and no export: from session files, and from a database collected before."""

from __future__ import annotations

import pytest

from palpate.analysis.exporting.export import Choices, export
from palpate.analysis.exporting.tabular import ExportRefused
from palpate.analysis.ratings.sources import DataRequest, read_source
from palpate.analysis.regenerating.regeneration import regenerate
from palpate.studies.collecting.collect import collect, open_database
from palpate.studies.participants.people import add as enter
from palpate.studies.participants.registry import open_registry
from palpate.studies.participants.withdrawal import withdraw
from tests.analysis.exporting.labs import RECORDED, rewritten

PLAN = """
study: doors_small
tests:
  - {name: means, test: means, by: [variant]}
"""


@pytest.fixture
def lab(tmp_path):
    """Four recorded people, collected into LAB/lab.sqlite; then P002 withdrew."""
    lab = tmp_path / "lab"
    (lab / "sessions").mkdir(parents=True)
    for source in sorted(RECORDED.glob("sessions/doors_small_P00[1-4]_s1.sqlite")):
        (lab / "sessions" / source.name).write_bytes(source.read_bytes())
    (lab / "analysis.yaml").write_text(PLAN)
    engine = open_database(f"sqlite:///{lab / 'lab.sqlite'}")
    list(collect(sorted((lab / "sessions").glob("*.sqlite")), engine))
    engine.dispose()
    registry = open_registry(lab)
    for number in range(1, 5):
        enter(registry, f"P00{number}")
    withdraw(registry, "P002", "asked to")
    return lab


@pytest.fixture(params=["files", "database"])
def source(lab, request):
    return DataRequest("doors_small", lab, f"sqlite:///{lab / 'lab.sqlite'}" if request.param == "database" else None)


def test_analyses_and_reports_hold_nobody_who_withdrew(source):
    ratings, _ = read_source(source)
    assert ratings.participants == ("P001", "P003", "P004")
    [line] = [exclusion for exclusion in ratings.exclusions if "P002" in exclusion.who]
    assert line.why == "the participant withdrew"


def test_a_regenerated_study_holds_nobody_who_withdrew(source, lab, monkeypatch):
    monkeypatch.setattr(
        "palpate.analysis.regenerating.regeneration.names", lambda _: {"doors_small": lab / "study.yaml"}
    )
    regenerated = regenerate(source, lab / "analysis.yaml")
    assert regenerated.material.participants == ("P001", "P003", "P004")
    assert "P002" not in set(regenerated.answered[0].rows["participant"])


@pytest.mark.parametrize(
    "fmt", ["bids", "psych-ds", "csv", pytest.param("parquet", marks=pytest.mark.needs("pyarrow"))]
)
def test_no_format_holds_anybody_who_withdrew(source, fmt, tmp_path):
    exported = export(source, tmp_path / "out", Choices(fmt))
    everything = b"".join(path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file())
    assert exported.participants == 3 and b"P002" not in everything
    assert not [path for path in (tmp_path / "out").rglob("*") if "P002" in path.name or path.suffix == ".sqlite"]


def test_a_database_of_real_people_is_shared_only_beside_the_registry_that_tells_who_withdrew(tmp_path, lab):
    source = RECORDED / "sessions/doors_small_P001_s1.sqlite"
    rewritten(source, tmp_path / "doors_small_P005_s1.sqlite", header={"participant": "P005", "rig": {"kind": "live"}})
    url = f"sqlite:///{tmp_path / 'real.sqlite'}"
    engine = open_database(url)
    list(collect([tmp_path / "doors_small_P005_s1.sqlite"], engine))
    engine.dispose()
    with pytest.raises(ExportRefused, match="no registry of participants.*--lab"):
        export(DataRequest("doors_small", tmp_path, url), tmp_path / "out", Choices("csv"))
    assert export(DataRequest("doors_small", lab, url), tmp_path / "out", Choices("csv")).participants == 1
