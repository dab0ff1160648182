"""Stuck wires are found however the samples are cut into blocks, and live ones never."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.devices.daq.voltage_check import VoltageCheck
from palpate.devices.device import DeviceFault
from tests.examples import examples


def watch(stuck_s=0.1):
    check = VoltageCheck("it", ("a", "b"), 0.0, 10.0, 1000.0, stuck_s)
    check.begin()
    return check


@given(st.integers(1, 400), st.lists(st.integers(1, 60), min_size=30, max_size=30))
@settings(max_examples=examples(60), deadline=None)
def test_a_stuck_wire_is_a_fault_at_the_block_in_which_it_has_stood_long_enough(first, cuts) -> None:
    volts = np.random.default_rng(1).uniform(4, 6, (1000, 2))
    volts[first:, 1] = 5.0
    eye, at = watch(), 0
    for cut in cuts:
        still = at + cut - 1 - first
        if still >= 100:
            with pytest.raises(DeviceFault, match="it: b has stood at 5 V"):
                eye.see(volts[at : at + cut])
            return
        eye.see(volts[at : at + cut])
        at += cut


def test_a_wire_that_changes_every_now_and_then_is_alive() -> None:
    eye = watch()
    volts = np.full((950, 2), 5.0)
    volts[::90] += 0.1
    volts[:, 1] += np.arange(950) * 1e-6
    for first in range(0, 950, 70):
        assert not eye.see(volts[first : first + 70]).any()


def test_what_stands_within_half_a_percent_of_an_end_is_at_it() -> None:
    assert watch().see(np.array([[0.04, 5.0], [0.06, 9.96]])).tolist() == [[True, False], [False, True]]


def test_no_time_at_all_turns_it_off_and_beginning_forgets() -> None:
    still = np.full((5000, 2), 5.0)
    watch(0.0).see(still)
    eye = watch()
    eye.see(still[:99])
    eye.begin()
    eye.see(still[:99])
    with pytest.raises(DeviceFault):
        eye.see(still[:2])
