import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.devices.door.link.messages import Telemetry
from palpate.devices.door.link.telemetry import LOST, Opening, TelemetryBlocks, untrue


def sample(number, angle=0.0, **more):
    values = {"velocity_deg_s": 0.0, "torque_Nm": 0.0, "brake_A": 0.0, "state": 3, "fault": 0} | more
    return Telemetry(number * 2000, number % 2**32, angle, **values)


def test_lost_samples_are_numbered_and_reported():
    blocks = TelemetryBlocks().blocks([(n, sample(n)) for n in (7, 8, 9, 13, 14)])
    assert [(block.first, len(block.data) // 20, block.lost, block.why) for block in blocks] == [
        (0, 3, 0, ""),
        (6, 2, 3, LOST),
    ]
    assert blocks[0].device_s == pytest.approx(9 * 0.002) and blocks[0].at_ns == 9


@given(st.lists(st.integers(0, 200), max_size=60, unique=True), st.integers(0, 2**32 - 1), st.integers(1, 9))
def test_numbers_rise_and_everything_is_given_or_lost_across_calls_and_over_the_counters_end(some, start, size):
    numbers = sorted({0, *some})
    numbering, next_, count = TelemetryBlocks(), 0, 0
    for at in range(0, len(numbers), size):
        for block in numbering.blocks([(0, sample(start + n)) for n in numbers[at : at + size]]):
            assert block.first == next_ + block.lost
            next_, count = block.first + len(block.data) // 20, count + len(block.data) // 20
    assert next_ == numbers[-1] + 1 and count == len(numbers)


def test_a_sample_that_comes_twice_counts_once():
    blocks = TelemetryBlocks().blocks([(0, sample(n)) for n in (0, 1, 1, 0, 2)])
    assert [(block.first, len(block.data) // 20) for block in blocks] == [(0, 3)]


def test_a_row_holds_the_channels_in_their_order():
    (block,) = TelemetryBlocks().blocks([(0, sample(0, 12.5, velocity_deg_s=3.0, torque_Nm=7.25, brake_A=0.5))])
    assert struct.unpack("<5f", block.data) == (12.5, 3.0, 7.25, 0.5, 3.0)


@pytest.mark.parametrize(
    ("telemetry", "what"),
    [
        (sample(0, math.nan), "not_a_number"), (sample(0, torque_Nm=math.inf), "not_a_number"),
        (sample(0, 91.0), "over_range"), (sample(0, torque_Nm=-501.0), "over_range"),
    ],
)  # fmt: skip
def test_telemetry_that_cannot_be_true_is_a_fault(telemetry, what):
    assert untrue("door", telemetry).what == what


def test_telemetry_that_can_be_true_is_none():
    assert untrue("door", sample(0, 61.0, torque_Nm=40.0)) is None


@pytest.mark.parametrize(
    ("angles", "opened", "back"),
    [
        ([0, 20, 59.9, 0], False, False),
        ([0, 20, 60.1], True, False),
        ([0, 20, 60.1, 30], True, False),
        ([0, 20, 60.1, 30, 2.9], True, True),
        ([61, 30, 0], False, False),  # where it stood when the play began does not count
        ([61, 30, 0, 62, 1], True, True),
    ],
)
def test_a_door_is_back_once_it_was_opened_from_closed_to_its_end(angles, opened, back):
    opening = Opening(62.0)
    for angle in angles:
        opening.see(sample(0, float(angle)))
    assert (opening.opened, opening.back) == (opened, back)


def test_the_largest_opening_angle_is_stored():
    opening = Opening(62.0)
    for angle in (50.0, 0.0, 33.3, math.nan, 12.0):
        opening.see(sample(0, angle))
    assert opening.most_deg == 33.3
