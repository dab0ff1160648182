"""The check of a plan against a study before there are data: its outcomes, factors and columns."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from palpate.analysis.figures.figure_kind import FigureKind, FigureSettings
from palpate.analysis.plans.answers import COLUMNS, Kind, StatisticSettings, Takes, columns_named
from palpate.analysis.plans.idle import idle_settings
from palpate.analysis.plans.kinds import FIGURES, TESTS
from palpate.analysis.plans.reading import Plan
from palpate.analysis.plans.where import Condition, Range, Where, first_word, keeps, levels_of
from palpate.analysis.ratings.people import ANSWER, CLOSED
from palpate.analysis.ratings.rating_files import load_ratings
from palpate.analysis.ratings.reading import column_name
from palpate.analysis.ratings.sources import IMPORTED, DataRequest
from palpate.protocols.complaints import Problem
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.forms import Question
from palpate.protocols.study import Study, is_number
from palpate.protocols.tasks import TASKS
from palpate.studies.catalogue import STUDY_FILE, find, names, read_study
from palpate.studies.participants.lab_forms import lab_forms

WORDS_ONLY = ("word", "kind", "category")
OF_FORMS = ("participant", "session", "group", "attribute")
OF_CHOICES = ("track", "procedure", "design", "alternatives", "session_number", "level", "target")
ALWAYS = ("participant", "session", "group", "stimulus", "attribute", "category", "trial", "block", "word", "kind")


def check_against_study(request: DataRequest, plan: Plan) -> None:
    """Raise PlanError with every outcome, column and level that the study lacks, by line and nearest name.

    Of an earlier version of the study (`digest`) only the data are known, so that missing columns show in the tests.
    """
    if request.digest is not None:
        return
    study: Study | None = None
    if (Path(request.name) / STUDY_FILE).is_file() or request.name in names(request.lab):
        study = read_study(find(request.name, request.lab)).study
    design: StudyColumns | None = None
    columns: dict[str, Collection[str]]
    outcomes: dict[Takes, Collection[str]]
    if study is None:
        ratings = load_ratings(request.lab / IMPORTED / request.name)
        columns = dict.fromkeys((*map(str, ratings.table.columns), *ALWAYS), ())
        outcomes = {"ratings": ratings.attributes}
    else:
        form = lab_forms(study, request.lab, live=False) if "demographics" in study.opening else None
        design = study_columns(study, form.questions if form is not None else ())
        columns, outcomes = _known(design)
    both: tuple[tuple[str, Sequence[StatisticSettings | FigureSettings]], ...] = (
        ("tests", plan.tests),
        ("figures", plan.figures),
    )
    problems = [
        Problem((section, place, *problem.path), problem.message)
        for section, settings in both
        for place, test in enumerate(settings)
        if test.table is None
        for problem in _problems(test, _takes(test), columns, outcomes, design)
    ]
    for place, rule in enumerate(plan.declared.exclusions):
        for column, condition in (rule.where or {}).items():
            of_rule = _level_problems(column, condition, columns)
            problems += [Problem(("exclusions", place, *problem.path), problem.message) for problem in of_rule]
        for n, column in enumerate(rule.outlying.within if rule.outlying is not None else ()):
            if column not in columns:
                at = ("exclusions", place, "outlying", "within", n)
                problems.append(Problem(at, f"the study has no column {column!r}; {nearest(column, columns)}"))
    if problems:
        raise plan.complaint(problems)


def refuse_idle_settings(plan: Plan) -> None:
    """Raise PlanError with every setting without effect, which is a mistake in a plan that is not in use yet.

    `regenerate` still reads such a plan, with a note beside the answer.
    """
    both: tuple[tuple[str, Sequence[StatisticSettings | FigureSettings]], ...] = (
        ("tests", plan.tests),
        ("figures", plan.figures),
    )
    problems = [
        Problem((section, place, idle.name), f"{idle.name} has no effect {idle.where}; leave it out")
        for section, settings in both
        for place, test in enumerate(settings)
        for idle in idle_settings(test, _kind_of(test))
    ]
    if problems:
        raise plan.complaint(problems)


def problems_of_test(settings: StatisticSettings, design: StudyColumns) -> list[Problem]:
    """Return the problems of one test of a study's own answers, before there are data."""
    return list(_problems(settings, _takes(settings), *_known(design), design))


def _known(design: StudyColumns) -> tuple[dict[str, Collection[str]], dict[Takes, Collection[str]]]:
    """Return the study's columns with their levels (empty: any), and its outcomes by table.

    Questions to participants about themselves are columns, too, as `answer.NAME` if a column of the stimuli has the
    name.
    """
    study = design.study
    columns: dict[str, Collection[str]] = dict.fromkeys(ALWAYS, ())
    columns |= {name: levels for name, (_, levels) in design.people.items()}
    if study.participants is not None and study.participants.sessions is not None:
        columns["session"] = [str(number) for number in range(1, study.sessions + 1)]
    columns["stimulus"] = [stimulus.id for stimulus in study.stimuli]
    columns["group"] = list(study.groups)
    for name in study.stimuli[0].columns if study.stimuli else ():
        columns[column_name(name)] = {stimulus.columns.get(name, "") for stimulus in study.stimuli}
    items = study.questionnaire.items if study.questionnaire is not None else ()
    return columns, {
        "ratings": [attribute.name for attribute in study.attributes],
        "forms": [item.name for item in items],
    }


def _takes(settings: StatisticSettings | FigureSettings) -> Takes:
    return settings.source or _kind_of(settings).takes


def _kind_of(settings: StatisticSettings | FigureSettings) -> Kind | FigureKind:
    return TESTS[settings.test] if isinstance(settings, StatisticSettings) else FIGURES[settings.figure]


def _problems(
    settings: StatisticSettings | FigureSettings,
    takes: Takes,
    columns: Mapping[str, Collection[str]],
    outcomes: Mapping[Takes, Collection[str]],
    design: StudyColumns | None,
) -> Iterator[Problem]:
    if takes == "choices":
        columns = {**columns, **dict.fromkeys(OF_CHOICES, ())}
    yield from _source_problems(settings, takes, design)
    if takes not in outcomes or not outcomes[takes]:
        if takes in ("ratings", "forms"):
            yield Problem(("name",), f"{settings.name!r} asks about {takes}, of which the study has none")
    else:
        for n, name in enumerate(settings.outcomes or ()):
            if name not in outcomes[takes]:
                yield Problem(("outcomes", n), f"no outcome {name!r}; {nearest(name, outcomes[takes])}")
    for column, condition in settings.where.items():
        yield from _level_problems(column, condition, columns)
    if design is not None and isinstance(settings, StatisticSettings) and takes in ("ratings", "forms"):
        of_forms = {*OF_FORMS, *design.people}
        columns = {
            name: levels
            for name, levels in columns.items()
            if (name in of_forms if takes == "forms" else name not in WORDS_ONLY)
        }
    unknown = False
    for key in (*COLUMNS, "random", "interactions"):
        for column in columns_named(settings, (key,)):
            if column not in columns:
                unknown = True
                yield Problem((key,), f"the study has no column {column!r}; {nearest(column, columns)}")
    if design is not None and isinstance(settings, StatisticSettings) and takes in ("ratings", "forms") and not unknown:
        yield from design.problems(settings, outcomes[takes] if settings.outcomes is None else settings.outcomes)


def _source_problems(
    settings: StatisticSettings | FigureSettings, takes: Takes, design: StudyColumns | None
) -> Iterator[Problem]:
    """Yield problems of a test without the table that it needs."""
    if takes == "choices" and design is not None and TASKS[design.study.task].answers != "choices":
        yield Problem(("name",), f"{settings.name!r} asks about choices, and the study's task gives none")
    if takes == "table" and settings.table is None and isinstance(settings, StatisticSettings):
        yield Problem(("name",), f"{settings.name!r} needs a table of the plan's own; name it with `table`")


def _level_problems(column: str, condition: Condition, columns: Mapping[str, Collection[str]]) -> Iterator[Problem]:
    if column not in columns:
        yield Problem(("where", column), f"the study has no column {column!r}; {nearest(column, columns)}")
        return
    if isinstance(condition, Range):
        word = "P001" if column == "participant" else first_word(columns[column])
        if word is not None:
            message = f"{column!r} holds words, as {word!r}; a range ({condition}) asks about numbers"
            yield Problem(("where", column), message)
        elif columns[column] and not any(map(condition.holds, columns[column])):
            yield Problem(("where", column), f"no {column} {condition}; there are {', '.join(sorted(columns[column]))}")
    for level in levels_of(condition):
        if columns[column] and level not in columns[column]:
            yield Problem(("where", column), f"no {column} {level!r}; {nearest(level, sorted(columns[column]))}")


Rows = Sequence[Mapping[str, str]]
CROSSED = {"icc", "kendall_w"}
"""Kinds of test in which every rater in `raters` rates every target in `targets`."""
TRIAL = "trial"
"""The column of a trial's place in its session, which everybody has, with a stimulus of their own order."""
VARYING = {"friedman", "nemenyi"}
"""Kinds of test whose `factor` varies within participants."""


@dataclass(frozen=True)
class StudyColumns:
    """The columns of a study: `encountered` has, by group, a row for each stimulus in each session of one participant.

    `people` has the questions about participants by name: the kind of the answer and its levels (none: any).
    """

    study: Study
    encountered: Mapping[str, Rows]
    people: Mapping[str, tuple[str, tuple[str, ...]]]

    def problems(self, settings: StatisticSettings, outcomes: Collection[str]) -> Iterator[Problem]:
        """Yield problems that no data could solve: a factor of one level, in the wrong place, or crossed with gaps."""
        groups: dict[str, Rows] = {}  # what each group encounters under `where`
        for group, encountered in self.encountered.items():
            every = [{**row, "attribute": outcome} for row in encountered for outcome in outcomes]
            where = settings.where.items()
            own = [row for row in every if all(keeps(condition, row[name]) for name, condition in where if name in row)]
            if own:
                groups[group] = own
        factor = "within" if settings.test in VARYING else "any"
        places = {"within": "within", "between": "between", "factor": factor, "by": "any", "fixed": "any"}
        for key, expected in places.items():
            for name in _texts(getattr(settings, key, None)):
                if message := self._misplaced(name, expected, groups, settings.where):
                    yield Problem((key,), message)
        for name in _texts(getattr(settings, "numeric", None)):
            values = {row[name] for rows in self.encountered.values() for row in rows if name in row}
            kind = self.people[name][0] if name in self.people else None
            is_numeric = all(map(is_number, values)) if kind is None else kind in ("number", "points")
            if not is_numeric:
                yield Problem(("numeric",), f"{name!r} holds words, not numbers")
        if settings.test in CROSSED:
            yield from self._uncrossed(
                getattr(settings, "targets", ""), getattr(settings, "raters", ""), groups, settings.where
            )
        # The factors whose combinations everybody must encounter: those within participants.
        factors = [*_texts(getattr(settings, "within", None)), *_texts(getattr(settings, "factor", None))]
        crossed = [name for name in factors if self._varies(name, groups, settings.where) == "within"]
        if TRIAL in crossed and set(crossed) - {TRIAL, "session"}:
            yield Problem(("within",), f"{TRIAL!r} is not met with every level of another factor")
        for group, rows in groups.items():
            if TRIAL not in crossed and crossed and (gap := _gap(rows, crossed, list(groups.values()))):
                place = f" in group {group}" if group else ""
                yield Problem(("within" if hasattr(settings, "within") else "factor",), f"nobody{place} meets {gap}")

    def _uncrossed(self, targets: str, raters: str, groups: Mapping[str, Rows], where: Where) -> Iterator[Problem]:
        """Yield problems that prevent every rater from rating every target."""
        if targets == raters:
            yield Problem(("raters",), f"{raters!r} is named in `targets`, too")
            return
        for key, name, other in (("targets", targets, raters), ("raters", raters, targets)):
            kind = self._varies(name, groups, where)
            if kind not in ("participant", "within", "unknown") or (name == "trial" and other != "participant"):
                yield Problem((key,), f"not every level of {name!r} is met with every level of {other!r}")
                return
        names = [n for n in (targets, raters) if n != TRIAL and self._varies(n, groups, where) == "within"]
        for rows in groups.values():
            if names and (gap := _gap(rows, names, list(groups.values()))):
                yield Problem(("targets",), f"nobody meets {gap}")
                return

    def _misplaced(self, name: str, place: str, groups: Mapping[str, Rows], where: Where) -> str:
        """Return why a column cannot be a factor in that place ("within", "between" or "any"), else an empty text."""
        kind = self._varies(name, groups, where)
        if kind in ("unknown", *(("within", "between") if place == "any" else (place,))):
            return ""
        if kind == "one level":
            more = "; the study declares one session" if name == "session" and self.study.sessions == 1 else ""
            return f"{name!r} has one level here, and a factor has two or more{more}"
        if kind == "number":
            return f"{name!r} is a number with many levels; a model takes it in `numeric`"
        if kind == "participant":
            return f"{name!r} identifies participants and is not a factor"
        other = "it is the same in all answers of a participant" if kind == "between" else "a participant meets several"
        return f"{name!r} is not a factor {place} participants: {other}" + (f"; name it in `{kind}`" * (place != "any"))

    def _varies(self, name: str, groups: Mapping[str, Rows], where: Where) -> str:
        if name == "participant":
            return "participant"
        if name == TRIAL:
            return "within"
        if name in self.people:
            kind, levels = self.people[name]
            condition = where.get(name)
            chosen = (
                levels
                if condition is None
                else levels_of(condition) or [level for level in levels if keeps(condition, level)]
            )
            return "number" if kind == "number" else "one level" if len(chosen) == 1 else "between"
        levels_by_group = [{row[name] for row in rows} for rows in groups.values() if name in rows[0]]
        if not levels_by_group:
            return "unknown"
        if all(len(levels) == 1 for levels in levels_by_group):
            return "between" if len(set().union(*levels_by_group)) > 1 else "one level"
        return "within"


def study_columns(study: Study, questions: Sequence[Question]) -> StudyColumns:
    """Return the columns of the study's future answers; `questions` are those about a person."""
    groups: Sequence[str | None] = [*study.groups] or [None]
    encountered: dict[str, list[dict[str, str]]] = {}
    for group, session in product(groups, range(1, study.sessions + 1)):
        for stimulus in study.stimuli_of(group):
            block = "main" if study.order.blocks is None else stimulus.columns[study.order.blocks.by]
            own = {column_name(name): level for name, level in stimulus.columns.items()}
            row = {**own, "stimulus": stimulus.id, "group": group or "", "session": str(session), "block": block}
            encountered.setdefault(group or "", []).append(row)
    levels: dict[str, tuple[str, tuple[str, ...]]] = {
        question.name: (question.kind, tuple(value for value, _ in question.levels))
        for question in questions
        if question.kind in CLOSED
    }
    if study.questionnaire is not None:
        points = tuple(str(n) for n in range(1, study.questionnaire.points + 1))
        levels |= {item.name: ("points", points) for item in study.questionnaire.items}
    columns = {column_name(name) for name in (study.stimuli[0].columns if study.stimuli else ())}
    people = {name: answer for name, answer in levels.items() if name not in columns}
    return StudyColumns(study, encountered, people | {f"{ANSWER}{name}": answer for name, answer in levels.items()})


def _gap(rows: Rows, crossed: Sequence[str], everybody: Sequence[Rows]) -> str:
    """Return the first combination of levels (of all groups) that is not among the rows, as text."""
    levels = [dict.fromkeys(row[name] for group in everybody for row in group) for name in crossed]
    there = {tuple(row[name] for name in crossed) for row in rows}
    for cell in product(*levels):
        if cell not in there:
            return " with ".join(f"{name} {level}" for name, level in zip(crossed, cell, strict=True))
    return ""


def _texts(value: Any) -> tuple[str, ...]:
    return (value,) if isinstance(value, str) else tuple(value) if isinstance(value, tuple) else ()
