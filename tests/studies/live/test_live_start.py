"""A live session that is refused to begin leaves no trace: no row of the square, no ledger."""

from __future__ import annotations

from functools import partial

import pytest

from palpate.studies.catalogue import read_study
from palpate.studies.participants.admission import finish
from palpate.studies.participants.allocations import every_allocation
from palpate.studies.participants.people import add
from palpate.studies.participants.registry import open_registry
from palpate.studies.participants.rows import allocate_row
from tests.studies.participants.labs import new_lab

TOY = """\
study: toy
task: slider_rating
stimuli: [A, B, C, D]
attributes: [[Soft, Hard]]
scale: {from: -10, to: 10, step: 1}
order: {design: williams}
needs: [window]
opening: [consent]
"""


@pytest.fixture
def lab(tmp_path):
    """A lab that knows P001; its consent is filled in, its screen not calibrated."""
    path = tmp_path / "lab"
    add(new_lab(path), "P001")
    (path / "consent.md").write_text("I agree.")
    (path / "studies" / "toy").mkdir()
    (path / "studies" / "toy" / "study.yaml").write_text(TOY)
    return path


@pytest.fixture
def refused(lab, run_palpate):
    """Return a function that runs the study toy with P001, which is refused, and returns the message."""
    return partial(run_palpate, "run", "toy", "--participant", "P001", "--lab", lab, status=2)


NOT_CALIBRATED = pytest.param((), "screen is not calibrated", marks=pytest.mark.needs("psychopy"))


@pytest.mark.parametrize(("more", "message"), [NOT_CALIBRATED, (("--session", "2"), "P001 has no session 1")])
def test_a_start_that_is_refused_takes_no_row(lab, refused, more, message):
    assert message in refused(*more)
    assert every_allocation(open_registry(lab)) == [] and list((lab / "sessions").glob("*.sqlite")) == []


def test_a_folder_that_is_no_lab_is_reported(lab, refused):
    for name in ("participants.json", "consent.md"):
        (lab / name).unlink()
    assert f"is not a lab: it holds no participants.json; make it one with: palpate init {lab}" in refused()


def test_who_finished_the_study_at_another_station_cannot_begin_it_anew(lab, refused):
    toy = read_study(lab / "studies" / "toy" / "study.yaml").study
    allocate_row(open_registry(lab), toy, "P001")
    finish(lab, toy, "P001")
    assert "P001 has finished toy in a session that is not in" in refused()
