"""BIDS: what the standard's own validator says of every kind of study, and what stands in the files."""

from __future__ import annotations

import csv
import gzip
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

from palpate.analysis.streams.recorded_streams import streams_of
from palpate.studies.sessions.record import read
from tests.analysis.exporting.labs import AT, RECORDED, exported, lab_of, rewritten
from tests.analysis.streams.ledgers import Written, block, block_description

KINDS = (
    "door_ratings", "texture_similarity", "door_adjectives", "door_lexicon", "door_matching", "door_authoring",
    "texture_capture",
)  # fmt: skip
NO_NETWORK = {"HTTP_PROXY": "http://127.0.0.1:9", "HTTPS_PROXY": "http://127.0.0.1:9", "NO_PROXY": ""}
"""Nothing listens there: a validator that fetched its schema would fail."""


def errors_by_validator(folder):
    """The validator's exit code and the codes of its errors, by the schema that it holds itself."""
    validator = Path(sys.executable).parent / "bids-validator-deno"
    with tempfile.TemporaryDirectory() as elsewhere:  # it reads nothing under /dev, where tests' files in memory are
        copy = shutil.copytree(folder, Path(elsewhere) / "out")
        done = subprocess.run([validator, copy, "--format", "json", "--max-rows", "-1"], capture_output=True, text=True,
                              env={**os.environ, **NO_NETWORK}, timeout=60, check=False)  # fmt: skip
    assert done.stdout, done.stderr
    issues = json.loads(done.stdout)["issues"]["issues"]
    return done.returncode, {issue["code"] for issue in issues if issue["severity"] == "error"}


def tsv(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE))


@pytest.mark.needs("bids-validator")
@pytest.mark.parametrize("study", KINDS)
def test_every_kind_of_study_passes_the_validator(study, tmp_path):
    exported(lab_of(tmp_path / "lab", study), study, tmp_path / "out", "bids")
    assert errors_by_validator(tmp_path / "out") == (0, set())


@pytest.mark.needs("bids-validator")
def test_the_validator_would_say_no(tmp_path):
    """The check above can fail: a table without its key column, a file that BIDS does not know."""
    out = tmp_path / "out"
    exported(lab_of(tmp_path / "lab", "door_lexicon"), "door_lexicon", out, "bids", recordings=False)
    (out / "participants.tsv").write_text("who\tage\nsub-P001\t28\n")
    (out / "words.txt").write_text("smooth\n")
    code, errors = errors_by_validator(out)
    assert code == 16 and {"NOT_INCLUDED"} < errors


def test_every_column_is_described_and_levels_say_what_the_ends_of_the_scale_are(tmp_path):
    out = tmp_path / "out"
    exported(lab_of(tmp_path / "lab", "door_ratings"), "door_ratings", out, "bids")
    described = json.loads((out / "task-doorratings_beh.json").read_text())
    rows = tsv(out / "sub-P001/ses-01/beh/sub-P001_ses-01_task-doorratings_beh.tsv")
    assert all(described[name]["Description"] for name in rows[0])
    assert described["attribute"]["Levels"]["Damped"].startswith("from Damped (-10) to Recoiling (10); physical.")
    assert (described["value"]["Minimum"], described["value"]["Maximum"]) == (-10, 10)
    assert next(iter(rows[0])) == "onset" and rows[0]["onset"] == "30.999"
    assert {row["stim_file"] for row in rows} <= {f"profiles/{row['stimulus']}.csv" for row in rows}
    assert all((out / "stimuli" / row["stim_file"]).is_file() for row in rows)
    assert (out / "stimuli/measured/LICENSE").is_file() and (out / "stimuli/LICENCE.txt").is_file()


def test_a_recording_says_when_it_began_and_brings_its_samples_back(tmp_path):
    lab, out = lab_of(tmp_path / "lab", "door_ratings"), tmp_path / "out"
    exported(lab, "door_ratings", out, "bids")
    stem = out / "sub-P001/ses-01/beh/sub-P001_ses-01_task-doorratings_run-001_recording-door_physio"
    about = json.loads(Path(f"{stem}.json").read_text())
    lines = gzip.decompress(Path(f"{stem}.tsv.gz").read_bytes()).decode().splitlines()
    [stream] = streams_of(read(lab / "sessions/door_ratings_P001_s1.sqlite"), 1)
    values = np.array([[float(cell) for cell in line.split("\t")] for line in lines], dtype="float32")
    assert np.array_equal(values, stream.values().astype("float32"))
    assert (about["SamplingFrequency"], about["StartTime"], about["Columns"]) == (100.0, 30.999, ["angle", "force"])


@pytest.fixture
def lossy(tmp_path):
    """A session in which two streams lost samples in the middle and at the end, and one value is NaN."""
    lab = tmp_path / "lab"
    written = Written(lab / "sessions" / "door_capture_P001_s1.sqlite")
    written.begin(1, t_s=10.0)
    force = np.arange(1000.0)
    force[3] = np.nan
    place = np.arange(300.0).reshape(100, 3)
    xyz = {"channels": ("x", "y", "z"), "units": ("mm",) * 3}
    lost, hidden = [(500, 20, "buffer full"), (1000, 5, "cable")], [(50, 10, "hidden")]
    written.chunk(
        (block("door_force", force[:500], 1000.0, 0, 10.0), block_description(0, 500)),
        (block("door_place", place[:50], 100.0, 0, 10.0, **xyz), block_description(0, 50)),
    )
    written.chunk(
        (block("door_force", force[520:], 1000.0, 520, 10.52), block_description(520, 480, gaps=lost)),
        (block("door_place", place[60:], 100.0, 60, 10.6, **xyz), block_description(60, 40, gaps=hidden)),
    )
    written.done()
    written.end()
    written.note("session_ended", {"trials": 1})
    written.record()
    return lab


@pytest.mark.needs("bids-validator")
def test_lost_samples_read_not_available_where_they_were_and_are_reported(lossy, tmp_path):
    out = tmp_path / "out"
    exported(lossy, "door_capture", out, "bids")
    beh = out / "sub-P001/ses-01/beh/sub-P001_ses-01_task-doorcapture_run-001_recording-doorforce_physio.tsv.gz"
    lines = gzip.decompress(beh.read_bytes()).decode().splitlines()
    about = json.loads(Path(str(beh).replace(".tsv.gz", ".json")).read_text())
    assert len(lines) == 1005 and lines[500:520] == ["n/a"] * 20 and lines[1000:] == ["n/a"] * 5
    assert [lines[n] for n in (3, 499, 520, 999)] == ["n/a", "499", "520", "999"]
    assert (about["SamplesLost"], about["NotFinite"], about["StartTime"]) == (25, 1, 10.0)
    assert about["Gaps"][0] == {"FirstRow": 500, "Rows": 20, "Reason": "buffer full"}
    assert "35 samples lost, with gaps in 2 recordings" in (out / "README.md").read_text()
    assert errors_by_validator(out) == (0, set())


def test_positions_are_motion_data_and_their_gaps_are_events(lossy, tmp_path):
    out = tmp_path / "out"
    exported(lossy, "door_capture", out, "bids")
    stem = f"{out}/sub-P001/ses-01/motion/sub-P001_ses-01_task-doorcapture_tracksys-doorplace_run-001"
    lines = [line.split("\t") for line in Path(f"{stem}_motion.tsv").read_text().splitlines()]
    events = tsv(Path(f"{stem}_events.tsv"))
    assert [lines[n] for n in (0, 49, 60)] == [
        ["0", "1", "2", "0"],
        ["147", "148", "149", "0.49"],
        ["180", "181", "182", "0.6"],
    ]
    assert all(line[:3] == ["n/a"] * 3 for line in lines[50:60]) and len(lines) == 100
    assert [(e["trial_type"], e["onset"], e["duration"], e["session_onset"]) for e in events] == [
        ("recording", "0", "1", "10"), ("gap", "0.5", "0.1", "10.5"),
    ]  # fmt: skip


@pytest.mark.needs("bids-validator")
def test_no_date_leaves_the_lab_unless_requested(tmp_path):
    lab = tmp_path / "lab"
    rewritten(RECORDED / "ten/door_authoring_P001_s1.sqlite", lab / "sessions/door_authoring_P001_s1.sqlite")
    exported(lab, "door_authoring", tmp_path / "out", "bids")
    exported(lab, "door_authoring", tmp_path / "dated", "bids", dates=True)
    assert AT["at"].startswith("1987-06-05")
    assert not any(b"1987" in unzipped(path) for path in tmp_path.glob("out/**/*") if path.is_file())
    [row] = tsv(tmp_path / "dated/sub-P001/sub-P001_sessions.tsv")
    assert row["acq_time"] == "1987-06-05T04:03:02Z"
    assert errors_by_validator(tmp_path / "dated") == (0, set())


def unzipped(path):
    return gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()


def test_the_questionnaire_and_the_switches_have_tables_of_their_own(tmp_path):
    lab = lab_of(tmp_path / "lab", "door_authoring", "texture_similarity")
    exported(lab, "door_authoring", tmp_path / "a", "bids")
    [row] = tsv(tmp_path / "a/sub-P001/ses-01/beh/sub-P001_ses-01_task-doorauthoringquestionnaire_beh.tsv")
    assert row == {
        "Correctness": "6",
        "Differentiability": "5",
        "Realism": "6",
        "Ease_of_use": "6",
        "Learnability": "4",
    }
    exported(lab, "texture_similarity", tmp_path / "b", "bids")
    first, *_ = tsv(tmp_path / "b/sub-P001/ses-01/beh/sub-P001_ses-01_task-texturesimilarity_events.tsv")
    assert first == {"onset": "54.158", "duration": "0", "trial_type": "real", "trial": "1"}  # 52.662 + 1.496


@pytest.mark.needs("bids-validator")
def test_a_participant_of_two_sessions_has_both(tmp_path):
    lab = lab_of(tmp_path / "lab", "door_lexicon")
    first = lab / "sessions/door_lexicon_P001_s1.sqlite"
    rewritten(first, lab / "sessions/door_lexicon_P001_s2.sqlite", header={"session": 2})
    exported(lab, "door_lexicon", tmp_path / "out", "bids")
    assert [row["session_id"] for row in tsv(tmp_path / "out/sub-P001/sub-P001_sessions.tsv")] == ["ses-01", "ses-02"]
    [row] = tsv(tmp_path / "out/participants.tsv")
    assert (row["participant_id"], row["sessions"]) == ("sub-P001", "2")
    assert errors_by_validator(tmp_path / "out") == (0, set())


def test_the_lab_says_who_made_the_data_and_under_which_licence(tmp_path):
    lab = lab_of(tmp_path / "lab", "door_lexicon")
    (lab / "dataset_description.json").write_text('{"Authors": ["A. Author", "B. Author"], "License": "CC-BY-4.0"}')
    exported(lab, "door_lexicon", tmp_path / "out", "bids")
    about = json.loads((tmp_path / "out/dataset_description.json").read_text())
    assert (about["Authors"], about["License"]) == (["A. Author", "B. Author"], "CC-BY-4.0")
    assert about["BIDSVersion"] == "1.11.1" and about["GeneratedBy"][0]["Name"] == "Palpate"
    assert about["Simulated"] is True and about["Name"].endswith("(simulated)")
