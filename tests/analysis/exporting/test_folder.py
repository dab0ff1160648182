"""The folder: whole or not at all, equal bytes for equal data, and nothing of anybody's is ever overwritten."""

from __future__ import annotations

import pytest

from palpate.analysis.exporting.folder import MARK
from palpate.analysis.exporting.tabular import ExportRefused
from palpate.studies.sessions.record import LedgerError
from tests.analysis.exporting.labs import exported, lab_of

STUDY = "door_authoring"


@pytest.fixture
def lab(tmp_path):
    return lab_of(tmp_path / "lab", STUDY)


def bytes_of(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    "fmt", ["bids", "psych-ds", "csv", pytest.param("parquet", marks=pytest.mark.needs("pyarrow"))]
)
def test_two_exports_are_the_same_bytes(lab, tmp_path, fmt):
    exported(lab, STUDY, tmp_path / "one", fmt)
    exported(lab, STUDY, tmp_path / "two", fmt)
    assert bytes_of(tmp_path / "one") == bytes_of(tmp_path / "two")


def test_files_that_no_export_made_stay(lab, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "thesis.tex").write_text("years of work")
    for replace in (False, True):
        with pytest.raises(ExportRefused, match="no export wrote"):
            exported(lab, STUDY, out, "csv", replace=replace)
    assert bytes_of(out) == {"thesis.tex": b"years of work"}


def test_an_export_is_replaced_only_on_request_and_only_if_nothing_was_added(lab, tmp_path):
    out = tmp_path / "out"
    exported(lab, STUDY, out, "csv")
    with pytest.raises(ExportRefused, match="--replace"):
        exported(lab, STUDY, out, "psych-ds")
    (out / "notes.txt").write_text("mine")
    with pytest.raises(ExportRefused, match=r"notes\.txt was added"):
        exported(lab, STUDY, out, "psych-ds", replace=True)
    (out / "notes.txt").unlink()
    exported(lab, STUDY, out, "psych-ds", replace=True)
    assert (out / "data").is_dir() and not (out / "ratings.csv").exists()
    assert {path.name for path in tmp_path.iterdir()} == {"lab", "out"}


def test_an_export_that_fails_leaves_the_one_before_and_nothing_else(lab, tmp_path):
    out = tmp_path / "out"
    exported(lab, STUDY, out, "csv")
    before = bytes_of(out)
    (lab / "sessions" / "door_authoring_P002_s1.sqlite").write_bytes(b"no ledger")
    with pytest.raises(LedgerError):
        exported(lab, STUDY, out, "csv", replace=True)
    assert bytes_of(out) == before and {path.name for path in tmp_path.iterdir()} == {"lab", "out"}


def test_an_empty_folder_is_taken_and_a_file_is_not(lab, tmp_path):
    (tmp_path / "empty").mkdir()
    exported(lab, STUDY, tmp_path / "empty", "csv")
    assert (tmp_path / "empty" / MARK).is_file()
    (tmp_path / "file").write_text("x")
    with pytest.raises(ExportRefused, match="not a folder"):
        exported(lab, STUDY, tmp_path / "file", "csv")
