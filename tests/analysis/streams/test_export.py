"""Streams listed and exported from the command line: aligned columns with their account, or as recorded."""

from __future__ import annotations

import csv
import hashlib
import json
import random
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from palpate.analysis.streams.recorded_streams import StreamError
from palpate.devices.door.commands import doors
from palpate.devices.door.recording import read_columns
from palpate.signals.aligning.refusals import AlignError
from palpate.signals.doors.profile_file import read_profile
from palpate.signals.doors.profiles import normalise
from palpate.studies.sessions.ledger import LedgerError
from tests.analysis.streams.commands_for_tests import output_of
from tests.analysis.streams.ledgers import DOOR, RECORDED, Written, block, chunks

ROOT = Path(__file__).parents[3]


def columns(path):
    with path.open(newline="") as file:
        header, *rows = list(csv.reader(file))
    table = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows])
    return dict(zip(header, table.T, strict=True))


def account(path):
    return json.loads(path.with_suffix(".json").read_text())


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """Two trials of a capture: three streams by two drifting clocks, the second trial with losses."""
    written = Written(tmp_path_factory.mktemp("lab") / "texture_capture_P001_s1.sqlite")
    rng = random.Random(2)
    xyz = {"channels": ("x", "y", "z"), "units": ("mm",) * 3, "clock": "tracker"}
    for trial, start in ((1, 20.0), (2, 60.0)):
        force_s, place_s = (start + np.arange(10 * rate) / (rate * 1.00005) for rate in (3000, 120))
        path = np.stack([np.sin(place_s), np.cos(place_s), place_s], axis=1)
        if trial == 2:
            path[600:620] = np.nan
        written.begin(trial)
        chunks(written, {
            "tool_force": (np.sin(3 * force_s), 3000, 3000.15, start, lambda: rng.expovariate(2000), {"clock": "daq"}),
            "tool_position": (path, 120, 120.006, start, lambda: rng.expovariate(500), xyz),
        })  # fmt: skip
        written.done(tool_force={"calibration": "FT123"})
        written.end()
    written.trial = None
    written.note("session_ended", {"trials": 2})
    return written.record().path


def test_a_session_lists_its_streams_with_their_clocks(session):
    rows = json.loads(output_of(session, "--json"))[0]["streams"]
    assert [(row["trial"], row["stream"], row["samples"]) for row in rows] == [
        (trial, *stream) for trial in (1, 2) for stream in (("tool_force", 30000), ("tool_position", 1200))
    ]
    for row in rows:
        assert row["timing"]["drift_ppm"] == pytest.approx(50, abs=4 * row["timing"]["drift_error_ppm"])
        assert row["seconds"] == pytest.approx(10, abs=0.01) and row["lost"] == 0
    text = output_of(session, "--trial", 1).splitlines()
    assert "calibration" in text[1] and "measured Hz" in text[1] and len(text) == 4
    assert "FT123" in text[2] and "3000.15" in text[2] and "daq" in text[2]
    assert max(map(len, text[1:])) < 130


def test_both_spellings_of_listing_and_a_folder_say_the_same(session):
    assert output_of(session) == output_of("list", session) == output_of(session.parent)
    assert "no streams" in output_of(RECORDED / "texture_adjectives_P001_s1.sqlite")


def test_an_aligned_export_is_the_truth_on_the_grid_and_explains_itself(session, tmp_path):
    out = tmp_path / "one.csv"
    output_of("export", session, "--trial", 1, "--out", out)
    table, description = columns(out), account(out)
    time_s = table["time_s"]
    assert list(table) == ["time_s", "tool_force_value", *(f"tool_position_{axis}" for axis in "xyz")]
    assert (np.diff(np.round(time_s * 1000)) == 1).all() and len(time_s) == description["grid"]["rows"] > 9900
    inside = slice(200, -200)
    assert np.abs(table["tool_force_value"] - np.sin(3 * time_s))[inside].max() < 1e-3
    assert np.abs(table["tool_position_x"] - np.sin(time_s))[inside].max() < 1e-3
    assert np.abs(table["tool_position_z"] - time_s)[inside].max() < 1e-3
    assert description["ledger_sha256"] == hashlib.sha256(session.read_bytes()).hexdigest()
    assert (description["study"], description["trial"], description["stimulus"], description["counts"]) == (
        "door_capture",
        1,
        "K8",
        True,
    )
    position = description["streams"]["tool_position"]
    assert position["units"] == ["mm", "mm", "mm"] and position["timing"]["rate_is"] == "measured"
    assert position["method"]["name"] == "bandlimited" and position["method"]["rms_error_of_a_sine"] < 1e-3
    assert position["method"]["leak_from_above_the_grid"] is None
    assert description["streams"]["tool_force"]["method"]["leak_from_above_the_grid"] < 1e-3


def test_what_is_occluded_stays_empty_and_is_reported(session, tmp_path):
    out = tmp_path / "two.csv"
    output_of("export", session, "--trial", 2, "--out", out, "--method", "tool_position=pchip,tool_force=linear")
    table, description = columns(out), account(out)["streams"]
    hidden = np.isnan(table["tool_position_x"])
    assert 165 < hidden.sum() == description["tool_position"]["empty_rows"] < 180
    assert np.isfinite(table["tool_force_value"]).all()
    assert description["tool_position"]["not_finite"] == 20 and description["tool_position"]["holes"] == 1
    assert (
        description["tool_position"]["method"]["name"] == "pchip"
        and description["tool_force"]["method"]["name"] == "linear"
    )
    output_of("export", session, "--trial", 2, "--out", out, "--longest-gap", 0.2, "--marks")
    table = columns(out)
    assert np.isfinite(table["tool_position_x"]).all() and not table["tool_force_bridged"].any()
    assert (np.flatnonzero(table["tool_position_bridged"]) == np.flatnonzero(hidden)).all()
    assert account(out)["streams"]["tool_position"]["bridged_rows"] == hidden.sum()


def test_a_known_latency_moves_a_stream_back(session, tmp_path):
    output_of("export", session, "--trial", 1, "--out", tmp_path / "a.csv", "--latency", "tool_position=0.05")
    table = columns(tmp_path / "a.csv")
    assert np.abs(table["tool_position_z"] - (table["time_s"] + 0.05))[200:-200].max() < 1e-3


@pytest.mark.long
def test_a_whole_session_goes_into_a_folder_and_raw_streams_as_they_were_recorded(session, tmp_path):
    files = json.loads(output_of("export", session, "--out", tmp_path / "all", "--rate", 500, "--json"))["files"]
    assert [Path(name).name for name in files if name.endswith("csv")] == [
        f"texture_capture_P001_s1_t00{trial}.csv" for trial in (1, 2)
    ]
    assert np.diff(columns(Path(files[0]))["time_s"]).mean() == pytest.approx(0.002)
    output_of("export", session, "--trial", 1, "--raw", "--out", tmp_path / "raw")
    raw = columns(tmp_path / "raw" / "texture_capture_P001_s1_t001_tool_force.csv")
    assert (raw["sample"] == np.arange(30000)).all()
    assert raw["value"].astype(np.float32) == pytest.approx(np.sin(3 * (20 + np.arange(30000) / 3000.15)), abs=1e-6)
    assert raw["time_s"] == pytest.approx(20 + np.arange(30000) / 3000.15, abs=1e-4)
    assert account(tmp_path / "raw" / "texture_capture_P001_s1_t001.json")["raw"] is True
    assert not list(tmp_path.rglob("*.part"))


def test_several_recordings_of_a_trial_are_chosen_among(tmp_path):
    ledger = RECORDED / "door_authoring_P001_s1.sqlite"
    with pytest.raises(StreamError, match="one file holds one aligned recording; there are 2: choose one with --act"):
        output_of("export", ledger, "--trial", 2, "--out", tmp_path / "a.csv")
    output_of("export", ledger, "--trial", 2, "--act", 2, "--out", tmp_path / "a.csv")
    assert account(tmp_path / "a.csv")["act"] == 2
    with pytest.raises(StreamError, match="trial 2 has 2 recordings, none is 3"):
        output_of("export", ledger, "--trial", 2, "--act", 3, "--out", tmp_path / "a.csv")


@pytest.mark.parametrize(
    ("arguments", "error", "says"),
    [
        (["--trial", 9], StreamError, "trial 9 was not presented"),
        (["--method", "sinc"], AlignError, "no method 'sinc'"),
        (["--method", "tool_torque=linear"], StreamError, "no stream 'tool_torque' beside it; there are: "),
        (["--latency", "tool_torque=1"], StreamError, "no stream 'tool_torque'"),
        (["--rate", 0], AlignError, "a grid of 0.0 Hz"),
        (["--rate", "nan"], AlignError, "a grid of nan Hz"),
        (["--latency", "tool_force=nan"], AlignError, "finite numbers are needed"),
        (["--latency", "tool_force=30"], StreamError, "shares no time with the others: tool_force -10.0"),
        (["--longest-gap", -1], StreamError, "stream tool_force: a rate of .* longest gap of -1.0 s"),
        (["--act", 1, "--trial", 1, "--hinge", "tool_force"], StreamError, "a stream of x, y, z is needed"),
        (["--raw", "--trial", 1], StreamError, "raw streams have a file each: give a folder"),
    ],
)
def test_what_cannot_be_exported_is_refused_and_nothing_is_written(session, tmp_path, arguments, error, says):
    trial = [] if "--trial" in arguments else ["--trial", 1]
    with pytest.raises(error, match=says):
        output_of("export", session, *trial, *arguments, "--out", tmp_path / "a.csv")
    assert not list(tmp_path.iterdir())


def test_a_mistake_in_the_options_is_reported_as_one(session, tmp_path):
    output = output_of("export", session, "--latency", "soon", "--out", tmp_path / "a.csv", status=2)
    assert "STREAM=SECONDS is expected" in output
    assert "no ledgers" in output_of(tmp_path, status=2)
    with pytest.raises(StreamError, match="name it with --trial"):
        output_of("export", session, "--act", 1, "--out", tmp_path)
    with pytest.raises(LedgerError, match="no such ledger"):
        output_of("export", tmp_path / "none.sqlite", "--out", tmp_path)


def test_streams_that_were_noted_are_exported_raw_only(tmp_path):
    written = Written(tmp_path / "s.sqlite")
    written.begin(1)
    rows = block("marker", np.arange(6.0), 0, channels=("item", "time", "value"), units=("index", "s", "scale"))
    written.note("reply", {}, [rows])
    written.end("answered")
    path = written.record().path
    with pytest.raises(StreamError, match="can be exported raw only"):
        output_of("export", path, "--trial", 1, "--out", tmp_path / "a.csv")
    output_of("export", path, "--trial", 1, "--raw", "--out", tmp_path)
    assert (tmp_path / "s_t001_marker.csv").read_text().splitlines() == ["sample,item,time,value", "0,0,1,2", "1,3,4,5"]


def test_a_form_s_marker_beside_a_recording_does_not_keep_the_recording_from_being_aligned(tmp_path):
    written = Written(tmp_path / "s.sqlite")
    written.begin(1)
    written.note("reply", {}, [block("marker", np.arange(3.0), 0, channels=("item", "time", "value"), units=("",) * 3)])
    written.ask_for("present")
    written.note("reply", {}, [block("door_force", np.arange(100.0), 1000)])
    written.end("answered")
    path = written.record().path
    output_of("export", path, "--trial", 1, "--out", tmp_path / "door.csv")
    assert "door_force_value" in columns(tmp_path / "door.csv")
    output_of("export", path, "--out", tmp_path / "all")
    assert sorted(file.name for file in (tmp_path / "all").iterdir()) == ["s_t001_act2.csv", "s_t001_act2.json"]
    with pytest.raises(StreamError, match="can be exported raw only"):
        output_of("export", path, "--trial", 1, "--act", 1, "--out", tmp_path / "a.csv")


@pytest.mark.parametrize("method", ["bandlimited", "cubic", "linear"])
def test_a_recorded_door_is_exported_and_normalised_to_its_profile(tmp_path, method):
    """The recording's door is K8 of the twin: force at 1 kHz, angle at 80 Hz (thesis 5.3.1.1)."""
    door, profile = tmp_path / "door.csv", tmp_path / "K8_g0.csv"
    output_of("export", DOOR, "--trial", 1, "--method", method, "--out", door)
    arguments = ["normalise", door, "--angle-column", "door_angle_angle", "--force-column", "door_force_force"]
    done = CliRunner().invoke(doors, [*map(str, arguments), "--zero", "--out", str(profile)], catch_exceptions=False)
    assert "621 points from 7,988 rows" in done.output
    off = np.array(read_profile(profile)) - np.array(read_profile(ROOT / "studies/door_capture/profiles/K8.csv"))
    assert np.sqrt(np.mean(off[1:-1] ** 2)) < 0.15 and np.abs(off[5:-5]).max() < 1.0


def test_a_measured_car_door_survives_two_sensors_two_clocks_and_an_export(tmp_path):
    """studies/door_ratings/measured, opened in 7 s with backlash, tracked as a marker in space by another clock."""
    known = read_columns(ROOT / "studies/door_ratings/measured/haptune_actual.csv", ("angle_deg", "force_N"))
    force_of = np.array(known["angle_deg"]), np.array(known["force_N"])

    def angle_at(t):
        share = np.clip((t - 10.6) / 7.0, 0, 1)
        return 64 * (3 * share**2 - 2 * share**3) - 0.4 * np.exp(-(((t - 14.5) / 0.1) ** 2))

    written = Written(tmp_path / "door.sqlite")
    written.begin(1, t_s=10)
    rng, noise = random.Random(4), np.random.default_rng(4)
    force_s, place_s = 10 + np.arange(8500) / 1000.04, 10 + np.arange(680) / 79.997
    turned = np.radians(20 + angle_at(place_s))
    xyz = np.stack([900 * np.cos(turned), 900 * np.sin(turned), np.full(680, 700.0)], 1) + noise.normal(
        0, 0.1, (680, 3)
    )
    pulled = np.interp(angle_at(force_s), *force_of) + noise.normal(0, 0.05, 8500)
    xyz = np.column_stack([xyz, np.ones(680)])
    place = {"channels": ("x", "y", "z", "seen"), "units": ("mm", "mm", "mm", "1"), "clock": "tracker"}
    chunks(written, {
        "door_force": (pulled, 1000, 1000.04, 10.0, lambda: rng.expovariate(3000), {"clock": "daq"}),
        "door_position": (xyz, 80, 79.997, 10.0, lambda: rng.expovariate(500), place),
    })  # fmt: skip
    written.done()
    written.end()
    output_of("export", written.record().path, "--trial", 1, "--hinge", "door_position", "--out", tmp_path / "d.csv")
    assert account(tmp_path / "d.csv")["hinge"]["radius"] == pytest.approx(900, abs=1)
    arguments = ["normalise", str(tmp_path / "d.csv"), "--force-column", "door_force_value", "--zero"]
    CliRunner().invoke(doors, [*arguments, "--out", str(tmp_path / "p.csv")], catch_exceptions=False)
    expected = normalise(*force_of).force_N
    off = np.array(read_profile(tmp_path / "p.csv")) - expected
    assert np.corrcoef(off + expected, expected)[0, 1] > 0.99
    assert np.sqrt(np.mean(off[10:] ** 2)) < 0.5


def test_help_imports_nothing_heavy():
    code = (
        "import sys\nfrom palpate.analysis.streams.commands import streams\n"
        "for words in (['--help'], ['list', '--help'], ['export', '--help']):\n"
        "    streams.main(words, standalone_mode=False)\n"
        "print([name for name in ('numpy', 'scipy', 'sqlalchemy', 'rich', 'devices') if name in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, cwd=ROOT, timeout=60
    )
    assert done.stdout.strip().endswith("[]")
