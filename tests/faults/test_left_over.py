"""What a killed writer left unfinished is no part of any answer, wherever it lies."""

import re
import shutil

import pytest

from palpate import command_line
from palpate.protocols.files import UNFINISHED
from tests.faults.commands import make_lab

READING = (
    "participants list --lab lab", "participants balance doors_small --lab lab", "studies --lab lab",
    "replay --lab lab", "collect --lab lab --to sqlite:///again.db", "models list --lab lab",
    "monitor --json --lab lab", "import sponges.yaml sponges.csv --lab lab --replace", "analyse nothing --lab lab",
    "doors augment doors --out made", "streams list lab/sessions/doors_small_P001_s1.sqlite",
    "export doors_small --csv --to shared --lab lab", "regenerate doors_small --no-figures --lab lab",
    "regenerate doors_small --check --lab lab", "init lab",
)  # fmt: skip


@pytest.fixture
def labs(tmp_path, monkeypatch):
    """Two equal working directories; every folder of the second also holds an unfinished file and folder."""
    clean, littered = tmp_path / "a", tmp_path / "b"
    clean.mkdir()
    make_lab(clean)
    (clean / "doors").mkdir()
    shutil.copy(clean / "profile.csv", clean / "doors" / "BC3_g0.csv")
    monkeypatch.chdir(clean)
    shutil.copytree(clean, littered)
    for folder in [littered, *(path for path in littered.rglob("*") if path.is_dir())]:
        (folder / f"{UNFINISHED}0a1b2c").write_bytes(b"half a fi")
        draft = folder / f"{UNFINISHED}3d4e5f"
        draft.mkdir()
        for path in [path for path in folder.iterdir() if path.is_file()]:
            (draft / path.name).write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    return clean, littered


@pytest.mark.long
def test_what_a_killed_writer_left_changes_no_answer(labs, monkeypatch, capsys):
    """But for times, and the folder's own name."""
    answers = []
    for folder in labs:
        monkeypatch.chdir(folder)
        answers.append([])
        for line in READING:
            capsys.readouterr()
            code = command_line._status(line.split())
            text = re.sub(r"\d+\.\d+|[\d,]+ times as fast", "", "".join(capsys.readouterr()).replace(str(folder), ""))
            answers[-1].append((line, code, text))
    for before, after in zip(*answers, strict=True):
        assert before == after
