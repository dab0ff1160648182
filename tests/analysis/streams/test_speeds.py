"""Speeds beside the positions they come from: right on the grid, empty where unknown, with their error and delay."""

from __future__ import annotations

import json
import random

import numpy as np
import pytest

from palpate.analysis.streams.recorded_streams import StreamError
from palpate.signals.aligning.speed import slope
from tests.analysis.streams.commands_for_tests import output_of
from tests.analysis.streams.ledgers import Written, block, block_description, chunks

TRUE_HZ, START_S, HZ, AMPLITUDE = 120.006, 20.0, 1.5, 40.0
XYZ = {"channels": ("x", "y", "z"), "units": ("mm",) * 3, "clock": "tracker"}


def exported(path, out, *arguments):
    output_of("export", path, "--trial", 1, "--out", out, "--speed", "tool_position", *arguments)
    table = np.genfromtxt(out, delimiter=",", names=True)
    return table, json.loads(out.with_suffix(".json").read_text())["streams"]["tool_position"]["speed"]


def stroke(times_s):
    """To and fro along x and y, 5 : 12; at 10 mm/s along z."""
    along = AMPLITUDE * np.sin(2 * np.pi * HZ * times_s)
    return np.stack([5 / 13 * along, 12 / 13 * along, 10 * times_s], axis=1)


def velocity_mm_s(times_s):
    along = 2 * np.pi * HZ * AMPLITUDE * np.cos(2 * np.pi * HZ * times_s)
    return np.stack([5 / 13 * along, 12 / 13 * along, np.full_like(times_s, 10)], axis=1)


def session(path, hidden=None, noise_mm=0.0, scale=1.0, **further):
    """20 s of the stroke by a clock that is 50 ppm fast."""
    values = stroke(START_S + np.arange(2400) / TRUE_HZ)
    values += noise_mm * np.random.default_rng(1).standard_normal(values.shape)
    if hidden is not None:
        values[hidden] = np.nan
    written, rng = Written(path), random.Random(4)
    written.begin(1)
    delay = lambda: rng.expovariate(2000)  # noqa: E731
    chunks(written, {"tool_position": (scale * values, 120, TRUE_HZ, START_S, delay, {**XYZ, **further})})
    written.end()
    return written.record().path


def velocities(table):
    return np.stack([table[f"tool_position_v{axis}"] for axis in "xyz"], axis=1)


@pytest.mark.parametrize("window", [3, 7, 13])
def test_the_speed_of_a_stroke_is_right_but_for_the_error_that_is_reported(tmp_path, window):
    table, about = exported(session(tmp_path / "s.sqlite"), tmp_path / "t.csv", "--speed-window", window)
    inner = table[200:-200]
    truth = velocity_mm_s(inner["time_s"])
    off = velocities(inner) - truth
    documented_share = about["relative_error_of_a_sine"]["1.5 Hz"]
    share = np.sqrt((off**2).mean() / (truth[:, :2] ** 2).sum(axis=1).mean() * 3)
    assert share == pytest.approx(documented_share, abs=3e-4)
    speed = np.linalg.norm(velocities(inner), axis=1)
    np.testing.assert_allclose(inner["tool_position_speed"], speed, rtol=1e-6)
    assert (inner["tool_position_speed"] > 9).all()
    estimate = slope(window, 2, about["rate_hz"])
    assert about["rate_hz"] == pytest.approx(TRUE_HZ, rel=5e-6)
    assert (about["window"], about["delay_s"], about["causal"]) == (window, pytest.approx(0, abs=1e-12), False)
    assert about["known_after_s"] == pytest.approx((window - 1) / 2 / TRUE_HZ, rel=1e-5)
    assert about["ahead_s"] > about["known_after_s"]
    assert about["noise_gain_per_s"] == pytest.approx(estimate.noise_gain_per_s)
    assert about["bias"] == {"of_derivative": 3, "times": pytest.approx(estimate.bias), "unit": "s^2"}
    assert about["columns"] == ["tool_position_vx", "tool_position_vy", "tool_position_vz", "tool_position_speed"]


def test_a_causal_speed_takes_nothing_from_the_future_and_says_how_late_it_is(tmp_path):
    """Two strokes that part at 30 s: the speed before is the same, and lies half a sample behind on average."""
    still = slice(1200, 2400)
    one, about = exported(session(tmp_path / "a.sqlite"), tmp_path / "a.csv", "--causal")
    other, _ = exported(session(tmp_path / "b.sqlite", still), tmp_path / "b.csv", "--causal", "--everything")
    assert about["causal"] and about["ahead_s"] == 0.0 and about["aligned_by"] == "hold"
    assert about["delay_s"] == pytest.approx(0.5 / TRUE_HZ, rel=1e-4)
    parted_s = START_S + 1199 / TRUE_HZ
    before = one["time_s"] < parted_s - 1e-3
    same = velocities(other[: len(one)])[before]
    np.testing.assert_array_equal(velocities(one)[before], same)
    inner = one[200:-200]
    late = velocity_mm_s(inner["time_s"] - about["delay_s"])
    on_time = velocity_mm_s(inner["time_s"])
    assert about["relative_error_of_aligning_it"]["1.5 Hz"] == pytest.approx(
        2 * np.pi * HZ / TRUE_HZ / 3**0.5, rel=0.05
    )
    rms = [np.sqrt(((velocities(inner) - truth) ** 2).mean()) for truth in (late, on_time)]
    assert rms[0] < 0.6 * rms[1]


@pytest.mark.parametrize(("causal", "first", "last"), [((), 597, 607), (("--causal",), 600, 610)])
def test_an_occlusion_and_a_window_around_it_have_no_speed(tmp_path, causal, first, last):
    """Five samples are hidden: with seven to a window, velocities 597 to 607 (or 600 to 610) are not known."""
    table, about = exported(session(tmp_path / "s.sqlite", slice(600, 605)), tmp_path / "t.csv", "--marks", *causal)
    times_s = START_S + np.array([first - 1, last + 1]) / TRUE_HZ
    inside = (table["time_s"] > times_s[0] + 1e-4) & (table["time_s"] < times_s[1] - 1e-4)
    known = ~np.isnan(table["tool_position_speed"])
    assert not known[inside].any() and known[200:-200][~inside[200:-200]].all()
    assert about["empty_rows"] == (~known).sum()


def test_a_hole_that_positions_bridge_is_not_bridged_by_their_speed(tmp_path):
    """One lost sample of a 1 kHz stream is 1 ms: the position goes on, the speed does not know."""
    written, received = Written(tmp_path / "s.sqlite"), [(0, 1000), (1001, 2000)]
    written.begin(1)
    for first, end in received:
        n = np.arange(first, end)
        arrived = [(int(number), START_S + number / 1000) for number in n[9::10]]
        gaps = [(1000, 1, "overrun")] if first else []
        piece = block("tool_position", stroke(START_S + n / 1000), 1000, first, START_S + first / 1000, **XYZ)
        written.chunk((piece, block_description(first, end - first, arrived, gaps)))
    written.end()
    table, _ = exported(written.record().path, tmp_path / "t.csv", "--speed-window", 5, "--method", "linear")
    unknown = np.flatnonzero(np.isnan(table["tool_position_speed"][100:-100])) + 100
    assert np.isfinite(table["tool_position_x"]).all()
    assert 4 <= len(unknown) <= 6 and (np.diff(unknown) == 1).all() and 1000 in unknown


def test_the_noise_that_is_reported_is_the_positions_and_the_speed_of_rest_follows(tmp_path):
    table, about = exported(session(tmp_path / "s.sqlite", noise_mm=0.05), tmp_path / "t.csv")
    assert about["noise_mm"] == pytest.approx(0.05, rel=0.05)
    assert about["noise_mm_s"] == pytest.approx(0.05 * about["noise_gain_per_s"], rel=0.05)
    assert about["at_rest_mm_s"] == pytest.approx(1.6 * about["noise_mm_s"], rel=0.01)
    off = velocities(table)[200:-200, 2] - 10
    assert off.std() < 1.1 * about["noise_mm_s"]


def test_positions_in_metres_give_mm_per_second(tmp_path):
    table, about = exported(session(tmp_path / "s.sqlite", scale=1e-3, units=("m",) * 3), tmp_path / "t.csv")
    assert about["unit"] == "mm/s"
    np.testing.assert_allclose(table["tool_position_vz"][100:-100], 10, atol=0.05)


@pytest.mark.parametrize(
    ("further", "arguments", "says"),
    [
        ({"channels": ("a", "b", "z")}, (), "two or three of x, y, z in one unit of mm, cm, m; it has a in mm"),
        ({"units": ("N",) * 3}, (), "of mm, cm, m; it has x in N"),
        ({"units": ("mm", "m", "mm")}, (), "in one unit of"),
        ({"channels": ("x", "y", "speed"), "units": ("mm", "mm", "mm/s")}, (), "a channel `speed` already"),
        ({}, ("--speed-window", 4), "speed over 4 samples: a window of 4 samples and degree 2"),
        ({}, ("--speed-window", 2, "--causal"), "speed over 2 samples"),
        ({}, ("--speed-window", 3001), "speed over 3001 samples: 0 of 2400 samples are finite"),
        ({}, ("--speed", "tool_place"), "there is no stream 'tool_place' beside it; there are: tool_position"),
    ],
)
def test_what_has_no_speed_is_refused_by_name_and_nothing_is_written(tmp_path, further, arguments, says):
    path = session(tmp_path / "s.sqlite", **further)
    with pytest.raises(StreamError, match=says):
        exported(path, tmp_path / "t.csv", *arguments)
    assert not list(tmp_path.glob("t.*"))


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--causal",), "say of which stream, --speed STREAM"),
        (("--speed-window", 5), "say of which stream, --speed STREAM"),
        (("--speed", "tool_position", "--raw"), "--raw has none"),
    ],
)
def test_options_that_mean_nothing_together_are_reported(tmp_path, arguments, says):
    output = output_of("export", session(tmp_path / "s.sqlite"), "--out", tmp_path / "out", *arguments, status=2)
    assert says in " ".join(output.replace("│", " ").split())
