"""From sensors to a recording: what comes out of what went in, and what is refused or noted."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.modeling.textures.plausible import clipped_share
from palpate.modeling.textures.preparing import Touched, prepared
from palpate.modeling.textures.rates import evenly
from palpate.modeling.textures.recording import Joined, TextureDataError
from tests.modeling.textures.textures_for_tests import vibration

N = 3000


def touched(acceleration=None, force=None, speed=None, **further):
    felt = vibration(N) if acceleration is None else acceleration
    return Touched(
        "made", evenly("acceleration", felt, 1000.0, "made"),
        evenly("force", np.full(N, 1.0) if force is None else force, 1000.0, "made"),
        evenly("speed", np.linspace(20, 90, N) if speed is None else speed, 1000.0, "made"), **further,
    )  # fmt: skip


def test_gravity_is_gone_energy_stays_and_the_upper_edge_is_reported():
    axes = np.stack([vibration(N, axis) for axis in range(3)], axis=1)
    recording = prepared("t", "T", [touched(axes + np.array([0, 0, 9.80665]))])
    assert recording.acceleration_m_s2.std() == pytest.approx(np.sqrt(3), rel=0.1)
    assert abs(recording.acceleration_m_s2.mean()) < 0.02
    assert any("upper edge of 1000 Hz is left out" in note for note in recording.notes)
    assert any("DFT321" in note for note in recording.notes)
    np.testing.assert_allclose(recording.speed_mm_s[100:-100], np.linspace(20, 90, N)[100:-100], atol=0.1)
    np.testing.assert_allclose(recording.force_N, 1.0)


def test_a_force_that_counts_down_is_turned_and_reported():
    recording = prepared("t", "T", [touched(force=np.full(N, -0.8) + 0.1 * np.sin(np.arange(N) / 50))])
    assert recording.force_N.mean() == pytest.approx(0.8, abs=0.02)
    assert any("sign is changed" in note for note in recording.notes)


def test_what_never_varies_is_reported():
    recording = prepared("t", "T", [touched(speed=np.full(N, 45.0), force=np.full(N, 0.8))])
    assert [note for note in recording.notes if "never varies" in note] == [
        "speed never varies (45 mm/s): what it does cannot be learned",
        "force never varies (0.8 N): what it does cannot be learned",
    ]


def test_a_hole_cuts_the_recording_and_two_explorations_join():
    whole = touched()
    there = np.ones(N, dtype=bool)
    there[1000:1200] = False
    force = replace(whole.force, times_s=whole.force.times_s[there], values=whole.force.values[there])
    recording = prepared("t", "T", [replace(whole, force=force), whole])
    assert isinstance(recording, Joined)
    assert recording.borders == (1000, 2800)
    assert recording.signals.shape == (3, 5800)
    assert any("2 stretches between holes, 2.80 of 3.00 s" in note for note in recording.notes)


def test_what_ends_early_or_is_not_known_to_the_end_is_reported():
    whole, half = touched(), np.linspace(20, 90, N)
    half[N // 2 :] = np.nan
    for speed, lasts in ((half[: N // 2], 1500), (half, 1500), (np.linspace(20, 90, N - 300), 2700)):
        recording = prepared("t", "T", [touched(speed=speed)])
        assert recording.signals.shape == (3, lasts)
        assert (
            f"all signals are known together for {lasts / 1000:.2f} of 3.00 s (acceleration 3.00 s, speed"
            f" {lasts / 1000:.2f} s, force 3.00 s): the rest is left out" in recording.notes
        )
    late = replace(whole.force, times_s=whole.force.times_s + 1.0)
    assert any("for 2.00 of 3.00 s (" in note for note in prepared("t", "T", [replace(whole, force=late)]).notes)
    for speed in (half[:0:-1], np.linspace(20, 90, N - 100)):  # what begins late; what ends with the others, nearly
        notes = [note for note in prepared("t", "T", [touched(speed=speed)]).notes if "known together" in note]
        assert len(notes) == (len(speed) == N - 1)


def test_a_hole_beside_a_missing_end_is_counted_against_all_that_was_recorded():
    speed = np.linspace(20, 90, N - 500)
    speed[1000:1200] = np.nan
    assert any(
        "2 stretches between holes, 2.30 of 3.00 s" in n for n in prepared("t", "T", [touched(speed=speed)]).notes
    )


@pytest.mark.parametrize("hz", [20.0, 120.0])
def test_what_the_slope_of_positions_loses_at_the_ends_is_no_note(hz):
    t = np.arange(round(3 * hz)) / hz
    circles = 30 * np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    moved = replace(touched(), speed=None, position=evenly("position", circles, hz, "made"))
    assert not any("known together" in note for note in prepared("t", "T", [moved]).notes)


@pytest.mark.parametrize(
    ("still", "message"),
    [((1,), "axis 2 of 3 is constant; was it connected"), ((0, 2), "axes 1 and 3 of 3 are constant; were they"),
     ((0, 1, 2), "acceleration is constant; was the accelerometer connected")],
)  # fmt: skip
def test_an_axis_that_stands_still_is_refused_as_that(still, message):
    axes = np.stack([vibration(N, axis) for axis in range(3)], axis=1)
    axes[:, still] = 9.81
    with pytest.raises(TextureDataError, match=message):
        prepared("t", "T", [touched(axes)])


def test_clipping_is_reported_or_refused_and_a_sine_is_not_clipped():
    felt = 9 * vibration(N)
    recording = prepared("t", "T", [touched(np.clip(felt, -22, 22))])
    assert any("clipped" in note for note in recording.notes)
    with pytest.raises(TextureDataError, match="clipped at the end"):
        prepared("t", "T", [touched(np.clip(felt, -9, 9))])
    assert clipped_share(np.sin(np.arange(N) / 7)[:, None]) == 0
    assert clipped_share(felt[:, None]) == 0
    assert clipped_share(np.rint(1.2 * vibration(N))[:, None]) == 0  # a converter of a few steps
    noisy = np.clip(felt, -9, 9) + 0.01 * np.random.default_rng(0).standard_normal(N)
    assert clipped_share(noisy[:, None]) > 0.1


SPIKED = vibration(N)
SPIKED[700] = 1e6
LONE = vibration(N)
LONE[700] = 900.0


@pytest.mark.parametrize(
    ("felt", "message"),
    [(np.zeros(N), "constant"), (np.full(N, 9.80665), "constant"), (9.8 + 1e-9 * vibration(N), "silent"),
     (SPIKED, "sample 701, is 1e.06"), (LONE, "sample 701.*fault of a sensor"), (np.ones(1), "samples"),
     (vibration(200), "0.3 s"), (np.full(N, np.nan), "finite numbers")],
    ids=["silent", "constant", "still", "million", "spike", "one", "short", "nan"],
)  # fmt: skip
def test_what_no_texture_can_be_learned_from_is_refused(felt, message):
    with pytest.raises(TextureDataError, match=message):
        prepared("t", "T", [touched(felt)])


def test_a_constant_beside_single_bits_of_noise_in_half_precision_is_read():
    half = (9.8 + vibration(N)).astype(np.float16)
    assert prepared("t", "T", [touched(half)]).signals.dtype == np.float64


@pytest.mark.parametrize(("what", "value"), [("speed", 1e6), ("force", 1e6)])
def test_a_speed_or_force_that_cannot_be_is_refused(what, value):
    wrong = np.full(N, 1.0)
    wrong[5] = value
    with pytest.raises(TextureDataError, match=f"{what}, sample 6"):
        prepared("t", "T", [touched(**{what: wrong})])


def test_nothing_to_prepare_and_no_speed_are_refused():
    with pytest.raises(TextureDataError, match="no recording"):
        prepared("t", "T", [])
    with pytest.raises(TextureDataError, match="neither a speed nor positions"):
        prepared("t", "T", [replace(touched(), speed=None)])
