import pytest

from palpate.protocols.trial import ParticipantRow
from palpate.studies.lab import ParticipantError
from palpate.studies.participants.admission import admit, decline, demand_not_finished, finish, readmit
from palpate.studies.participants.allocations import every_allocation
from palpate.studies.participants.rows import allocate_row, release
from palpate.studies.participants.withdrawal import withdraw
from tests.protocols.studies_for_tests import toy
from tests.studies.participants.labs import filled, grouped
from tests.studies.participants.test_registry import audit_of


def test_a_live_session_gets_the_row_there_is_or_a_new_one(home):
    filled(home, 2)
    allocate_row(home, toy(), "P001", row=7)
    assert admit(home.lab, toy(), "P001", live=True) == ParticipantRow("P001", None, 7)
    assert admit(home.lab, toy(), "P002", live=True) == ParticipantRow("P002", None, 0)
    assert admit(home.lab, grouped(study="other"), "P002", live=True, group="y", row=3).row == 3


def test_a_simulated_session_gets_the_row_there_is_and_writes_nothing(home, tmp_path):
    filled(home, 3)
    allocate_row(home, toy(), "P001", row=7)
    allocate_row(home, toy(), "P003")
    release(home, toy(), "P003", "-")
    before = audit_of(home)
    assert admit(home.lab, toy(), "P001", live=False) == ParticipantRow("P001", None, 7)
    assert [admit(home.lab, toy(), who, live=False) for who in ("P002", "P003", "P099")] == [None] * 3
    assert audit_of(home) == before
    nowhere = tmp_path / "nowhere"
    assert admit(nowhere, toy(), "P001", live=False) is None and not nowhere.exists()


def test_nobody_who_withdrew_is_admitted_not_even_simulated(home):
    filled(home, 1)
    withdraw(home, "P001", "-")
    for live in (True, False):
        with pytest.raises(ParticipantError, match="P001 has withdrawn from"):
            admit(home.lab, toy(), "P001", live)


def test_a_live_session_asks_for_a_lab_and_a_participant_it_knows(home, tmp_path):
    with pytest.raises(
        ParticipantError, match=r"P009 is not known in .*lab: palpate participants add --pseudonym P009"
    ):
        admit(home.lab, toy(), "P009", live=True)
    (home.lab / "participants" / "registry.sqlite").unlink()
    with pytest.raises(ParticipantError, match="P001 is not known"):
        admit(home.lab, toy(), "P001", live=True)
    assert not (home.lab / "participants" / "registry.sqlite").exists()
    (tmp_path / "empty").mkdir()
    with pytest.raises(ParticipantError, match=r"empty is not a lab: it holds no participants.json; .*palpate init"):
        admit(tmp_path / "empty", toy(), "P001", live=True)
    assert list((tmp_path / "empty").iterdir()) == []


def test_a_finished_session_is_on_record_once_and_keeps_its_row(home, tmp_path):
    filled(home, 2)
    finish(tmp_path / "nowhere", toy(), "P001")
    finish(home.lab, toy(), "P001")
    admit(home.lab, toy(), "P001", live=True)
    finish(home.lab, toy(), "P001")
    finish(home.lab, toy(), "P001")
    assert [what for what, _ in audit_of(home)].count("finished") == 1
    assert [allocation.status for allocation in every_allocation(home)] == ["finished"]
    assert admit(home.lab, toy(), "P002", live=True).row == 1
    release(home, toy(), "P002", "-")
    finish(home.lab, toy(), "P002")
    assert [allocation.status for allocation in every_allocation(home)] == ["finished", "released"]


def test_who_finished_at_another_station_is_refused_here(home):
    filled(home, 1)
    demand_not_finished(home.lab, "toy", "P001")
    admit(home.lab, toy(), "P001", live=True)
    demand_not_finished(home.lab, "toy", "P001")
    finish(home.lab, toy(), "P001")
    with pytest.raises(ParticipantError, match=r"P001 has finished toy in a session that is not in .*release toy P001"):
        demand_not_finished(home.lab, "toy", "P001")
    release(home, toy(), "P001", "void")
    demand_not_finished(home.lab, "toy", "P001")


def test_a_session_is_resumed_only_on_a_row_that_is_still_the_participants(home, tmp_path):
    filled(home, 2)
    readmit(tmp_path / "nowhere", toy(), "P001")
    readmit(home.lab, toy(), "P001")
    assert every_allocation(home) == []
    admit(home.lab, toy(), "P001", live=True)
    release(home, toy(), "P001", "left")
    readmit(home.lab, toy(), "P001")
    assert [allocation.status for allocation in every_allocation(home)] == ["active"]
    release(home, toy(), "P001", "left")
    allocate_row(home, toy(), "P002", replaces="P001")
    with pytest.raises(ParticipantError, match=r"P001 had row 0 of toy, which is P002's now"):
        readmit(home.lab, toy(), "P001")


def test_who_declines_gives_up_the_row_unless_a_session_was_finished_on_it(home):
    filled(home, 2)
    for who in ("P001", "P002"):
        admit(home.lab, toy(), who, live=True)
    finish(home.lab, toy(), "P001")
    decline(home.lab, toy(), "P001")
    decline(home.lab, toy(), "P002")
    assert [allocation.status for allocation in every_allocation(home)] == ["finished", "released"]
