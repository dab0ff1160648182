"""Comparisons of a regenerated study: with the files of an earlier run, and with exact arithmetic.

Statistics may differ by 1e-9 of their value from the committed ones, tables not at all. Every analysis of variance can
be computed again in exact fractions.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.analysis.plans.answers import QuestionResult
from palpate.analysis.plans.idle import effective
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.regenerating.outputs import OUTCOMES, STATISTICS, listed
from palpate.analysis.reports.tables import is_p
from palpate.analysis.statistics.exact import self_check
from palpate.analysis.statistics.refusals import SHOWN
from palpate.protocols.tables import split_line
from palpate.protocols.undefined import nan_to_none

RELATIVE, ROUNDING = 1e-9, 1e-12
EXACT_RELATIVE = 1e-12
ABSENT = "(absent)"
OWN = ("tables/", "tests/", "figures/")
"""The places of CSV files in a folder that does not list its files."""


class NothingCommitted(ValueError):
    """There is nothing to compare with."""


@dataclass(frozen=True)
class Difference:
    """A difference between a committed file and the regenerated one."""

    file: str
    where: str
    committed: str
    found: str

    def text(self) -> str:
        """Return one line: file, place, committed value, regenerated value."""
        return f"{self.file}: {self.where}: committed {self.committed}, found {self.found}"


def differences(texts: Mapping[str, str], folder: Path) -> list[Difference]:
    """Return every difference between the regenerated texts and the files committed in `folder`.

    statistics.json is compared number by number (relative 1e-9; times and versions are free), test and figure tables
    cell by cell in the same way, the tidy tables exactly. Below 1e-12 a number other than p counts as 0. Pictures,
    documents and the report follow from these, and only need to exist if the folder lists them. Raises NothingCommitted
    if the folder has no statistics.
    """
    if not (folder / STATISTICS).is_file():
        raise NothingCommitted(f"{folder}: no {STATISTICS} to compare with; regenerate once without --check")
    promised = listed(folder)
    there = {path.relative_to(folder).as_posix() for path in folder.rglob("*.csv")}
    committed = {name for name in there if name.startswith(OWN) and (name in promised or not promised)} | {STATISTICS}
    gone = sorted(name for name in promised - set(texts) if not (folder / name).is_file())
    differing = [Difference(name, "the file", "listed", "not there") for name in gone]
    differing += [
        Difference(name, "the file", "present", "no longer written") for name in sorted(committed - set(texts))
    ]
    differing += [Difference(name, "the file", "absent", "made now") for name in sorted(set(texts) - committed)]
    for name in sorted(committed & set(texts)):
        # Bytes, so that a line ending that was changed on the way is seen as such.
        before = (folder / name).read_bytes().decode("utf-8")
        if before != texts[name]:
            compare = _compare_statistics if name == STATISTICS else _compare_tables
            differing += compare(name, before, texts[name])
    return differing


def _compare_statistics(name: str, before: str, now: str) -> Iterator[Difference]:
    try:
        old = json.loads(before)
    except ValueError as error:
        yield Difference(name, "the file", f"no JSON ({error})", "statistics")
        return
    new = json.loads(now)
    if isinstance(old, dict) and OUTCOMES not in old:
        new.pop(OUTCOMES, None)  # it names what is compared, and is no result
    yield from _compare_values(name, "", _results(old), _results(new))


def _compare_tables(name: str, before: str, now: str) -> Iterator[Difference]:
    """Yield the lines that differ: in any character of a tidy table, in any number of others beyond the tolerance."""
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
    """Return statistics without the parts that may differ between machines: versions, and times of answers."""
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
    try:
        pairs = zip(names, old, new, strict=True)
        return all(a == b or _near(name, float(a), float(b)) for name, a, b in pairs)
    except ValueError:
        return False


def _near(name: str, a: float, b: float) -> bool:
    """Return whether the numbers are equal up to rounding; a small p is not rounding."""
    return abs(a - b) <= max(RELATIVE * max(abs(a), abs(b)), 0.0 if is_p(name) else ROUNDING)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _compare_values(file: str, where: str, before: Any, now: Any) -> Iterator[Difference]:
    """Yield the values that differ, each with its path; entries of lists are named by name and outcome."""
    if isinstance(before, dict) and isinstance(now, dict):
        for key in sorted({*before, *now}):
            path = f"{where}.{key}".lstrip(".")
            yield from _compare_values(file, path, before.get(key, ABSENT), now.get(key, ABSENT))
    elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        for place, (old, new) in enumerate(zip(before, now, strict=True)):
            words = [str(old[key]) for key in ("name", "outcome") if old.get(key)] if isinstance(old, dict) else []
            label = " ".join(words) if isinstance(old, dict) and old.get("name") else place
            yield from _compare_values(file, f"{where}[{label}]", old, new)
    elif before != now and not (
        _is_number(before) and _is_number(now) and _near(where.rpartition(".")[2], float(before), float(now))
    ):
        committed, found = (json.dumps(value, ensure_ascii=False) for value in (before, now))
        yield Difference(file, where, *(text if len(text) <= 80 else f"{text[:77]}..." for text in (committed, found)))


def difference_lines(differences: list[Difference]) -> list[str]:
    """Return the first differences as lines, and the number of the others."""
    lines = [difference.text() for difference in differences[: 4 * SHOWN]]
    return lines + [f"... and {len(differences) - len(lines)} more"] * (len(differences) > len(lines))


@dataclass(frozen=True)
class ExactCheck:
    """The comparison of one effect with exact arithmetic: the largest relative difference, or None with the reason."""

    test: str
    effect: str
    difference: float | None
    note: str

    def text(self) -> str:
        """Return one line: the test, the effect, its relative difference."""
        distance = self.note if self.difference is None else f"{self.difference:.1e} from exact arithmetic"
        return f"exact: {self.test}: {self.effect}: {distance}"


def exact_checks(results: Sequence[QuestionResult]) -> list[ExactCheck]:
    """Return a line for every effect of every analysis of variance that was answered from complete data."""
    lines: list[ExactCheck] = []
    for result in results:
        if result.settings.test != "anova" or result.rows is None or result.answer is None:
            continue
        name = " ".join(filter(None, (result.settings.name, result.outcome)))
        if result.missing.cells and not result.missing.left_out:
            lines.append(ExactCheck(name, "all", None, "not checked: answered by a mixed model"))
            continue
        settings = effective(result.settings, TESTS[result.settings.test]).model_dump()
        checks = self_check(
            result.rows,
            "value",
            within=list(settings["within"]) or None,
            between=list(settings["between"]) or None,
            subject="participant",
            sum_of_squares=settings["sum_of_squares"],
            missing="listwise" if result.missing.policy == "listwise" else "raise",
            aggregate="mean",
        )
        lines += [
            ExactCheck(name, str(row["Source"]), nan_to_none(row["difference"]), row["note"])
            for row in checks.to_dict("records")
        ]
    return lines
