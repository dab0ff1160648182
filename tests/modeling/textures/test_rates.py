"""Any rate on one grid of 1 kHz; speed from positions; what no clock sampled."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.modeling.textures.rates import Sampled, along, evenly, on_grid, speed_from
from palpate.modeling.textures.recording import TextureDataError


def wave(hz, rate_hz, seconds=2.0):
    return np.sin(2 * np.pi * hz * np.arange(round(seconds * rate_hz)) / rate_hz)


def rms(values):
    return float(np.sqrt((values**2).mean()))


@pytest.mark.parametrize("rate_hz", [1000.0, 3000.0, 8000.0, 10_000.0, 1001.3, 44_100.0])
def test_vibration_of_any_rate_is_right_and_nothing_folds_down(rate_hz):
    inside, above = (evenly("acceleration", wave(hz, rate_hz), rate_hz, "t") for hz in (200, 620))
    (resampled,), known, _ = on_grid([inside])
    t = np.arange(len(resampled)) / 1000
    assert known.all()
    assert rms((resampled[:, 0] - np.sin(2 * np.pi * 200 * t))[200:-200]) < 1e-3
    if rate_hz > 1300:
        assert rms(on_grid([above])[0][0][200:-200]) < 1e-3


def test_signals_of_three_rates_share_their_time():
    signals = [evenly("acceleration", wave(5, 3000.0), 3000.0, "t"), evenly("force", wave(5, 10_000.0), 10_000.0, "t"),
            evenly("speed", wave(5, 120.0), 120.0, "t")]  # fmt: skip
    resampled, known, notes = on_grid(signals)
    assert {len(signal) for signal in resampled} == {len(known)}
    for one in resampled[1:]:
        assert np.abs(one - resampled[0])[150:-150].max() < 2e-3
    assert notes == ()


def test_times_rounded_to_the_millisecond_are_taken_for_the_even_ones_they_were():
    exact = evenly("acceleration", wave(150, 3000.0), 3000.0, "t")
    rounded = replace(exact, times_s=np.round(exact.times_s, 3), written_s=1e-3)
    (resampled,), _, notes = on_grid([rounded])
    (expected,), _, _ = on_grid([exact])
    n = min(len(resampled), len(expected))
    assert notes == ()
    assert rms((resampled[:n] - expected[:n])[200:-200]) < 0.01


def test_uneven_times_are_interpolated_and_reported():
    chance = np.random.default_rng(0)
    t = np.cumsum(chance.uniform(0.5, 1.5, 8000)) / 4000
    sampled = Sampled("acceleration", t, np.sin(2 * np.pi * 100 * t)[:, None], 4000.0, "t")
    (resampled,), known, notes = on_grid([sampled])
    grid = np.ceil(t[0] * 1000) / 1000 + np.arange(len(resampled)) / 1000
    assert "uneven" in notes[0]
    assert rms((resampled[:, 0] - np.sin(2 * np.pi * 100 * grid))[known][200:-200]) < 0.01


def test_long_holes_stay_unknown_and_short_ones_are_reported():
    sampled = evenly("force", wave(2, 1000.0), 1000.0, "t")
    lost = np.ones(2000, dtype=bool)
    lost[500:510] = lost[1200:1300] = False
    holed = replace(sampled, times_s=sampled.times_s[lost], values=sampled.values[lost])
    _, known, notes = on_grid([holed])
    assert known[500:510].all()
    assert not known[1205:1295].any()
    assert "bridged" in notes[0]


def test_speed_is_that_in_the_plane():
    t = np.arange(600) / 120
    place = np.stack([40 * np.sin(4 * t), 40 * np.cos(4 * t), 30 * np.sin(9 * t)], axis=1)
    sampled = evenly("position", place, 120.0, "t")
    speed = speed_from(sampled)
    inside = np.isfinite(speed.values).all(axis=1)
    assert inside.sum() == 600 - 6
    np.testing.assert_allclose(np.linalg.norm(speed.values, axis=1)[inside], 160, rtol=0.01)
    tilted = replace(sampled, values=place[:, [2, 0, 1]])
    np.testing.assert_allclose(
        np.linalg.norm(speed_from(tilted, (2.0, 0.0, 0.0)).values, axis=1), np.linalg.norm(speed.values, axis=1)
    )
    flat = replace(sampled, values=place[:, :2])
    np.testing.assert_allclose(speed_from(flat).values, speed.values[:, :2])


def test_a_hidden_marker_leaves_speed_unknown_about_it():
    place = np.tile(np.arange(240.0)[:, None], (1, 3))
    place[100:103] = np.nan
    speed = speed_from(evenly("position", place, 120.0, "t")).values
    assert not np.isfinite(speed[97:106]).any()
    assert np.isfinite(speed[110:230]).all()


def test_force_along_a_normal():
    force = np.array([[1.0, 2.0, 3.0]])
    assert along(force, (0, 0, 2)) == pytest.approx(3.0)
    assert along(force, (0, -1, 0)) == pytest.approx(-2.0)
    assert along(np.array([[7.0]]), (0, 0, 1)) == 7.0
    with pytest.raises(TextureDataError, match="no direction"):
        along(force, (0, 0, 0))


@pytest.mark.parametrize(
    ("rate_hz", "times", "message"),
    [(50.0, np.arange(100) / 50, "100 to 250000 Hz"), (np.nan, np.arange(100.0), "100 to 250000 Hz"),
     (1000.0, np.arange(100)[::-1] / 1000, "must be finite and rise"),
     (1000.0, np.r_[0, np.nan, np.arange(2, 100)] / 1000, "must be finite and rise"), (1000.0, np.zeros(1), "two or")],
)  # fmt: skip
def test_clocks_that_cannot_be_are_refused(rate_hz, times, message):
    with pytest.raises(TextureDataError, match=message):
        on_grid([Sampled("acceleration", times, np.zeros((len(times), 1)), rate_hz, "t")])


def test_signals_without_a_common_time_are_refused():
    early = evenly("force", wave(2, 1000.0), 1000.0, "t")
    with pytest.raises(TextureDataError, match="share no time"):
        on_grid([early, replace(early, what="speed", times_s=early.times_s + 5)])
