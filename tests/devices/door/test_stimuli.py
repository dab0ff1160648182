"""The stimulus folder is what the commands make, byte for byte, and its table describes them correctly."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from palpate.devices.door.commands import doors
from palpate.signals.doors.features import describe
from palpate.signals.doors.grid import DoorDataError
from palpate.signals.doors.profile_file import read_profile

STUDY = Path(__file__).parents[3] / "studies" / "door_ratings"


def run(*arguments: object) -> Result:
    return CliRunner().invoke(doors, [str(argument) for argument in arguments], catch_exceptions=False)


def test_make_rebuilds_the_committed_folder_byte_for_byte(tmp_path) -> None:
    assert len(json.loads(run("make", "--out", tmp_path, "--json").output)["files"]) == 91
    rebuilt = {path.relative_to(tmp_path): path.read_bytes() for path in tmp_path.rglob("*.csv")}
    committed = [STUDY / "stimuli.csv", *(STUDY / "profiles").iterdir()]
    assert rebuilt == {path.relative_to(STUDY): path.read_bytes() for path in committed}


def test_check_finds_the_committed_folder_equal() -> None:
    result = run("make", "--check", STUDY)
    assert (result.exit_code, result.output) == (0, f"{STUDY}: equal\n")


def test_check_names_what_differs_and_exits_with_1(tmp_path) -> None:
    shutil.copytree(STUDY / "profiles", tmp_path / "profiles")
    shutil.copy(STUDY / "stimuli.csv", tmp_path)
    touched = tmp_path / "profiles" / "K3_g4.csv"
    touched.write_bytes(touched.read_bytes().replace(b"\n30.0,", b"\n30.0,1", 1))
    (tmp_path / "profiles" / "K8_g0.csv").unlink()
    (tmp_path / "profiles" / "K9_g0.csv").write_text("mine", encoding="utf-8")
    with (tmp_path / "stimuli.csv").open("ab") as table:
        table.write(b"one more line\n")
    result = run("make", "--check", tmp_path, "--json")
    assert result.exit_code == 1
    assert json.loads(result.output) == {
        "equal": False,
        "differences": [
            f"{touched}: differs from line 302",
            f"{tmp_path / 'profiles' / 'K8_g0.csv'}: missing",
            f"{tmp_path / 'stimuli.csv'}: has another number of lines",
            f"{tmp_path / 'profiles' / 'K9_g0.csv'}: not a file of this study",
        ],
    }


def table() -> list[dict[str, str]]:
    with (STUDY / "stimuli.csv").open(encoding="utf-8", newline="") as lines:
        return list(csv.DictReader(lines))


def test_the_table_has_90_stimuli_and_names_the_measured_door() -> None:
    rows = table()
    assert len({row["id"] for row in rows}) == len(rows) == 90
    assert {(row["car"], row["source"]) for row in rows} == {
        ("BC3", "measured"),
        *((car, "simulated") for car in ("FORD", "G90", "K3", "K8", "MQ4")),
    }
    kinds = ["original", *3 * ["amplitude"], *3 * ["position"], *3 * ["perturbation"], *3 * ["plateau"], *2 * ["bump"]]
    for place in range(0, 90, 15):
        assert [row["variant"] for row in rows[place : place + 15]] == [f"g{number}" for number in range(15)]
        assert [row["augmentation"] for row in rows[place : place + 15]] == kinds


@pytest.mark.parametrize("row", table(), ids=lambda row: row["id"])
def test_each_row_describes_its_own_file(row) -> None:
    assert row["file"] == f"profiles/{row['id']}.csv"
    assert row["id"] == f"{row['car']}_{row['variant']}"
    features = describe(np.array(read_profile(STUDY / row["file"])))
    assert {name: float(row[name]) for name in features} == pytest.approx(features, abs=5.1e-5)


def test_files_have_line_feeds_fixed_decimals_and_no_minus_zero() -> None:
    for path in [STUDY / "stimuli.csv", *(STUDY / "profiles").iterdir()]:
        content = path.read_bytes()
        assert b"\r" not in content
        assert b"-0.0000" not in content
        assert content.endswith(b"\n")


def test_the_measured_profile_is_the_source_within_a_tenth_of_a_degree() -> None:
    with (STUDY / "measured" / "haptune_actual.csv").open(encoding="utf-8", newline="") as lines:
        rows = [(float(row["angle_deg"]), float(row["force_N"])) for row in csv.DictReader(lines)]
    angle, force = np.array(rows).T
    profile = np.array(read_profile(STUDY / "profiles" / "BC3_g0.csv"))
    error = profile - np.interp(np.arange(621) / 10, angle, force)
    assert np.abs(error[4:]).max() < 0.05
    assert profile[0] == pytest.approx(force[0], abs=1e-4)


def test_the_measured_door_keeps_its_licence_and_notice() -> None:
    assert "Apache License" in (STUDY / "measured" / "LICENSE").read_text(encoding="utf-8")
    assert "github.com/mudassir-awan/HapTune" in (STUDY / "measured" / "NOTICE").read_text(encoding="utf-8")


def test_simulate_and_augment_give_the_files_of_the_study(tmp_path) -> None:
    assert run("simulate", "--all", "--out", tmp_path).output == f"5 files written to {tmp_path}\n"
    assert run("augment", tmp_path, "--out", tmp_path).output == f"70 files written to {tmp_path}\n"
    assert len(list(tmp_path.iterdir())) == 75
    for path in tmp_path.iterdir():
        assert path.read_bytes() == (STUDY / "profiles" / path.name).read_bytes()


def test_normalise_gives_the_measured_original_of_the_study(tmp_path) -> None:
    run("normalise", STUDY / "measured" / "haptune_actual.csv", "--out", tmp_path / "door.csv")
    assert (tmp_path / "door.csv").read_bytes() == (STUDY / "profiles" / "BC3_g0.csv").read_bytes()


def test_an_augmentation_that_is_refused_names_the_file_and_writes_nothing(tmp_path) -> None:
    flat = tmp_path / "flat_g0.csv"
    flat.write_text("angle_deg,force_N\n" + "".join(f"{i / 10:.1f},5\n" for i in range(621)), encoding="utf-8")
    with pytest.raises(DoorDataError, match=r"flat_g0\.csv: g1 .* needs 1 major peaks"):
        run("augment", flat, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["simulate", "--out", "x"], "Name a door with --door, or all with --all"),
        (["simulate", "--all", "--door", "K3", "--out", "x"], "Name a door with --door"),
        (["simulate", "--door", "K9", "--out", "x"], "no simulated door 'K9'"),
        (["make"], "either --out FOLDER"),
        (["augment", ".", "--out", "x"], r"no file named \*_g0\.csv"),
    ],
)
def test_a_command_used_wrongly_says_how_to_use_it(tmp_path, monkeypatch, arguments, message) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(DoorDataError, match=message):
        run(*arguments)
    assert list(tmp_path.iterdir()) == []


def test_every_command_has_help_with_an_example() -> None:
    for name in ("normalise", "simulate", "augment", "make", "draw"):
        assert f"palpate doors {name}" in run(name, "--help").output


@pytest.mark.long
def test_the_picture_shows_every_profile(tmp_path) -> None:
    run("draw", STUDY, "--out", tmp_path / "doors.svg")
    picture = (tmp_path / "doors.svg").read_text(encoding="utf-8")
    assert picture.count('<g id="axes_') == 30
    for text in ("BC3 (measured)", "MQ4 (simulated)", "g14", "perturbation"):
        assert f"<!-- {text}" in picture


def test_a_folder_without_a_table_of_doors_cannot_be_drawn(tmp_path) -> None:
    (tmp_path / "stimuli.csv").write_text("id,car\nx,y\n", encoding="utf-8")
    with pytest.raises(DoorDataError, match="column variant, augmentation, source, file missing"):
        run("draw", tmp_path, "--out", tmp_path / "doors.png")
