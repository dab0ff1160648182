"""The figures of alignment: the default way reaches them on every stream, and naive ways do not."""

from __future__ import annotations

import pytest

from benchmarks.alignment.cases import cases
from benchmarks.alignment.truth import KINDS


@pytest.fixture(scope="module")
def errors():
    """Ten seconds of each stream."""
    return {(case.case, case.input, case.method): case.error(case.run()) for case in cases(quick=True)}


def of_stream(errors, kind, by=""):
    return {method: error for (case, _, method), error in errors.items() if case == f"{by}{kind} onto 1 kHz"}


def by_clock(errors, kind):
    return of_stream(errors, kind, "bandlimited, ")


@pytest.mark.parametrize("kind", [kind.name for kind in KINDS])
def test_every_stream_comes_onto_1_khz_within_half_a_percent(errors, kind):
    by_method = of_stream(errors, kind)
    assert by_method["palpate, bandlimited"] < 0.5 and by_method["palpate, bandlimited"] == min(by_method.values())
    clocked = by_clock(errors, kind)
    clocked.pop("1 ms untold, by its stamps")  # which know more than any arrival tells
    assert clocked["palpate, line under arrivals"] == by_method["palpate, bandlimited"] == min(clocked.values())
    assert (
        min(by_method["palpate, hold"], clocked["nominal rate, first arrival"], clocked["linear, arrivals as times"])
        > 5
    )


@pytest.mark.parametrize("kind", [kind.name for kind in KINDS])
def test_a_clock_from_arrivals_is_right_within_microseconds(errors, kind):
    case = "a clock from arrivals"
    assert errors[case, kind, "palpate, line under arrivals"] < 50
    assert errors[case, kind, "least squares"] > 500


@pytest.mark.parametrize("kind", [kind.name for kind in KINDS])
def test_a_delay_that_all_arrivals_share_cannot_be_seen_and_costs_what_theory_says(errors, kind):
    """1 ms at the RMS frequency of 0.2 to 25 Hz: 2 pi 14.5 Hz 1 ms = 9.1 %."""
    assert by_clock(errors, kind)["1 ms untold"] == pytest.approx(9.1, abs=0.3)


@pytest.mark.parametrize("kind", [kind.name for kind in KINDS])
def test_stamps_by_the_hosts_clock_take_that_delay_away(errors, kind):
    """Stamps that scatter by 0.1 ms, about a thousand of them: 3 us, which is 0.03 %."""
    assert by_clock(errors, kind)["1 ms untold, by its stamps"] < 0.2
