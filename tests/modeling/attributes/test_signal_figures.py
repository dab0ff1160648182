"""The numbers behind Figures 3.5 and 3.6 of the thesis: extremes, times, power, segments; and the command."""

import csv
import json

import numpy as np
import pytest
from click.testing import CliRunner

from palpate.analysis.features.touch import RATE_HZ, SEGMENT, Stretch, Touch
from palpate.modeling.attributes.signal_figures import COLUMNS, Explored, explored_texture, segment_rows, vibration_rows
from palpate.modeling.commands_library import textures
from palpate.modeling.textures.preparing import Touched
from palpate.modeling.textures.rates import evenly
from palpate.modeling.textures.reading_ledgers import NoCapture
from tests.modeling.attributes.captured_textures import session


def stretch(samples, first, force_N=1.0, amplitude=2.0, hz=100.0):
    vibration = amplitude * np.sin(2 * np.pi * hz * np.arange(samples) / RATE_HZ)
    return Stretch(vibration[:, None], np.linspace(0, 50, samples), np.full(samples, force_N), first)


def explored(*stretches, seconds=8.0):
    n = round(3000 * seconds)
    raw = np.stack([np.full(n, 1.0), np.zeros(n), np.full(n, 9.81)], axis=1)
    raw[4321, 0], raw[4321, 1] = 77.0, -55.0
    touched = Touched("made", evenly("acceleration", raw, 3000, "made"), evenly("force", np.ones(n), 3000, "made"))
    return Explored("made", touched, Touch("made", tuple(stretches)), 0.0, ())


def of(rows, shows):
    return [row for row in rows if row["shows"] == shows]


def test_a_short_peak_is_in_the_figure_however_long_the_recording():
    rows = vibration_rows(explored(stretch(3000, 2500)))
    assert COLUMNS <= len(of(rows, "x")) < 2 * COLUMNS
    assert max(row["high"] for row in of(rows, "x")) == 77 and min(row["low"] for row in of(rows, "y")) == -55
    (peak,) = [row for row in of(rows, "x") if row["high"] == 77]
    assert peak["time_s"] == pytest.approx(4321 / 3000, abs=8 / COLUMNS)
    assert {row["low"] for row in of(rows, "z")} == {9.81}


def test_a_tone_has_its_power_at_its_frequency():
    """A sine of amplitude 2 has the mean square 2; the tone is whole numbers of periods long, so no window leaks it."""
    spectrum = of(vibration_rows(explored(stretch(3000, 2500))), "spectrum")
    assert sum(row["power"] for row in spectrum) * RATE_HZ / SEGMENT == pytest.approx(2.0, rel=1e-9)
    assert max(spectrum, key=lambda row: row["power"])["hz"] == 100


def test_segments_without_contact_are_marked_and_have_no_part_in_the_power():
    both = explored(stretch(1000, 2500), stretch(1000, 4000, force_N=0.05, amplitude=9.0, hz=200.0))
    cuts = of(segment_rows(both, 60), "segment")
    assert [row["contact"] for row in cuts] == [True, True, False, False]
    spectrum = of(vibration_rows(both), "spectrum")
    assert sum(row["power"] for row in spectrum) * RATE_HZ / SEGMENT == pytest.approx(2.0, rel=1e-9)


def test_segments_stand_at_their_times_after_trimming_and_after_a_hole():
    cuts = of(segment_rows(explored(stretch(1400, 2500), stretch(700, 4200)), 60), "segment")
    assert [(row["time_s"], row["until_s"]) for row in cuts] == [(2.5, 3.0), (3.0, 3.5), (4.2, 4.7)]


def test_only_so_many_seconds_are_shown_with_their_hand():
    rows = segment_rows(explored(stretch(6000, 2500)), 1.0)
    assert [row["time_s"] for row in of(rows, "segment")] == [2.5, 3.0]
    speed = of(rows, "speed")
    assert (speed[0]["time_s"], speed[-1]["time_s"]) == (2.5, 3.499)
    assert speed[-1]["low"] == pytest.approx(50 * 999 / 5999)
    assert {row["high"] for row in of(rows, "force")} == {1.0}


def test_a_lab_s_capture_is_drawn_with_its_numbers(tmp_path):
    session(tmp_path, "P001", [{"stimulus": "T03", "seconds": 8.0}, {"stimulus": "T01"}])
    session(tmp_path, "P002", [{"stimulus": "T03", "seed": 9}])
    out = tmp_path / "figures"
    result = CliRunner().invoke(
        textures, ["draw", "T03", "--lab", str(tmp_path), "--out", str(out), "--json"], catch_exceptions=False
    )
    answer = json.loads(result.output)
    expected = [str(out / f"{name}.{kind}") for name in ("figure_3_5", "figure_3_6") for kind in ("svg", "png", "csv")]
    assert answer["files"] == expected and sorted(map(str, out.iterdir())) == sorted(expected)
    assert "simulated" in answer["notes"] and "the first of 2 captures is drawn" in answer["notes"]
    rows = list(csv.DictReader((out / "figure_3_6.csv").read_text().splitlines()))
    cuts = [float(row["time_s"]) for row in rows if row["shows"] == "segment"]
    assert cuts[0] == pytest.approx(2.5, abs=1e-9) and np.diff(cuts) == pytest.approx(0.5)
    assert explored_texture(tmp_path, "T03").touch.seconds == pytest.approx(3.0, abs=0.02)
    with pytest.raises(NoCapture, match="no capture of 'T02' counts"):
        explored_texture(tmp_path, "T02")
