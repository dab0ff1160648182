"""Tables of texts for readers of a page, a Word file, LaTeX or a terminal.

Values become texts by column: digits are aligned, an undefined number is a dash with its reason below the table, and
each column has a readable name and a description. Numbers have a true minus, no leading zero below one, and no p is
zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from palpate.analysis.plans.answers import Row, Value
from palpate.analysis.statistics import apa

NONE = "–"
NO_NUMBER = "There is no such number for this row."
LONG_TEXT = 40
MOST_DECIMALS = 8
MOST_LETTERS = 30
"""The number of letters above which a cell wraps on paper."""
SUPERSCRIPTS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
_NO_TEXTS: Mapping[str, str] = MappingProxyType({})
_NO_GROUPS: Mapping[int, str] = MappingProxyType({})


HEADINGS: Mapping[str, str] = {
    "a": "A", "b": "B", "n": "n", "t": "t", "T": "t", "F": "F", "z": "z", "W": "W", "r": "r", "p": "p",
    "k": "conditions",
    "df": "df", "dof": "df", "df1": "df₁", "df2": "df₂", "ddof1": "df₁", "ddof2": "df₂", "F_ddof1": "df₁ of F",
    "F_ddof2": "df₂ of F", "other_F": "largest other F", "chi2": "χ²", "r2": "R²", "m2": "m²", "Q": "Q", "H": "H",
    "p_unc": "p, uncorrected", "p_uncorrected": "p, uncorrected", "p_corr": "p, corrected",
    "p_corrected": "p, corrected",
    "p_GG_corr": "p, GG", "p_HF_corr": "p, HF", "p_greenhouse_geisser": "p, GG",
    "p_huynh_feldt": "p, HF", "p_exact": "p, exact", "p_exact_holm": "p, exact, Holm", "p_chi2": "p of χ²",
    "p_F": "p of F", "p_low": "p, lower bound", "p_high": "p, upper bound", "p_deviance": "p of the deviance",
    "p_kind": "kind of p", "p_adjust": "adjusted by", "t_low": "t, lower bound", "t_high": "t, upper bound",
    "ci_low": "CI, low", "ci_high": "CI, high", "ci95_low": "95% CI, low", "ci95_high": "95% CI, high",
    "low": "low", "high": "high", "interval_low": "interval, low", "interval_high": "interval, high",
    "bound_low": "bound, low", "bound_high": "bound, high", "W_low": "W, low", "W_high": "W, high",
    "sd": "SD", "se": "SE", "SS": "sum of squares", "MS": "mean square", "SS_error": "error sum of squares",
    "sum_of_squares": "sum of squares", "error_sum_of_squares": "error sum of squares", "mean_square": "mean square",
    "np2": "η²p", "partial_eta_squared": "η²p", "partial_eta_squared_low": "η²p, low", "np2_low": "η²p, low",
    "partial_eta_squared_high": "η²p, high", "np2_high": "η²p, high", "ng2": "η²G", "ng2_low": "η²G, low",
    "ng2_high": "η²G, high", "generalized_eta_squared": "η²G", "generalized_eta_squared_low": "η²G, low",
    "generalized_eta_squared_high": "η²G, high", "eta2": "η²", "eta_squared": "η²", "eta_squared_low": "η², low",
    "eta_squared_high": "η², high", "eps": "ε, GG", "eps_HF": "ε, HF",
    "epsilon_greenhouse_geisser": "ε, GG", "epsilon_huynh_feldt": "ε, HF",
    "mean_diff": "mean difference", "mean_difference": "mean difference", "dz": "dz", "cohens_dz": "dz",
    "cohens_dz_low": "dz, low", "cohens_dz_high": "dz, high", "hedges": "Hedges' g", "family": "family",
    "family_size": "tests in the family", "ICC": "ICC", "Source": "factor", "tied": "with ties", "alpha": "α",
    "kappa": "κ",
    "kendall_w": "Kendall's W", "mean_rank_r": "mean rank r", "raters_with_ties": "raters with ties",
    "sd_interval": "SD of the interval", "half": "half-width", "ratings_min": "ratings, fewest",
    "ratings_max": "ratings, most", "mean_absolute_error": "mean absolute error", "mae": "mean absolute error",
    "r_others": "r with the others", "kept_chance": "chance of being kept", "share_ticked": "share ticked",
    "word_kept": "word kept", "antonym_kept": "antonym kept", "relevance_word": "relevance of the word",
    "relevance_antonym": "relevance of the antonym", "item_rest": "r, item and rest", "item_total": "r, item and total",
    "average_r": "mean r of items", "standardised": "α, standardised", "jnd": "JND", "p_converges": "rests at",
    "converges_at": "comes to rest at", "reversal_threshold": "threshold, reversals",
    "log_likelihood": "log likelihood",
    "aic": "AIC", "bic": "BIC", "icc": "ICC", "marginal_r2": "R², marginal", "conditional_r2": "R², conditional",
    "q1": "lower quartile", "q3": "upper quartile", "min": "least", "max": "most", "whisker_low": "whisker, low",
    "whisker_high": "whisker, high", "semi_major": "ellipse, long half-axis", "semi_minor": "ellipse, short half-axis",
    "angle_deg": "ellipse, angle (°)", "first_trial": "first trial", "last_trial": "last trial", "stars": "marked",
    "response_time_s": "response time (s)", "words_of_its_own": "words of its own",
}  # fmt: skip
_NUMBERED = {"pc": "component", "dim": "dimension", "direction_": "direction"}


@dataclass(frozen=True)
class Head:
    """A column's head: its name as text, the alignment of its cells, its name in files, and its meaning.

    `kind` is text, number (right), words (may wrap) or hash.
    """

    name: str
    kind: str = "text"
    column: str = ""
    meaning: str = ""


@dataclass(frozen=True)
class Emphasis:
    """The emphasis in a table: rows (the default method), cells (the best of a column), others' columns and rows."""

    rows: frozenset[int] = frozenset()
    cells: frozenset[tuple[int, int]] = frozenset()
    columns: frozenset[int] = frozenset()
    others: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Table:
    """Rows of texts with heads, and notes below.

    `groups` are headings above the rows at these places, `ruled` the rows with a rule above, `keys` the marks of
    figures that each row belongs to.
    """

    heads: tuple[Head, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    groups: Mapping[int, str] = field(default_factory=lambda: _NO_GROUPS)
    ruled: frozenset[int] = frozenset()
    keys: tuple[tuple[str, ...], ...] = ()
    emphasis: Emphasis = field(default_factory=Emphasis)

    @property
    def legend(self) -> tuple[Head, ...]:
        """The columns with a description."""
        return tuple(head for head in self.heads if head.meaning)


def text_table(heads: Iterable[str | Head], rows: Iterable[Sequence[str]], notes: Iterable[str] = ()) -> Table:
    """Return a table of texts; a column given by its name has short texts."""
    columns = tuple(Head(head) if isinstance(head, str) else head for head in heads)
    return Table(columns, tuple(tuple(row) for row in rows), tuple(notes))


def grouped_table(heads: Iterable[str | Head], rows: Iterable[Sequence[str]], notes: Iterable[str] = ()) -> Table:
    """Return a table without a first cell where it repeats the one above, and with rules above the others."""
    table = text_table(heads, rows, notes)
    first = [row[0] for row in table.rows]
    repeats = [place > 0 and text == first[place - 1] for place, text in enumerate(first)]
    cells = tuple(("", *row[1:]) if again else row for row, again in zip(table.rows, repeats, strict=True))
    starts = {place for place, text in enumerate(row[0] for row in cells) if text and place > 0}
    return replace(table, rows=cells, ruled=frozenset(starts if any(repeats) else ()))


def number(name: str) -> Head:
    """Return the head of a column of numbers."""
    return Head(name, "number")


def words(name: str) -> Head:
    """Return the head of a column of sentences, which may wrap."""
    return Head(name, "words")


def value_table(
    rows: Sequence[Row],
    meanings: Mapping[str, str] = _NO_TEXTS,
    known: Collection[str] = (),
    without: str = NO_NUMBER,
    headings: Mapping[str, str] = _NO_TEXTS,
) -> Table:
    """Return the rows as texts with readable column names, and each row's `note` below at the number that it explains.

    `meanings` describe columns. `known` are the keys of marks: a row belongs to those that it names. `without` is the
    note on a missing number without one; if it is "", such a cell stays empty. `headings` name columns that have no
    usual heading.
    """
    notes = Footnotes()
    names = filled_columns(rows)
    columns = [column_texts(name, [row.get(name) for row in rows]) for name in names]
    texts = []
    for row, cells in zip(rows, zip(*columns, strict=True), strict=True):
        note = str(row.get("note") or "")
        if NONE in cells:
            dash = notes.marked(NONE, note or without) if note or without else ""
            texts.append(tuple(dash if cell == NONE else cell for cell in cells))
        else:
            texts.append((notes.marked(cells[0], note), *cells[1:]))
    heads = []
    for name in names:
        words = [value for row in rows if isinstance(value := row.get(name), str)]
        kind = "number" if not words else "words" if max(map(len, words)) > LONG_TEXT else "text"
        heads.append(Head(headings.get(name) or heading(name), kind, name, meanings.get(name, "")))
    return Table(tuple(heads), tuple(texts), notes.lines(), keys=tuple(row_keys(row, known) for row in rows))


def filled_columns(rows: Sequence[Row]) -> list[str]:
    """Return the columns that any row fills, "result" if none does; a row's note is below the table."""
    names = dict.fromkeys(name for row in rows for name in row if name != "note")
    return [name for name in names if any(row.get(name) not in (None, "") for row in rows)] or ["result"]


def row_keys(row: Row, known: Collection[str]) -> tuple[str, ...]:
    """Return the marks' keys among a row's texts, without duplicates."""
    return tuple(dict.fromkeys(value for value in row.values() if isinstance(value, str) and value in known))


def column_texts(name: str, values: Sequence[Value]) -> list[str]:
    """Return a column's values as text, all with the same decimals, so that digits are aligned.

    p is never 0, an undefined number is a dash; a missing text stays empty.
    """
    missing = "" if any(isinstance(value, str) for value in values) else NONE
    numbers = [value for value in values if isinstance(value, float) and math.isfinite(value)]
    largest = max(map(abs, numbers), default=0.0)
    if counts(name) and all(value == int(value) and abs(value) < 1e6 for value in numbers):
        decimals = 0
    elif largest > 1 or not largest:
        decimals = 2
    else:
        decimals = min(MOST_DECIMALS, max(3, 1 - math.floor(math.log10(largest))))
    return [_text(name, value, decimals, missing) for value in values]


def _text(name: str, value: Value, decimals: int, missing: str) -> str:
    if value is None or value == "":
        return missing
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    return f"{value}".replace("-", "−") if isinstance(value, int) else _number(name, value, decimals)


def _number(name: str, value: float, decimals: int) -> str:
    """Return a number with these decimals, and no sign before zero."""
    if not math.isfinite(value):
        return NONE if math.isnan(value) else "∞" if value > 0 else "−∞"
    if is_p(name) and 0 <= value <= 1:
        return p_cell(value)
    if abs(value) >= 1e6:
        return fixed(value, decimals)
    text = f"{value:.{decimals}f}"
    return text.lstrip("-") if not text.strip("-0.") else text.replace("-", "−")


@dataclass(frozen=True)
class NumberedTable:
    """A table of a manuscript: its number, its name in the plan, its title, the table and the text below."""

    number: int
    name: str
    title: str
    table: Table
    notes: tuple[str, ...]


def table_letters(table: Table) -> int:
    """Return how many letters wide a table is, which decides whether its page is rotated. Heads may wrap."""
    cells = zip(*table.rows, strict=True) if table.rows else [() for _ in table.heads]
    widest = (max(map(len, (*head.name.split(), *column))) for head, column in zip(table.heads, cells, strict=True))
    return sum(min(MOST_LETTERS, letters) + 2 for letters in widest)


class Footnotes:
    """The notes of one table, each written once: `marked` adds a number to a text and stores the note."""

    def __init__(self) -> None:
        self._numbers: dict[str, str] = {}

    def marked(self, text: str, note: str) -> str:
        """Return the text with the number of its note, or unchanged without a note."""
        if not note:
            return text
        number = self._numbers.setdefault(note, str(len(self._numbers) + 1).translate(SUPERSCRIPTS))
        return f"{text} {number}"

    def lines(self) -> tuple[str, ...]:
        """Return the notes below the table."""
        return tuple(f"{number} {note}" for note, number in self._numbers.items())


def heading(name: str) -> str:
    """Return a column's readable name: its usual one, else its name with spaces."""
    if name in HEADINGS:
        return HEADINGS[name]
    for start, word in _NUMBERED.items():
        if name.startswith(start) and name.removeprefix(start).isdigit():
            return f"{word} {name.removeprefix(start)}"
    return " ".join(name.replace("_", " ").split())


def is_p(name: str) -> bool:
    """Return whether a column holds p values, by its name."""
    return name == "p" or name.startswith("p_") or name.endswith("_p")


def counts(name: str) -> bool:
    """Return whether a column's integers are shown as such: degrees of freedom and counts."""
    return name in {"n", "W", "family"} or name.startswith(("df", "dof", "ddof", "n_", "count", "F_ddof"))


def fixed(value: float | None, decimals: int = 2) -> str:
    """Return a number with these decimals, in powers of ten if they would not suffice."""
    return NONE if value is None or math.isnan(value) else apa.number(value, decimals)


def share(value: float | None) -> str:
    """Return a number that cannot exceed 1 (an eta squared, an epsilon) to three decimals, without its leading zero."""
    if value is None or math.isnan(value):
        return NONE
    if 0 < value < 0.0005:
        return "< .001"
    return f"{value:.3f}".removeprefix("0")


def p_cell(value: float | None) -> str:
    """Return a p value with three decimals in APA style: never 0."""
    return NONE if value is None else apa.p_value(value)


def degrees(value: float | None) -> str:
    """Return degrees of freedom: as an integer if they are one, else with two decimals."""
    if value is None or math.isnan(value):
        return NONE
    return f"{value:.0f}" if value == int(value) else f"{value:.2f}"


def written(value: Any, form: str) -> str:
    """Return a value as text: "text", "int", "share", "s", "ms", "bytes", "tiny", or digits after the point."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return NONE
    if form in ("text", "words"):
        return str(value)
    return _FORMS[form](float(value)).replace("-", "−")


def in_seconds(value: float) -> str:
    """Return a time in a suitable unit."""
    if value >= 120:
        return f"{value / 60:.0f} min"
    return f"{value:.0f} s" if value >= 10 else f"{value:.1f} s" if value >= 0.1 else f"{value * 1e3:.1f} ms"


_FORMS: Mapping[str, Callable[[float], str]] = {
    "int": lambda value: f"{value:,.0f}",
    "share": lambda value: f"{value:.1%}",
    "0": lambda value: f"{value:.0f}",
    "1": lambda value: f"{value:.1f}",
    "2": lambda value: f"{value:.2f}",
    "3": lambda value: f"{value:.3f}",
    "s": in_seconds,
    "ms": lambda value: f"{value:.2f}" if value < 10 else f"{value:.0f}",
    "bytes": lambda value: f"{value / 1e6:.1f} MB" if value >= 1e6 else f"{value / 1e3:.0f} kB",
    "tiny": lambda value: "0" if value == 0 else f"{value:.0e}",
}
