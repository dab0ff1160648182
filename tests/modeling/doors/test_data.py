"""The data set: its rows and digest, its scaling, and the measured doors that real profiles come from."""

from __future__ import annotations

import csv
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from palpate.modeling.doors.data import scaling_of
from palpate.modeling.doors.measured_door import measured_doors
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.signals.doors.profiles import normalise
from tests.modeling.doors.data_for_tests import crossed

SMALL = Path(__file__).parents[2] / "recorded" / "doors_small" / "study.yaml"
MEASURED = Path(__file__).parents[3] / "studies" / "door_ratings" / "measured"


def test_picked_rows_keep_everything_of_each_stimulus():
    data = crossed(2, 3)
    some = data.rows(np.array([4, 0]))
    assert some.ids == (data.ids[4], data.ids[0]) and some.doors == ("D1", "D0")
    assert np.array_equal(some.force_N, data.force_N[[4, 0]]) and np.array_equal(some.rating, data.rating[[4, 0]])


def test_the_digest_follows_what_a_model_can_learn_from_and_nothing_else():
    data = crossed(2, 3)
    touched = data.force_N.copy()
    touched[3, 100] += 1e-12
    assert replace(data, made_from=("elsewhere",)).digest == data.digest
    assert replace(data, force_N=touched).digest != data.digest
    assert replace(data, source=("x", *data.source[1:])).digest != data.digest
    assert data.rows(np.array([1, 0, 2, 3, 4, 5])).digest != data.digest


def test_one_range_scales_all_forces_and_one_all_ratings_to_0_to_100_and_back():
    data = crossed(2, 3)
    scaling = scaling_of(data)
    for up, down, values in (
        (scaling.force_up, scaling.force_down, data.force_N), (scaling.rating_up, scaling.rating_down, data.rating),
    ):  # fmt: skip
        assert (up(values).min(), up(values).max()) == (0, 100)
        assert down(up(values)) == pytest.approx(values, abs=1e-12)


@pytest.mark.parametrize("what", ["force_N", "rating"])
def test_data_that_are_equal_throughout_have_no_scale(what):
    data = crossed(2, 3)
    with pytest.raises(ModelDataError, match="all (forces|ratings) are 3: there is nothing to learn from"):
        scaling_of(replace(data, **{what: np.full_like(getattr(data, what), 3.0)}))


@pytest.mark.parametrize("name", ["actual", "edited_v1", "edited_v2", "edited_v3", "edited_v4"])
def test_a_measured_door_is_what_normalising_its_recording_gives(name):
    with (MEASURED / f"haptune_{name}.csv").open(encoding="utf-8", newline="") as lines:
        rows = [(float(row["angle_deg"]), float(row["force_N"])) for row in csv.DictReader(lines)]
    assert len(rows) == 771
    recorded = normalise(*np.array(rows).T)
    assert measured_doors()[name] == pytest.approx(recorded.force_N, abs=5.1e-5), "files hold four decimals"
    assert recorded.padded_points == 0


def test_the_five_measured_doors_differ_from_one_another():
    doors = measured_doors()
    assert list(doors) == ["actual", "edited_v1", "edited_v2", "edited_v3", "edited_v4"]
    every = np.array(list(doors.values()))
    apart = np.abs(every[:, None] - every).max(axis=2)[~np.eye(5, dtype=bool)]
    assert every.shape == (5, 621) and apart.min() > 1


def test_the_licence_folder_tells_of_every_file_in_it():
    text = (MEASURED / "README.md").read_text(encoding="utf-8")
    for file in MEASURED.rglob("*.csv"):
        assert f"`{file.relative_to(MEASURED)}`" in text, file


def test_reading_folding_and_evaluating_data_import_no_device_no_torch_and_no_plots():
    code = (
        "import sys\n"
        "from palpate.modeling import lab_answers\n"
        "from palpate.modeling.doors import ceiling, folding, measured_door, reading_tables\n"
        "from palpate.modeling.doors import training_variants\n"
        "from palpate.modeling.doors.reading import simulated_data\n"
        f"from pathlib import Path\nsimulated_data(2, study=Path({str(SMALL)!r}))\nmeasured_door.measured_doors()\n"
        "print(sorted({name.split('.')[0] for name in sys.modules} & {'devices', 'torch', 'psychopy', 'sklearn'}))"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"
