"""A data set saved and loaded is the same; a refused or interrupted save leaves nothing behind."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.analysis.ratings.dataset import LARGEST, Crossing, DataRefused, Exclusion, Input, Ratings, Scale
from palpate.analysis.ratings.rating_files import load_ratings, save_ratings
from tests.analysis.ratings_for_tests import add_session, add_study, database, definition, small_ratings, stimuli_of
from tests.examples import examples

FULL = small_ratings(
    [("P1", "Soft", "x", 0.1), ("P2", "Soft", "None", 1e-300)],
    scale=Scale(0, 1, 0.1),
    inputs=(Input("a.csv", "0" * 64, "2 rows"),),
    exclusions=(Exclusion("rows", "P3", "no value", 2),),
    antonyms={"Soft": "Hard"},
    categories={"Soft": "physical"},
    crossings=(Crossing({}, {"level": ("x", "None")}),),
    pooled="level",
    source="somewhere",
    licence="CC0",
)


def test_everything_comes_back(tmp_path: Path) -> None:
    save_ratings(FULL, tmp_path / "imported" / "full")
    again = load_ratings(tmp_path / "imported" / "full")
    pd.testing.assert_frame_equal(again.table, FULL.table, check_exact=True)
    assert {**vars(again), "table": None} == {**vars(FULL), "table": None}


def test_a_study_from_ledgers_comes_back_too(tmp_path: Path) -> None:
    from palpate.analysis.ratings.reading import read_ratings

    engine = database()
    add_study(engine, "d1", definition())
    add_session(engine, "P1", "1", stimuli_of("1"))
    ratings = read_ratings(engine, "doors")
    save_ratings(ratings, tmp_path / "doors")
    pd.testing.assert_frame_equal(load_ratings(tmp_path / "doors").table, ratings.table, check_exact=True)


@given(
    values=st.lists(st.floats(-LARGEST, LARGEST), min_size=1, max_size=5),
    label=st.text(st.characters(exclude_categories=["Cs"]), max_size=8),
)
@settings(max_examples=examples(80), deadline=None)
def test_any_float_and_any_text_come_back_exactly(
    tmp_path_factory: pytest.TempPathFactory, values: list[float], label: str
) -> None:
    ratings = small_ratings([(f"P{i}", "Soft", label, v) for i, v in enumerate(values)])
    folder = tmp_path_factory.mktemp("saved") / "set"
    save_ratings(ratings, folder)
    again = load_ratings(folder).table
    assert [v.hex() for v in again["value"].tolist()] == [v.hex() for v in values]
    assert again["level"].tolist() == [label] * len(values)


def test_an_existing_data_set_is_replaced_only_on_request(tmp_path: Path) -> None:
    folder = tmp_path / "set"
    save_ratings(FULL, folder)
    other = replace(FULL, name="other")
    with pytest.raises(DataRefused, match="exists already"):
        save_ratings(other, folder)
    assert load_ratings(folder).name == "small"
    save_ratings(other, folder, replace=True)
    assert load_ratings(folder).name == "other"
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_a_folder_that_holds_anything_else_is_not_replaced(tmp_path: Path) -> None:
    folder = tmp_path / "set"
    save_ratings(FULL, folder)
    (folder / "notes.txt").write_text("mine")
    with pytest.raises(DataRefused, match=r"holds notes\.txt, which no import wrote"):
        save_ratings(FULL, folder, replace=True)
    assert (folder / "notes.txt").read_text() == "mine" and load_ratings(folder).name == "small"


def test_a_save_that_is_refused_leaves_nothing(tmp_path: Path) -> None:
    table = FULL.table.astype({"level": object})
    table.loc[1, "level"] = None
    with pytest.raises(DataRefused, match="column 'level', row 2: None is not a text"):
        save_ratings(replace(FULL, table=table), tmp_path / "set")
    assert list(tmp_path.iterdir()) == []


def test_a_save_that_dies_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_ratings(FULL, tmp_path / "set")

    def full_disk(_: int) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr("os.fsync", full_disk)
    with pytest.raises(OSError, match="no space left"):
        save_ratings(replace(FULL, name="other"), tmp_path / "set", replace=True)
    assert [path.name for path in tmp_path.iterdir()] == ["set"]
    assert load_ratings(tmp_path / "set").name == "small"


def test_a_table_changed_by_hand_is_refused(tmp_path: Path) -> None:
    save_ratings(FULL, tmp_path / "set")
    path = tmp_path / "set" / "ratings.csv"
    path.write_text(path.read_text().replace("0.1", "0.2"))
    with pytest.raises(DataRefused, match="was changed after the import"):
        load_ratings(tmp_path / "set")
    path.unlink()
    with pytest.raises(DataRefused, match="the table is missing"):
        load_ratings(tmp_path / "set")


@pytest.mark.parametrize(
    ("change", "reason"),
    [({"format": 2}, "format 2, this version reads 1"), ({"within": None}, "not a description of a data set")],
)
def test_a_description_of_another_kind_is_refused(tmp_path: Path, change: dict[str, object], reason: str) -> None:
    save_ratings(FULL, tmp_path / "set")
    path = tmp_path / "set" / "dataset.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(DataRefused, match=reason):
        load_ratings(tmp_path / "set")
    path.write_text("{")
    with pytest.raises(DataRefused, match="not a description of a data set"):
        load_ratings(tmp_path / "set")
    with pytest.raises(DataRefused, match="no imported data set"):
        load_ratings(tmp_path / "elsewhere")


def test_a_data_set_needs_its_columns() -> None:
    with pytest.raises(DataRefused, match="no column 'level'; the columns are participant, attribute, value"):
        Ratings(**{**FULL.__dict__, "table": FULL.table[["participant", "attribute", "value"]]})
    with pytest.raises(DataRefused, match="named twice"):
        Ratings(**{**FULL.__dict__, "between": ("level",)})
    with pytest.raises(DataRefused, match="no attribute 'Warm'"):
        FULL.only("Warm")
    with pytest.raises(DataRefused, match="no factor 'car'; the factors are level"):
        FULL.levels("car")
