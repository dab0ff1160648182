"""What a quick evaluation and a quick training print and write: words and headings exactly, numbers to 2 %.

Held to the letter: the names of files, columns, rows and methods, the keys of JSON, and the report without its numbers.
Numbers of tables may differ by what another processor's last bits can do, never by more. A network's few epochs, and
the segments of an autoregression, make of such bits numbers that differ by a third: in their rows, only the words are
held.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.snapshots.texts import call, compare, read_page, run, without_numbers, without_what_varies

pytestmark = [pytest.mark.long, pytest.mark.needs("torch", "librosa", "pywt", "skimage", "compiler")]
DOORS = "mean,ridge,forest,pca_ridge,gaussian_process,forward:mlp,nearest,pca_regression,generator"
SCENES = {
    "doors": [
        f"evaluate doors --simulated --quick --methods {DOORS} --workers 1 --lab LAB",
        f"evaluate doors --simulated --quick --methods {DOORS} --workers 1 --lab LAB --json",
        "train doors --simulated --quick --forward ridge --inverse nearest --workers 1 --lab LAB",
        "train doors --simulated --quick --forward nonsense --workers 1 --lab LAB",
        "evaluate doors --lab LAB",
        "evaluate doors --data nothing.csv --lab LAB",
        "evaluate doors --simulated --quick --methods nonsense --lab LAB",
    ],
    "textures": [
        "evaluate textures --simulated --quick --methods ar,dstn --textures cloth --workers 1 --lab LAB",
        "evaluate textures --simulated --quick --methods ar,dstn --textures cloth --workers 1 --lab LAB --json",
        "train textures --simulated --quick --methods ar --textures cloth --workers 1 --lab LAB",
        "train textures --simulated --quick --methods nonsense --workers 1 --lab LAB",
        "evaluate textures --simulated --quick --methods ar --textures velvet --lab LAB",
        "evaluate textures --lab LAB",
        "evaluate textures --tables nothing --lab LAB",
    ],
    "attributes": [
        "evaluate attributes --quick --methods ridge --workers 1 --no-figures --lab LAB",
        "evaluate attributes --quick --methods ridge --workers 1 --no-figures --json --lab LAB",
        "train attributes --quick --method ridge --workers 1 --lab LAB",
        "train attributes --quick --method nonsense --workers 1 --lab LAB",
        "evaluate attributes --quick --methods nonsense --lab LAB",
        "evaluate attributes --lab NOWHERE",
        "evaluate attributes --folder nothing --lab LAB",
    ],
}
"""Commands by the text that keeps what they print and write."""
TOLERANCE = 0.02
MEASURED = re.compile(r"(^|_)(s|ms|us|bytes|MB|runtime|error|difference|seconds)$")
"""Columns that say how long something took, or on what."""
SENSITIVE = {"mlp", "network", "generator", "ar", "dstn"}
"""Methods whose numbers another processor's last bits change by more than the tolerance."""


@pytest.mark.parametrize("name", SCENES)
def test_outputs_of_evaluations_are_unchanged(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    if name == "attributes":
        simulate = "textures simulate --textures T01,T15,T33 --seconds 6 --pictures 1 --raters 1 --lab LAB"
        call(simulate, capsys)
    else:
        call("init LAB", capsys)
    printed = re.sub(r"(?m)^\{.*\}$", as_outline, run(SCENES[name], tmp_path, capsys))
    printed = without_numbers(printed)
    places = [path for kind in ("evaluated", "models") for path in (tmp_path / "LAB" / kind).rglob("*.*")]
    files = [path for path in sorted(places) if path.is_file() and not hidden(path.relative_to(tmp_path))]
    described_files = "\n".join(line for path in files for line in described(path, tmp_path))
    compare(f"evaluations/{name}", f"{printed}\n{without_what_varies(described_files, tmp_path)}\n", TOLERANCE)


def as_outline(answer: re.Match[str]) -> str:
    """Return what a command answered as JSON, as an outline."""
    return json.dumps(outline(json.loads(answer[0].replace(":TIME", ":0"))), indent=1, ensure_ascii=False)


def hidden(path: Path) -> bool:
    """Return whether it is a cached result."""
    return any(part.startswith(".") for part in path.parts)


def described(path: Path, folder: Path) -> Iterator[str]:
    """Yield a file's name, and what of its content the next version must write, too."""
    yield f"@ {path.relative_to(folder).as_posix()}"
    if path.suffix == ".html":
        yield without_numbers(read_page(path.read_text(encoding="utf-8"), 3))
    elif path.suffix == ".json":
        yield json.dumps(outline(json.loads(path.read_text(encoding="utf-8"))), indent=1, ensure_ascii=False)
    elif path.suffix == ".csv":
        yield from table_lines(path)
    elif path.suffix == ".safetensors":
        yield from tensor_lines(path)


def outline(value: Any, key: str = "") -> Any:
    """Return JSON data with # for each number, and one item for all items of a list that look alike."""
    if key in ("software", "versions", "machine"):
        return "VERSION"
    if isinstance(value, dict):
        return {key: outline(item, key) for key, item in value.items()}
    if isinstance(value, list):
        items = [outline(item) for item in value]
        return [item for number, item in enumerate(items) if item not in items[:number]]
    if isinstance(value, str):
        return without_numbers(value)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return "#" if is_number and key not in ("jobs", "jobs_kept", "seed") else value


def table_lines(path: Path) -> Iterator[str]:
    """Yield a table's headings and first thirty rows, numbers to five digits, what was measured as TIME."""
    with path.open(newline="", encoding="utf-8") as file:
        headings, *rows = list(csv.reader(file))
    yield " | ".join(headings)
    for row in rows[:30]:
        sensitive = not SENSITIVE.isdisjoint(row)
        yield " | ".join(cell_text(heading, cell, sensitive) for heading, cell in zip(headings, row, strict=True))
    yield f"({len(rows)} rows)"


def cell_text(heading: str, cell: str, sensitive: bool) -> str:
    """Return a number with five digits, or # where it is sensitive to the last bits; another cell as it is."""
    if cell and MEASURED.search(heading):
        return "TIME"
    if sensitive and heading == "beyond":  # which limits it did not keep
        return "#"
    try:
        number = f"{float(cell):.5g}"
    except ValueError:
        return cell
    return "#" if sensitive or heading in ("recovered", "felt") else number  # a generator's doors


def tensor_lines(path: Path) -> Iterator[str]:
    """Yield the names, types and shapes in a file of safetensors."""
    content = path.read_bytes()
    header = json.loads(content[8 : 8 + int.from_bytes(content[:8], "little")])
    for name, about in sorted(header.items()):
        shape = "[#, 3]" if name == "triangles" else about.get("shape", "")  # as many as the segments need
        yield f"{name}: {about.get('dtype', '')} {shape}"
