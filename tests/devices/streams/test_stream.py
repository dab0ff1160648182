"""Blocks put together: every sample in its place, every gap reported, every arrival time unchanged."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.devices.device import Block
from palpate.devices.streams.reader import NO_ROOM, Ring
from palpate.devices.streams.stream import ARRIVALS, PIECE_BYTES, Stream
from palpate.protocols.canonical import canonical
from palpate.protocols.events import NS
from tests.devices.streams.labs import XYZ, block, rows


def stream(signal=XYZ, room=10_000_000):
    return Stream("tool_acceleration", "vibration", signal, Ring(room, 4 * len(signal.channels)))


def put(one, *blocks):
    for one_block in blocks:
        one.ring.put(one_block)
    return one.take()


def test_blocks_become_one_piece_with_its_time_and_its_clock():
    pieces, entry = put(stream(), block(0, 10, at_s=5.0), block(10, 10, at_s=5.013))
    (piece,) = pieces
    assert (piece.stream, piece.channels, piece.units) == ("tool_acceleration", XYZ.channels, XYZ.units)
    assert (piece.rate_hz, piece.first, piece.count, piece.clock) == (1000.0, 0, 20, "daq")
    assert piece.data == rows(0, 20)
    assert piece.t0_ns == round(4.991 * NS)  # sample 9 was there at 5 s, and no arrival says it was earlier
    last = [[9, 5 * NS], [19, round(5.013 * NS)]]
    assert entry == {"first": 0, "count": 20, "lost": 0, "why": "", "arrived": last}


def test_a_gap_begins_a_new_piece_and_says_why():
    one = stream()
    pieces, entry = put(
        one, block(3, 7, lost=3, why="started late"), block(10, 10), block(25, 5, lost=5, why="overrun")
    )
    assert [(piece.first, piece.count) for piece in pieces] == [(3, 17), (25, 5)]
    assert [piece.t0_ns for piece in pieces] == [3_000_000, 25_000_000]
    assert (entry["first"], entry["count"], entry["lost"], entry["why"]) == (0, 22, 8, "started late; overrun")
    assert entry["gaps"] == [[0, 3, "started late"], [20, 5, "overrun"]]
    assert (one.samples, one.lost, one.gaps) == (22, 8, 2)
    _, entry = put(one, block(40, 10))
    assert (entry["first"], entry["gaps"]) == (30, [[30, 10, "the sensor's numbering jumps"]])


def test_what_is_dropped_at_the_very_end_is_reported_too():
    one = stream(room=2000)
    for first in range(0, 1000, 100):
        one.ring.put(block(first, 100))
    _, entry = one.take()
    assert entry["count"] == 100
    pieces, entry = one.take(last=True)
    assert pieces == () and entry["gaps"] == [[100, 900, NO_ROOM]] and entry["arrived"] == []
    assert (one.next, one.lost) == (1000, 900)
    assert one.take(last=True) == ((), None)


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 400)), max_size=60), st.integers(1, 20))
def test_chunks_follow_each_other_without_a_hole(blocks, step):
    """Whatever is lost and however it is cut: every sample is there once or reported missing once."""
    one, first, pieces, entries = stream(), 0, [], []
    for start in range(0, len(blocks), step):
        for lost, count in blocks[start : start + step]:
            one.ring.put(block(first + lost, count, lost=lost, why="x"))
            first += lost + count
        samples, of_it = one.take()
        pieces.extend(samples)
        entries.extend([] if of_it is None else [of_it])
    assert [entry["first"] for entry in entries] == [0, *(t["first"] + t["count"] + t["lost"] for t in entries)][
        : len(entries)
    ]
    numbers = [n for piece in pieces for n in range(piece.first, piece.first + piece.count)]
    gone = [n for t in entries for at, lost, _ in t.get("gaps", []) for n in range(at, at + lost)]
    assert sorted(numbers + gone) == list(range(first))
    assert b"".join(piece.data for piece in pieces) == b"".join(rows(n, 1) for n in numbers)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (block(5, 10), "sample 5 came, 0 lost before it, where 10 was the next"),
        (block(12, 10, lost=5), "sample 12 came, 5 lost before it, where 10 was the next"),
        (Block(10, bytes(13), 0), "13 bytes came, which is no whole number of 3 channels"),
    ],
)
def test_an_impossible_count_is_a_fault_and_the_samples_before_it_stay(wrong, message):
    one = stream()
    pieces, _ = put(one, block(0, 10), wrong)
    assert [piece.count for piece in pieces] == [10]
    assert one.broken.what == "firmware" and message in str(one.broken)


def test_a_large_chunk_comes_in_pieces_that_follow_each_other():
    one = stream()
    pieces, entry = put(one, *(block(first, 2000) for first in range(0, 80_000, 2000)))
    assert entry["count"] == 80_000 and len(entry["arrived"]) <= ARRIVALS
    assert all(len(piece.data) <= PIECE_BYTES for piece in pieces)
    assert [piece.first for piece in pieces] == [0, *np.cumsum([piece.count for piece in pieces])[:-1].tolist()]
    assert [piece.t0_ns for piece in pieces] == [round(piece.first / 1000 * NS) for piece in pieces]


def test_of_many_arrivals_the_earliest_are_stored_with_the_devices_own_time():
    late = [0.004, 0.001, 0.003, 0.002] * 16
    blocks = [block(10 * n, 10, at_s=(10 * n + 9) / 1000 + delay, device_s=500.0 + n) for n, delay in enumerate(late)]
    _, entry = put(stream(), *blocks)
    assert [n for n, _ in entry["arrived"]] == [10 * n + 9 for n in range(1, 64, 4)]
    assert entry["device_s"] == [500.0 + n for n in range(1, 64, 4)]


def test_what_is_no_number_is_stored_as_it_is_and_counted():
    one = stream()
    data = np.frombuffer(rows(0, 10), "<f4").reshape(-1, 3).copy()
    data[2, 1], data[8:, 0] = math.nan, math.inf
    pieces, entry = put(one, Block(0, data.tobytes(), 0))
    assert pieces[0].data == data.tobytes()
    assert entry["not_a_number"] == 3 and one.bad_run == 2
    assert all(math.isfinite(level) for level in one.level.rms)
    canonical(entry)


def test_the_run_of_bad_rows_goes_on_from_chunk_to_chunk():
    one, bad = stream(), np.full(30, math.nan, "<f4").tobytes()
    for first in (0, 10, 20):
        put(one, Block(first, bad, 0))
    assert one.bad_run == 30 and one.level.rms == (0.0, 0.0, 0.0)
    put(one, block(30, 10))
    assert one.bad_run == 0


def test_the_summary_measures_the_rate_and_names_the_calibration():
    """A clock that runs 300 ppm fast, blocks every 10 ms for 20 s, of which one is lost."""
    one = stream()
    for n in range(2000):
        if n != 1000:
            at_s = (10 * n + 9) / 1000 / 1.0003 + (0.002 if n % 7 else 0.0)
            one.ring.put(block(10 * n, 10, at_s=at_s))
    one.take()
    summary = one.summary()
    assert (summary["samples"], summary["lost"], summary["gaps"], summary["seconds"]) == (19_990, 10, 1, 20.0)
    assert summary["drift_ppm"] == pytest.approx(300.0, abs=0.1) and 0 <= summary["drift_se_ppm"] < 1
    assert summary["rate_hz"] == pytest.approx(1000.3, abs=1e-4) and summary["nominal_hz"] == 1000.0
    assert summary["calibration"] == "made up, 2026-11-01" and summary["clock"] == "daq"
    assert summary["units"] == ["m/s^2"] * 3
    canonical(summary)


def test_the_devices_own_time_gives_its_drift_where_it_counts_wrongly():
    """Half of the samples never existed for the device's counter: its rate is off, its clock is not."""
    one = stream()
    for n in range(2000):
        one.ring.put(block(10 * n, 10, at_s=n / 50, device_s=n / 50 * 1.00002))
    one.take()
    summary = one.summary()
    assert summary["device_ppm"] == pytest.approx(20.0, abs=0.1) and 0 <= summary["device_se_ppm"] < 1
    assert summary["drift_ppm"] == pytest.approx(-500_000, abs=100)
    assert summary["rate_hz"] == pytest.approx(500.0, abs=0.1)


def test_a_stream_without_a_rate_says_nothing_of_its_clock():
    one = stream(replace(XYZ, rate_hz=0.0))
    pieces, entry = put(one, block(0, 2, at_s=1.0), block(2, 1, at_s=9.0))
    assert pieces[0].rate_hz == 0 and pieces[0].t0_ns == NS and entry["arrived"]
    assert [one.summary()[name] for name in ("seconds", "rate_hz", "drift_ppm")] == [None] * 3


def held_up(n, at_s=30.0, seconds=2.0):
    """When block n of 10 ms came, where whoever reads was held up for so long at at_s."""
    due_s = (10 * n + 9) / 1000
    return at_s + seconds if at_s <= due_s < at_s + seconds else due_s


@pytest.mark.parametrize(
    ("arrived_s", "stood_s"), [(held_up, 0.0), (lambda n: (10 * n + 9) / 1000 + 2.0 * (n > 3000), 2.0)]
)
def test_a_sensor_that_stood_still_is_known_from_one_that_was_read_late(arrived_s, stood_s):
    one = stream()
    put(one, *(block(10 * n, 10, at_s=arrived_s(n)) for n in range(6000)))
    one.take(last=True)
    assert one.standstill.stood_s == pytest.approx(stood_s)


@pytest.mark.parametrize(("step_s", "runs"), [(0.0, True), (3600.0, False), (-3600.0, True)])
def test_a_device_clock_that_was_set_meanwhile_gives_no_rate(step_s, runs):
    one, chance = stream(), np.random.default_rng(1)
    for n in range(3000):
        late_s, stamp_s = chance.exponential(0.001), (10 * n + 9) / 1000 + step_s * (n > 1500)
        put(one, block(10 * n, 10, at_s=(10 * n + 9) / 1000 + late_s, device_s=5000.0 + stamp_s))
    summary = one.summary()
    assert ("device_ppm" in summary) is runs and abs(summary.get("device_ppm", 0.0)) < 50 > abs(summary["drift_ppm"])
