"""Problems of tests of one kind, known from a study's declaration alone, that no answers could solve."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING, Any

from palpate.analysis.plans.study_factors import TRIAL, missing_combination
from palpate.analysis.ratings.reading import column_name
from palpate.protocols.complaints import Problem
from palpate.protocols.study import is_number
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from palpate.analysis.plans.study_factors import Rows, StudyFactors


def likert_problems(settings: Any, design: StudyFactors, _outcomes: Collection[str]) -> Iterator[Problem]:
    """Yield a problem where ratings have no points that could be counted."""
    scale = design.study.scale
    if settings.source == "ratings" and scale is not None and scale.step is None:
        yield Problem(("source",), "ratings on a scale without steps have no points to count")


def crossing_problems(settings: Any, design: StudyFactors, outcomes: Collection[str]) -> Iterator[Problem]:
    """Yield problems that prevent every rater from rating every target."""
    targets, raters, where = settings.targets, settings.raters, settings.where
    groups = design.groups(settings, outcomes)
    if targets == raters:
        yield Problem(("raters",), f"{raters!r} is named in `targets`, too")
        return
    for key, name, other in (("targets", targets, raters), ("raters", raters, targets)):
        kind = design.varies(name, groups, where)
        if kind not in ("participant", "within") or (name == "trial" and other != "participant"):
            yield Problem((key,), f"not every level of {name!r} is met with every level of {other!r}")
            return
    names = [n for n in (targets, raters) if n != TRIAL and design.varies(n, groups, where) == "within"]
    for rows in groups.values():
        if names and (gap := missing_combination(rows, names, list(groups.values()))):
            yield Problem(("targets",), f"nobody meets {gap}")
            return


def alpha_problems(settings: Any, design: StudyFactors, outcomes: Collection[str]) -> Iterator[Problem]:
    """Yield a problem if a case of Cronbach's alpha, a combination of its columns, is without some item."""
    groups = design.groups(settings, outcomes)
    cases = settings.cases or ("participant", "stimulus")
    if settings.items in cases:
        yield Problem(("items",), f"{settings.items!r} is among the cases, too; name other columns in `cases`")
        return
    if settings.items == TRIAL and set(cases) - {"participant", "session"}:
        yield Problem(("items",), f"{TRIAL!r} is not met with every level of another factor")
    kind = design.varies(settings.items, groups, settings.where)
    if kind in ("one level", "unknown") or (kind == "between" and "participant" in cases):
        yield Problem(("items",), design.misplaced(settings.items, "within", groups, settings.where))
    named = [name for name in cases if name in design.columns]
    for rows in groups.values() if kind == "within" and settings.items != TRIAL else ():
        met = _by([{**row, "case": " ".join(row[name] for name in named)} for row in rows], "case", settings.items)
        if len(set(map(len, met.values()))) > 1 or len(next(iter(met.values()))) < len(set().union(*met.values())):
            yield Problem(("items",), f"not every case has every level of {settings.items!r}")
            return


def retest_problems(settings: Any, design: StudyFactors, outcomes: Collection[str]) -> Iterator[Problem]:
    """Yield problems of test and retest: several answers at one moment, or no stimulus that is met twice."""
    groups = design.groups(settings, outcomes)
    rows = [row for own in groups.values() for row in own]
    sessions = {row["session"] for row in rows}
    ordered = {"session", TRIAL} if len(sessions) > 1 else {TRIAL}
    named = [*settings.targets, *settings.order]
    if not ordered <= set(settings.order) and all(name in design.columns for name in named):
        moments = [tuple(row[name] for name in ("group", "attribute", *named)) for row in rows]
        if len(set(moments)) < len(moments) or design.study.order.repeats > 1:
            yield Problem(("order",), f"several answers are at the same moment; name {' and '.join(sorted(ordered))}")
    if len(sessions) == 1 and design.study.order.repeats == 1 and "stimulus" in settings.targets:
        yield Problem(("targets",), "nobody meets a stimulus twice: repeat stimuli, or have several sessions")


def trend_problems(settings: Any, design: StudyFactors, outcomes: Collection[str]) -> Iterator[Problem]:
    """Yield problems of trends: levels in several families or at several numbers, or families of one level."""
    groups = design.groups(settings, outcomes)
    rows = [row for own in groups.values() for row in own]
    for key in ("families", "pooled"):
        if getattr(settings, key) not in design.columns - {"attribute", "session", "group", "study"}:
            yield Problem((key,), f"{getattr(settings, key)!r} is no column of the stimuli")
            return
    for key, name in (("families", settings.families), ("numeric", settings.numeric)):
        if name is None:
            continue
        if name not in design.columns:
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


def category_problems(settings: Any, design: StudyFactors, outcomes: Collection[str]) -> Iterator[Problem]:
    """Yield a problem where the attributes compared are not of two categories, or of none."""
    for key in ("by", "over"):
        if "attribute" in getattr(settings, key):
            yield Problem((key,), "'attribute' has a place in this test already: attributes are compared")
    categories = [attribute.category for attribute in design.study.attributes if attribute.name in outcomes]
    if None in categories or len(set(categories)) != 2:
        yield Problem(("outcomes",), "attributes of two categories are compared: say `category` in the study")


def target_problems(settings: Any, design: StudyFactors, outcomes: Collection[str]) -> Iterator[Problem]:
    """Yield problems of errors from targets: columns that are not the stimuli's, or name no attribute."""
    groups = design.groups(settings, outcomes)
    for key in ("target", "attribute_column"):
        if getattr(settings, key) not in design.columns - {"attribute", "session", "group", "study"}:
            yield Problem((key,), f"{getattr(settings, key)!r} is no column of the stimuli")
            return
    named = {row[settings.attribute_column] for rows in groups.values() for row in rows}
    if not named & set(outcomes):
        yield Problem(("attribute_column",), f"{settings.attribute_column!r} names none of the attributes asked")


def map_problems(settings: Any, design: StudyFactors, outcomes: Collection[str]) -> Iterator[Problem]:
    """Yield problems of a map: outcomes beside those of pairs, or more dimensions than distances can span."""
    if getattr(settings, "pairs", None) is not None:
        if len(outcomes) != 1:
            yield Problem(("outcomes",), f"`pairs` needs one outcome; here are {', '.join(outcomes)}")
        return
    if getattr(settings, "on", "") == "attributes":
        return
    rows = [row for own in design.groups(settings, outcomes).values() for row in own]
    levels = {name: {row[name] for row in rows if name in row} for name in (settings.over, settings.items)}
    points, items = (len(levels[name]) or math.inf for name in (settings.over, settings.items))
    nonmetric = "nonmetric" in (getattr(settings, "method", ""), getattr(settings, "on", ""))
    most = points - 1 if nonmetric else min(points - 1, items)
    if settings.dimensions > most:
        by = "" if nonmetric else f" by {items} of {settings.items!r}"
        message = f"a map of {points} levels of {settings.over!r}{by} has {count(int(most), 'dimension')} at most"
        yield Problem(("dimensions",), message)


def _by(rows: Rows, key: str, name: str) -> dict[str, set[str]]:
    """Return the levels of `name` by level of `key`."""
    levels: dict[str, set[str]] = {}
    for row in rows:
        levels.setdefault(row[key], set()).add(row[name])
    return levels


def intensity_problems(settings: Any, design: StudyFactors, _outcomes: Collection[str]) -> Iterator[Problem]:
    """Yield a problem unless the intensity is a column of the stimuli with a number above 0 for each."""
    of_stimuli = [{column_name(name): level for name, level in s.columns.items()} for s in design.study.stimuli]
    if any(settings.intensity not in columns for columns in of_stimuli):
        yield Problem(("intensity",), f"{settings.intensity!r} is no column of the stimuli, each of which has one")
    elif wrong := [
        columns[settings.intensity] for columns in of_stimuli if not above_zero(columns[settings.intensity])
    ]:
        yield Problem(("intensity",), f"found {wrong[0]!r} in {settings.intensity!r}; numbers above 0 are expected")


def above_zero(text: str) -> bool:
    """Return whether a text is a number above 0."""
    return is_number(text) and float(text) > 0
