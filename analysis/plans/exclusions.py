"""What a plan leaves out, rule by rule, each line counted: who, which trials, which ratings, and why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from palpate.analysis.plans.material import OF_A_RATING, Material
from palpate.analysis.plans.reading import AnalysisPlan, Outlying, Rule
from palpate.analysis.plans.where import Range, Where, first_word, kept_rows, levels_of
from palpate.analysis.ratings.dataset import DataRefused, Exclusion
from palpate.analysis.ratings.diagnostics import diagnose
from palpate.analysis.reliability.sessions import answered_trials
from palpate.protocols.did_you_mean import nearest

TRIAL = ["participant", "session", "trial"]


@dataclass(frozen=True)
class Left:
    """The material that is left, and a line for everything that a rule left out (also for one that met nothing)."""

    material: Material
    lines: tuple[Exclusion, ...]


def apply_exclusions(material: Material, declared: AnalysisPlan) -> Left:
    """Apply the plan's rules in their order, each to what the earlier ones left.

    Raises DataRefused on an unknown participant or column, and where nobody is left.
    """
    lines: list[Exclusion] = []
    whole = material
    for rule in declared.exclusions:
        # The data as they were read must have every person, column and level; an earlier rule may have left it out.
        where = dict(rule.where or {})
        people = () if isinstance(where.get("participant"), Range) else levels_of(where.pop("participant", ()))
        for who in (*(rule.participants or ()), *people):
            if who not in whole.participants and not any(line.who.split(",")[0] == who for line in whole.exclusions):
                near = nearest(who, whole.participants)
                raise DataRefused(f"{whole.name!r}: the plan leaves out {who!r}, who has no session; {near}")
        matching(whole.people.added(whole.trials, tuple(where)), where, whole.name)
        material, own = _applied(material, rule)
        lines += own or [Exclusion("nothing", "nobody", rule.because, 0)]
    if not material.participants:
        raise DataRefused(f"{material.name!r}: the plan's exclusions leave nobody; see exclusions of the plan")
    return Left(material, tuple(lines))


def _applied(material: Material, rule: Rule) -> tuple[Material, list[Exclusion]]:
    where = rule.where or {}
    if where and len(material.people.named(material.trials, where)) == len(where):
        # The participants with these answers about themselves, also those without a trial.
        everybody = material.people.added(pd.DataFrame({"participant": list(material.participants)}), tuple(where))
        people = [str(who) for who in everybody.loc[_keeps(everybody, where), "participant"]]
        return _without_people(material, people, rule.because)
    if rule.outlying is not None:
        return _without_outlying(material, rule.outlying, rule.because)
    if rule.faster_than_s is not None or rule.slower_than_s is not None or rule.where is not None:
        # A trial is known by its session and place, in an imported table by all that it says about it.
        trials = _bad_trials(material, rule)
        key = TRIAL if "session" in trials.columns else [name for name in trials.columns if name not in OF_A_RATING]
        gone = set(zip(*(trials[name].tolist() for name in key), strict=True))
        whose = ["participant", "session"] if "session" in trials.columns else ["participant"]
        lines = [
            Exclusion("trials", ", session ".join(map(str, names)), rule.because, len(rows))
            for names, rows in trials.groupby(whose, sort=True)
        ]

        def stays(table: pd.DataFrame) -> pd.Series[bool]:
            if not set(key) <= set(table.columns):
                return pd.Series(True, index=table.index)
            keys = zip(*(table[name].tolist() for name in key), strict=True)
            return pd.Series([key not in gone for key in keys], index=table.index, dtype=bool)

        return _kept(material, stays), lines
    return _without_people(material, _bad_people(material, rule), rule.because)


def _bad_people(material: Material, rule: Rule) -> list[str]:
    if rule.participants is not None:
        return [who for who in material.participants if who in rule.participants]
    if rule.fewer_than is not None:
        # Those with too few answered trials, also somebody who answered a form and no trial at all.
        if "session" not in material.trials.columns:
            raise DataRefused(f"{material.name!r}: no session is on record, which `fewer_than` counts; leave it out")
        answered = material.trials["session"].value_counts()
        whose = pd.concat([table[["session", "participant"]] for table in (material.trials, material.forms)])
        return sorted(
            {
                str(who)
                for session, who in whose.drop_duplicates().itertuples(index=False)
                if (planned := material.planned.get(session, 0))
                and answered.get(session, 0) / planned < rule.fewer_than
            }
        )
    # Those on whom at least so many of the rater diagnostics raise a flag.
    least = rule.flagged or 1
    ratings = material.ratings
    if ratings is None or ratings.scale is None:
        raise DataRefused(f"{material.name!r}: `flagged` needs ratings on a declared scale")
    if "session" not in ratings.table.columns:
        raise DataRefused(f"{material.name!r}: no session is on record, which `flagged` looks at; leave it out")
    bad = []
    for who, rows in ratings.table.groupby("participant", sort=True):
        sessions = [answered_trials(own) for _, own in rows.groupby("session", sort=True)]
        signs = [diagnose(trials, ratings.scale.low, ratings.scale.high) for trials in sessions]
        if max(sum(sign.flagged for sign in own) for own in signs) >= least:
            bad.append(str(who))
    return bad


def _bad_trials(material: Material, rule: Rule) -> pd.DataFrame:
    """The trials (participant, session, trial) that a rule leaves out."""
    if rule.where is not None:
        return material.trials[_keeps(material.people.added(material.trials, tuple(rule.where)), rule.where)]
    if material.ratings is None or "response_time_s" not in material.ratings.table.columns:
        raise DataRefused(f"{material.name!r}: no response times are on record; leave faster_than_s, slower_than_s out")
    seconds = material.ratings.table.groupby(TRIAL, as_index=False)["response_time_s"].max()
    if rule.faster_than_s is not None:
        bad = seconds["response_time_s"] < rule.faster_than_s
    else:
        bad = seconds["response_time_s"] > (rule.slower_than_s or 0.0)
    return pd.DataFrame(seconds[bad])


def matching(table: pd.DataFrame, where: Where, name: str) -> pd.Series[bool]:
    """Which rows have the wanted level in every column. Raises DataRefused on an unknown column or level."""
    for column, wanted in where.items():
        if column not in table.columns:
            raise DataRefused(f"{name!r}: no column {column!r}; {nearest(column, map(str, table.columns))}")
        known = set(table[column].dropna().astype(str))
        if isinstance(wanted, Range) and (word := first_word(known)) is not None:
            raise DataRefused(f"{name!r}: {column!r} holds words, as {word!r}; a range ({wanted}) asks about numbers")
        for level in levels_of(wanted):
            if level not in known and known:
                raise DataRefused(f"{name!r}: no {column} {level!r}; {nearest(level, sorted(known))}")
    return _keeps(table, where)


def _keeps(table: pd.DataFrame, where: Where) -> pd.Series[bool]:
    kept = pd.Series(True, index=table.index)
    for column, wanted in where.items():
        kept &= kept_rows(table[column], wanted)
    return kept


def _without_people(material: Material, people: list[str], why: str) -> tuple[Material, list[Exclusion]]:
    whose = (material.trials if material.ratings is None else material.ratings.table)["participant"]
    lines = [Exclusion("participant", who, why, int((whose == who).sum())) for who in people]
    return _kept(material, lambda table: ~table["participant"].isin(people)), lines


def _without_outlying(material: Material, rule: Outlying, why: str) -> tuple[Material, list[Exclusion]]:
    """Ratings far from the mean of their cell, themselves in it; a cell of equal values has none."""
    if material.ratings is None:
        raise DataRefused(f"{material.name!r}: `outlying` needs ratings")
    table = material.ratings.table
    for column in rule.within:
        if column not in table.columns:
            raise DataRefused(f"{material.name!r}: no column {column!r}; {nearest(column, map(str, table.columns))}")
    cells = table.groupby(list(rule.within), sort=False)["value"]
    unequal = cells.transform("max") > cells.transform("min")
    far = ((table["value"] - cells.transform("mean")).abs() > rule.sd * cells.transform("std")) & unequal
    lines = [
        Exclusion("ratings", str(who), why, len(rows)) for who, rows in table[far].groupby("participant", sort=True)
    ]
    ratings = replace(material.ratings, table=table[~far].reset_index(drop=True))
    return replace(material, ratings=ratings), lines


def _kept(material: Material, stays: Callable[[pd.DataFrame], Any]) -> Material:
    def part(table: pd.DataFrame) -> pd.DataFrame:
        return table[stays(table)].reset_index(drop=True) if len(table) else table

    ratings = material.ratings
    return replace(
        material,
        ratings=None if ratings is None else replace(ratings, table=part(ratings.table)),
        trials=part(material.trials),
        words=part(material.words),
        forms=part(material.forms),
    )
