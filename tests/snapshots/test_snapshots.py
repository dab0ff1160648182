"""The help of every command, and what sixty commands print, against texts that are kept beside this file.

To write the texts anew: RENEW_SNAPSHOTS=1 .venv/bin/python -m pytest tests/snapshots. A commit that changes a text
changes nothing else, and its difference is read line by line.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from palpate import command_line

HERE = Path(__file__).parent
FROZEN = HERE.parent / "recorded" / "frozen"
RENEW = bool(os.environ.get("RENEW_SNAPSHOTS"))
WIDTH = 100
RUNS = {
    "studies": ["studies", "studies --json", "check door_ratings", "check nonsense", "check door_ratings --json"],
    "plan": [
        "plan door_ratings --participant P001",
        "plan texture_ratings --participant P007 --json",
        "plan nonsense",
        "plan door_ratings --row 999",
        "plan texture_similarity --session 3",
    ],
    "run": [
        "init NEW",
        "run door_ratings --participant P001..P002 --simulate --seed 1 --lab NEW",
        "run nonsense --lab NEW",
        "run door_ratings --participant P001 --simulate --lab NEW",
        "run door_ratings --lab NEW",
        "run door_ratings --participant P001 --simulate --lab NOWHERE",
        "run door_ratings --participant P09 --lab LAB",
    ],
    "resume": [
        "resume LAB/sessions/texture_ratings_P002_s1.sqlite",
        "resume LAB/sessions/nothing.sqlite",
        "resume LAB/sessions/door_capture_P002_s1.sqlite --json",
        "resume LAB/sessions/texture_ratings_P001_s1.sqlite",
        "resume LAB/README.md",
    ],
    "replay": [
        "replay LAB/sessions/door_ratings_P001_s1.sqlite",
        "replay --lab LAB --workers 1 --json",
        "replay LAB/README.md",
    ],
    "collect": [
        "collect --lab LAB",
        "collect --rebuild --lab LAB",
        "collect --lab LAB",
        "collect --lab LAB --json",
        "collect --lab LAB --to sqlite:///LAB/participants/registry.sqlite",
        "collect --lab LAB --to nonsense://x",
    ],
    "participants": [
        "participants list --lab LAB",
        "participants balance texture_ratings --lab LAB",
        "participants add --lab LAB",
        "participants add --pseudonym P0001 --lab LAB",
        "participants overlap texture_ratings --lab LAB",
    ],
    "rig": ["rig simulate --lab LAB", "rig kinds"],
    "streams": [
        "streams LAB/sessions/texture_capture_P001_s1.sqlite",
        "streams show LAB/sessions/door_ratings_P001_s1.sqlite",
        "streams --help",
    ],
    "models": [
        "models list --lab LAB",
        "models list --json",
        "models card door-perception --lab LAB",
        "models card nonsense",
        "models compare door-perception door-force --lab LAB",
    ],
    "predict": [
        "predict LAB/README.md",
        "predict --wish Nonsense=3",
        "predict profile.csv",
        "predict profile.csv --json",
    ],
    "import": [
        "import imported/sponges.yaml --lab LAB",
        "import nothing.yaml --lab LAB",
        "import profile.csv --lab LAB",
    ],
    "analyse": ["analyse sponges --lab LAB", "analyse nonsense --lab LAB", "analyse texture_ratings --lab LAB"],
    "regenerate": [
        "regenerate sponges --lab LAB --no-figures",
        "regenerate sponges --lab LAB --check",
        "regenerate nonsense --lab LAB",
        "regenerate texture_ratings --lab LAB --check-plan",
    ],
    "export": ["export texture_ratings --lab LAB --to shared --csv", "export texture_ratings --lab LAB --to shared"],
    "textures": ["textures find rough --lab LAB", "textures show cloth --lab LAB", "textures nearest cloth --lab LAB"],
    "mistakes": ["nonsense", "stuides", "run --nonsense", "doors nonsense"],
}
"""Commands by the text that keeps what they print; LAB is a copy of the frozen lab, of each text its own."""


@pytest.fixture(autouse=True)
def plain_terminal(monkeypatch):
    for name, value in {"COLUMNS": str(WIDTH), "NO_COLOR": "1", "TERM": "dumb", "LINES": "50"}.items():
        monkeypatch.setenv(name, value)


def compare(name: str, text: str) -> None:
    """Compare a text with the one that is kept, or keep it."""
    file = HERE / "expected" / f"{name}.txt"
    if RENEW:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    assert file.is_file(), f"no snapshot {file.name}: RENEW_SNAPSHOTS=1"
    assert text == file.read_text(encoding="utf-8")


PRINT_HELP = """
import json, sys, palpate
from tests.faults.commands import commands
import click
pages = {}
for name, command in commands().items():
    with click.Context(command, info_name=f"palpate {name}", terminal_width=int(sys.argv[1])) as context:
        context.help_option_names = ["-h", "--help"]
        pages[name] = command.get_help(context)
json.dump(pages, sys.stdout)
"""
"""In a process of its own: click keeps the first help option that a command was asked for."""


@pytest.fixture(scope="module")
def help_pages():
    done = subprocess.run(
        [sys.executable, "-c", PRINT_HELP, str(WIDTH)], capture_output=True, check=True, cwd=HERE.parents[1]
    )
    return json.loads(done.stdout)


@pytest.mark.parametrize("verb", command_line.VERBS)
def test_the_help_of_every_command_says_what_it_said(verb, help_pages):
    pages = [page for name, page in help_pages.items() if name.split()[0] == verb]
    compare(f"help/{verb}", "\n\n\n".join(pages) + "\n")


@pytest.mark.parametrize("name", RUNS)
def test_commands_print_what_they_printed(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(FROZEN, tmp_path, dirs_exist_ok=True, ignore=shutil.ignore_patterns("README.md", "expected.json"))
    (tmp_path / "lab").rename("LAB")
    if name not in {"collect", "replay", "resume", "run"}:
        command_line._status(["collect", "--rebuild", "--lab", "LAB"])
        capsys.readouterr()
    said = []
    for line in RUNS[name]:
        status = command_line._status(shlex.split(line))
        out, err = capsys.readouterr()
        said += [
            f"$ palpate {line}",
            out.rstrip("\n"),
            *([f"-- {err.rstrip()}"] if err.strip() else []),
            f"= {status}\n",
        ]
    compare(f"commands/{name}", without_what_varies("\n".join(said), tmp_path))


def without_what_varies(text: str, folder: Path) -> str:
    """Leave out what differs between two runs or machines: folders, durations, versions, the host's name, dates."""
    text = text.replace(str(folder), "FOLDER").replace(str(HERE.parents[1]), "CHECKOUT")
    text = re.sub(r"\bdigest [0-9a-f]{16}\b", "digest DIGEST", text)  # of a ledger, which names package versions
    text = re.sub(r"in [\d.,]+ (s|ms|min)\b", "in TIME", text)
    text = re.sub(r"\([\d,]+ times as fast\)", "(N times as fast)", text)
    text = re.sub(r'"(seconds|rate|took_s|times_as_fast)":\s?[\d.e+-]+', r'"\1":TIME', text)
    text = re.sub(r"\b\d{4}-\d\d-\d\d(T[\d:.]+(Z|[+-]\d\d:\d\d)?)?\b", "DATE", text)
    text = re.sub(r"stations/[\w.-]+/", "stations/HOST/", text)
    return re.sub(r"(pingouin|statsmodels|SciPy|NumPy|pandas) \d+\.\d[\w.]*", r"\1 VERSION", text)
