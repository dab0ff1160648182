"""The library as a file: whole or not at all, and refused where it is not what was written."""

import json
import os

import pytest
from pydantic import ValidationError

from palpate.modeling.library.entries import Library, LibraryError
from palpate.modeling.library.files import (
    NewerLibrary,
    demand_folder,
    earlier_in,
    place_of,
    read_library,
    write_library,
    write_whole,
)
from palpate.protocols.canonical import digest
from tests.modeling.library.library_for_tests import entry, rated, small_library


@pytest.fixture
def lab(tmp_path):
    write_library(tmp_path, small_library())
    return tmp_path


def changed(lab, **parts):
    path = place_of(lab)
    content = {**json.loads(path.read_text()), **parts}
    content.pop("digest")
    path.write_text(json.dumps({**content, "digest": digest(content)}))


def test_it_reads_back_from_the_lab_or_the_file_and_is_written_once(lab):
    assert read_library(lab) == small_library() == read_library(place_of(lab))
    before = place_of(lab).stat().st_mtime_ns
    assert write_library(lab, small_library()) == (place_of(lab), False)
    assert place_of(lab).stat().st_mtime_ns == before
    assert write_library(lab, small_library(simulated=True))[1] and read_library(lab).simulated
    assert [path.name for path in place_of(lab).parent.iterdir()] == ["index.json"]


def test_a_missing_library_is_reported_with_how_to_make_it(tmp_path):
    with pytest.raises(LibraryError, match="there is no library of textures yet. `palpate textures index` makes it"):
        read_library(tmp_path)
    assert earlier_in(tmp_path) is None


def test_a_newer_one_is_neither_read_nor_taken_for_none(lab):
    changed(lab, format="palpate-library/2", more="of it")
    for reading in (read_library, earlier_in):
        with pytest.raises(
            NewerLibrary, match="format 'palpate-library/2'; this version reads 'palpate-library/1'. Up"
        ):
            reading(lab)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.99])
def test_one_that_was_cut_short_is_refused(lab, share):
    path = place_of(lab)
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(LibraryError, match="cut short or damaged. `palpate textures index` makes it again"):
        read_library(lab)
    assert earlier_in(lab) is None


@pytest.mark.parametrize(
    ("old", "new"), [("sandpaper", "sandpager"), ("97.0", "79.0"), ('"simulated": false', '"simulated": true')]
)
def test_one_that_was_edited_is_refused(lab, old, new):
    path = place_of(lab)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(LibraryError, match="not what was written"):
        read_library(lab)


@pytest.mark.parametrize("content", [b"[]", b"{}", b"null", b'{"format": 3}', b'{"format": "other/1"}', b"\xff\xfe"])
def test_another_file_is_refused(lab, content):
    place_of(lab).write_bytes(content)
    with pytest.raises(LibraryError):
        read_library(lab)


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"attributes": []}, "attributes"),
        ({"attributes": [["a", "b"]]}, "does not tell 1 attributes"),
        ({"unknown": 1}, "unknown"),
        ({"textures": [{"id": "", "label": "", "category": ""}]}, "textures.0.id"),
    ],
)
def test_one_that_contradicts_itself_is_refused(lab, parts, message):
    changed(lab, **parts)
    with pytest.raises(LibraryError, match=message):
        read_library(lab)


def test_numbers_that_are_none_and_repeated_names_are_refused():
    with pytest.raises(ValidationError):
        rated(float("nan"), 1, 2, 3)
    with pytest.raises(ValidationError, match="appears twice"):
        small_library(entry("T01", rated=rated(1, 2, 3, 4)), entry("T01", rated=rated(1, 2, 3, 4)))
    assert Library.model_validate(small_library().model_dump()) == small_library()


def test_a_file_is_replaced_whole_and_nothing_else_is_left(tmp_path):
    path = tmp_path / "a.png"
    for content in (b"one", b"another"):
        write_whole(path, content)
        assert path.read_bytes() == content and [file.name for file in tmp_path.iterdir()] == ["a.png"]


def test_what_cannot_be_written_leaves_the_earlier_one(tmp_path, monkeypatch):
    path = tmp_path / "a.png"
    write_whole(path, b"one")

    def full(_handle):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(LibraryError, match="a.png: it cannot be written .no space left on the device.; any"):
        write_whole(path, b"another")
    assert path.read_bytes() == b"one" and [file.name for file in tmp_path.iterdir()] == ["a.png"]


def test_a_folder_that_is_not_there_is_reported_and_not_made(tmp_path):
    demand_folder(tmp_path / "a.png")
    with pytest.raises(LibraryError, match="there is no folder .*none; make it first"):
        demand_folder(tmp_path / "none" / "a.png")
    assert not (tmp_path / "none").exists()
