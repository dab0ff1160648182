"""Files of the library: whole or not at all."""

import os

import pytest

from palpate.modeling.library.entries import LibraryError
from palpate.modeling.library.writing import demand_folder, write_whole


def test_a_file_is_replaced_whole_and_nothing_else_is_left(tmp_path):
    path = tmp_path / "a.png"
    for content in (b"one", b"another"):
        write_whole(path, content)
        assert path.read_bytes() == content and [each.name for each in tmp_path.iterdir()] == ["a.png"]


def test_what_cannot_be_written_leaves_the_earlier_one(tmp_path, monkeypatch):
    path = tmp_path / "a.png"
    write_whole(path, b"one")

    def full(_handle):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(LibraryError, match="a.png: it cannot be written .no space left on the device.; any"):
        write_whole(path, b"another")
    assert path.read_bytes() == b"one" and [each.name for each in tmp_path.iterdir()] == ["a.png"]


def test_a_folder_that_is_not_there_is_told_and_not_made(tmp_path):
    demand_folder(tmp_path / "a.png")
    with pytest.raises(LibraryError, match="there is no folder .*none; make it first"):
        demand_folder(tmp_path / "none" / "a.png")
    assert not (tmp_path / "none").exists()
