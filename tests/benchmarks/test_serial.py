import pytest

from benchmarks.serial import cases, frames_lost
from benchmarks.serial_drills import DRILLS, run_drill
from palpate.devices.door.link.codes import SAFE_WITHIN_MS, DoorFault


@pytest.mark.needs("serial")
def test_every_case_of_the_bench_is_right():
    for case in cases(quick=True):
        if not case.case.startswith("safe"):
            assert case.error(case.run()) <= (2 if case.case == "garbage on the line" else 0), case


def test_after_every_drill_the_motor_is_off_and_the_brake_switched_on_within_50_ms():
    for name in DRILLS:
        result = run_drill(name)
        assert result.fault is not DoorFault.none and result.off_ms <= result.without_motor_ms <= SAFE_WITHIN_MS, name


def test_garbage_among_frames_costs_one_at_most():
    assert max(map(frames_lost, range(10_000, 10_300))) <= 1
