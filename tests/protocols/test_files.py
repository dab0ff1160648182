"""The writer of files: whole or not at all, with the file's name in every error."""

import errno
import stat
from pathlib import Path

import pytest

from palpate.protocols.files import UNFINISHED, open_text, staged_files, staged_folder, write_bytes, write_text

pytestmark = pytest.mark.needs("linux")


def contents(folder):
    return {path.relative_to(folder).as_posix(): path.read_text() for path in folder.rglob("*") if path.is_file()}


def test_a_file_that_is_replaced_keeps_its_mode_and_a_link_keeps_pointing(tmp_path):
    real, link = write_text(tmp_path / "deep" / "real.txt", "old"), tmp_path / "link.txt"
    real.chmod(0o640)
    link.symlink_to(real)
    write_text(link, "new")
    assert link.is_symlink() and real.read_text() == "new" and stat.S_IMODE(real.stat().st_mode) == 0o640


def test_a_device_is_written_directly_and_its_error_names_it():
    with pytest.raises(OSError, match="'/dev/full'") as full:
        write_bytes(Path("/dev/full"), b"x")
    assert full.value.errno == errno.ENOSPC


@pytest.mark.parametrize("stop", [KeyboardInterrupt, ValueError("a fault")])
def test_what_stops_the_writing_leaves_the_earlier_file_and_nothing_else(tmp_path, stop):
    write_text(tmp_path / "a.txt", "old")
    with pytest.raises((KeyboardInterrupt, ValueError)), open_text(tmp_path / "a.txt") as file:
        file.write("new")
        file.flush()
        raise stop
    with pytest.raises((KeyboardInterrupt, ValueError)), open_text(tmp_path / "made" / "here" / "b.txt") as file:
        raise stop
    assert contents(tmp_path) == {"a.txt": "old"} and len(list(tmp_path.iterdir())) == 1


def test_a_check_that_refuses_the_unfinished_file_leaves_the_earlier_one(tmp_path):
    def refuse(draft):
        assert draft.read_text() == "new" and draft.name.startswith(UNFINISHED)
        raise ValueError("refused")

    write_text(tmp_path / "a.txt", "old")
    with pytest.raises(ValueError, match="refused"):
        write_bytes(tmp_path / "a.txt", b"new", refuse)
    assert contents(tmp_path) == {"a.txt": "old"}


def test_files_that_belong_together_are_all_placed_or_none_is(tmp_path):
    for name in ("a.txt", "gone.txt"):
        write_text(tmp_path / name, "old")
    (tmp_path / "z.txt").mkdir()
    with pytest.raises(OSError, match="z.txt") as refused, staged_files(tmp_path, obsolete=["gone.txt"]) as draft:
        for name in ("a.txt", "new/b.txt", "z.txt"):
            write_text(draft / name, "new")
    assert refused.value.__notes__ == [f"{tmp_path} was left as it was"]
    assert contents(tmp_path) == {"a.txt": "old", "gone.txt": "old"} and not (tmp_path / "new").exists()
    (tmp_path / "z.txt").rmdir()
    with staged_files(tmp_path, obsolete=["gone.txt"]) as draft:
        for name in ("a.txt", "new/b.txt", "z.txt"):
            write_text(draft / name, "new")
    assert contents(tmp_path) == {"a.txt": "new", "new/b.txt": "new", "z.txt": "new"}


def test_a_folder_is_replaced_as_a_whole(tmp_path):
    folder = tmp_path / "data"
    for text in ("old", "new"):
        with staged_folder(folder) as draft:
            write_text(draft / f"{text}.txt", text)
    assert contents(folder) == {"new.txt": "new"}
    with pytest.raises(KeyboardInterrupt), staged_folder(folder) as draft:
        write_text(draft / "half.txt", "half")
        raise KeyboardInterrupt
    assert contents(tmp_path) == {"data/new.txt": "new"}
