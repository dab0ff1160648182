"""What a reader finds in reports and beside them: the text of each page, the files, the headings of their tables.

The numbers of shipped plans are held to 1e-9 by tests/test_recorded_many.py; here are the words around them.
"""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path

import pytest

from tests.recorded.make_many import MANY, PEOPLE
from tests.snapshots.texts import PLANS, compare, make_lab, read_page, run, without_what_varies

SCENES = {
    "foreign": [
        "import PLANS/towels.yaml --lab LAB",
        "regenerate towels --plan PLANS/towels_plan.yaml --lab LAB",
        "report towels --lab LAB",
        "analyse towels --lab LAB --no-figures",
        "report sponges --lab LAB --json",
    ],
    "korean": [
        "import PLANS/korean.yaml --lab LAB",
        "regenerate towels_ko --plan PLANS/korean_plan.yaml --lab LAB",
        "report towels_ko --lab LAB",
    ],
    "doors": [
        "init NEW",
        "run door_ratings --participant P001..P006 --simulate --seed 1 --lab NEW",
        "regenerate door_ratings --plan PLANS/doors_plan.yaml --lab NEW --no-crosscheck",
    ],
}
"""Commands by the text that keeps the reports they write."""
LONG_SCENES = {
    "frozen": [
        "report texture_ratings --lab LAB",
        "regenerate texture_ratings --lab LAB",
        "report door_ratings --lab LAB",
    ],
    "crossed": [
        "init NEW",
        "run door_ratings --participant P001..P006 --simulate --seed 1 --lab NEW",
        "report door_ratings --lab NEW",
        "analyse door_ratings --lab NEW --json",
    ],
    **{f"shipped_{name}": [f"regenerate {name} --lab MANY"] for name in PEOPLE},
}
"""The same, for the full run: the shipped plans on the recorded sessions."""


FIRST_ROWS = 3
"""How many rows of each table are stored of a long scene: its numbers are compared elsewhere."""


def written(folder: Path, most_rows: int) -> str:
    """Return the files' names: of pages with the text, of tables with headings, of recorded data with the digest."""
    parts = []
    for path in sorted(path for kind in ("analysis", "regenerated") for path in folder.glob(f"*/{kind}/*/**/*.*")):
        if path.name == "seconds.json":
            continue
        parts.append(f"@ {path.relative_to(folder).as_posix()}{described(path)}")
        if path.suffix == ".html":
            parts.append(read_page(path.read_text(encoding="utf-8"), most_rows))
    return "\n".join(parts)


def described(path: Path) -> str:
    """Return what a line about a file adds to its name."""
    if path.suffix != ".csv":
        return ""
    text = path.read_text(encoding="utf-8")
    headings, *rows = text.splitlines()
    digest = (
        f", sha256 {hashlib.sha256(text.encode()).hexdigest()}"
        if path.parent.name == "tables" and "LAB" in path.parts
        else ""
    )
    return f": {len(rows)} rows, {headings}{digest}"


@pytest.mark.parametrize(
    ("name", "commands"),
    [*SCENES.items(), *(pytest.param(*scene, marks=pytest.mark.long) for scene in LONG_SCENES.items())],
)
def test_reports_are_unchanged(name, commands, tmp_path, monkeypatch, capsys, rebuilt):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(PLANS, tmp_path / "PLANS")
    make_lab(tmp_path)
    shutil.rmtree(tmp_path / "LAB" / "regenerated")
    if commands[0] != "init NEW":
        shutil.copy(rebuilt, tmp_path / "LAB")
    if "MANY" in commands[0]:
        shutil.copytree(MANY / "sessions", tmp_path / "MANY" / "sessions")
    most_rows = FIRST_ROWS if name in LONG_SCENES else 1000
    printed = run(commands, tmp_path, capsys)
    compare(f"reports/{name}", f"{printed}\n{without_what_varies(written(tmp_path, most_rows), tmp_path)}\n")
