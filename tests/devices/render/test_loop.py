from dataclasses import dataclass, field

import numpy as np
import pytest

from palpate.devices.actuator.queue import DECAY
from palpate.devices.render.hands import Scripted
from palpate.devices.render.loop import EDGES_US, AtOnce, Deadlines, Loop
from palpate.devices.render.opened import twin_coil
from palpate.devices.render.sinks import Coil, RecordingSink, on_coil
from palpate.devices.render.trace import ROOM, Trace
from palpate.signals.textures.sounds import RenderError
from palpate.signals.textures.voice import open_voice, play
from tests.devices.render.made import model

MS = 1_000_000


@dataclass
class Virtual:
    """A clock of virtual time; `stalls` says how late a wait ends: {due in ms: ms}."""

    stalls: dict = field(default_factory=dict)
    ns: int = 0

    def now_ns(self):
        return self.ns

    def until(self, at_ns):
        self.ns = max(self.ns, at_ns) + round(self.stalls.get(at_ns // MS, 0) * MS)

    def s(self):
        return self.ns / 1e9


@dataclass
class Counting:
    """Plays 1, 2, 3, ...; each takes so long of the clock."""

    clock: Virtual
    us: float = 50.0
    n: int = 0

    def step(self, _speed, _force):
        self.n += 1
        self.clock.ns += round(1000 * self.us)
        return float(self.n)


def at_work(stalls=(), us=50.0, ahead=10):
    clock = Virtual(dict(stalls))
    coil = twin_coil(ahead, clock.s)
    coil.limiter.peak = coil.limiter.rms = 1e9
    coil.start()
    sink = Coil(coil, ahead, 1.0)
    return Loop(Counting(clock, us), Scripted([], []), sink, clock), coil


def played(coil):
    return coil.output.whole()[0]


def test_on_time_every_sample_is_played_once_in_order_and_none_is_missing():
    loop, coil = at_work()
    loop.run(500)
    coil.check()
    samples = played(coil)
    np.testing.assert_array_equal(samples, np.arange(1.0, len(samples) + 1))
    assert len(samples) >= 499
    assert coil.queue.underruns == coil.queue.missing == loop.ready.late == 0
    assert loop.ready.steps == 500
    assert loop.ready.worst_us == pytest.approx(50.0)


@pytest.mark.parametrize("stall", [2.0, 5.0, 8.2])
def test_a_stall_shorter_than_the_buffer_is_late_and_not_felt(stall):
    loop, coil = at_work({200: stall})
    loop.run(500)
    coil.check()
    samples = played(coil)
    np.testing.assert_array_equal(samples, np.arange(1.0, len(samples) + 1))
    assert coil.queue.underruns == 0
    assert loop.ready.late == int(stall)
    assert loop.ready.skipped == int(stall) - 1
    assert loop.ready.steps >= 500


def test_after_a_stall_longer_than_the_buffer_the_last_sample_has_decayed_and_all_is_caught_up_in_one_turn():
    loop, coil = at_work({200: 25.0}, us=1.0)
    loop.run(500)
    coil.check()
    samples = played(coil)
    gap = 200 + 10 - 1
    np.testing.assert_array_equal(samples[:gap], np.arange(1.0, gap + 1))
    missing = coil.queue.missing
    assert 14 <= missing <= 16
    np.testing.assert_allclose(samples[gap : gap + missing], gap * DECAY ** np.arange(1, missing + 1), rtol=1e-9)
    np.testing.assert_array_equal(samples[gap + missing : gap + missing + 50], gap + np.arange(1.0, 51))
    assert coil.queue.underruns == 1
    assert coil.record()["underruns"] == 1
    assert loop.ready.late == 25
    assert loop.ready.worst_us == pytest.approx(25_000, rel=0.01)


def test_where_a_turn_itself_is_held_up_its_earlier_samples_are_played():
    loop, coil = at_work({200: 6.0}, us=900.0)
    loop.run(220)
    coil.check()
    assert coil.queue.underruns == 0  # making all six first would have taken longer than the 4 ms that were left


def test_steps_that_take_too_long_are_all_late():
    loop, coil = at_work(us=1500.0)
    loop.run(300)
    assert loop.ready.late_share > 0.9
    assert coil.queue.underruns > 0


def test_what_is_played_at_a_pace_is_what_is_played_at_once_whatever_stalls():
    texture, n = model(), 400
    hand = Scripted([100.0] * 300 + [0.0] * 100, [1.0] * n)
    runs = []
    for stalls in ({}, {50: 3.0, 90: 40.0}):
        clock = Virtual(dict(stalls))
        coil = twin_coil(10, clock.s)
        coil.start()
        trace = Trace.own()
        Loop(open_voice(texture, seed=5), hand, on_coil(coil), clock, trace).run(n)
        runs.append(trace.since(0)[1][0, :300])
    np.testing.assert_array_equal(runs[0], runs[1])
    np.testing.assert_array_equal(runs[0], play(texture, np.full(300, 100.0), np.ones(300), 5))


def test_at_once_into_an_array_gives_one_sample_a_step():
    sink = RecordingSink()
    Loop(Counting(Virtual()), Scripted([], []), sink, AtOnce()).run(9)
    assert sink.samples == [float(n) for n in range(1, 11)]


def test_a_twin_is_driven_by_its_own_gain_and_a_real_coil_must_be_identified():
    coil = twin_coil(10)
    sink = on_coil(coil, 5)
    assert sink.gain_V == pytest.approx(1 / 20)
    coil.output = object()
    with pytest.raises(RenderError, match=r"Identify it first: palpate rig calibrate actuator"):
        on_coil(coil)
    with pytest.raises(RenderError, match=r"11 ms ahead; 1 to 10"):
        Coil(twin_coil(10), 11)


def test_a_trace_returns_the_newest_samples_and_their_count():
    trace = Trace.own()
    for n in range(ROOM + 5):
        trace.note(float(n), 2.0 * n, 3.0 * n)
    count, last = trace.since(ROOM + 2)
    assert count == ROOM + 5
    np.testing.assert_array_equal(last[:, 0], [ROOM + 2, 2 * (ROOM + 2), 3 * (ROOM + 2)])
    assert trace.since(0)[1].shape == (3, ROOM // 2)
    assert trace.since(count)[1].shape == (3, 0)


def test_quantiles_of_deadlines_are_at_most_a_cell_too_large():
    rng = np.random.default_rng(2)
    times = rng.lognormal(5.0, 1.0, 20_000)
    deadlines = Deadlines()
    for us in times:
        deadlines.note(round(1000 * us))
    for share in (0.5, 0.9, 0.99, 0.999):
        exact = np.quantile(times, share)
        assert exact * 0.999 <= deadlines.quantile_us(share) <= exact * 1.19
    assert deadlines.late == np.count_nonzero(np.round(1000 * times) > 1e6)
    assert deadlines.worst_us == pytest.approx(times.max(), rel=1e-4)
    assert sum(deadlines.record()["cells_us"].values()) == deadlines.steps
    assert EDGES_US[0] == 4.0


def test_no_steps_are_no_statistics():
    assert Deadlines().record()["late_share"] == 0.0
    assert Deadlines().quantile_us(0.99) == 0.0
