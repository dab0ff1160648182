import pytest

from palpate.studies.lab import ParticipantError
from palpate.studies.participants.allocations import every_allocation
from palpate.studies.participants.export import export
from palpate.studies.participants.identities import Identity, identify, identities
from palpate.studies.participants.people import add
from palpate.studies.participants.registry import withdrawn
from palpate.studies.participants.rows import allocate_row
from palpate.studies.participants.withdrawal import withdraw
from tests.protocols.studies_for_tests import toy
from tests.studies.participants.labs import filled, record_session
from tests.studies.participants.test_registry import audit_of


def everything_in(lab):
    return b"".join(path.read_bytes() for path in lab.rglob("*") if path.is_file())


def test_who_withdraws_is_erased_their_rows_go_back_and_their_sessions_are_marked(registry):
    lab = registry.lab
    filled(registry, 2)
    for who, name in (("P001", "Kim Hana"), ("P002", "Lee Minsu")):
        identify(lab, who, Identity(name, f"{who}@example.org"))
        allocate_row(registry, toy(), who)
        record_session(lab, who, {"age": 30}, row=(None, int(who[-1]) - 1))
    allocate_row(registry, toy(study="other"), "P001")
    record_session(lab, "P0011", row=(None, 5))
    export(registry)
    assert "sub-P001\t30" in (lab / "participants.tsv").read_text()

    done = withdraw(registry, "P001", "on request")
    assert (done.erased, done.sessions) == (True, ("toy_P001_s1.sqlite",))
    assert [(allocation.study, allocation.row) for allocation in done.released] == [("other", 0), ("toy", 0)]
    assert withdrawn(lab) == {"P001"} and set(identities(lab)) == {"P002"}
    assert b"Kim Hana" not in everything_in(lab) and b"P001@example" not in everything_in(lab)
    assert "sub-P001\t" not in (lab / "participants.tsv").read_text()
    assert "sub-P002\t30" in (lab / "participants.tsv").read_text()
    assert audit_of(registry)[-1] == (
        "withdrawn",
        {"participant": "P001", "why": "on request", "identity_erased": True, "sessions": ["toy_P001_s1.sqlite"]},
    )
    assert {(row.participant, row.study): row.holds for row in every_allocation(registry)} == {
        ("P001", "other"): False, ("P001", "toy"): False, ("P002", "toy"): True,
    }  # fmt: skip
    assert add(registry) == "P003"


def test_a_withdrawal_that_was_interrupted_is_finished_by_the_next(home):
    filled(home, 1)
    withdraw(home, "P001", "on request")
    identify(home.lab, "P001", Identity("Kim Hana"))
    with pytest.raises(ParticipantError, match="P001 has withdrawn already; nothing about their identity is stored"):
        withdraw(home, "P001", "on request")
    assert identities(home.lab) == {}


def test_nobody_unknown_can_withdraw(home):
    with pytest.raises(ParticipantError, match="P009 is not known"):
        withdraw(home, "P009", "-")


def test_nothing_is_withdrawn_while_the_store_is_open_to_others(home):
    filled(home, 1)
    identify(home.lab, "P001", Identity("Kim Hana"))
    (home.lab / "private").chmod(0o755)
    with pytest.raises(ParticipantError, match="chmod 700"):
        withdraw(home, "P001", "-")
    assert withdrawn(home.lab) == set()


def test_the_row_of_a_session_from_before_the_registry_is_on_offer_again(home):
    record_session(home.lab, "P001", row=(None, 4))
    add(home, "P001")
    [released] = withdraw(home, "P001", "-").released
    assert (released.study, released.row) == ("toy", 4)
    filled(home, 1)
    assert allocate_row(home, toy(), "P002").row == 4


@pytest.mark.parametrize("why", ["Kim Hana asked", "a mail of HANA", "wrote from hana@example.org", " "])
def test_a_reason_that_says_who_it_was_is_refused_and_nothing_is_done(home, why):
    filled(home, 1)
    identify(home.lab, "P001", Identity("Kim Hana", "hana@example.org"))
    with pytest.raises(ParticipantError, match="--why: "):
        withdraw(home, "P001", why)
    assert set(identities(home.lab)) == {"P001"} and withdrawn(home.lab) == set()
    withdraw(home, "P001", "on request, by mail; no manager or hanami was in it")
