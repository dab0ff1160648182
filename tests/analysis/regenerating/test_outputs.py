"""Outputs take their places whole, and nothing that was not made here is touched."""

import json
from pathlib import Path

import pytest

from palpate.analysis.regenerating.outputs import MARK, PlaceRefused, listed, written_whole


def write(folder, **files):
    with written_whole(folder) as (draft, names):
        for name, text in files.items():
            path = draft / name.replace("__", "/")
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
    return names


def contents(folder):
    return {path.relative_to(folder).as_posix(): path.read_text() for path in folder.rglob("*") if path.is_file()}


def test_what_is_no_longer_made_goes_and_what_others_made_stays(tmp_path):
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "mine").write_text("drawn by hand")
    write(tmp_path, page="1", figures__a="1", tests__t="1")
    write(tmp_path, page="2")
    assert listed(tmp_path) == {"page"}
    assert {n: t for n, t in contents(tmp_path).items() if n != MARK} == {"page": "2", "figures/mine": "drawn by hand"}
    assert not (tmp_path / "tests").exists()


def test_anothers_file_in_the_way_is_refused_and_nothing_is_written(tmp_path):
    (tmp_path / "page").write_text("a thesis")
    with pytest.raises(PlaceRefused, match="page exists and was not written by regenerate"):
        write(tmp_path, a="1", page="1")
    assert contents(tmp_path) == {"page": "a thesis"}


@pytest.mark.parametrize("stopped", [KeyboardInterrupt, RuntimeError])
def test_a_run_that_is_stopped_leaves_what_was_there(tmp_path, stopped):
    write(tmp_path, page="1", old="1")
    before = contents(tmp_path)

    def stop(name):
        with written_whole(tmp_path) as (draft, _):
            (draft / name).write_text("half")
            raise stopped

    with pytest.raises(stopped):
        stop("page")
    assert contents(tmp_path) == before
    assert [path.name for path in tmp_path.iterdir() if path.is_dir()] == []


def test_a_list_that_leads_out_of_the_folder_removes_nothing_there(tmp_path):
    folder, outside = tmp_path / "in", tmp_path / "letter"
    folder.mkdir()
    outside.write_text("dear")
    (folder / MARK).write_text(json.dumps({"files": ["../letter", str(outside), "", "page"]}))
    write(folder, other="1")
    assert outside.read_text() == "dear"
    assert set(contents(folder)) == {MARK, "other"}


@pytest.mark.parametrize("text", ["{", "[]", '{"files": 3}', "{}"])
def test_a_damaged_list_lists_nothing(tmp_path, text):
    (Path(tmp_path) / MARK).write_text(text)
    assert listed(tmp_path) == frozenset()
