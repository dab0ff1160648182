"""What was exported is what was collected: read back, bit for bit, or compared with tables made without Palpate."""

from __future__ import annotations

import pandas as pd
import pytest
from pyarrow import parquet

from palpate.analysis.exporting.reading_back import exported_ratings
from palpate.analysis.exporting.tabular import ExportRefused
from palpate.analysis.ratings.reading import read_ratings
from palpate.studies.collecting.collect import collect, open_database
from tests.analysis.exporting.labs import RECORDED, exported, lab_of, read_rows

pytestmark = pytest.mark.needs("pyarrow")

RATED = ("doors_small", "door_ratings", "texture_similarity", "door_matching", "door_authoring")


def collected(lab, study):
    engine = open_database("sqlite://")
    try:
        list(collect(sorted((lab / "sessions").glob("*.sqlite")), engine))
        return read_ratings(engine, study).table
    finally:
        engine.dispose()


@pytest.mark.parametrize("fmt", ["bids", "csv"])
@pytest.mark.parametrize("study", RATED)
def test_ratings_read_back_are_the_same_table(study, fmt, tmp_path):
    """Twelve people; an answer that was revised; floats; a trial that was repeated; practice trials."""
    lab = lab_of(tmp_path / "lab", study)
    exported(lab, study, tmp_path / "out", fmt)
    pd.testing.assert_frame_equal(exported_ratings(tmp_path / "out"), collected(lab, study), check_exact=True)


def test_only_an_export_with_ratings_is_read_back(tmp_path):
    lab = lab_of(tmp_path / "lab", "door_lexicon")
    exported(lab, "door_lexicon", tmp_path / "words", "csv")
    exported(lab, "door_lexicon", tmp_path / "psych", "psych-ds")
    for folder, why in (("words", "holds no rating"), ("psych", "psych-ds; one to bids or csv"), ("lab", "no export")):
        with pytest.raises(ExportRefused, match=why):
            exported_ratings(tmp_path / folder)


TABLES = {
    "words": ("word", "kind", "counts"), "responses": ("attribute", "value", "revised", "counts"),
    "switches": ("side", "at_s"),
}  # fmt: skip


@pytest.mark.parametrize(("study", "table"), [
    ("texture_adjectives", "words"), ("door_lexicon", "words"), ("texture_similarity", "switches"),
    ("texture_ratings", "responses"), ("door_authoring", "responses"),
])  # fmt: skip
def test_csv_holds_what_plain_sqlite_finds_in_the_ledger(study, table, tmp_path):
    """tests/recorded/expected/ten was made by Python's sqlite3 and json alone (tests/recorded/make_ten.py)."""
    exported(lab_of(tmp_path / "lab", study), study, tmp_path / "out", "csv")
    ours = read_rows(tmp_path / f"out/{'ratings' if table == 'responses' else table}.csv")
    expected = [
        row for row in read_rows(RECORDED / f"expected/ten/{table}.csv") if row["session"].startswith(f"{study}/")
    ]
    assert ours and sorted(plain(row, table) for row in ours) == sorted(plain(row, table) for row in expected)


def plain(row, table):
    """The cells that both have: truths as true and false, numbers in their shortest form."""
    truths = {"1": "true", "0": "false", "True": "true", "False": "false"}
    cells = {name: row[name] for name in ("trial", *TABLES[table])}
    for name in cells.keys() & {"revised", "counts"}:
        cells[name] = truths.get(cells[name], cells[name])
    for name in cells.keys() & {"trial", "value", "at_s"}:
        cells[name] = repr(float(cells[name] or "nan"))
    return list(cells.values())


def test_parquet_holds_what_csv_holds_and_says_what_columns_mean(tmp_path):
    lab = lab_of(tmp_path / "lab", "door_ratings")
    exported(lab, "door_ratings", tmp_path / "csv", "csv")
    exported(lab, "door_ratings", tmp_path / "parquet", "parquet")
    for path in sorted((tmp_path / "parquet").glob("*.parquet")):
        table = parquet.read_table(path)
        ours = pd.read_csv(tmp_path / "csv" / f"{path.stem}.csv", dtype=str, keep_default_na=False)
        for name in table.column_names:
            values = [cell(value) for value in table.column(name).to_pylist()]
            assert values == ours[name].tolist(), (path.stem, name)
    about = parquet.read_schema(tmp_path / "parquet/ratings.parquet").field("value").metadata
    assert about[b"description"].startswith(b"The rating: -10 where")


def cell(value):
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    return str(int(value)) if isinstance(value, float) and value.is_integer() else str(value)


def test_without_pyarrow_parquet_says_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyarrow.parquet", None)
    with pytest.raises(ExportRefused, match=r'pip install "palpate\[export\]"'):
        exported(lab_of(tmp_path / "lab", "door_lexicon"), "door_lexicon", tmp_path / "out", "parquet")
    assert not (tmp_path / "out").exists()
