"""The factors of a study: what varies within participants, what between them, and which levels everybody meets."""

from __future__ import annotations

import math
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
from palpate.protocols.wording import count

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
        if not getattr(settings, "halves", False):
            places["groups"] = "between"
        for key, expected in places.items():
            for name in _texts(getattr(settings, key, None)):
                if message := self._misplaced(name, expected, groups, settings.where):
                    yield Problem((key,), message)
        yield from self._problems_of_kind(settings, groups, outcomes)
        # The factors whose combinations everybody must encounter: those within participants.
        factors = [*_texts(getattr(settings, "within", None)), *_texts(getattr(settings, "factor", None))]
        crossed = [name for name in factors if self._varies(name, groups, settings.where) == "within"]
        if TRIAL in crossed and set(crossed) - {TRIAL, "session"}:
            yield Problem(("within",), f"{TRIAL!r} is not met with every level of another factor")
        for group, rows in groups.items():
            if TRIAL not in crossed and crossed and (gap := _missing_combination(rows, crossed, list(groups.values()))):
                place = f" in group {group}" if group else ""
                yield Problem(("within" if hasattr(settings, "within") else "factor",), f"nobody{place} meets {gap}")

    def _problems_of_kind(
        self, settings: Any, groups: Mapping[str, Rows], outcomes: Collection[str]
    ) -> Iterator[Problem]:
        """Yield the problems that only tests of this kind have."""
        match settings.test:
            case "icc" | "kendall_w":
                yield from self._crossing_problems(settings.targets, settings.raters, groups, settings.where)
            case "cronbach_alpha":
                yield from self._alpha_problems(settings, groups)
            case "likert":
                if settings.source == "ratings" and self.study.scale is not None and self.study.scale.step is None:
                    yield Problem(("source",), "ratings on a scale without steps have no points to count")
            case "retest":
                yield from self._retest_problems(settings, groups)
            case "trends":
                yield from self._trend_problems(settings, groups)
            case "categories":
                yield from self._category_problems(settings, outcomes)
            case "target_error":
                yield from self._target_problems(settings, groups, outcomes)
            case "mds" | "procrustes" | "vectors":
                yield from self._map_problems(settings, groups, outcomes)

    def _crossing_problems(
        self, targets: str, raters: str, groups: Mapping[str, Rows], where: Where
    ) -> Iterator[Problem]:
        """Yield problems that prevent every rater from rating every target."""
        if targets == raters:
            yield Problem(("raters",), f"{raters!r} is named in `targets`, too")
            return
        for key, name, other in (("targets", targets, raters), ("raters", raters, targets)):
            kind = self._varies(name, groups, where)
            if kind not in ("participant", "within") or (name == "trial" and other != "participant"):
                yield Problem((key,), f"not every level of {name!r} is met with every level of {other!r}")
                return
        names = [n for n in (targets, raters) if n != TRIAL and self._varies(n, groups, where) == "within"]
        for rows in groups.values():
            if names and (gap := _missing_combination(rows, names, list(groups.values()))):
                yield Problem(("targets",), f"nobody meets {gap}")
                return

    def _alpha_problems(self, settings: Any, groups: Mapping[str, Rows]) -> Iterator[Problem]:
        """Yield a problem if a case of Cronbach's alpha, a combination of its columns, is without some item."""
        cases = settings.cases or ("participant", "stimulus")
        if settings.items in cases:
            yield Problem(("items",), f"{settings.items!r} is among the cases, too; name other columns in `cases`")
            return
        if settings.items == TRIAL and set(cases) - {"participant", "session"}:
            yield Problem(("items",), f"{TRIAL!r} is not met with every level of another factor")
        kind = self._varies(settings.items, groups, settings.where)
        if kind in ("one level", "unknown") or (kind == "between" and "participant" in cases):
            yield Problem(("items",), self._misplaced(settings.items, "within", groups, settings.where))
        named = [name for name in cases if name in self._columns]
        for rows in groups.values() if kind == "within" and settings.items != TRIAL else ():
            met = _by([{**row, "case": " ".join(row[name] for name in named)} for row in rows], "case", settings.items)
            if len(set(map(len, met.values()))) > 1 or len(next(iter(met.values()))) < len(set().union(*met.values())):
                yield Problem(("items",), f"not every case has every level of {settings.items!r}")
                return

    def _retest_problems(self, settings: Any, groups: Mapping[str, Rows]) -> Iterator[Problem]:
        """Yield problems of test and retest: several answers at one moment, or no stimulus that is met twice."""
        rows = [row for own in groups.values() for row in own]
        sessions = {row["session"] for row in rows}
        ordered = {"session", TRIAL} if len(sessions) > 1 else {TRIAL}
        named = [*settings.targets, *settings.order]
        if not ordered <= set(settings.order) and all(name in self._columns for name in named):
            moments = [tuple(row[name] for name in ("group", "attribute", *named)) for row in rows]
            if len(set(moments)) < len(moments) or self.study.order.repeats > 1:
                yield Problem(
                    ("order",), f"several answers are at the same moment; name {' and '.join(sorted(ordered))}"
                )
        if len(sessions) == 1 and self.study.order.repeats == 1 and "stimulus" in settings.targets:
            yield Problem(("targets",), "nobody meets a stimulus twice: repeat stimuli, or have several sessions")

    def _trend_problems(self, settings: Any, groups: Mapping[str, Rows]) -> Iterator[Problem]:
        """Yield problems of trends: levels in several families or at several numbers, or families of one level."""
        rows = [row for own in groups.values() for row in own]
        for key in ("families", "pooled"):
            if getattr(settings, key) not in self._columns - {"attribute", "session", "group", "study"}:
                yield Problem((key,), f"{getattr(settings, key)!r} is no column of the stimuli")
                return
        for key, name in (("families", settings.families), ("numeric", settings.numeric)):
            if name is None:
                continue
            if name not in self._columns:
                yield Problem((key,), f"{name!r} is no column of the stimuli")
                return
            levels = _by(rows, settings.pooled, name)
            if several := next((level for level, own in levels.items() if len(own) > 1), None):
                yield Problem((key,), f"{settings.pooled} {several} has several levels of {name!r}, and needs one")
                return
        if all(len(own) < 2 for own in _by(rows, settings.families, settings.pooled).values()):
            yield Problem(("families",), "no family has two levels; a trend needs at least two")
        if settings.reference is not None and settings.reference not in {row[settings.pooled] for row in rows}:
            yield Problem(("reference",), f"no level {settings.reference!r} of {settings.pooled!r}")

    def _category_problems(self, settings: Any, outcomes: Collection[str]) -> Iterator[Problem]:
        """Yield a problem where the attributes compared are not of two categories, or of none."""
        for key in ("by", "over"):
            if "attribute" in getattr(settings, key):
                yield Problem((key,), "'attribute' has a place in this test already: attributes are compared")
        categories = [attribute.category for attribute in self.study.attributes if attribute.name in outcomes]
        if None in categories or len(set(categories)) != 2:
            yield Problem(("outcomes",), "attributes of two categories are compared: say `category` in the study")

    def _target_problems(
        self, settings: Any, groups: Mapping[str, Rows], outcomes: Collection[str]
    ) -> Iterator[Problem]:
        """Yield problems of errors from targets: columns that are not the stimuli's, or name no attribute."""
        for key in ("target", "attribute_column"):
            if getattr(settings, key) not in self._columns - {"attribute", "session", "group", "study"}:
                yield Problem((key,), f"{getattr(settings, key)!r} is no column of the stimuli")
                return
        named = {row[settings.attribute_column] for rows in groups.values() for row in rows}
        if not named & set(outcomes):
            yield Problem(("attribute_column",), f"{settings.attribute_column!r} names none of the attributes asked")

    def _map_problems(self, settings: Any, groups: Mapping[str, Rows], outcomes: Collection[str]) -> Iterator[Problem]:
        """Yield problems of a map: outcomes beside those of pairs, or more dimensions than distances can span."""
        if getattr(settings, "pairs", None) is not None:
            if len(outcomes) != 1:
                yield Problem(("outcomes",), f"`pairs` needs one outcome; here are {', '.join(outcomes)}")
            return
        if getattr(settings, "on", "") == "attributes":
            return
        rows = [row for own in groups.values() for row in own]
        levels = {name: {row[name] for row in rows if name in row} for name in (settings.over, settings.items)}
        points, items = (len(levels[name]) or math.inf for name in (settings.over, settings.items))
        nonmetric = "nonmetric" in (getattr(settings, "method", ""), getattr(settings, "on", ""))
        most = points - 1 if nonmetric else min(points - 1, items)
        if settings.dimensions > most:
            by = "" if nonmetric else f" by {items} of {settings.items!r}"
            message = f"a map of {points} levels of {settings.over!r}{by} has {count(int(most), 'dimension')} at most"
            yield Problem(("dimensions",), message)

    @property
    def _columns(self) -> set[str]:
        """The columns that each row of `encountered` has, and `attribute`."""
        return {"attribute", *(name for rows in self.encountered.values() for row in rows[:1] for name in row)}

    def _misplaced(self, name: str, place: str, groups: Mapping[str, Rows], where: Where) -> str:
        """Return why a column cannot be a factor in that place ("within", "between" or "any"), else an empty text."""
        kind = self._varies(name, groups, where)
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


def _by(rows: Rows, key: str, name: str) -> dict[str, set[str]]:
    """Return the levels of `name` by level of `key`."""
    levels: dict[str, set[str]] = {}
    for row in rows:
        levels.setdefault(row[key], set()).add(row[name])
    return levels


def _missing_combination(rows: Rows, crossed: Sequence[str], everybody: Sequence[Rows]) -> str:
    """Return the first combination of levels (of all groups) that is not among the rows, as text."""
    levels = [dict.fromkeys(row[name] for group in everybody for row in group) for name in crossed]
    there = {tuple(row[name] for name in crossed) for row in rows}
    for cell in product(*levels):
        if cell not in there:
            return " with ".join(f"{name} {level}" for name, level in zip(crossed, cell, strict=True))
    return ""


def _texts(value: Any) -> tuple[str, ...]:
    return (value,) if isinstance(value, str) else tuple(value) if isinstance(value, tuple) else ()
