"""The table of surfaces: it names the study's textures, and what is wrong in it is named by file, line and column."""

import csv
import subprocess
import sys

import numpy as np
import pytest

from palpate.devices.surfaces.choice import surface_for
from palpate.devices.surfaces.table import COLUMNS, SHIPPED, SPANS, SurfaceDataError, read_surfaces
from palpate.studies.catalogue import SHIPPED as STUDIES

ROWS = list(csv.reader(SHIPPED.read_text(encoding="utf-8").splitlines()))


def stimuli(group):
    with (STUDIES / "texture_capture" / "stimuli.csv").open(encoding="utf-8") as lines:
        return [row for row in csv.DictReader(lines) if row["set"] == group]


def test_the_fifty_textures_of_the_study_in_sixteen_classes():
    expected = [(row["id"], row["label"], row["class"]) for row in stimuli("perception")]
    assert [(surface.id, surface.label, surface.category) for surface in read_surfaces().values()] == expected
    assert len(expected) == 50 and len({row[2] for row in expected}) == 16


def test_the_physics_follow_what_the_study_says_of_a_texture():
    """Friction and stiffness are what simulated raters go by, so they must be there to be felt."""
    rows, table = stimuli("perception"), read_surfaces()
    for column, parameter, sign in [
        ("sim_slipperiness", "kinetic_friction", -1), ("sim_softness", "stiffness_N_mm", -1),
        ("sim_bumpiness", "bumps_um", 1),
    ]:  # fmt: skip
        order = sorted(rows, key=lambda row: float(row[column]))
        values = [sign * getattr(table[row["id"]], parameter) for row in order]
        assert values == sorted(values)


@pytest.mark.parametrize("column", ["sim_roughness", "sim_slipperiness", "sim_softness"])
def test_bumps_go_with_no_other_property(column):
    """Else a sense that cannot tell bumps would tell them by what goes with them."""
    rows = stimuli("perception")
    bumps, other = (np.array([float(row[name]) for row in rows]) for name in ("sim_bumpiness", column))
    assert abs(np.corrcoef(bumps, other)[0, 1]) < 0.35


def bumps_by_class():
    bumps = {}
    for row in stimuli("perception"):
        bumps.setdefault(row["class"], []).append(float(row["sim_bumpiness"]))
    return {name: sorted(values) for name, values in bumps.items() if len(values) > 1}


def test_flat_and_wavy_samples_stand_in_the_same_class():
    bumps = bumps_by_class()
    both = {name for name, values in bumps.items() if values[0] < 25 and values[-1] > 50}
    assert both == {
        "wood", "hardboard", "cardboard", "paper", "fabric", "denim", "foam", "rubber", "plastic"
    }  # fmt: skip
    assert set(bumps) - both == {"sandpaper", "towel", "carpet", "mesh"}
    assert {name for name, values in bumps.items() if values[-1] - values[0] < 30} == {"mesh"}


def written(tmp_path, line, column, text):
    rows = [list(row) for row in ROWS]
    rows[line - 1][COLUMNS.index(column)] = text
    path = tmp_path / "mine.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(rows)
    return path


@pytest.mark.parametrize("column", SPANS)
@pytest.mark.parametrize("text", ["", "soft", "nan", "inf", "-1", "1e9"])
def test_a_number_out_of_its_range_is_named_by_file_line_and_column(tmp_path, column, text):
    path = written(tmp_path, 7, column, text)
    with pytest.raises(SurfaceDataError, match=rf"mine\.csv, line 7, column '{column}': '{text}' found, a number from"):
        read_surfaces(path)


@pytest.mark.parametrize(
    ("column", "text", "message"),
    [
        ("pattern", "tartan", "line 3.*'tartan' is not known; expected one of none, ribs"),
        ("paint", "blue", "line 3.*'blue' is not known"),
        ("colour", "blue", "line 3.*expected #rrggbb"),
        ("class", "", "line 3, column 'class': empty"),
        ("id", "T01", "line 3, column 'id': 'T01' appears twice"),
        ("static_friction", "0.02", "line 3.*static_friction 0.02 is less than kinetic_friction"),
    ],
)
def test_a_word_that_is_not_known_is_refused(tmp_path, column, text, message):
    with pytest.raises(SurfaceDataError, match=message):
        read_surfaces(written(tmp_path, 3, column, text))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "line 1: column 'id' is missing"),
        (b"\xff\xfe\x00", "not a UTF-8 text file"),
        (",".join(COLUMNS).encode(), "no surface found"),
        (",".join((*COLUMNS, "id")).encode(), "column 'id' appears more than once"),
        (",".join((*COLUMNS, "taste")).encode(), "line 1: found .*taste"),
        ((",".join(COLUMNS) + "\nT01,wood").encode(), f"line 2: 2 values found, {len(COLUMNS)} expected"),
    ],
)
def test_a_file_that_is_no_table_is_refused(tmp_path, content, message):
    path = tmp_path / "mine.csv"
    path.write_bytes(content)
    with pytest.raises(SurfaceDataError, match=message):
        read_surfaces(path)
    with pytest.raises(SurfaceDataError, match="cannot be read"):
        read_surfaces(tmp_path / "none.csv")


def test_every_stimulus_of_the_study_has_a_surface():
    for row in (*stimuli("rendering"), *stimuli("pilot")):
        assert surface_for(row["id"], row).category == row["class"]
    mine = surface_for("mine", {"sim_softness": "100", "sim_slipperiness": "0"})
    assert (mine.kinetic_friction, mine.stiffness_N_mm) == (0.9, pytest.approx(0.398, rel=1e-3))
    with pytest.raises(SurfaceDataError, match="stimulus 'mine': 'soft' in the column 'sim_softness'"):
        surface_for("mine", {"sim_softness": "soft"})


def test_the_table_is_read_without_numpy():
    code = "import sys, palpate.devices.surfaces.choice as c; c.surface_for('T01', {}); print('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout == "False\n"
