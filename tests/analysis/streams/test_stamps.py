"""Stamps of samples: by the host's clock they tell the delay that arrivals hide, by another they do not."""

from __future__ import annotations

import json
import random

import numpy as np
import pytest

from palpate.analysis.streams.recorded_streams import StreamError, streams_of
from palpate.protocols.clocks import fit_clock
from palpate.signals.aligning.stamps import stamps_of
from tests.analysis.streams.commands_for_tests import output_of
from tests.analysis.streams.ledgers import Written, block, block_description

XYZ = {"channels": ("x", "y", "z"), "units": ("mm",) * 3}
TRUE_HZ, START_S = 120.006, 20.0


def late_by(late_s, seed=1):
    """(n, arrival, stamp) of 20 s at 120 Hz: stamps err by 0.1 ms to both sides, arrivals are late_s or more later."""
    rng, samples, arrived_s = random.Random(seed), [], 0.0
    for n in range(2, 2400, 4):
        taken_s = START_S + n / TRUE_HZ
        arrived_s = max(arrived_s, taken_s + late_s + rng.expovariate(1000))
        samples.append((n, arrived_s, taken_s + rng.gauss(0, 1e-4)))
    return samples


def stamps(samples, clock="lsl"):
    return stamps_of(samples, 120.0, clock, fit_clock([(n, arrived_s) for n, arrived_s, _ in samples], 120.0))


def recorded(path, clock="lsl", own_zero_s=0.0, late_s=0.02):
    """A session of a tracker that stamps, and a force sensor at once; both see the same sine."""
    written, rng = Written(path), random.Random(3)
    written.begin(1)
    by_stamp = {n: (arrived_s, stamp_s) for n, arrived_s, stamp_s in late_by(late_s)}
    for first in range(0, 2400, 60):
        n = np.arange(first, first + 60)
        x = 50 * np.sin(2 * np.pi * (START_S + n / TRUE_HZ))
        received = [number for number in by_stamp if first <= number < first + 60]
        about = block_description(first, 60, [(number, by_stamp[number][0]) for number in received])
        about["device_s"] = [by_stamp[number][1] - own_zero_s for number in received]
        place = block("tool_position", np.stack([x, 0 * x, 0 * x], 1), 120, first, START_S, clock, **XYZ)
        m = np.arange(first * 25, (first + 60) * 25)
        ends = m[93::94]
        force = block("tool_force", 50 * np.sin(2 * np.pi * (START_S + m / 3000)), 3000, int(m[0]), START_S, "daq")
        arrived = [(int(end), START_S + end / 3000 + rng.expovariate(5000)) for end in ends]
        written.chunk((place, about), (force, block_description(int(m[0]), len(m), sorted(arrived))))
    written.end()
    return written.record()


@pytest.mark.parametrize("late_s", [0.0, 0.0042, 0.3])
def test_the_delay_that_all_arrivals_share_is_reported_within_its_error(late_s):
    results = [stamps(late_by(late_s, seed)) for seed in range(10)]
    assert all(result.problem is None for result in results)
    off = [(result.late_s - late_s) / result.late_error_s for result in results]
    assert max(map(abs, off)) < 3 and max(result.late_error_s for result in results) < 5e-5
    assert results[0].late_median_s == pytest.approx(late_s + 0.7e-3, abs=0.2e-3)
    assert results[0].late_p95_s > results[0].late_median_s
    assert results[0].scatter_s == pytest.approx(1e-4, rel=0.1)
    assert results[0].line.time_s(1200) == pytest.approx(
        START_S + 1200 / TRUE_HZ, abs=3 * results[0].line.offset_error_s
    )


def test_stamps_that_were_set_late_now_and_then_do_not_move_the_line():
    samples = [(n, arrived_s + 0.1, stamp_s + (0.05 if n % 40 == 2 else 0)) for n, arrived_s, stamp_s in late_by(0.004)]
    assert stamps(samples).late_s == pytest.approx(0.104, abs=2e-4)


@pytest.mark.parametrize(
    ("clock", "change", "says"),
    [
        ("door", lambda n, s: s, r"its own clock \(door\): only their differences mean something"),
        ("lsl", lambda n, s: s - 17_000, "came 17000 s after their stamps"),
        ("lsl", lambda n, s: s + 0.03, "after their stamps: between"),
        ("lsl", lambda n, s: s + 300e-6 * n / 120, "drift from its arrivals by -5.9.* ms"),
        ("lsl", lambda n, s: 5.0, "are not on a line"),
        ("lsl", lambda n, s: s + (1000 if n > 1200 else 0), "are not on a line"),
        ("lsl", lambda n, s: float("nan"), "are not on a line"),
    ],
)
def test_stamps_that_cannot_say_when_a_sample_was_taken_are_named(clock, change, says):
    result = stamps([(n, arrived_s, change(n, stamp_s)) for n, arrived_s, stamp_s in late_by(0.004)], clock)
    assert result.late_s is None
    with pytest.raises(AssertionError, match=says):
        raise AssertionError(result.problem)


def test_few_stamps_tell_nothing():
    assert "10 stamps are too few" in stamps(late_by(0.004)[:10]).problem


def test_a_listing_and_an_account_say_how_late_samples_came_against_their_stamps(tmp_path):
    path = recorded(tmp_path / "s.sqlite").path
    heading, position = output_of(path).splitlines()[1], output_of(path).splitlines()[2]
    assert "late ms" in heading and "tool_position" in position and " +-0.0" in position
    rows = {row["stream"]: row for row in json.loads(output_of(path, "--json"))[0]["streams"]}
    about = rows["tool_position"]["stamps"]
    assert about["late_s"] == pytest.approx(0.02, abs=1e-4) and about["usable"] and about["of_the_host"]
    assert rows["tool_position"]["timing"]["from"] == "arrivals" and rows["tool_force"]["stamps"] is None
    assert f"{1e3 * about['late_s']:.3f}" in position


@pytest.mark.parametrize(("further", "off"), [([], 0.02), (["--by-stamps", "tool_position"], 0.0)])
def test_an_export_by_stamps_takes_the_shared_delay_away(tmp_path, further, off):
    """Both sensors see one sine; by arrivals the tracker is 20 ms late, which is 6.3 mm of it."""
    path, out = recorded(tmp_path / "s.sqlite").path, tmp_path / "t.csv"
    output_of("export", path, "--trial", 1, "--out", out, *further)
    table = np.genfromtxt(out, delimiter=",", names=True)[200:-200]
    truth = 50 * np.sin(2 * np.pi * (table["time_s"] - off))
    assert np.abs(table["tool_position_x"] - truth).max() < 0.03
    about = json.loads(out.with_suffix(".json").read_text())["streams"]["tool_position"]
    assert about["timing"]["from"] == ("its own stamps" if further else "arrivals")
    assert about["stamps"]["late_s"] == pytest.approx(0.02, abs=1e-4)


def test_raw_streams_are_timed_by_stamps_as_well(tmp_path):
    path = recorded(tmp_path / "s.sqlite").path
    output_of("export", path, "--raw", "--trial", 1, "--out", tmp_path, "--by-stamps", "tool_position")
    table = np.genfromtxt(tmp_path / "s_t001_tool_position.csv", delimiter=",", names=True)
    np.testing.assert_allclose(table["time_s"], START_S + table["sample"] / TRUE_HZ, atol=3e-5)


@pytest.mark.parametrize(
    ("name", "clock", "own_zero_s", "says"),
    [
        ("tool_position", "door", 15.0, r"its own clock \(door\)"),
        ("tool_position", "lsl", -500.0, "are not by this host's clock"),
        ("tool_force", "lsl", 0.0, "did not stamp its samples"),
        ("tool_speed", "lsl", 0.0, "there is no stream 'tool_speed' beside it; there are: tool_position, tool_force"),
    ],
)
def test_what_cannot_be_timed_by_stamps_is_refused_by_name_and_nothing_is_written(
    tmp_path, name, clock, own_zero_s, says
):
    path = recorded(tmp_path / "s.sqlite", clock, own_zero_s).path
    with pytest.raises(StreamError, match=f"trial 1, attempt 1: stream .*{says}"):
        output_of("export", path, "--trial", 1, "--out", tmp_path / "t.csv", "--by-stamps", name)
    assert not list(tmp_path.glob("t.*"))


def test_stamps_of_a_stream_without_a_rate_are_not_used(tmp_path):
    written = Written(tmp_path / "s.sqlite")
    written.begin(1)
    written.chunk(
        (block("notes", [1, 2], 0), {**block_description(0, 2, [(0, 1.0), (1, 2.0)]), "device_s": [1.0, 2.0]})
    )
    written.end()
    assert streams_of(written.record(), 1)[0].stamps is None
