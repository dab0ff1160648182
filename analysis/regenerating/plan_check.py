"""The check of a plan against a study before there are data: its outcomes, factors and columns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from palpate.analysis.figures.figure_kind import FigureKind, FigureSettings
from palpate.analysis.plans.answers import (
    COLUMNS,
    OF_VALUES,
    READ,
    TERMS,
    Kind,
    StatisticSettings,
    column_names,
    columns_named,
)
from palpate.analysis.plans.idle import idle_settings
from palpate.analysis.plans.kinds import FIGURES, TESTS
from palpate.analysis.plans.reading import Plan, Rule
from palpate.analysis.plans.sources import OF_NUMBERS, is_plain, source_of, source_problem
from palpate.analysis.plans.study_factors import StudyFactors, study_factors
from palpate.analysis.plans.study_tables import TRIALS, Columns, study_tables, table_columns
from palpate.analysis.plans.where import Where
from palpate.analysis.ratings.own_answers import TIMES
from palpate.analysis.ratings.rating_files import load_ratings
from palpate.analysis.ratings.reading import OF_A_RATING
from palpate.analysis.ratings.sources import IMPORTED, DataRequest
from palpate.analysis.regenerating.regeneration import read_table
from palpate.protocols.complaints import Problem
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.forms import Question
from palpate.protocols.study import Study
from palpate.studies.catalogue import STUDY_FILE, find, names, read_study
from palpate.studies.participants.lab_forms import lab_forms


def check_against_study(request: DataRequest, plan: Plan) -> None:
    """Raise PlanError with every outcome, column and level that the study lacks, by line and nearest name.

    Of an earlier version of the study (`digest`) only the data are known, so that missing columns show in the tests.
    """
    if request.digest is not None:
        return
    known = known_answers(request, plan)
    problems = [
        Problem((*place, *problem.path), problem.message)
        for place, settings in _declared(plan)
        for problem in known.problems(settings)
    ]
    problems += [
        Problem(("exclusions", place, *problem.path), problem.message)
        for place, rule in enumerate(plan.declared.exclusions)
        for problem in known.problems_of_rule(rule)
    ]
    if problems:
        raise plan.complaint(problems)


def known_answers(request: DataRequest, plan: Plan) -> KnownAnswers:
    """Return what is known of the answers to a plan before they are read: of a study, or of an imported table."""
    own = {name: table_columns(read_table(plan.table_path(name))) for name in plan.declared.tables}
    if (Path(request.name) / STUDY_FILE).is_file() or request.name in names(request.lab):
        study = read_study(find(request.name, request.lab)).study
        form = lab_forms(study, request.lab, live=False) if "demographics" in study.opening else None
        return replace(answers_of_study(study, form.questions if form is not None else ()), own=own)
    ratings = load_ratings(request.lab / IMPORTED / request.name)
    trials = [name for name in ratings.table.columns if name not in OF_A_RATING]
    tables = {"ratings": table_columns(ratings.table), TRIALS: table_columns(ratings.table[trials])}
    return KnownAnswers(tables, {"ratings": ratings.attributes}, own=own)


def refuse_idle_settings(plan: Plan) -> None:
    """Raise PlanError with every setting without effect, which is a mistake in a plan that is not in use yet.

    `regenerate` still reads such a plan, with a note beside the answer.
    """
    problems = [
        Problem((*place, idle.name), f"{idle.name} has no effect {idle.where}; leave it out")
        for place, settings in _declared(plan)
        for idle in idle_settings(settings, _kind_of(settings))
    ]
    if problems:
        raise plan.complaint(problems)


def _declared(plan: Plan) -> Iterator[tuple[tuple[str, int], StatisticSettings | FigureSettings]]:
    """Yield the tests and figures of a plan, each with its place in the file."""
    yield from ((("tests", n), test) for n, test in enumerate(plan.tests))
    yield from ((("figures", n), figure) for n, figure in enumerate(plan.figures))


def answers_of_study(study: Study, questions: Sequence[Question]) -> KnownAnswers:
    """Return what is known of a study's answers before there are any; `questions` are those about a person."""
    items = study.questionnaire.items if study.questionnaire is not None else ()
    outcomes = {
        "ratings": tuple(attribute.name for attribute in study.attributes),
        "forms": tuple(item.name for item in items),
    }
    return KnownAnswers(study_tables(study, questions), outcomes, study_factors(study, questions))


def _kind_of(settings: StatisticSettings | FigureSettings) -> Kind | FigureKind:
    return TESTS[settings.test] if isinstance(settings, StatisticSettings) else FIGURES[settings.figure]


@dataclass(frozen=True)
class KnownAnswers:
    """What is known of the answers to a plan before they are read: their tables, outcomes by table, and design.

    `own` are the plan's own tables; `design` is None for imported data.
    """

    tables: Mapping[str, Columns]
    outcomes: Mapping[str, Sequence[str]]
    design: StudyFactors | None = None
    own: Mapping[str, Columns] = field(default_factory=dict)

    def problems(self, settings: StatisticSettings | FigureSettings) -> Iterator[Problem]:
        """Yield the problems of a test or figure that no answers could solve."""
        kind = _kind_of(settings)
        source = source_of(settings, kind)
        if problem := source_problem(settings, kind):
            yield Problem(("source",), problem)
            return
        if settings.table is not None:
            columns, outcomes = self.own[settings.table], None
        elif source == "table":
            if isinstance(settings, StatisticSettings):
                yield Problem(("name",), f"{settings.name!r} needs a table of the plan's own; name it with `table`")
            return
        elif source not in self.tables:
            has = ", ".join(name for name in self.tables if name != TRIALS)
            near = f"; it has {has}" if settings.source is not None and has else ""
            yield Problem(("name",), f"{settings.name!r} asks about {source}, {LACKS}{near}")
            return
        else:
            columns, outcomes = self.tables[source], self.outcomes.get(source)
        for n, name in enumerate(settings.outcomes or () if outcomes is not None else ()):
            if name not in (outcomes or ()):
                yield Problem(("outcomes", n), f"no outcome {name!r}; {nearest(name, outcomes or ())}")
        yield from _level_problems(settings.where, columns)
        misnamed = list(_column_problems(settings, columns))
        yield from misnamed
        if self.design is None or misnamed or not isinstance(settings, StatisticSettings) or settings.table is not None:
            return
        selected = settings.outcomes or outcomes or ()
        if outcomes is not None:
            yield from self.design.problems(settings, selected)
        # What the design says of a test of ratings does not hold for a form's own table.
        of_own_table = kind.takes in OF_NUMBERS and is_plain(source)
        if (problems := TESTS[settings.test].problems) is not None and not of_own_table:
            yield from problems(settings, self.design, selected)

    def problems_of_rule(self, rule: Rule) -> Iterator[Problem]:
        """Yield the problems of a rule for leaving something out."""
        yield from _level_problems(rule.where or {}, self.tables[TRIALS])
        ratings = self.tables.get("ratings")
        for key in ("outlying", "flagged"):
            if ratings is None and getattr(rule, key) is not None:
                yield Problem((key,), f"is about ratings, {LACKS}")
        for key in ("faster_than_s", "slower_than_s"):
            timed = [columns for name, columns in self.tables.items() if name == "ratings" or _is_own(name)]
            if getattr(rule, key) is not None and not any(set(TIMES) & set(columns) for columns in timed):
                yield Problem((key,), "no response times of ratings or choices are recorded; leave the rule out")
        for n, column in enumerate(rule.outlying.within if rule.outlying is not None and ratings is not None else ()):
            if column not in (ratings or ()):
                at = ("outlying", "within", n)
                yield Problem(at, f"the study has no column {column!r}; {nearest(column, ratings or ())}")


def _is_own(name: str) -> bool:
    """Return whether this is a table that a form of the study brings of its own."""
    return is_plain(name) and name != TRIALS


LACKS = "of which the study has none"
OF_RATINGS = ("participant", "value")
"""Columns that a table of the plan's own has for kinds of test that take ratings."""


def _column_problems(settings: StatisticSettings | FigureSettings, columns: Columns) -> Iterator[Problem]:
    """Yield each setting that names a column that is not there, holds words instead of numbers, or is named twice."""
    kind = _kind_of(settings)
    source = source_of(settings, kind)
    name = settings.table if settings.table is not None else source if is_plain(source) else None
    whose = "the study" if name is None or source == "choices" else f"the table {name!r}"
    implied = OF_RATINGS if is_plain(source) and kind.takes in OF_NUMBERS else ()
    for column in implied if isinstance(settings, StatisticSettings) else ():
        if column not in columns and getattr(settings, column, None) is None:
            at = "source" if settings.table is None else "table"
            yield Problem((at,), f"{whose} has no column {column!r}; {nearest(column, columns)}")
    # Who won a pair of a study follows from its choices, not from columns.
    unread = ("winner", "loser") if settings.table is None and settings.source == "choices" else ()
    for key in (key for key in (*COLUMNS, *TERMS, *READ) if key not in unread):
        for column in columns_named(settings, (key,)):
            # A column that is read as it is stands in the table itself, not among the answers about oneself.
            if column not in columns or (key in READ and columns[column].about_people):
                yield Problem((key,), f"{whose} has no column {column!r}; {nearest(column, columns)}")
            elif key in OF_VALUES and not (columns[column].numbers and (key not in READ or columns[column].plain)):
                yield Problem((key,), f"{column!r} holds words, not numbers")
    if isinstance(settings, StatisticSettings):
        yield from _named_twice(settings)
        yield from _no_predictors(settings)


def _named_twice(settings: StatisticSettings) -> Iterator[Problem]:
    """Yield a problem for each column in two places of a test, where every place has its own column."""
    of_ratings = _kind_of(settings).takes in OF_NUMBERS
    keys = (*COLUMNS, "value", "order") if of_ratings else ("by",)
    implied = set() if hasattr(settings, "raters") or hasattr(settings, "cases") else {"participant"}
    implied |= {"value"} if settings.value is None else set()
    seen: set[tuple[str, str]] = {("", name) for name in implied if of_ratings}
    for key in keys:
        # A number, and what categories are compared over, may be a factor as well.
        place = key if key == "numeric" or (key == "over" and not hasattr(settings, "items")) else ""
        for name in () if key in settings.not_columns else column_names(getattr(settings, key, None)):
            if (place, name) in seen or (of_ratings and name in implied):
                yield Problem((key,), f"{name!r} has a place in this test already; every column has one")
            seen.add((place, name))


def _no_predictors(settings: StatisticSettings) -> Iterator[Problem]:
    """Yield a problem for each interaction that is not one of different predictors."""
    predictors = columns_named(settings, ("fixed", "numeric"))
    for place, term in enumerate(getattr(settings, "interactions", ())):
        parts = term.split(":")
        if len(set(parts)) < max(2, len(parts)) or not set(parts) <= set(predictors):
            message = f"an interaction is of two or more predictors, as in {':'.join((*predictors, 'b')[:2])!r}"
            yield Problem(("interactions", place), message)


def _level_problems(where: Where, columns: Columns) -> Iterator[Problem]:
    for column, condition in where.items():
        if column not in columns:
            yield Problem(("where", column), f"the study has no column {column!r}; {nearest(column, columns)}")
        elif message := columns[column].problem(column, condition):
            yield Problem(("where", column), message)
