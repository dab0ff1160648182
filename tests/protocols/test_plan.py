import subprocess
import sys
from collections import Counter
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.protocols.balance import certificate
from palpate.protocols.orders import rows_of
from palpate.protocols.plan import PlanError, compile_plan, main_order
from palpate.protocols.trial import ParticipantRow
from tests.examples import examples
from tests.protocols.studies_for_tests import toy, toy_plan


def order(plan):
    return [trial.stimulus.id for trial in plan.trials]


def test_the_digest_is_the_same_on_every_machine_and_python():
    assert toy_plan().digest == "819e47817f917432dae34816f9e3b68c057a400adac006d741ca83abd046cbe9"
    assert order(toy_plan()) == list("DCBA")


def test_the_digest_is_the_same_in_another_process_with_another_hash_seed():
    code = "from tests.protocols.studies_for_tests import toy_plan; print(toy_plan().digest)"
    for seed in ("1", "2"):
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={"PYTHONHASHSEED": seed}
        )
        assert done.stdout.strip() == toy_plan().digest


@pytest.mark.parametrize(
    "change",
    [
        {"participant": "P002"}, {"row": 1}, {"seed": 1}, {"title": "Toy"}, {"rest": {"every": 3}},
        {"attributes": [["Soft", "Hard"], ["Cold", "Hot"]]}, {"order": {"design": "latin"}},
    ],
)  # fmt: skip
def test_whatever_changes_the_session_changes_the_digest(change):
    assert toy_plan(**change).digest != toy_plan().digest


def test_what_does_not_change_the_session_changes_no_digest():
    rows = list(reversed(toy().definition()["stimuli"]))
    assert order(toy_plan(stimuli=rows)) == order(toy_plan())


designs = st.sampled_from(["williams", "latin", "random", "as_listed"])


@settings(max_examples=examples(60), deadline=None)
@given(
    n=st.integers(1, 20), design=designs, repeats=st.integers(1, 3), row=st.integers(0, 200), seed=st.integers(0, 5),
    practice=st.integers(0, 3), every=st.integers(1, 7), blocked=st.booleans(), blocks=designs,
)  # fmt: skip
def test_every_plan_holds_every_stimulus_and_keeps_its_promises(
    n, design, repeats, row, seed, practice, every, blocked, blocks
):
    stimuli = [{"id": f"s{i}", "columns": {"kind": str(i % 3)}} for i in range(n)]
    declared = {"design": design, "repeats": repeats}
    if blocked:
        declared |= {"within": "block", "blocks": {"by": "kind", "design": blocks}}
    changes = {"stimuli": stimuli, "order": declared, "rest": {"every": every}, "simulation": None}
    if practice:
        changes["practice"] = {"stimuli": [f"s{i % n}" for i in range(practice)]}
    plan = toy_plan(row=row, seed=seed, **changes)
    assert [t.number for t in plan.trials] == list(range(1, practice + n * repeats + 1))
    assert [t.practice for t in plan.trials] == [True] * practice + [False] * (n * repeats)
    main = plan.trials[practice:]
    for one in range(repeats):
        assert sorted(t.stimulus.id for t in main[one * n : (one + 1) * n]) == sorted(f"s{i}" for i in range(n))
    assert [i for i, t in enumerate(main) if t.rest_before] == list(range(every, len(main), every))
    assert not any(t.rest_before for t in plan.trials[:practice])
    assert [t.number for t in plan.trials if not t.may_go_back] == ([1, practice + 1] if practice else [1])
    if blocked:
        for one in range(repeats):
            kinds = [t.block for t in main[one * n : (one + 1) * n]]
            assert sum(a != b for a, b in pairwise(kinds)) == len(set(kinds)) - 1
    assert toy_plan(row=row, seed=seed, **changes).digest == plan.digest


def sequences(study, rows):
    return [[felt[0].id for _, felt in main_order(study, ParticipantRow(f"P{r}", None, r))] for r in range(rows)]


@pytest.mark.parametrize(("n", "rows"), [(4, 4), (5, 10), (6, 12)])
def test_williams_orders_are_balanced_over_their_rows(n, rows):
    study = toy(stimuli=[{"id": f"s{i}"} for i in range(n)], simulation=None)
    assert certificate(sequences(study, rows)).balanced


def test_latin_orders_are_balanced_for_position():
    counts = certificate(sequences(toy(order={"design": "latin"}), 8))
    assert counts.position_range == (2, 2)


def test_repeats_take_the_next_row():
    study = toy(order={"design": "williams", "repeats": 2})
    once = sequences(toy(), 5)
    assert sequences(study, 4) == [once[r] + once[r + 1] for r in range(4)]


@pytest.mark.parametrize("outer", ["latin", "williams", "random", "as_listed"])
@pytest.mark.parametrize("inner", ["latin", "williams"])
@pytest.mark.parametrize("blocks", range(1, 6))
@pytest.mark.parametrize("size", range(1, 6))
def test_in_time_every_block_order_meets_every_order_within_equally_often(blocks, size, inner, outer):
    names = "vwxyz"[:blocks]
    stimuli = [{"id": f"{k}{i}", "columns": {"kind": k}} for k in names for i in range(size)]
    declared = {"design": inner, "within": "block", "blocks": {"by": "kind", "design": outer}}
    study = toy(stimuli=stimuli, simulation=None, order=declared)
    outer_rows, inner_rows = rows_of(outer, blocks), rows_of(inner, size)
    rows = sequences(study, outer_rows * inner_rows)
    order = [tuple(dict.fromkeys(item[0] for item in row)) if outer_rows > 1 else () for row in rows]
    within = [tuple(item for item in row if item[0] == "v") for row in rows]
    met = Counter(zip(order, within, strict=True))
    assert len(met) == outer_rows * inner_rows and set(met.values()) == {1}
    certificates = certificate(within)
    assert len(set(certificates.position_range)) == 1


@pytest.mark.parametrize("seed", [2**63, -(2**63) - 1])
def test_a_seed_that_no_database_holds_is_refused(seed):
    with pytest.raises(PlanError, match="at most 63 bits"):
        toy_plan(seed=seed)


def test_random_orders_differ_between_participants_and_seeds():
    random = {"order": {"design": "random"}, "stimuli": [{"id": f"s{i}"} for i in range(12)], "simulation": None}
    first = order(toy_plan("P001", **random))
    assert first != order(toy_plan("P002", **random)) != order(toy_plan("P002", seed=1, **random))
    assert first == order(toy_plan("P001", row=5, **random))


def test_as_listed_is_as_listed():
    assert order(toy_plan(order={"design": "as_listed"}, row=3)) == list("ABCD")


def test_groups_meet_their_own_stimuli():
    study = toy(groups={"1": {"kind": ["x"]}, "2": {"kind": ["y"]}})
    plan = compile_plan(study, ParticipantRow("P001", "2", 0))
    assert sorted(order(plan)) == ["B", "D"]


@pytest.mark.parametrize(
    ("groups", "who", "message"),
    [
        ({"1": {"kind": ["x"]}}, ParticipantRow("P001", "3"), "group '3'; toy has groups 1"),
        ({"1": {"kind": ["x"]}}, ParticipantRow("P001"), "group None; toy has groups 1"),
        ({}, ParticipantRow("P001", "1"), "toy has no groups"),
        ({}, ParticipantRow("P001", None, -1), "row -1"),
    ],
)
def test_a_participant_who_does_not_fit_is_refused(groups, who, message):
    with pytest.raises(PlanError, match=message):
        compile_plan(toy(groups=groups), who)
