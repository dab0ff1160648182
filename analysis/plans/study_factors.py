"""The factors of a study: what varies within participants, what between them, and which levels everybody meets."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from palpate.analysis.plans.answers import StatisticSettings
from palpate.analysis.plans.study_tables import about_people, trial_row
from palpate.analysis.plans.where import Where, keeps, levels_of
from palpate.protocols.complaints import Problem
from palpate.protocols.forms import Question
from palpate.protocols.study import Study

Rows = Sequence[Mapping[str, str]]
TRIAL = "trial"
"""The column of a trial's place in its session, which everybody has, with a stimulus of their own order."""
VARYING = {"friedman", "nemenyi"}
"""Kinds of test whose `factor` varies within participants."""


@dataclass(frozen=True)
class StudyFactors:
    """The columns of a study: `encountered` has, by group, a row for each stimulus in each session of one participant.

    `people` has the questions about participants by name: the kind of the answer and its levels (none: any).
    """

    study: Study
    encountered: Mapping[str, Rows]
    people: Mapping[str, tuple[str, tuple[str, ...]]]

    def groups(self, settings: StatisticSettings, outcomes: Collection[str]) -> dict[str, Rows]:
        """Return what each group encounters under the test's `where`, a row for each outcome."""
        groups: dict[str, Rows] = {}
        for group, encountered in self.encountered.items():
            every = [{**row, "attribute": outcome} for row in encountered for outcome in outcomes]
            where = settings.where.items()
            own = [row for row in every if all(keeps(condition, row[name]) for name, condition in where if name in row)]
            if own:
                groups[group] = own
        return groups

    def problems(self, settings: StatisticSettings, outcomes: Collection[str]) -> Iterator[Problem]:
        """Yield problems of factors that no data could solve: of one level, in the wrong place, or crossed with gaps.

        What only tests of one kind need is in the kind's own `problems`.
        """
        groups = self.groups(settings, outcomes)
        factor = "within" if settings.test in VARYING else "any"
        places = {"within": "within", "between": "between", "factor": factor, "by": "any", "fixed": "any"}
        if not getattr(settings, "halves", False):
            places["groups"] = "between"
        for key, expected in places.items():
            for name in _texts(getattr(settings, key, None)):
                if message := self.misplaced(name, expected, groups, settings.where):
                    yield Problem((key,), message)
        # The factors whose combinations everybody must encounter: those within participants.
        factors = [*_texts(getattr(settings, "within", None)), *_texts(getattr(settings, "factor", None))]
        crossed = [name for name in factors if self.varies(name, groups, settings.where) == "within"]
        if TRIAL in crossed and set(crossed) - {TRIAL, "session"}:
            yield Problem(("within",), f"{TRIAL!r} is not met with every level of another factor")
        for group, rows in groups.items():
            if TRIAL not in crossed and crossed and (gap := missing_combination(rows, crossed, list(groups.values()))):
                place = f" in group {group}" if group else ""
                yield Problem(("within" if hasattr(settings, "within") else "factor",), f"nobody{place} meets {gap}")

    @property
    def columns(self) -> set[str]:
        """The columns that each row of `encountered` has, and `attribute`."""
        return {"attribute", *(name for rows in self.encountered.values() for row in rows[:1] for name in row)}

    def misplaced(self, name: str, place: str, groups: Mapping[str, Rows], where: Where) -> str:
        """Return why a column cannot be a factor in that place ("within", "between" or "any"), else an empty text."""
        kind = self.varies(name, groups, where)
        if kind in (("within", "between") if place == "any" else (place,)):
            return ""
        if kind == "unknown":
            return f"{name!r} is no factor: it is a part of each answer"
        if kind == "one level":
            more = "; the study declares one session" if name == "session" and self.study.sessions == 1 else ""
            return f"{name!r} has one level here, and a factor has two or more{more}"
        if kind == "number":
            return f"{name!r} is a number with many levels; a model takes it in `numeric`"
        if kind == "participant":
            return f"{name!r} identifies participants and is not a factor"
        other = "it is the same in all answers of a participant" if kind == "between" else "a participant meets several"
        return f"{name!r} is not a factor {place} participants: {other}" + (f"; name it in `{kind}`" * (place != "any"))

    def varies(self, name: str, groups: Mapping[str, Rows], where: Where) -> str:
        """Return how a column varies: "within" or "between" participants, or why it is not a factor.

        That is "one level", "number", "participant", or "unknown" for a column that only answers fill.
        """
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


def study_factors(study: Study, questions: Sequence[Question]) -> StudyFactors:
    """Return the columns of the study's future answers; `questions` are those about a person."""
    encountered = {
        group or "": [
            {**trial_row(study, group, stimulus, session), "study": study.study}
            for session, stimulus in product(range(1, study.sessions + 1), study.stimuli_of(group))
        ]
        for group in study.groups or (None,)
    }
    return StudyFactors(study, encountered, about_people(study, questions))


def missing_combination(rows: Rows, crossed: Sequence[str], everybody: Sequence[Rows]) -> str:
    """Return the first combination of levels (of all groups) that is not among the rows, as text."""
    levels = [dict.fromkeys(row[name] for group in everybody for row in group) for name in crossed]
    there = {tuple(row[name] for name in crossed) for row in rows}
    for cell in product(*levels):
        if cell not in there:
            return " with ".join(f"{name} {level}" for name, level in zip(crossed, cell, strict=True))
    return ""


def _texts(value: Any) -> tuple[str, ...]:
    return (value,) if isinstance(value, str) else tuple(value) if isinstance(value, tuple) else ()
