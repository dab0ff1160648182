"""The stimulus files beside door_ratings: what the program and the shipped models make, and nothing else."""

import itertools

import numpy as np
import pytest
from click.testing import CliRunner

from palpate.devices.door.commands import doors
from palpate.devices.door.making import Doors, maker_for
from palpate.devices.door.sets import differences, make
from palpate.signals.doors.grid import DoorDataError
from palpate.signals.doors.limits import LIMIT_N, STEEPEST_N_DEG
from palpate.studies.catalogue import SHIPPED

STUDIES = ("door_adjectives", "door_capture", "door_matching")


@pytest.mark.parametrize("study", STUDIES)
def test_the_stimuli_of_a_study_are_what_the_program_makes(study, tmp_path):
    folder = SHIPPED / study
    assert differences(study, folder) == []
    written = make(study, tmp_path)
    assert all(path.read_bytes() == (folder / path.relative_to(tmp_path)).read_bytes() for path in written)


def test_a_changed_missing_or_foreign_file_is_named(tmp_path):
    make("door_matching", tmp_path)
    (tmp_path / "profiles" / "New_10.csv").write_text("angle_deg,force_N\n")
    (tmp_path / "profiles" / "New_90.csv").unlink()
    (tmp_path / "profiles" / "mine.csv").touch()
    lines = [line.removeprefix(str(tmp_path / "profiles")) for line in differences("door_matching", tmp_path)]
    assert lines == ["/New_10.csv: differs", "/New_90.csv: missing", "/mine.csv: not a file of this study"]
    with pytest.raises(DoorDataError, match="'toy' has no made stimuli"):
        make("toy", tmp_path)


def test_the_six_doors_are_those_of_door_ratings():
    for study, car in itertools.product(("door_adjectives", "door_capture"), ("BC3", "K8")):
        same = SHIPPED / "door_ratings" / "profiles" / f"{car}_g0.csv"
        assert (SHIPPED / study / "profiles" / f"{car}.csv").read_bytes() == same.read_bytes()


def test_a_studys_profiles_are_compared_and_remade_by_its_name(tmp_path):
    result = CliRunner().invoke(doors, ["make", "--study", "door_matching", "--out", str(tmp_path)])
    assert result.exit_code == 0 and len(list((tmp_path / "profiles").glob("*.csv"))) == 14
    compared = ["make", "--study", "door_matching", "--check", str(tmp_path)]
    assert CliRunner().invoke(doors, compared).output.endswith(": equal\n")
    changed = next((tmp_path / "profiles").glob("*.csv"))
    changed.write_text(changed.read_text().replace("0.0,", "0.0,-", 1))
    answer = CliRunner().invoke(doors, compared)
    assert answer.exit_code == 1 and f"{changed}: differs" in answer.output


def test_stored_doors_equal_their_files_and_are_within_the_bounds():
    stored_doors = Doors(maker_for(None))
    for value in (0.0, 50.0, 100.0):
        force_N = np.array(stored_doors.force_N(dict.fromkeys(stored_doors.maker.attributes, value)))
        assert force_N.shape == (621,) and (np.round(force_N, 4) == force_N).all()
        assert np.abs(force_N).max() <= LIMIT_N
        assert np.abs(np.diff(force_N)).max() <= STEEPEST_N_DEG / 10 + 1e-4
    with pytest.raises(DoorDataError, match="Loud"):
        stored_doors.force_N({"Loud": 50.0})
