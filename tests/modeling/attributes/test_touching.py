"""From sensors to what was felt: what is trimmed, filtered and reported, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.analysis.features.touch import segments
from palpate.analysis.features.touch_features import touch_features
from palpate.modeling.attributes.reading_touch import felt_of, filtering, touch_of
from palpate.modeling.textures.preparing import Touched, prepared
from palpate.modeling.textures.rates import evenly
from palpate.modeling.textures.recording import TextureDataError
from tests.modeling.textures.textures_for_tests import vibration

N = 8000
AXES = np.stack([vibration(N, axis) for axis in range(3)], axis=1)


def touched(acceleration=AXES, force=None, rate_hz=1000.0, n=N):
    felt = np.asarray(acceleration)[:n]
    return Touched(
        "made", evenly("acceleration", felt, rate_hz, "made"),
        evenly("force", np.linspace(0.5, 2, n) if force is None else force, 1000.0, "made"),
        evenly("speed", np.linspace(20, 90, n), 1000.0, "made"),
    )  # fmt: skip


def without(given, first, last):
    """Its force was not recorded there."""
    there = np.ones(len(given.force.times_s), dtype=bool)
    there[first:last] = False
    force = replace(given.force, times_s=given.force.times_s[there], values=given.force.values[there])
    return replace(given, force=force)


def lengths(touch):
    return [len(stretch.axes) for stretch in touch.stretches]


def test_two_and_a_half_seconds_go_at_both_ends_after_filtering():
    trimmed, notes = touch_of("t", [touched()])
    whole, _ = touch_of("t", [touched()], filtering(trim_s=0))
    assert lengths(trimmed) == [3000]
    for what in ("axes", "speed_mm_s", "force_N"):
        np.testing.assert_array_equal(getattr(trimmed.stretches[0], what), getattr(whole.stretches[0], what)[2500:5500])
    assert "the first and last 2.5 s are left out" in notes


def test_the_axes_are_filtered_and_still_apart():
    t = np.arange(N) / 1000
    slow = 3 * np.sin(2 * np.pi * 5 * t)
    gravity = np.array([0, 0, 9.81])
    plain, notes = touch_of("t", [touched()])
    held, _ = touch_of("t", [touched(AXES + gravity + slow[:, None])])
    assert plain.stretches[0].axes.shape == (3000, 3)
    np.testing.assert_allclose(held.stretches[0].axes, plain.stretches[0].axes, atol=0.02)  # 5 Hz: -96 dB
    np.testing.assert_allclose(held.stretches[0].speed_mm_s, np.linspace(20, 90, N)[2500:5500], atol=1e-3)
    assert any("the upper edge of 500 Hz is left out" in note for note in notes)
    assert any("3 axes of acceleration on one by DFT321, in segments of 0.5 s" in note for note in notes)


def test_the_energy_is_that_of_the_recording_for_rendering():
    mine, _ = touch_of("t", [touched()], filtering(trim_s=0))
    other = prepared("t", "T", [touched()])
    np.testing.assert_allclose((segments(mine).vibration ** 2).sum(), (other.acceleration_m_s2**2).sum(), rtol=1e-9)


def test_a_faster_accelerometer_and_a_slower_force_meet_at_1_khz():
    fine = np.repeat(AXES, 3, axis=0)
    given = replace(
        touched(), acceleration=evenly("acceleration", fine, 3000.0, "made"),
        force=evenly("force", np.linspace(0.5, 2, N // 10), 100.0, "made"),
    )  # fmt: skip
    touch, _ = touch_of("t", [given])
    assert lengths(touch)[0] == pytest.approx(3000, abs=12)


@pytest.mark.parametrize(
    ("hole", "left"),
    [((3000, 3400), [500, 2100]), ((1000, 1300), [3000]), ((2400, 2700), [2800]), ((5200, 8000), [200])],
    ids=["within", "in what is trimmed", "over the border", "to the end"],
)
def test_holes_cut_and_trimming_counts_from_the_explorations_own_ends(hole, left):
    given = without(touched(), *hole)
    if left == [200]:
        with pytest.raises(TextureDataError, match=r"acceleration lasts 8 s at 1000 Hz, and force 5\.2 s at 1000 Hz"):
            touch_of("t", [given])
    else:
        assert lengths(touch_of("t", [given])[0]) == left


def minute(looks=7200, late_s=0.0):
    """60 s from sensors of 3 kHz and 8 kHz and a tracker of 120 Hz, which begins later."""
    felt = np.stack([vibration(180_000, axis) for axis in range(3)], axis=1)
    t = np.arange(looks) / TRACKED_HZ
    position = evenly("position", 30 * np.stack([np.cos(t), np.sin(t), 0 * t], axis=1), TRACKED_HZ, "made")
    return Touched(
        "made", evenly("acceleration", felt, 3000.0, "made"),
        evenly("force", np.linspace(0.5, 2, 480_000), 8000.0, "made"),
        position=replace(position, times_s=position.times_s + late_s),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("given", "samples", "count"),
    [({"looks": 7201}, 55_000, 110), ({}, 54_992, 109), ({"looks": 7201, "late_s": 0.1}, 54_900, 109)],
    ids=["all to the end", "the tracker's last look is a step before the end", "the tracker begins later"],
)
def test_a_minute_has_110_segments_or_109(given, samples, count):
    touch, _ = touch_of("t", [minute(**given)], filtering(remove_hum=False))
    assert lengths(touch) == [samples]
    assert len(segments(touch).vibration) == count


def test_several_explorations_are_each_trimmed():
    touch, notes = touch_of("t", iter([touched(), touched(n=7000)]))
    assert lengths(touch) == [3000, 2000]
    assert len(notes) == len(set(notes))


def test_recordings_of_any_source_are_known_by_their_samples():
    def felt(*given, label="a"):
        return felt_of("t", label, "wood", iter(given))

    one = felt(touched())
    assert (one.id, one.label, one.category) == ("t", "a", "wood")
    assert one.made_from == felt(replace(touched(), where="elsewhere"), label="b").made_from
    both = felt(touched(), touched(2 * AXES))
    assert one.made_from < both.made_from
    assert len(both.touch.stretches) == len(both.made_from) == 2


def test_what_never_varies_is_reported():
    _, notes = touch_of("t", [touched(force=np.full(N, 0.8))])
    assert any("force never varies (0.8 N)" in note for note in notes)


@pytest.mark.parametrize(("stated_hz", "lasts"), [(2000.0, 4), (500.0, 16), (1060.0, 7.547), (940.0, 8.511)])
def test_acceleration_at_a_rate_that_is_not_its_own_is_refused(stated_hz, lasts):
    with pytest.raises(TextureDataError, match=f"lasts {lasts} s at {stated_hz:g} Hz, and force 8 s at 1000 Hz"):
        touch_of("t", [touched(rate_hz=stated_hz)])


TRACKED_HZ = 120.0
SECOND = np.arange(round(N / 1000 * TRACKED_HZ)) / TRACKED_HZ
"""When a tracker looked."""


def tracked(stated_hz=TRACKED_HZ, samples=None):
    """A tracker's circles of 30 mm a second, in place of a speed; it looked 120 times a second, whatever is stated."""
    circles = 30 * np.stack([np.cos(SECOND), np.sin(SECOND), 0 * SECOND], axis=1)
    return replace(touched(), speed=None, position=evenly("position", circles[:samples], stated_hz, "made"))


@pytest.mark.parametrize(("stated_hz", "lasts"), [(60.0, 16), (240.0, 4), (127.0, 7.559), (113.0, 8.496)])
def test_a_tracker_at_a_rate_that_is_not_its_own_is_refused(stated_hz, lasts):
    with pytest.raises(
        TextureDataError, match=f"position lasts {lasts} s at {stated_hz:g} Hz, and force 8 s at 1000 Hz"
    ):
        touch_of("t", [tracked(stated_hz)])


@pytest.mark.parametrize("stated_hz", [TRACKED_HZ, 119.0, 121.0])
def test_a_tracker_s_own_rate_is_right_and_its_clock_may_drift(stated_hz):
    touch, _ = touch_of("t", [tracked(stated_hz)])
    assert touch.stretches[0].speed_mm_s.mean() == pytest.approx(30 * stated_hz / TRACKED_HZ, rel=1e-3)


def test_a_tracker_may_stop_a_little_before_the_others():
    assert lengths(touch_of("t", [tracked(samples=len(SECOND) - 40)])[0]) == [pytest.approx(2660, abs=50)]
    with pytest.raises(TextureDataError, match="position lasts 7.5 s at 120 Hz, and force 8 s at 1000 Hz.*cut short"):
        touch_of("t", [tracked(samples=900)])


@pytest.mark.parametrize(("stated_hz", "lasts"), [(2000.0, 4), (500.0, 16)])
def test_a_speed_or_a_force_at_a_rate_that_is_not_its_own_is_refused(stated_hz, lasts):
    speed = evenly("speed", np.linspace(20, 90, N), stated_hz, "made")
    with pytest.raises(TextureDataError, match=f"speed lasts {lasts} s at {stated_hz:g} Hz, and force 8 s at 1000 Hz"):
        touch_of("t", [replace(touched(), speed=speed)])
    force = evenly("force", np.linspace(0.5, 2, N), stated_hz, "made")
    with pytest.raises(TextureDataError, match=f"lasts 8 s at 1000 Hz, and force {lasts} s at {stated_hz:g} Hz"):
        touch_of("t", [replace(touched(), force=force)])


def test_sensors_that_stop_a_little_apart_are_read():
    force = evenly("force", np.linspace(0.5, 2, N - 300), 1000.0, "made")
    touch, notes = touch_of("t", [replace(touched(), force=force)])
    assert lengths(touch) == [2700]
    assert any("known together for 7.70 of 8.00 s" in note for note in notes)


def test_a_tail_that_is_not_known_is_left_out_and_reported():
    speed = np.linspace(20, 90, N)
    speed[4000:] = np.nan
    touch, notes = touch_of("t", [replace(touched(), speed=evenly("speed", speed, 1000.0, "made"))])
    assert lengths(touch) == [1500]
    assert (
        "all signals are known together for 4.00 of 8.00 s (acceleration 8.00 s, speed 4.00 s, force 8.00 s): the rest"
        " is left out" in notes
    )
    assert not any("known together" in note for note in touch_of("t", [touched()])[1])


@pytest.mark.needs("librosa", "pywt")
def test_segments_without_contact_are_reported_and_never_any_is_refused():
    force = np.where(np.arange(N) // 500 == 8, 0.0, 1.2)
    touch, notes = touch_of("t", [touched(force=force)])
    assert "1 of 6 segments (17%) are without contact (mean force below 0.15 N): left out" in notes
    assert len(touch_features(touch)["mfcc"]) == 5
    assert not any("without contact" in note for note in touch_of("t", [touched()])[1])
    with pytest.raises(TextureDataError, match="t: no contact in any of 6 segments"):
        touch_of("t", [touched(force=np.linspace(0.02, 0.1, N))])


def test_too_short_is_refused_and_may_be_trimmed_less():
    for n, message in ((4000, r"nothing of its 4\.00 s is left"), (5300, r"longest stretch without a hole is 0\.3 s")):
        with pytest.raises(TextureDataError, match=message):
            touch_of("t", [touched(n=n, force=np.linspace(0.5, 2, n))])
    touch, _ = touch_of("t", [touched(n=4000, force=np.linspace(0.5, 2, 4000))], filtering(trim_s=0.25))
    assert lengths(touch) == [3500]


DEAD = AXES * [1, 0, 1]
SPIKED = AXES.copy()
SPIKED[4000] = 1e6


@pytest.mark.parametrize(
    ("given", "message"),
    [([], "there is no recording"), ([touched(np.zeros((N, 3)))], "acceleration is constant"),
     ([touched(DEAD)], "axis 2 of 3 is constant"), ([touched(1e-9 * AXES)], "is silent"),
     ([touched(np.clip(AXES, -0.3, 0.3))], "clipped at the end"),
     ([touched(np.full((N, 3), np.nan))], "0 of 8000 samples of acceleration are finite"),
     ([touched(AXES[:1])], "1 of 1 samples of acceleration are finite"), ([touched(SPIKED)], "at most 2000 can be"),
     ([touched(rate_hz=40.0)], "100 to 250000 Hz are expected"), ([touched(rate_hz=1e6)], "unit of the times")],
    ids=["none", "constant", "an axis", "silent", "clipped", "NaN", "one sample", "a spike", "too slow", "too fast"],
)  # fmt: skip
def test_signals_that_tell_nothing_are_refused(given, message):
    with pytest.raises(TextureDataError, match=message):
        touch_of("t", given)


@pytest.mark.parametrize("trim_s", [-1.0, float("nan"), float("inf")])
def test_so_much_cannot_be_trimmed(trim_s):
    with pytest.raises(TextureDataError, match="to be trimmed at both ends"):
        filtering(trim_s)
