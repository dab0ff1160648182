from __future__ import annotations

import pytest

from palpate.analysis.monitoring.watching import Watch
from palpate.studies.participants.people import add
from palpate.studies.participants.registry import open_registry
from palpate.studies.participants.rows import allocate_row, release
from palpate.studies.participants.withdrawal import withdraw
from tests.analysis.monitoring.people_for_tests import PLAIN, run
from tests.protocols.studies_for_tests import toy
from tests.studies.labs import Lab


@pytest.fixture
def lab(tmp_path):
    return Lab(tmp_path)


def rows_of(snapshot):
    (group,) = snapshot.balances[0].groups
    return {row.place: (row.state, [holder.participant for holder in row.holders]) for row in group.rows}, group.counts


def test_the_registry_says_who_withdrew_who_waits_and_whose_row_is_free(lab):
    registry, study = open_registry(lab.path), toy(**PLAIN)
    for number in range(1, 6):
        add(registry, f"P00{number}")
    for number in range(1, 5):
        allocate_row(registry, study, f"P00{number}", row=number - 1)
    run(lab, "P001", 0)
    run(lab, "P002", 1)
    run(lab, "P003", 2, stop_before=2)
    withdraw(registry, "P002", "asked to")
    release(registry, study, "P003", "did not come back")
    view = Watch(lab.path).look()
    assert [(session.participant, session.rated) for session in view.sessions if session.withdrawn] == [("P002", None)]
    rows, counts = rows_of(view)
    assert rows == {
        0: ("complete", ["P001"]),
        1: ("withdrawn", ["P002"]),
        2: ("released", ["P003"]),
        3: ("allocated", ["P004"]),
    }
    assert counts["free"] == 2
    assert view.balances[0].groups[0].certificate.sequences == 1


def test_a_registry_that_cannot_be_read_is_reported_and_the_sessions_are_shown_all_the_same(lab):
    run(lab, "P001")
    (lab.path / "participants").mkdir()
    (lab.path / "participants" / "registry.sqlite").write_bytes(b"no database at all, " * 99)
    view = Watch(lab.path).look()
    assert "may be out of date" in view.people_problem
    assert len(view.sessions) == 1


def test_the_balance_counts_rows_and_positions_as_the_certificate_does(lab):
    for row in range(4):
        run(lab, f"P00{row + 1}", row)
    run(lab, "P005", 4)
    run(lab, "P006", 1, stop_before=2)
    view = Watch(lab.path).look()
    rows, counts = rows_of(view)
    assert rows[0] == ("complete", ["P001", "P005"])
    assert rows[1] == ("complete", ["P002", "P006"])
    assert counts == {"complete": 4, "free": 0}
    (group,) = view.balances[0].groups
    assert group.certificate.sequences == 5
    assert group.certificate.position_range == (1, 2)
    assert "5 sequences of 4 items: not balanced (yet)" in group.verdict


def test_the_orders_of_a_study_that_keeps_something_blind_name_no_stimulus(lab):
    blind = {"console": {"blind": ["kind"]}}
    for row in range(4):
        run(lab, f"P00{row + 1}", row, changes=blind)
    (group,) = Watch(lab.path).look().balances[0].groups
    assert sorted(group.certificate.positions) == [f"stimulus {n}" for n in range(1, 5)]
    assert group.certificate.position_range == (1, 1)


def test_a_study_that_was_changed_between_participants_is_balanced_by_version(lab):
    run(lab, "P001", 0)
    run(lab, "P002", 1, changes={"title": "Other words"})
    assert len(Watch(lab.path).look().balances) == 2


def test_blocks_go_round_in_rows_of_blocks_times_rows_within(lab):
    blocked = {"design": "latin", "within": "block", "blocks": {"by": "kind", "design": "latin"}}
    run(lab, "P001", 0, changes={"order": blocked})
    (group,) = Watch(lab.path).look().balances[0].groups
    assert (group.round, group.design) == (4, "latin within blocks")


def test_where_everybody_meets_the_same_order_there_is_nothing_to_balance(lab):
    run(lab, "P001", 0, changes={"order": {"design": "as_listed"}})
    (group,) = Watch(lab.path).look().balances[0].groups
    assert group.verdict == "Everybody meets the stimuli as listed: there is nothing to balance."


def test_drawn_orders_have_no_rows_to_share_out(lab):
    run(lab, "P001", 7, changes={"order": {"design": "random"}})
    (group,) = Watch(lab.path).look().balances[0].groups
    assert group.round == 1
