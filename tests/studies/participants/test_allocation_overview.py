from palpate.protocols.balance import certificate
from palpate.protocols.plan import main_order
from palpate.protocols.trial import ParticipantRow
from palpate.studies.participants.allocation_overview import Overlap, group_allocations, overlaps
from palpate.studies.participants.people import add
from palpate.studies.participants.rows import allocate_row, release
from palpate.studies.participants.withdrawal import withdraw
from tests.protocols.studies_for_tests import toy
from tests.studies.participants.labs import filled, grouped, record_session


def test_a_study_is_certified_balanced_when_its_square_is_full_and_not_before(registry):
    filled(registry, 5)
    for number in range(1, 4):
        allocate_row(registry, toy(), f"P{number:03d}")
        assert not group_allocations(registry, toy())[0].certificate.balanced
    allocate_row(registry, toy(), "P004")
    [whole] = group_allocations(registry, toy())
    assert whole.certificate.balanced and whole.certificate.sequences == 4 and whole.group is None
    assert [holder.participant for holder in whole.holders] == ["P001", "P002", "P003", "P004"] and whole.next_row == 4
    release(registry, toy(), "P002", "ill")
    [gap] = group_allocations(registry, toy())
    assert not gap.certificate.balanced and gap.given_up == ((1, "P002"),) and gap.next_row == 1
    allocate_row(registry, toy(), "P005", replaces="P002")
    [mended] = group_allocations(registry, toy())
    assert mended.certificate.balanced and mended.given_up == () and mended.holders[1].replaces == "P002"


def test_groups_stand_by_themselves_and_sessions_from_before_the_registry_count(home):
    record_session(home.lab, "P001", row=("x", 0))
    filled(home, 1)
    allocate_row(home, grouped(), "P002")
    x, y = group_allocations(home, grouped())
    assert [(holder.participant, holder.status) for holder in x.holders] == [("P001", "session")]
    assert [(holder.participant, holder.status) for holder in y.holders] == [("P002", "active")]
    assert (x.certificate.sequences, y.certificate.sequences) == (1, 1)


def test_a_study_that_nobody_is_in_stands_empty(home):
    [empty] = group_allocations(home, toy())
    assert (empty.holders, empty.given_up, empty.next_row, empty.certificate.sequences) == ((), (), 0, 0)


def test_how_many_also_took_part_in_another_study(registry):
    filled(registry, 8)
    people = [f"P{number:03d}" for number in range(1, 9)]
    for who in people[:5]:
        allocate_row(registry, toy(), who)
    for who in people[3:]:
        allocate_row(registry, toy(study="door_lexicon"), who)
    record_session(registry.lab, "P001", study="similarity")
    shared = overlaps(registry, "toy")
    assert shared == [Overlap("door_lexicon", 2, 5), Overlap("similarity", 1, 5)]
    assert shared[0].text() == "40 % (2 of 5) also took part in door_lexicon"
    release(registry, toy(study="door_lexicon"), "P004", "left before it began")
    withdraw(registry, "P001", "-")
    assert overlaps(registry, "toy") == [Overlap("door_lexicon", 1, 4)]
    assert overlaps(registry, "nothing") == [Overlap("door_lexicon", 0, 0), Overlap("toy", 0, 0)]


def test_a_pseudonym_within_another_is_not_taken_for_it(home):
    add(home, "P1")
    record_session(home.lab, "P11", study="other")
    allocate_row(home, toy(), "P1")
    assert overlaps(home, "toy") == [Overlap("other", 0, 1)]


def test_simulated_people_take_part_in_nothing(home):
    filled(home, 1)
    allocate_row(home, toy(), "P001")
    record_session(home.lab, "P002", kind="simulated")
    record_session(home.lab, "P001", study="other", kind="simulated")
    assert overlaps(home, "toy") == []
    record_session(home.lab, "P001", study="another")
    assert overlaps(home, "toy") == [Overlap("another", 1, 1)]


def test_the_certificate_of_a_random_design_is_of_the_orders_that_were_run(home):
    study = toy(order={"design": "random"})
    filled(home, 2)
    for who in ("P001", "P002"):
        row = allocate_row(home, study, who)
        record_session(home.lab, who, row=(None, row.row), seed=int(who[1:]) + 6)
    orders = [
        [felt[0].id for _, felt in main_order(study, ParticipantRow(f"P00{n}", None, n - 1), n + 6)] for n in (1, 2)
    ]
    assert group_allocations(home, study)[0].certificate == certificate(orders)
    assert certificate(orders) != certificate(
        [[felt[0].id for _, felt in main_order(study, ParticipantRow(f"P00{n}", None, n - 1))] for n in (1, 2)]
    )
