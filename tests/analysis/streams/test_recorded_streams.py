"""Streams of a trial from its ledger: the attempt that counts, blocks joined, gaps and clocks as recorded."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from palpate.analysis.streams.recorded_streams import (
    Gap,
    StreamError,
    attempts_of,
    counting_attempts,
    streams_in,
    streams_of,
)
from palpate.protocols.session_state import fold
from palpate.studies.sessions.record import Record, read
from tests.analysis.streams.ledgers import DOOR, RECORDED, Written, block, block_description, chunks
from tests.protocols.every_task import plan_of
from tests.protocols.test_every_task import ran


@pytest.fixture
def written(tmp_path) -> Iterator[Written]:
    return Written(tmp_path / "session.sqlite")


def one_second(written, value, start=0.0):
    written.chunk((block("force", np.full(50, value), 100, 0, start), block_description(0, 50)))
    written.chunk((block("force", np.full(50, value), 100, 50, start + 0.5), block_description(50, 50)))
    written.done(force={"samples": 100, "gaps": 0, "calibration": "FT123 of 2026-01-05"})


def test_streams_of_a_reply_alone_are_read_as_ever():
    """A ledger of format 2: one block of each stream, beside the reply. Numbers: sqlite3 and json, make_ten.py."""
    force, angle = streams_of(read(DOOR), 2)
    assert (force.name, force.channels, force.units, force.rate_hz, force.count) == (
        "door_force",
        ("force",),
        ("N",),
        1000,
        8000,
    )
    assert (angle.name, angle.rate_hz, angle.values().shape) == ("door_angle", 80, (640, 1))
    assert force.timing.time_s(0) == angle.timing.time_s(0) == 47.244 and not force.timing.measured
    assert force.values()[:, 0].astype("<f4").tobytes() == force.blocks[0].data


def test_a_stimulus_that_was_presented_again_has_an_act_for_each_time():
    acts = [
        (stream.act, stream.name, stream.count)
        for stream in streams_of(read(RECORDED / "door_authoring_P001_s1.sqlite"), 2)
    ]
    assert acts == [(1, "door", 349), (2, "door", 349)]


def test_the_streams_of_a_set_name_the_stimulus_that_was_felt_when_they_were_recorded():
    plan = plan_of("ranking", settings={"again": False})
    events = tuple(ran(plan))
    record = Record(Path("set.sqlite"), events, (), (), fold(events))
    first, *_ = attempts_of(record)
    felt = [stimulus.id for stimulus in plan.trials[0].stimuli]
    assert [first.stimulus_of(stream.act) for stream in streams_in(first)] == felt and first.stimulus == felt[0]


def test_chunks_are_joined_and_their_clock_is_fitted(written):
    rng = random.Random(1)
    written.begin(1)
    values = np.arange(3000.0)
    chunks(written, {"force": (values, 100, 100 * (1 + 80e-6), 9.5, lambda: rng.expovariate(3000), {"clock": "daq"})})
    written.done(force={"calibration": "FT123"})
    written.end()
    [stream] = streams_of(written.record(), 1)
    assert (stream.values()[:, 0] == values).all() and (stream.numbers() == values).all()
    assert (stream.clock, stream.calibration, len(stream.blocks)) == ("daq", "FT123", 60)
    assert stream.timing.drift_ppm == pytest.approx(80, abs=4 * stream.timing.drift_error_ppm)
    assert stream.timing.time_s(0) == pytest.approx(9.5, abs=1e-4)
    assert [len(values) for _, values in stream.pieces()] == [50] * 60


def test_the_last_attempt_that_ended_well_counts(written):
    written.begin(1, 1)
    one_second(written, 1.0)
    written.note("fault", {"device": "daq", "what": "silent", "message": "gone"})
    written.end("faulted")
    written.begin(1, 2)
    one_second(written, 2.0)
    written.experimenter(do="repeat", which="this")
    written.end("repeated")
    written.begin(1, 3)
    one_second(written, 3.0)
    written.end()
    written.begin(2, 1)
    one_second(written, 4.0)
    written.experimenter(do="abort")
    record = written.record()
    assert [(a.trial, a.number, a.ending) for a in attempts_of(record)] == [
        (1, 1, "faulted"), (1, 2, "repeated"), (1, 3, "captured"), (2, 1, "not ended"),
    ]  # fmt: skip
    assert {trial: attempt.number for trial, attempt in counting_attempts(attempts_of(record)).items()} == {1: 3}
    assert streams_of(record, 1)[0].values()[0, 0] == 3
    assert streams_of(record, 1, attempt=1)[0].values()[0, 0] == 1
    with pytest.raises(StreamError, match=r"trial 2: no attempt that counts holds streams \(attempt 1 not ended\)"):
        streams_of(record, 2)
    with pytest.raises(StreamError, match="trial 7 was not presented"):
        streams_of(record, 7)
    with pytest.raises(StreamError, match="trial 1: attempt 9 holds no streams"):
        streams_of(record, 1, attempt=9)


def test_a_trial_that_is_wished_again_from_the_next_one_is_withdrawn(written):
    written.begin(1, 1)
    one_second(written, 1.0)
    written.end()
    written.begin(2, 1)
    written.experimenter(do="repeat", which="last")
    written.end("repeated")
    record = written.record()
    with pytest.raises(StreamError, match="attempt 1 captured, then wished again"):
        streams_of(record, 1)
    written = Written(record.path.with_name("again.sqlite"), written.events)
    written.begin(1, 2)
    one_second(written, 9.0)
    written.end()
    assert streams_of(written.record(), 1)[0].values()[0, 0] == 9


def test_an_answer_revised_later_keeps_the_streams_of_the_attempt_that_felt(written):
    written.begin(1, 1)
    one_second(written, 5.0)
    written.end("answered")
    written.trial, written.attempt = 1, 2
    written.note("trial_started", {"stimulus": "K8", "block": "main"})
    written.end("answered")
    assert streams_of(written.record(), 1)[0].attempt == 1


def test_the_streams_of_a_trial_that_was_being_revised_stay_when_the_one_before_is_to_be_repeated(written):
    """The answer stands in the form when the trial is repeated, and the stimulus is not presented anew."""
    for trial in (1, 2):
        written.begin(trial, 1)
        one_second(written, 5.0)
        written.end("answered")
    written.trial, written.attempt = 2, 2
    written.note("trial_started", {"stimulus": "K8", "block": "main"})
    written.ask_for("ask")
    written.experimenter(do="repeat", which="last")
    written.end("repeated")
    assert streams_of(written.record(), 2)[0].attempt == 1


def test_gaps_have_the_recorded_places_and_reasons(written):
    written.begin(1)
    written.chunk((block("force", np.zeros(40), 100, 3), block_description(0, 40, gaps=[(0, 3, "late start")])))
    parts = [block("force", np.zeros(10), 100, 50), block("force", np.zeros(10), 100, 65)]
    gaps = block_description(43, 20, gaps=[(43, 7, "overrun"), (60, 5, "link")])
    written.note("samples", {"streams": {"force": gaps}}, parts)
    written.chunk((block("force", np.zeros(10), 100, 80), block_description(80, 10)))
    written.note("samples", {"streams": {"force": block_description(90, 0, gaps=[(90, 4, "no room")])}})
    written.done(force={"gaps": 5, "lost": 24})
    written.end()
    [stream] = streams_of(written.record(), 1)
    assert stream.gaps == (
        Gap(0, 3, "late start"), Gap(43, 7, "overrun"), Gap(60, 5, "link"), Gap(75, 5, "not told"),
        Gap(90, 4, "no room"),
    )  # fmt: skip
    assert (stream.count, stream.lost) == (70, 24)
    assert stream.numbers().tolist() == [*range(3, 43), *range(50, 60), *range(65, 75), *range(80, 90)]


def test_what_is_missing_at_the_start_is_so_whatever_was_lost_later_in_that_chunk(written):
    """The recorded sum of a chunk is of all its gaps; the first block's own number says what is missing before it."""
    written.begin(1)
    summed = {"first": 0, "count": 20, "lost": 8, "why": "late start; overrun"}
    parts = [block("force", np.zeros(10), 100, 3), block("force", np.zeros(10), 100, 18)]
    written.note("samples", {"streams": {"force": summed}}, parts)
    written.done(force={"gaps": 2, "lost": 8})
    written.end()
    [stream] = streams_of(written.record(), 1)
    assert stream.gaps == (Gap(0, 3, "not told"), Gap(13, 5, "not told"))


def test_two_losses_in_a_row_keep_their_reasons_also_at_the_very_end(written):
    written.begin(1)
    lost = block_description(0, 20, gaps=[(10, 5, "overrun"), (15, 2, "link")])
    parts = [block("force", np.zeros(10), 100), block("force", np.zeros(10), 100, 18)]
    written.note("samples", {"streams": {"force": lost}}, parts)
    written.note(
        "samples", {"streams": {"force": block_description(28, 0, gaps=[(28, 4, "overrun"), (32, 1, "no room")])}}
    )
    written.done(force={"gaps": 4, "lost": 12})
    written.end()
    [stream] = streams_of(written.record(), 1)
    assert stream.gaps == (
        Gap(10, 5, "overrun"), Gap(15, 2, "link"), Gap(17, 1, "not told"), Gap(28, 4, "overrun"), Gap(32, 1, "no room"),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("second", "says"),
    [
        (block("force", np.zeros(50), 100, 49), "sample 49 appears twice, or the blocks are out of order"),
        (block("force", np.zeros(50), 200, 50), "rate_hz change from 100.0 to 200.0"),
        (block("force", np.zeros(50), 100, 50, units=("mV",)), r"units change from \('N',\) to \('mV',\)"),
        (block("force", np.zeros(50), 100, 50, clock="daq"), "clock change from host to daq"),
    ],
)
def test_blocks_that_do_not_fit_together_are_refused(written, second, says):
    written.begin(1)
    written.chunk((block("force", np.zeros(50), 100), block_description(0, 50)))
    written.chunk((second, block_description(second.first, 50)))
    written.done()
    written.end()
    with pytest.raises(StreamError, match=f"session.sqlite: trial 1, attempt 1: stream force: {says}"):
        streams_of(written.record(), 1)


def test_arrivals_that_run_backwards_are_refused_by_the_streams_name(written):
    written.begin(1)
    written.chunk((block("force", np.zeros(50), 100), block_description(0, 50, arrived=[(24, 3.0), (49, 2.0)])))
    written.done()
    written.end()
    [stream] = streams_of(written.record(), 1)
    with pytest.raises(StreamError, match="stream force: arrival 2 came at 2.0 s, before"):
        _ = stream.timing


def test_things_noted_as_they_happened_have_no_clock(written):
    written.begin(1)
    written.note(
        "reply", {}, [block("marker", np.ones((4, 3)), 0, channels=("item", "time", "value"), units=("", "s", ""))]
    )
    written.end("answered")
    [stream] = streams_of(written.record(), 1)
    assert stream.noted and stream.gaps == ()
    with pytest.raises(StreamError, match="nominal rate is 0"):
        _ = stream.timing


def test_one_stream_of_one_trial_is_in_memory_at_a_time(written):
    """Reading the ledger holds what streams there are, not their samples; asking for one holds that one."""
    import tracemalloc

    for trial in (1, 2, 3):
        written.begin(trial)
        for number in range(20):
            part = np.zeros(25_000)
            written.chunk((block("force", part, 50_000, 25_000 * number), block_description(25_000 * number, 25_000)))
        written.done()
        written.end()
    path = written.record().path  # 3 x 2 MB of samples
    written.events.clear()
    tracemalloc.start()
    record = read(path)
    streams = [streams_of(record, trial)[0] for trial in (1, 2, 3)]
    held, peak = tracemalloc.get_traced_memory()
    assert held < 1.5e6 and peak < 4e6
    for stream in streams:
        assert stream.values().shape == (500_000, 1)
    assert tracemalloc.get_traced_memory()[1] < 4e6 + 2 * 4e6
    tracemalloc.stop()
