"""Whether a study gives again what was committed: statistics to 1e-9 of their value, tables to the letter."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.analysis.regenerating.files import OUTCOMES, STATISTICS
from palpate.analysis.regenerating.output_folder import listed
from palpate.analysis.reports.headings import is_p
from palpate.analysis.statistics.refusals import SHOWN
from palpate.protocols.tables import split_line

RELATIVE, ROUNDING = 1e-9, 1e-12
ABSENT = "(absent)"
OWN = ("tables/", "tests/", "figures/")
"""Where the CSV files of a folder lie that does not list its files."""


class NothingCommitted(ValueError):
    """There is nothing to compare with."""


@dataclass(frozen=True)
class Difference:
    """A place in a committed file where the regenerated one says something else."""

    file: str
    where: str
    committed: str
    found: str

    def text(self) -> str:
        """One line: file, place, what was committed, what was found."""
        return f"{self.file}: {self.where}: committed {self.committed}, found {self.found}"


def differences(texts: Mapping[str, str], folder: Path) -> list[Difference]:
    """Every difference between the regenerated texts and the files committed in `folder`.

    statistics.json is compared number by number (relative 1e-9; times and versions are free), test and figure tables
    cell by cell in the same way, the tidy tables exactly. Below 1e-12 a number other than p counts as 0. Pictures,
    documents and the report are made from these; they are only asked to be there, where the folder lists them.
    Raises NothingCommitted where the folder has no statistics.
    """
    if not (folder / STATISTICS).is_file():
        raise NothingCommitted(f"{folder}: no {STATISTICS} to compare with; regenerate once without --check")
    promised = listed(folder)
    there = {path.relative_to(folder).as_posix() for path in folder.rglob("*.csv")}
    committed = {name for name in there if name.startswith(OWN) and (name in promised or not promised)} | {STATISTICS}
    gone = sorted(name for name in promised - set(texts) if not (folder / name).is_file())
    found = [Difference(name, "the file", "listed", "not there") for name in gone]
    found += _lacking(committed, set(texts))
    for name in sorted(committed & set(texts)):
        # Bytes, so that a line ending that was changed on the way is told as such.
        before = (folder / name).read_bytes().decode("utf-8")
        found += _compared(name, before, texts[name])
    return found


def _lacking(committed: set[str], texts: set[str]) -> Iterator[Difference]:
    for name in sorted(committed - texts):
        yield Difference(name, "the file", "present", "no longer made")
    for name in sorted(texts - committed):
        yield Difference(name, "the file", "absent", "made now")


def _compared(name: str, before: str, now: str) -> Iterator[Difference]:
    if before == now:
        return
    if name == STATISTICS:
        try:
            old = json.loads(before)
        except ValueError as error:
            yield Difference(name, "the file", f"no JSON ({error})", "statistics")
            return
        fresh = json.loads(now)
        if isinstance(old, dict) and OUTCOMES not in old:
            fresh.pop(OUTCOMES, None)  # it names what is compared, and is no result
        yield from _values(name, "", _results(old), _results(fresh))
        return
    exact = name.startswith("tables/")
    old_lines, lines = before.splitlines(), now.splitlines()
    if len(old_lines) != len(lines):
        yield Difference(name, "lines", str(len(old_lines)), str(len(lines)))
    names = split_line(lines[0]) if lines else []
    for number, (old_line, line) in enumerate(zip(old_lines, lines, strict=False), start=1):
        if old_line != line and (exact or not _cells_equal(names, old_line, line)):
            yield Difference(name, f"line {number}", repr(old_line)[:120], repr(line)[:120])
    if old_lines == lines:
        yield Difference(name, "line endings", "others", "\\n")


def _results(statistics: Any) -> Any:
    """Statistics without what may differ between two machines: versions, and the time each answer took."""
    if not isinstance(statistics, dict):
        return statistics
    rest = {key: value for key, value in statistics.items() if key != "software"}
    if isinstance(tests := rest.get("tests"), list):
        rest["tests"] = [
            {k: v for k, v in test.items() if k != "seconds"} if isinstance(test, dict) else test for test in tests
        ]
    return rest


def _cells_equal(names: list[str], before: str, now: str) -> bool:
    old, new = split_line(before), split_line(now)
    if not len(old) == len(new) == len(names):
        return False
    cells = zip(names, old, new, strict=True)
    return all(a == b or _near(name, _number(a), _number(b)) for name, a, b in cells)


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _near(name: str, a: float | None, b: float | None) -> bool:
    """Whether the numbers are one, but for rounding; a small p is no rounding."""
    rounding = 0.0 if is_p(name) else ROUNDING
    return a is not None and b is not None and abs(a - b) <= max(RELATIVE * max(abs(a), abs(b)), rounding)


def _values(file: str, where: str, before: Any, now: Any) -> Iterator[Difference]:
    if isinstance(before, dict) and isinstance(now, dict):
        for key in sorted({*before, *now}):
            yield from _values(file, f"{where}.{key}".lstrip("."), before.get(key, ABSENT), now.get(key, ABSENT))
    elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        for place, (old, new) in enumerate(zip(before, now, strict=True)):
            yield from _values(file, f"{where}[{_named(old, place)}]", old, new)
    elif not _same(where.rpartition(".")[2], before, now):
        yield Difference(file, where, _short(before), _short(now))


def _named(entry: Any, place: int) -> str:
    """An entry of a list by its name and outcome, where it has them."""
    if isinstance(entry, dict) and entry.get("name"):
        return " ".join(str(entry[key]) for key in ("name", "outcome") if entry.get(key))
    return str(place)


def _same(name: str, before: Any, now: Any) -> bool:
    numbers = isinstance(before, int | float) and isinstance(now, int | float)
    if numbers and not isinstance(before, bool) and not isinstance(now, bool):
        return before == now or _near(name, float(before), float(now))
    return bool(before == now)


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 80 else f"{text[:77]}..."


def told(differences: list[Difference]) -> list[str]:
    """The first differences as lines, and how many more there are."""
    lines = [difference.text() for difference in differences[: 4 * SHOWN]]
    return lines + [f"... and {len(differences) - len(lines)} more"] * (len(differences) > len(lines))
