import random

import pytest

from palpate.protocols.plan import compile_plan
from palpate.protocols.trial import ParticipantRow
from palpate.studies.lab import ParticipantError
from palpate.studies.participants.allocations import every_allocation
from palpate.studies.participants.people import add
from palpate.studies.participants.rows import allocate_row, release
from palpate.studies.participants.withdrawal import withdraw
from tests.protocols.studies_for_tests import toy
from tests.studies.participants.labs import filled, grouped, record_session
from tests.studies.participants.test_registry import audit_of


def places(registry, study, people):
    return [(who.group, who.row) for who in (allocate_row(registry, study, participant) for participant in people)]


def test_groups_fill_evenly_as_people_arrive_and_a_row_is_given_once(registry):
    filled(registry, 6)
    people = ["P004", "P002", "P006", "P001", "P003"]
    given = places(registry, grouped(), people)
    assert given == [("x", 0), ("y", 0), ("x", 1), ("y", 1), ("x", 2)]
    assert places(registry, grouped(), reversed(people)) == given[::-1]
    assert [what for what, _ in audit_of(registry)].count("allocated") == 5


def test_every_study_has_rows_of_its_own_and_rows_go_round_the_square(registry):
    filled(registry, 9)
    people = [f"P{n:03d}" for n in range(1, 10)]
    assert places(registry, toy(), people) == [(None, n) for n in range(9)]
    assert places(registry, toy(study="other"), people[:2]) == [(None, 0), (None, 1)]
    orders = [[t.stimulus.id for t in compile_plan(toy(), ParticipantRow("P001", None, n)).trials] for n in (0, 4, 8)]
    assert orders[0] == orders[1] == orders[2]


def test_the_row_of_somebody_who_dropped_out_is_offered_first_the_lowest_of_several(registry):
    filled(registry, 8)
    places(registry, toy(), ["P001", "P002", "P003", "P004"])
    for participant in ("P003", "P002"):
        release(registry, toy(), participant, "did not come back")
    assert places(registry, toy(), ["P005", "P006", "P007"]) == [(None, 1), (None, 2), (None, 4)]
    assert ("released", {"study": "toy", "participant": "P003", "group": None, "row": 2,
                         "why": "did not come back"}) in audit_of(registry)  # fmt: skip


def test_a_row_given_up_is_offered_before_one_that_nobody_ever_had(home):
    filled(home, 3)
    allocate_row(home, toy(), "P001", row=5)
    release(home, toy(), "P001", "ill")
    assert places(home, toy(), ["P002", "P003"]) == [(None, 5), (None, 0)]


def test_a_drop_out_makes_room_in_their_group(registry):
    filled(registry, 6)
    places(registry, grouped(), ["P001", "P002", "P003", "P004"])
    release(registry, grouped(), "P002", "ill")
    assert places(registry, grouped(), ["P005", "P006"]) == [("y", 0), ("x", 2)]


def test_a_replacement_inherits_group_and_row(registry):
    filled(registry, 6)
    places(registry, grouped(), ["P001", "P002", "P003"])
    with pytest.raises(ParticipantError, match=r"P002 still holds row 0 of group y of toy; if they dropped out: palp"):
        allocate_row(registry, grouped(), "P004", replaces="P002")
    release(registry, grouped(), "P002", "ill")
    for _ in range(2):
        assert allocate_row(registry, grouped(), "P004", replaces="P002") == ParticipantRow("P004", "y", 0)
    with pytest.raises(ParticipantError, match=r"row 0 of group y of toy is P004's"):
        allocate_row(registry, grouped(), "P005", replaces="P002")
    withdraw(registry, "P001", "on request")
    assert allocate_row(registry, grouped(), "P005", replaces="P001") == ParticipantRow("P005", "x", 0)
    inherited = {allocation.participant: allocation.replaces for allocation in every_allocation(registry, "toy")}
    assert inherited == {"P001": None, "P002": None, "P003": None, "P004": "P002", "P005": "P001"}


def test_who_dropped_out_and_comes_back_gets_their_own_row_unless_it_was_given(registry):
    filled(registry, 3)
    places(registry, toy(), ["P001", "P002"])
    release(registry, toy(), "P001", "moved")
    assert places(registry, toy(), ["P001"]) == [(None, 0)]
    release(registry, toy(), "P001", "moved again")
    assert places(registry, toy(), ["P003"]) == [(None, 0)]
    with pytest.raises(
        ParticipantError, match=r"P001 had row 0 of toy, which is P003's now, and a row is allocated onc"
    ):
        allocate_row(registry, toy(), "P001")


def test_a_row_that_is_asked_for_is_given_if_nobody_holds_it(registry):
    filled(registry, 4)
    assert allocate_row(registry, grouped(), "P001", "y", 3) == ParticipantRow("P001", "y", 3)
    assert allocate_row(registry, grouped(), "P002", "y") == ParticipantRow("P002", "y", 0)
    with pytest.raises(ParticipantError, match=r"row 3 of group y of toy is P001's; leave --row out"):
        allocate_row(registry, grouped(), "P003", "y", 3)
    with pytest.raises(ParticipantError, match="P001 has row 3 of group y of toy; a row is allocated once"):
        allocate_row(registry, grouped(), "P001", "y", 4)


@pytest.mark.parametrize(
    ("wish", "message"),
    [
        ({"group": "z"}, "toy has no group 'z'; known: x, y"),
        ({"row": 1}, "row 1 of which group. toy has groups x, y: give --group"),
        ({"group": "x", "row": -1}, "a row from 0 to"),
        ({"group": "x", "row": 2**31}, "a row from 0 to"),
        ({"replaces": "P001"}, "P001 cannot replace P001"),
        ({"replaces": "P002"}, "P002 never had a row of toy; there is nothing to inherit"),
        ({"replaces": "P002", "row": 1}, "leave --group and --row out"),
    ],
)
def test_a_wish_that_cannot_be_is_refused(home, wish, message):
    filled(home, 2)
    with pytest.raises(ParticipantError, match=message):
        allocate_row(home, grouped(), "P001", **wish)
    assert every_allocation(home) == []


def test_a_group_where_the_study_has_none_is_refused(home):
    filled(home, 1)
    with pytest.raises(ParticipantError, match="toy has no group 'x'; it has no groups"):
        allocate_row(home, toy(), "P001", "x")


def test_nobody_unknown_or_withdrawn_gets_or_gives_up_a_row(registry):
    filled(registry, 2)
    withdraw(registry, "P002", "on request")
    for act in (lambda who: allocate_row(registry, toy(), who), lambda who: release(registry, toy(), who, "-")):
        with pytest.raises(
            ParticipantError, match=r"P009 is not known in .*: palpate participants add --pseudonym P00"
        ):
            act("P009")
        with pytest.raises(ParticipantError, match="P002 has withdrawn"):
            act("P002")
    with pytest.raises(ParticipantError, match="P001 holds no row of toy"):
        release(registry, toy(), "P001", "-")


def test_a_lab_that_ran_before_it_had_a_registry_gives_no_row_twice(registry):
    for number, who in enumerate(("P001", "P002", "P003")):
        record_session(registry.lab, who, row=(None, number))
    filled(registry, 1)  # P004
    assert places(registry, toy(), ["P004"]) == [(None, 3)]
    add(registry, "P002")
    assert places(registry, toy(), ["P002"]) == [(None, 1)]
    add(registry, "P003")
    release(registry, toy(), "P003", "slept")
    add(registry, "P001")
    withdraw(registry, "P001", "on request")
    filled(registry, 2)  # P005, P006
    assert places(registry, toy(), ["P005"]) == [(None, 0)]
    assert allocate_row(registry, toy(), "P006", replaces="P003").row == 2


def test_two_earlier_sessions_of_one_row_are_distinguished(home):
    for who in ("P001", "P002"):
        record_session(home.lab, who, row=(None, 0))
        add(home, who)
    with pytest.raises(ParticipantError, match=r"P002 had row 0 of toy, which is P001's now.*release toy P001 --why"):
        allocate_row(home, toy(), "P002")
    release(home, toy(), "P001", "P002 replaced them")
    assert places(home, toy(), ["P002"]) == [(None, 0)]


@pytest.mark.parametrize("seed", range(2))
def test_whatever_people_do_no_row_has_two_holders_and_the_gaps_are_filled(home, seed):
    chance, study = random.Random(seed), grouped()
    for _ in range(40):
        holders = [allocation.participant for allocation in every_allocation(home) if allocation.holds]
        if holders and chance.random() < 0.4:
            release(home, study, chance.choice(holders), "-")
        else:
            allocate_row(home, study, add(home))
        rows = held(home)
        assert all(len(set(of)) == len(of) for of in rows.values())
    dropped_out = sum(not allocation.holds for allocation in every_allocation(home))
    assert dropped_out > 5
    for _ in range(dropped_out):
        allocate_row(home, study, add(home))
    rows = held(home)
    assert abs(len(rows["x"]) - len(rows["y"])) <= 1
    assert all(sorted(of) == list(range(len(of))) for of in rows.values())


def held(registry):
    """Group -> the rows that somebody holds."""
    everybody = [allocation for allocation in every_allocation(registry) if allocation.holds]
    return {group: [allocation.row for allocation in everybody if allocation.group == group] for group in ("x", "y")}
