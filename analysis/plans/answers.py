"""The inputs and outputs of every kind of test, and answers as text."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import Field

from palpate.analysis.plans.idle import Idle
from palpate.analysis.plans.sources import Takes
from palpate.analysis.plans.where import Condition
from palpate.analysis.ratings.dataset import DeclarationRefused
from palpate.analysis.statistics.apa import number
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.strict import Strict
from palpate.protocols.study import Text
from palpate.protocols.undefined import finite_or_none, nan_to_none
from palpate.protocols.wording import count

if TYPE_CHECKING:
    import pandas as pd

    from palpate.protocols.complaints import Problem
    from palpate.protocols.tracks import Track

Confidence = Annotated[float, Field(gt=0, lt=1)]
Value: TypeAlias = float | int | str | bool | None
Row: TypeAlias = Mapping[str, Value]
Missing = Literal["refuse", "listwise", "mixed_model"]
Normalise = Literal["none", "to_0_100", "to_-100_100", "z_within_participant", "range_within_participant"]
ADJUSTMENTS = {"holm": "Holm", "bonferroni": "Bonferroni", "none": "not adjusted"}
_NONE: Mapping[str, Any] = MappingProxyType({})

COLUMNS = (
    "within", "between", "factor", "fixed", "numeric", "by", "targets", "raters", "units", "items", "cases", "families",
    "pooled", "target", "attribute_column", "groups", "over", "condition", "staircase",
    "intensity",
)  # fmt: skip
"""Settings that name columns of the answers, which may also be answers about oneself."""
TERMS = ("random", "interactions")
"""Settings of a model that name columns, also several in one: "a:b"."""
FACTORS = tuple(name for name in (*COLUMNS, *TERMS) if name != "numeric")
"""Of these the settings that distinguish rows; a column in `numeric` is a number."""
OF_VALUES = ("numeric", "target", "value", "level", "correct", "n", "count", "intensity")
"""Settings that name columns of numbers."""
READ = ("value", "level", "correct", "n", "count", "order", "pairs", "winner", "loser", "tie", "first", "participant")
"""Settings that name columns which a test reads as they are."""


def column_names(value: object, terms: bool = False) -> list[str]:
    """Return every column in a setting; of `terms` also those of an interaction."""
    if isinstance(value, Mapping):
        return [text for pair in value.items() for end in pair for text in column_names(end, terms)]
    texts = (value,) if isinstance(value, str) else value if isinstance(value, tuple) else ()
    return [name for text in texts if isinstance(text, str) for name in (text.split(":") if terms else [text])]


def columns_named(settings: object, names: tuple[str, ...] = (*FACTORS, "numeric")) -> tuple[str, ...]:
    """Return the columns in the settings `names` of a test or figure, without those of its `where`."""
    others = getattr(settings, "not_columns", ())
    keys = (key for key in names if key not in others)
    return tuple(
        dict.fromkeys(name for key in keys for name in column_names(getattr(settings, key, None), key in TERMS))
    )


OF_THE_DESIGN = frozenset({"participant", "session", "group", "stimulus", "attribute", "trial", "block", "value"})
"""Columns that every answer has; any other may be a question about the person that somebody left unanswered."""


class StatisticSettings(Strict):
    """The common settings of the tests in an analysis plan; each kind adds its own.

    `name` is the test's own, unique in its plan and fit for a file name. `outcomes` are attributes, words' forms or
    items (None: all of them), `where` keeps the rows whose columns have these levels, or numbers in a range. `table`
    names one of the plan's own tables instead of the study's answers, `source` another table of answers than the kind's
    own ("forms": a questionnaire's items; else a table that a form of the study brings, such as "choices"). `value` is
    the column of numbers in such a table, or in the plan's own, for a kind that takes ratings (None: `value`).
    `normalise` and `missing` override the plan's own. `not_columns` are settings of the kind that name no columns,
    though those of other kinds with this name do.
    """

    not_columns: ClassVar[frozenset[str]] = frozenset()
    name: str
    test: str
    outcomes: tuple[str, ...] | None = None
    where: Mapping[Text, Condition] = {}
    table: str | None = None
    source: Takes | None = None
    value: Text | None = None
    normalise: Normalise | None = None
    missing: Missing | None = None

    def idle(self) -> Iterator[Idle]:
        """Yield the settings of the kind that have no effect in combination with the others."""
        yield from ()


def missing_without_effect(settings: StatisticSettings, where: str) -> Iterator[Idle]:
    """Yield `missing` for a kind that accepts gaps, unless the test names a question that may be left unanswered."""
    if set(columns_named(settings)) <= OF_THE_DESIGN:
        yield Idle("missing", where)


@dataclass(frozen=True)
class Selected:
    """The rows of one test, after exclusions, normalisation and its own `where`.

    `table` is long, one row per value: `participant`, `session`, `trial` (its place in the session), `group`,
    `stimulus`, every stimulus column as text, and
    - ratings: `attribute`, `value` (float64), `response_time_s`, `revised`;
    - words: `word`, `kind` ("ticked", "further", ...), one row per chosen word;
    - forms: `form`, `attribute` (the item's name), `value` (float64, NaN for an answer in words), `text`;
    - table: the columns of the plan's own table;
    - the name of a form's own table: that table as it was collected, of answers that count (analysis/ratings/
      own_answers.py). Of its `choices`, catch trials are among them.
    `trials` has one row per answered trial (participant, session, trial, group, stimulus and its columns): what a share
    is a share of. `levels` maps each text column to its levels in the study's order. `outcomes` has one name for a
    kind that is asked for each outcome by itself. `offered` are the words that a participant could tick. `antonyms` and
    `categories` map an attribute to the other end of its scale and to "physical" or "emotional". `scale` are the ends
    of the scale that `value` is on (None where it has none). `tables` are the plan's own tables by name. `seed` and
    `draws` are for whatever is resampled. `unanswered` are left out, as they did not answer a question about themselves
    that is a column here. `tracks` are those that the study declares, by name, for choices.
    """

    table: pd.DataFrame
    trials: pd.DataFrame
    outcomes: tuple[str, ...]
    levels: Mapping[str, tuple[str, ...]]
    alpha: float = 0.05
    seed: int = 0
    draws: int = 2000
    scale: tuple[float, float] | None = None
    offered: tuple[str, ...] = ()
    antonyms: Mapping[str, str] = field(default_factory=lambda: _NONE)
    categories: Mapping[str, str] = field(default_factory=lambda: _NONE)
    tables: Mapping[str, pd.DataFrame] = field(default_factory=lambda: _NONE)
    unanswered: tuple[str, ...] = ()
    tracks: Mapping[str, Track] = field(default_factory=lambda: _NONE)

    @property
    def outcome(self) -> str:
        """The only outcome, for kinds that are answered by outcome."""
        return self.outcomes[0]


@dataclass(frozen=True)
class Answer:
    """The numbers that answer one question.

    `rows` are the result's table: plain values, a float for a number, None where it is undefined (the row's `note` says
    why); p is never 0. `kinds` says of each column of numbers what it is ("generalized eta squared", "p,
    Greenhouse-Geisser, not adjusted"). `method` names what was computed and its source in a sentence. `participants`
    and `values` count the data that were used. `headline` is the sentence of a report, "" for none. `more` has further
    tables by name.
    """

    rows: tuple[Row, ...]
    method: str
    kinds: Mapping[str, str]
    participants: int
    values: int
    headline: str = ""
    notes: tuple[str, ...] = ()
    more: Mapping[str, tuple[Row, ...]] = field(default_factory=lambda: _NONE)


@dataclass(frozen=True)
class Kind:
    """A kind of test that a plan may use; `title` is its name in a report.

    `answer` raises a named ValueError with the reason if the question has no answer. `each` says whether outcomes are
    answered separately or together. `complete` names, for given settings, the factors whose cells each participant must
    have filled (averaging over the study's other factors): if a cell is missing, the plan's `missing` decides before
    `answer` is called. `with_gaps` is called instead under `missing: mixed_model`.
    `problems` yields why a study cannot answer it, as far as its declaration tells, for given settings, `StudyFactors`
    and the outcomes. `headings` are readable names of its own columns, beside those that all tests share
    (reports/tables.py).
    """

    title: str
    settings: type[StatisticSettings]
    answer: Callable[[Selected, Any], Answer]
    takes: Takes = "ratings"
    each: Literal["outcome", "all"] = "outcome"
    complete: Callable[[Any], tuple[str, ...]] | None = None
    with_gaps: Callable[[Selected, Any], Answer] | None = None
    problems: Callable[[Any, Any, Collection[str]], Iterator[Problem]] | None = None
    headings: Mapping[str, str] = field(default_factory=lambda: _NONE)


@dataclass(frozen=True)
class MissingSummary:
    """The missing cells of one question and their treatment: participants with gaps, missing cells in total,
    exclusions.
    """

    policy: Missing
    participants: int = 0
    cells: int = 0
    left_out: tuple[str, ...] = ()
    unanswered: tuple[str, ...] = ()

    def text(self) -> str:
        """Return a sentence, "" if nothing was missing."""
        silent = f"left out without an answer about themselves: {', '.join(self.unanswered)}" if self.unanswered else ""
        if not self.cells:
            return silent
        cells = f"{self.describe_cells()}; answered from what is there"
        if self.policy == "listwise":
            cells = f"{self.describe_cells()}; left out listwise: {', '.join(self.left_out)}"
        return "; ".join(filter(None, (cells, silent)))

    def describe_cells(self) -> str:
        """Return how much is missing as text."""
        return f"{count(self.cells, 'cell')} of {count(self.participants, 'participant')} missing"


@dataclass(frozen=True)
class QuestionResult:
    """A question with its answer, or the reason why there is none.

    `inputs` is the SHA-256 of the rows that were used, independent of their order. `seconds` is the wall time of the
    answer, `rows` are the rows that were used. `reason` is the type of the error behind a refusal.
    """

    settings: StatisticSettings
    outcome: str
    answer: Answer | None
    refused: str
    inputs: str
    missing: MissingSummary
    seconds: float
    rows: pd.DataFrame | None = None
    reason: type[ValueError] | None = None


def require_columns(table: pd.DataFrame, names: Iterable[str]) -> None:
    """Raise an error for a column that the table lacks, with the nearest name."""
    for name in names:
        if name not in table.columns:
            raise DeclarationRefused(f"no column {name!r}; {nearest(name, map(str, table.columns))}")


def answer_of(
    selected: Selected,
    rows: Sequence[Row],
    method: str,
    kinds: Mapping[str, str],
    *,
    table: pd.DataFrame | None = None,
    headline: str = "",
    notes: Iterable[str] = (),
    more: Mapping[str, tuple[Row, ...]] | None = None,
) -> Answer:
    """Return an answer with counts of participants and values in `table`, by default in all selected rows."""
    used = selected.table if table is None else table
    return Answer(
        rows=tuple(rows),
        method=method,
        kinds=kinds,
        participants=int(used["participant"].nunique()),
        values=int(used["value"].notna().sum()),
        headline=headline,
        notes=tuple(note for note in notes if note),
        more=more or {},
    )


def plain_rows(table: pd.DataFrame, finite: bool = False) -> tuple[Row, ...]:
    """Return the rows of a result with None for an undefined number, and for an infinite one where `finite`."""
    return tuple(plain_row(row, finite) for row in table.to_dict("records"))


def plain_row(row: Mapping[Any, Any], finite: bool = False) -> Row:
    """Return one row of a result as `plain_rows` does."""
    return {str(name): plain_value(value, finite) for name, value in row.items()}


def plain_value(value: Any, finite: bool = False) -> Value:
    """Return a value as a result table holds it; the parts of a compound label are joined with ", "."""
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, float):
        return finite_or_none(float(value)) if finite else nan_to_none(float(value))
    if isinstance(value, int | tuple):
        return value if isinstance(value, int) else ", ".join(map(str, value))
    return plain_value(value.item(), finite) if hasattr(value, "item") else str(value)


def sample_kinds(confidence: float, correction: str) -> dict[str, str]:
    """Return the meaning of each column of a one-sample t test."""
    return {
        "n": "participants",
        "sd": "SD over participants",
        "ci_low": share(confidence, "interval of the mean, Student's t"),
        "ci_high": share(confidence, "interval of the mean, Student's t"),
        "t": "one-sample t against 0",
        "df": "degrees of freedom",
        "dz": "dz = mean / SD",
        "p": "two-sided p, not adjusted",
        "p_corrected": f"two-sided p, {ADJUSTMENTS[correction]}",
        "family_size": "tests in the family",
    }


def share(confidence: float, words: str) -> str:
    """Return a text such as `95% interval ...`, in APA style."""
    return f"{100 * confidence:g}% {words}"


def averaged_note(least: int, most: int) -> str:
    """Return a note on how many ratings a participant's mean averages, "" if it is always one."""
    if most <= 1:
        return ""
    many = f"{most}" if least == most else f"{least} to {most}"
    return f"Each participant's {many} ratings in a cell were averaged first."


def turned_note(names: Sequence[str], selected: Selected) -> list[str]:
    """Return a note on attributes with a reversed scale, and its centre; none if there are none."""
    if not names:
        return []
    about = "0" if selected.scale is None else f"{(selected.scale[0] + selected.scale[1]) / 2:g}"
    return [f"Turned round about {about} before averaging: {', '.join(names)}."]


def table_notes(table: pd.DataFrame) -> tuple[str, str]:
    """Return notes on how many ratings each value averages, and who was left out; "" for none."""
    least, most = table.attrs.get("ratings_per_cell", (1, 1))
    dropped = table.attrs.get("dropped", [])
    left_out = f"Left out listwise: {', '.join(map(str, dropped))}." if dropped else ""
    return averaged_note(least, most), left_out


def coefficient(value: float) -> str:
    """Return a coefficient of at most 1 in APA style: .29, −.05, 1.00."""
    return re.sub(r"^(−?)0\.", r"\1.", number(value)) if math.isfinite(value) else "undefined"


def with_interval(name: str, value: Any, low: Any, high: Any, confidence: float) -> str:
    """Return a coefficient with its interval, if it has one: ICC(A,1) = .29, 95% CI [.02, .76]."""
    value, low, high = (plain_value(part, finite=True) for part in (value, low, high))
    if not isinstance(value, float):
        return f"{name} is undefined"
    text = f"{name} = {coefficient(value)}"
    if not (isinstance(low, float) and isinstance(high, float)):
        return text
    return f"{text}, {confidence:.0%} CI [{coefficient(low)}, {coefficient(high)}]"


def averaged(values_per_cell: tuple[int, int]) -> tuple[str, ...]:
    """Return the note on cells that are means of several values."""
    least, most = values_per_cell
    if most <= 1:
        return ()
    many = str(most) if least == most else f"{least} to {most}"
    return (f"Each cell is the mean of {many} values.",)
