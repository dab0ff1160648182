"""Sessions in which anything may happen: cut anywhere, they go on to the same end, byte for byte."""

import pytest

from tests.protocols.every_task import PARTS
from tests.protocols.random_sessions import Chance, go_on, plan_for

MOST_CUTS = 100
"""A longer session is cut at so many places, spread over it."""


def whole_session(plan, events, seed):
    return go_on(plan, events, lambda log: Chance(plan, log, seed))


@pytest.mark.untraced
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("task", PARTS)
def test_whatever_happens_a_session_cut_anywhere_is_the_uninterrupted_one(task, seed):
    plan = plan_for(task, seed)
    whole = whole_session(plan, [], seed)
    assert {"request", "reply", "experimenter"} <= {event.kind for event in whole}
    for cut in range(1, len(whole), 1 + len(whole) // (MOST_CUTS + 10)):
        assert whole_session(plan, whole[:cut], seed) == whole


def test_among_them_everything_happens():
    events = [event for task in PARTS for seed in (1, 2) for event in whole_session(plan_for(task, seed), [], seed)]
    done = {(e.value["do"], e.value.get("which")) for e in events if e.kind == "experimenter"}
    assert {("repeat", "this"), ("repeat", "last"), ("pause", None), ("note", None)} <= done
    assert {e.value["as"] for e in events if e.kind == "trial_ended"} == {
        "answered", "captured", "left", "repeated", "stopped",
    }  # fmt: skip
