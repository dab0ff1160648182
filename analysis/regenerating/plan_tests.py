"""Ask every question of a plan: each answer with its inputs' hash, what was missing, and the seconds it took."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import pandas as pd

from palpate.analysis.plans.answers import COLUMNS, Answer, Kind, Selected, StatisticSettings, columns_named
from palpate.analysis.plans.idle import effective, idle_notes
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.plans.missing import MissingSummary, handled
from palpate.analysis.plans.selecting import Selecting
from palpate.analysis.statistics.one_thread import one_thread
from palpate.protocols.progress import Clock, Progress

OUTCOME = "attribute"
IDENTITY = ("participant", "session", "trial", "stimulus", "attribute", "value", "text", "form", "kind", "word")
ALL = ""
"""The outcome of a question that is asked once for all outcomes."""


@dataclass(frozen=True)
class Question:
    """One test of the plan for one outcome (ALL: for all of them together), and the rows it is asked about."""

    settings: StatisticSettings
    kind: Kind
    outcome: str
    selected: Selected | None
    refused: str = ""


@dataclass(frozen=True)
class QuestionResult:
    """A question with its answer, or with the reason why there is none.

    `inputs` is the SHA-256 of the rows that were used, whatever their order. `seconds` is the wall time of the answer,
    `rows` are the rows it rests on.
    """

    settings: StatisticSettings
    outcome: str
    answer: Answer | None
    refused: str
    inputs: str
    missing: MissingSummary
    seconds: float
    rows: pd.DataFrame | None = None


def run_tests(
    selecting: Selecting, progress: Progress = lambda *_: None, clock: Clock = time.perf_counter
) -> tuple[QuestionResult, ...]:
    """Return every test of the plan for every outcome, in the plan's order. A test that cannot be made says why."""
    tests, results, digests = selecting.plan.tests, [], _Digests()
    with one_thread():
        for done, settings in enumerate(tests):
            for question in _questions(selecting, settings):  # one by one: the rows of all would not fit into memory
                progress(done, len(tests), " ".join((settings.name, question.outcome)))
                results.append(_answer(selecting, question, clock, digests))
    progress(len(tests), len(tests), "")
    return tuple(results)


def _questions(selecting: Selecting, settings: StatisticSettings) -> Iterator[Question]:
    kind = TESTS[settings.test]
    try:
        selected = selecting.of(settings, kind.takes)
    except ValueError as refusal:
        yield Question(settings, kind, ALL, None, str(refusal))
        return
    if kind.each == "all" or settings.table is not None or _compares_outcomes(settings):
        yield Question(settings, kind, ALL, selected)
        return
    for selection in selecting.by_outcome(selected):
        yield Question(settings, kind, selection.outcome, selection)


def _compares_outcomes(settings: StatisticSettings) -> bool:
    """Return whether the outcomes themselves are a factor of the test, as the items of a questionnaire may be."""
    return OUTCOME in columns_named(settings, COLUMNS)


@dataclass
class _Digests:
    """Digests of tables, each made once: many tests ask about the same one."""

    known: dict[int, tuple[pd.DataFrame, str]] = field(default_factory=dict)

    def of(self, table: pd.DataFrame, own: bool) -> str:
        if id(table) not in self.known:
            self.known[id(table)] = table, digest(table, own)  # the table too, so that no other one gets its id
        return self.known[id(table)][1]


def _answer(selecting: Selecting, question: Question, clock: Clock, digests: _Digests) -> QuestionResult:
    """Return the answer to a question, or the reason why there is none."""
    settings, kind, selected = question.settings, question.kind, question.selected
    policy = settings.missing or selecting.plan.declared.missing
    missing = MissingSummary(policy, unanswered=() if selected is None else selected.unanswered)
    if selected is None:
        return QuestionResult(settings, question.outcome, None, question.refused, "", missing, 0.0)
    own = settings.table is not None
    start = clock()
    try:
        if kind.complete is not None and not own and (settings.source or kind.takes) == "ratings":
            trials, faults = selecting.trials(settings.where), selecting.faults(settings)
            selected, gaps = handled(selected, faults, settings.where, policy, trials)
            missing = replace(gaps, unanswered=missing.unanswered)
        start = clock()
        answer_of = kind.answer
        if missing.cells and policy == "mixed_model":
            if kind.with_gaps is None:
                raise NoModel(
                    f"{missing.found()}, and {settings.test!r} has no form that takes gaps; give this test"
                    " `missing: listwise`, or ask a test of kind mixed_model instead"
                )
            answer_of = kind.with_gaps
        answer = answer_of(selected, effective(settings, kind).model_copy(update={"missing": policy}))
        answer = replace(answer, notes=(*answer.notes, *idle_notes(settings, kind)))
    except ValueError as refusal:
        inputs = digests.of(selected.table, own)
        return QuestionResult(settings, question.outcome, None, str(refusal), inputs, missing, clock() - start)
    seconds, inputs = clock() - start, digests.of(selected.table, own)
    return QuestionResult(settings, question.outcome, answer, "", inputs, missing, seconds, selected.table)


class NoModel(ValueError):
    """Cells are missing and the plan asks for a model that this kind of test does not have."""


def digest(table: pd.DataFrame, own: bool = False) -> str:
    """Return the SHA-256 of a table's rows as CSV: columns by name, rows sorted, so that no order changes it.

    Of a study's answers it takes who answered what to which stimulus; the stimulus' other columns stand in the study,
    whose digest is among the inputs. Of a table of the plan's `own` it takes every column.
    """
    columns = sorted(map(str, table.columns))
    if "session" in columns and not own:
        columns = [name for name in columns if name in IDENTITY]
    lines = table[columns].to_csv(index=False, header=False, lineterminator="\n", float_format="%.17g").splitlines()
    return hashlib.sha256("\n".join((",".join(columns), *sorted(lines))).encode()).hexdigest()


def by_name(results: Sequence[QuestionResult]) -> Mapping[str, Mapping[str, Answer]]:
    """Return the answers of each test by outcome, as figures look for them."""
    answers: dict[str, dict[str, Answer]] = {}
    for result in results:
        if result.answer is not None:
            answers.setdefault(result.settings.name, {})[result.outcome] = result.answer
    return answers
