import json

import numpy as np
import pytest
from click.testing import CliRunner

from palpate.modeling.commands_textures import evaluate_textures, train_textures
from palpate.modeling.textures.recording import TextureDataError
from palpate.signals.models.file import read_model
from palpate.studies.simulation.texture_simulator import SimulatedTextures
from tests.commands_for_tests import run_verb
from tests.modeling.textures.recording_for_tests import recording

pytestmark = pytest.mark.needs("torch")


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tables")
    for seed, name in enumerate(("felt", "grit")):
        acceleration, speed, force = recording(4.0, seed, name).signals
        rows = np.stack([np.arange(len(speed)) / 1000, acceleration, speed, force], axis=1)
        np.savetxt(
            folder / f"{name}.csv", rows, "%.6f", ",", header="time,acceleration (m/s2),speed,force", comments=""
        )
    return folder


def done(command, *arguments):
    return run_verb(command, *arguments, obj=SimulatedTextures)


def test_evaluate_reads_tables_and_resumes_from_finished_jobs(tables, tmp_path):
    arguments = ("--tables", tables, "--lab", tmp_path, "--methods", "ar", "--quick", "--workers", "1", "--no-figures")
    first = json.loads(done(evaluate_textures, *arguments, "--json").stdout)
    folder = tmp_path / "evaluated" / "textures"
    assert (folder / "report.html").stat().st_size > 20_000
    assert {row["texture"] for row in first["tables"]["textures"]} == {"felt", "grit"}
    assert all(row["level"] > 0.3 for row in first["tables"]["textures"])
    again = done(evaluate_textures, *arguments)
    assert "Piecewise" in again.stdout or "ar" in again.stdout
    assert str(folder / "report.html").replace("\n", "") in again.stdout.replace("\n", "")
    assert json.loads((folder / "evaluation.json").read_text())["jobs_kept"] == first["jobs"]


def test_train_writes_a_model_that_the_rig_reads(tables, tmp_path):
    arguments = (
        "--tables",
        tables,
        "--textures",
        "grit",
        "--lab",
        tmp_path,
        "--methods",
        "ar",
        "--workers",
        "1",
        "--quick",
    )
    (written,) = json.loads(done(train_textures, *arguments, "--json").stdout)
    assert written["card"] == str(tmp_path / "models" / "texture-grit-ar.json")
    card = read_model(tmp_path / "models" / "texture-grit-ar.json").card
    assert card.texture.id == "grit"
    assert card.metrics["free_level"] > 0


def test_a_rate_and_a_hand_held_still_may_stand_in_for_columns(tmp_path):
    acceleration = recording(3.0, 1, "bare").acceleration_m_s2
    np.savetxt(tmp_path / "bare.csv", acceleration, "%.6f", header="acceleration", comments="")
    held = ("--rate-hz", 1000, "--speed-mm-s", 80, "--force-n", 1)
    arguments = ("--tables", tmp_path / "bare.csv", "--lab", tmp_path, "--methods", "ar", "--quick", "--workers", "1")
    content = json.loads(done(evaluate_textures, *arguments, *held, "--no-figures", "--json").stdout)
    assert content["tables"]["textures"][0]["with_speed"] is None
    assert content["tables"]["textures"][0]["level"] > 0.3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--methods", "fotan"), "foten"),
        (("--textures", "gritt"), "grit"),
        (("--simulated", "--textures", "clot"), "cloth"),
    ],
)
def test_a_name_that_is_none_is_refused_with_the_nearest(tables, tmp_path, arguments, words):
    source = () if "--simulated" in arguments else ("--tables", tables)
    with pytest.raises(TextureDataError, match=words):
        done(evaluate_textures, "--lab", tmp_path, "--workers", "1", *source, *arguments)


def test_two_sources_at_once_are_refused(tables):
    result = CliRunner().invoke(evaluate_textures, ["--tables", str(tables), "--simulated"], obj=SimulatedTextures)
    assert result.exit_code == 2
    assert "--tables and --simulated: one of them" in result.output


def test_a_hand_held_still_without_tables_is_refused():
    result = CliRunner().invoke(train_textures, ["--simulated", "--force-n", "1"], obj=SimulatedTextures)
    assert result.exit_code == 2
    assert "--tables is expected" in result.output


def test_an_empty_lab_is_refused(tmp_path):
    with pytest.raises(TextureDataError, match="no session"):
        done(train_textures, "--lab", tmp_path)
