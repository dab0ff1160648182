"""Between the two threads: bounded, every loss is counted, and neither thread waits."""

import threading

from palpate.devices.device import Block
from palpate.devices.streams.reader import BLOCK_BYTES, NO_ROOM, Ring

ROW = 12


def put(ring, first, count, **also):
    ring.put(Block(first, bytes(ROW * count), first, **also))


def test_blocks_come_out_as_they_went_in_and_by_reference():
    ring, one = Ring(10_000, ROW), Block(0, bytes(120), 1)
    ring.put(one)
    assert ring.get(10_000)[0] is one
    assert ring.get(10_000) == [] and ring.waiting == 0


def test_where_there_is_no_room_the_next_block_counts_what_is_missing():
    ring = Ring(2 * (BLOCK_BYTES + 10 * ROW), ROW)
    for first in range(0, 50, 10):
        put(ring, first, 10)
    assert [block.first for block in ring.get(10_000)] == [0, 10]
    put(ring, 52, 10, lost=2, why="overrun")
    (next_block,) = ring.get(10_000)
    assert (next_block.first, next_block.lost, next_block.why) == (52, 32, f"{NO_ROOM}; overrun")
    assert ring.dropped == 0


def test_tiny_blocks_cannot_fill_the_memory_either():
    ring = Ring(100_000, ROW)
    for first in range(10_000):
        put(ring, first, 1)
    assert len(ring.held) == 100_000 // (BLOCK_BYTES + ROW)


def test_a_part_is_taken_in_order_and_at_least_one_block():
    ring = Ring(100_000, ROW)
    for first in range(0, 40, 10):
        put(ring, first, 10)
    assert [block.first for block in ring.get(130)] == [0, 10]
    assert [block.first for block in ring.get(1)] == [20]


def test_two_threads_at_full_speed_account_for_every_sample():
    """100,000 samples through a ring that is mostly full: the received and the lost ones are all of them, in order."""
    ring, done = Ring(40 * (BLOCK_BYTES + 5 * ROW), ROW), threading.Event()

    def read():
        for first in range(0, 100_000, 5):
            put(ring, first, 5)
        done.set()

    thread = threading.Thread(target=read)
    thread.start()
    taken = gone = expected = 0
    while not (done.is_set() and not ring.held):
        for block in ring.get(600):
            assert block.first == expected + block.lost
            expected = block.first + 5
            taken, gone = taken + 5, gone + block.lost
        assert ring.waiting <= ring.room
    thread.join()
    assert expected + ring.dropped == 100_000
    assert taken + gone + ring.dropped == 100_000
