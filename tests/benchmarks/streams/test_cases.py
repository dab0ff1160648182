"""The declared figures: what they run and how their errors are evaluated (no times: those are for `palpate bench`)."""

import math

import pytest

from benchmarks.streams import cases as bench_streams
from benchmarks.streams.cases import cases, run_apart
from benchmarks.streams.recordings import KINDS, SyntheticSensor
from benchmarks.streams.run import held_up
from tests.devices.streams.labs import Time


@pytest.mark.parametrize("writer", ["palpate", "one thread"])
def test_every_sample_that_was_given_stands_in_a_ledger_with_its_own_number(writer):
    counts = run_apart(10.0, 20.0, writer)
    assert counts["produced"].keys() == {name for name, *_ in KINDS}
    assert bench_streams._lost(counts) == 0 and min(counts["in_place"].values()) >= 10 * 119
    assert counts["held_up_ms"]["n"] > 50


def test_a_lost_and_a_doubled_sample_both_count():
    counts = {"produced": {"force": 100, "door": 10}, "in_place": {"force": 98, "door": 11}}
    assert bench_streams._lost(counts) == 3
    assert bench_streams._lost({**counts, "in_place": {}}) == 110


def test_a_reader_is_held_up_for_as_long_as_it_is_overdue_while_the_writer_works():
    writing = [(100, 200), (300, 400)]
    late = [(0, 50), (50, 150), (120, 130), (190, 320), (250, 290), (350, 500), (90, 410)]
    assert held_up(late, writing) == [0, 50, 10, 30, 0, 50, 200]
    assert held_up([(0, 50)], []) == [0]


def test_a_made_up_sensor_gives_what_is_due_and_says_how_late_it_was():
    time, sensor = Time(), SyntheticSensor("door", ("angle", "torque"), 1000.0, 20.0)
    sensor.start(time)
    assert sensor.read(0.0) == {}
    time.pass_s(0.01)
    (block,) = sensor.read(0.0)["samples"]
    assert (block.first, len(block.data), sensor.produced) == (0, 200 * 8, 200)
    time.pass_s(0.005)
    assert sensor.read(1.0)["samples"][0].first == 200
    assert sensor.late_ns == [(5_000_000, 15_000_000)]


def test_the_cases_name_their_input_and_the_clocks_their_error():
    declared = list(cases(quick=True))
    assert {case.area for case in declared} == {"streams"}
    assert all("20 times their pace" in case.input for case in declared if case.case != "a device's clock")
    errors = {
        (case.method, "lognormal" in case.input): case.error(case.run())
        for case in declared
        if case.case == "a device's clock"
    }
    assert len(errors) == 8 and all(math.isfinite(error) for error in errors.values())
    for law in (False, True):
        assert errors["earliest arrivals, on-line", law] * 3 < errors["least squares", law]
