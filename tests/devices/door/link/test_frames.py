import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.devices.door.link import messages as says
from palpate.devices.door.link.frames import (
    MAX_PAYLOAD,
    MAX_STUFFED,
    Frame,
    Parser,
    bare,
    frame_of,
    on_the_line,
    stuffed,
    unstuffed,
)  # fmt: skip
from tests.examples import examples

frames = st.builds(Frame, st.integers(0, 255), st.integers(0, 65535), st.binary(max_size=600))


@given(st.binary(max_size=2000) | st.binary(min_size=250, max_size=260).map(lambda data: data.replace(b"\0", b"\1")))
def test_stuffing_leaves_no_zero_and_comes_back(data):
    assert b"\0" not in stuffed(data)
    assert unstuffed(stuffed(data)) == data
    assert len(stuffed(data)) <= len(data) + len(data) // 254 + 1


@pytest.mark.parametrize("length", [253, 254, 255, 508, 509])
def test_runs_at_the_length_of_a_block_come_back(length):
    for data in (b"\1" * length, b"\1" * length + b"\0", b"\0" + b"\1" * length):
        assert unstuffed(stuffed(data)) == data


@given(st.lists(frames, max_size=8), st.integers(1, 50))
def test_frames_come_out_as_they_went_in_however_they_are_cut(sent, size):
    line = b"".join(map(on_the_line, sent))
    parser = Parser()
    frames = [frame for at in range(0, len(line), size) for frame in parser.feed(line[at : at + size])]
    assert frames == sent and parser.dropped == parser.dropped_bytes == 0


@settings(max_examples=examples(300))
@given(st.lists(st.binary(max_size=3000), max_size=12))
def test_anything_at_all_raises_nothing_and_keeps_little(pieces):
    parser = Parser()
    for piece in pieces:
        parser.feed(piece)
        assert parser.kept <= MAX_STUFFED


@settings(max_examples=examples(300))
@given(frames, st.data())
def test_a_frame_with_any_bit_turned_is_never_taken_for_a_frame(frame, data):
    raw = bytearray(bare(frame))
    bit = data.draw(st.integers(0, 8 * len(raw) - 1))
    raw[bit // 8] ^= 1 << bit % 8
    assert frame_of(bytes(raw)) is None
    assert Parser().feed(b"\0" + stuffed(bytes(raw)) + b"\0") == []


@settings(max_examples=examples(300))
@given(st.binary(max_size=3000), st.lists(frames, min_size=3, max_size=3), st.integers(0, 700))
def test_garbage_within_and_before_frames_costs_at_most_the_frame_that_it_struck(garbage, sent, at):
    first, *rest = map(on_the_line, sent)
    frames = Parser().feed(first[:at] + garbage + first[at:] + b"".join(rest))
    assert frames[-2:] == sent[1:]


@given(st.lists(frames, min_size=2, max_size=6), st.integers(0, 200), st.integers(1, 100))
def test_what_is_lost_of_the_line_costs_at_most_two_frames(sent, at, gone):
    line = b"".join(map(on_the_line, sent))
    short = 12 * gone // 100
    frames = Parser().feed(line[:at] + line[at + short :])
    assert len(frames) >= len(sent) - 2
    assert all(frame in sent for frame in frames)


def test_a_run_without_an_end_is_counted_and_forgotten():
    parser = Parser()
    for _ in range(1000):
        assert parser.feed(b"\x55" * 1000) == []
        assert parser.kept <= MAX_STUFFED
    frame = Frame(1, 2, b"after all that")
    assert parser.feed(on_the_line(frame)) == [frame]
    assert (parser.dropped, parser.dropped_bytes) == (1, 1_000_000)


def test_what_was_dropped_is_counted():
    parser = Parser()
    assert parser.feed(b"\0abc\0" + on_the_line(Frame(1, 1, b"")) + b"nonsense\0") == [Frame(1, 1, b"")]
    assert (parser.dropped, parser.dropped_bytes) == (2, 11)


def test_too_long_a_payload_is_not_sent():
    with pytest.raises(ValueError, match="1025 bytes"):
        on_the_line(Frame(1, 1, bytes(MAX_PAYLOAD + 1)))
    assert Parser().feed(on_the_line(Frame(1, 1, bytes(MAX_PAYLOAD)))) == [Frame(1, 1, bytes(MAX_PAYLOAD))]


@given(frames)
def test_a_frame_of_any_type_and_length_is_understood_or_not_and_raises_nothing(frame):
    message = says.understood(frame)
    assert message is None or frame.kind == message.KIND


def test_telemetry_survives_a_noisy_line():
    noise = random.Random(1)
    sent = [says.Telemetry(1000 * n, n, 1.0, 2.0, 3.0, 0.5, 3, 0) for n in range(400)]
    line = b""
    for sample in sent:
        line += says.sent(sample, sample.sample)
        if noise.random() < 0.1:
            line += noise.randbytes(noise.randrange(1, 200))
    messages = [says.understood(frame) for frame in Parser().feed(line)]
    assert messages == sent  # garbage between frames costs none of them
