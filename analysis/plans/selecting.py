"""Selection of a study's rows: the exclusions of a plan, and the rows of one test or figure.

Exclusions are counted by line: who, which trials, which ratings, and why.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeAlias

import pandas as pd

from palpate.analysis.figures.figure_kind import FigureKind, FigureSettings
from palpate.analysis.plans.answers import (
    FACTORS,
    Kind,
    Selected,
    StatisticSettings,
    columns_named,
    require_columns,
)
from palpate.analysis.plans.reading import AnalysisPlan, Outlying, Plan, Rule
from palpate.analysis.plans.sources import OF_NUMBERS, is_plain, source_of, source_problem, value_column
from palpate.analysis.plans.where import (
    Range,
    Where,
    compared_levels,
    first_word,
    level_texts,
    levels_of,
    matching_rows,
)
from palpate.analysis.ratings.collected_choices import common_tracks
from palpate.analysis.ratings.dataset import DataRefused, DeclarationRefused, Exclusion, NoRows, Ratings, natural
from palpate.analysis.ratings.design import CellFaults, cell_faults
from palpate.analysis.ratings.diagnostics import diagnose
from palpate.analysis.ratings.own_answers import TIMES
from palpate.analysis.ratings.people import SESSION, refuse_small_groups
from palpate.analysis.ratings.reading import OF_A_RATING, Material
from palpate.analysis.reliability.sessions import answered_trials
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.forms import own_tables
from palpate.protocols.wording import some

ANSWER = ("participant", "session", "trial", "form", "attribute", "kind", "word")
"""The columns that identify an answer within a session."""
Scale: TypeAlias = tuple[float, float] | None
TRIAL = ["participant", "session", "trial"]


@dataclass(frozen=True)
class Left:
    """The remaining material, and a line for the exclusions of each rule, including rules that excluded nothing."""

    material: Material
    lines: tuple[Exclusion, ...]


def apply_exclusions(material: Material, declared: AnalysisPlan) -> Left:
    """Apply the plan's rules in order, each to the remaining material.

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
    """Return the material without what one rule leaves out, and lines on it."""
    where = rule.where or {}
    if where and len(material.people.named(material.trials, where)) == len(where):
        # Leave out the participants with these answers about themselves, also those without a trial.
        everybody = material.people.added(pd.DataFrame({"participant": list(material.participants)}), tuple(where))
        people = [str(who) for who in everybody.loc[_keeps(everybody, where), "participant"]]
        return _without_people(material, people, rule.because)
    if rule.outlying is not None:
        return _without_outlying(material, rule.outlying, rule.because)
    if rule.where is not None:
        named = material.people.added(material.trials, tuple(rule.where))
        return _without_trials(material, material.trials[_keeps(named, rule.where)], rule.because)
    if rule.faster_than_s is not None or rule.slower_than_s is not None:
        return _without_trials(material, _trials_beyond_time(material, rule), rule.because)
    return _without_people(material, _bad_people(material, rule), rule.because)


def _trials_beyond_time(material: Material, rule: Rule) -> pd.DataFrame:
    """Return the trials (participant, session, trial) whose last rating, or choice, is too fast or too slow."""
    tables = [material.ratings.table] if material.ratings is not None else material.own.values()
    timed = ((table, column) for table in tables for column in TIMES if column in table.columns)
    table, column = next(timed, (None, ""))
    if table is None:
        raise DataRefused(f"{material.name!r}: no response times are recorded; leave faster_than_s, slower_than_s out")
    slowest = table.groupby(TRIAL, as_index=False)[column].max()
    seconds = slowest[column]
    bad = seconds < rule.faster_than_s if rule.faster_than_s is not None else seconds > (rule.slower_than_s or 0.0)
    return pd.DataFrame(slowest[bad])


def _without_trials(material: Material, trials: pd.DataFrame, why: str) -> tuple[Material, list[Exclusion]]:
    """Leave out trials, each known by its session and place, in an imported table by all that the table says of it."""
    key = TRIAL if "session" in trials.columns else [name for name in trials.columns if name not in OF_A_RATING]
    gone = set(zip(*(trials[name].tolist() for name in key), strict=True))
    whose = ["participant", "session"] if "session" in trials.columns else ["participant"]
    lines = [
        Exclusion("trials", ", session ".join(map(str, names)), why, len(rows))
        for names, rows in trials.groupby(whose, sort=True)
    ]

    def stays(table: pd.DataFrame) -> pd.Series[bool]:
        if not set(key) <= set(table.columns):
            return pd.Series(True, index=table.index)
        keys = zip(*(table[name].tolist() for name in key), strict=True)
        return pd.Series([key not in gone for key in keys], index=table.index, dtype=bool)

    return material.filtered(stays), lines


def _bad_people(material: Material, rule: Rule) -> list[str]:
    if rule.participants is not None:
        return [who for who in material.participants if who in rule.participants]
    if rule.fewer_than is not None:
        # Leave out those with too few answered trials, also somebody who answered a form and no trial at all.
        if "session" not in material.trials.columns:
            raise DataRefused(f"{material.name!r}: no session is recorded, which `fewer_than` counts; leave it out")
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
    # Otherwise the rule is `flagged`: leave out those on whom at least so many of the rater diagnostics raise a flag.
    least = rule.flagged or 1
    ratings = material.ratings
    if ratings is None or ratings.scale is None:
        raise DataRefused(f"{material.name!r}: `flagged` needs ratings on a declared scale")
    if "session" not in ratings.table.columns:
        raise DataRefused(f"{material.name!r}: no session is recorded, which `flagged` looks at; leave it out")
    bad = []
    for who, rows in ratings.table.groupby("participant", sort=True):
        sessions = [answered_trials(own) for _, own in rows.groupby("session", sort=True)]
        signs = [diagnose(trials, ratings.scale.low, ratings.scale.high) for trials in sessions]
        if max(sum(sign.flagged for sign in own) for own in signs) >= least:
            bad.append(str(who))
    return bad


def matching(table: pd.DataFrame, where: Where, name: str) -> pd.Series[bool]:
    """Return which rows have the levels of `where` in all columns.

    Raises DeclarationRefused on an unknown column and on a range of words, NoRows on a level that nothing has.
    """
    for column, condition in where.items():
        if column not in table.columns:
            raise DeclarationRefused(f"{name!r}: no column {column!r}; {nearest(column, map(str, table.columns))}")
        known = set(level_texts(table[column].dropna()))
        if isinstance(condition, Range) and (word := first_word(known)) is not None:
            raise DeclarationRefused(
                f"{name!r}: {column!r} holds words, as {word!r}; a range ({condition}) asks about numbers"
            )
        for level in compared_levels(table[column], condition):
            if level not in known and known:
                raise NoRows(f"{name!r}: no {column} {level!r}; {nearest(level, sorted(known))}")
    return _keeps(table, where)


def _keeps(table: pd.DataFrame, where: Where) -> pd.Series[bool]:
    chosen = pd.Series(True, index=table.index)
    for column, condition in where.items():
        chosen &= matching_rows(table[column], condition)
    return chosen


def _without_people(material: Material, people: list[str], why: str) -> tuple[Material, list[Exclusion]]:
    whose = (material.trials if material.ratings is None else material.ratings.table)["participant"]
    lines = [Exclusion("participant", who, why, int((whose == who).sum())) for who in people]
    return material.filtered(lambda table: ~table["participant"].isin(people)), lines


def _without_outlying(material: Material, rule: Outlying, why: str) -> tuple[Material, list[Exclusion]]:
    """Leave out ratings far from the mean of their cell, which includes them; a cell of equal values has none."""
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


@dataclass(frozen=True)
class Selector:
    """A selector of the rows of tests and figures, from the material after exclusions, the plan, and its own tables."""

    material: Material
    plan: Plan
    tables: Mapping[str, pd.DataFrame] = field(default_factory=dict)

    @cached_property
    def _known_faults(self) -> dict[bool, CellFaults]:
        return {}

    def faults(self, settings: StatisticSettings | None = None) -> CellFaults:
        """Return every cell of the ratings that is missing, filled too often or not in the design.

        For a test that names `session`, cells are by session.
        """
        ratings = self.material.ratings
        by_session = settings is not None and SESSION in (*columns_named(settings), *settings.where)
        if by_session not in self._known_faults:
            none = ratings is None or not len(ratings.table)
            self._known_faults[by_session] = (
                CellFaults() if none or ratings is None else cell_faults(ratings, by_session)
            )
        return self._known_faults[by_session]

    def _without_rows(self) -> Selected:
        """Return what a figure has that shows answers of tests alone."""
        declared, empty = self.plan.declared, self.material.trials.iloc[:0]
        return Selected(
            table=empty, trials=empty, outcomes=(), levels={}, alpha=declared.alpha, seed=declared.seed,
            draws=declared.draws,
        )  # fmt: skip

    def of(self, settings: StatisticSettings | FigureSettings, kind: Kind | FigureKind) -> Selected:
        """Return the rows of a test or figure, for all outcomes together. Raises DataRefused if there are none."""
        if kind.takes is None:
            return self._without_rows()
        if problem := source_problem(settings, kind):
            raise DeclarationRefused(f"{settings.name!r}: {problem}")
        takes = source_of(settings, kind)
        table, scale = self._table(settings, takes)
        if (value := value_column(settings, kind)) is not None:
            require_columns(table, (value,))
            table = table.assign(value=table[value])
        if takes != "table":
            refuse_repeated(table, self.material.name, self._keys(takes))
            table, silent = self._of_people(settings, table)
        else:
            silent = ()
            table = _where(table, matching(table, settings.where, self.material.name))
        if not len(table) and takes != "words":
            raise NoRows(f"{self.material.name!r}: no rows are left for {settings.name!r}")
        outcomes = self._outcomes(settings, table, takes)
        if takes in OF_NUMBERS and "attribute" in table.columns:
            table = _where(table, table["attribute"].isin(outcomes))
        if not len(table) and takes != "words":
            raise NoRows(f"{self.material.name!r}: no rows are left for {settings.name!r}")
        material, declared = self.material, self.plan.declared
        study, ratings = material.study, material.ratings
        listed = study.adjectives.words if study is not None and study.adjectives is not None else ()
        trials = self.trials(settings.where)
        known = {column: level for column, level in settings.where.items() if column in trials.columns}
        selected = Selected(
            table=table,
            trials=_where(material.trials, matching(trials, known, material.name)),
            outcomes=outcomes,
            levels=_levels(material.levels, table),
            alpha=declared.alpha,
            seed=declared.seed,
            draws=declared.draws,
            scale=scale,
            offered=tuple(column.word for column in listed),
            antonyms={} if ratings is None else ratings.antonyms,
            categories={} if ratings is None else ratings.categories,
            tables=self.tables,
            tracks=common_tracks(study) if takes == "choices" and study is not None else {},
        )
        return replace(selected, unanswered=silent)

    def by_outcome(self, selected: Selected) -> Iterator[Selected]:
        """Yield the selection of each outcome; tests with all ratings of an outcome share one table."""
        ratings = self.material.ratings
        shared = self._shared_tables if ratings is not None and selected.table is ratings.table else {}
        for outcome in selected.outcomes:
            if outcome not in shared:
                shared[outcome] = _where(selected.table, selected.table["attribute"] == outcome)
            yield replace(selected, table=shared[outcome], outcomes=(outcome,))

    @cached_property
    def _shared_tables(self) -> dict[str, pd.DataFrame]:
        return {}

    def trials(self, where: Where) -> pd.DataFrame:
        """Return the study's trials, with the columns of people and sessions that `where` names."""
        return self.material.people.added(self.material.trials, tuple(where))

    def _of_people(
        self, settings: StatisticSettings | FigureSettings, table: pd.DataFrame
    ) -> tuple[pd.DataFrame, tuple[str, ...]]:
        """Return the rows of `where` with the named columns of people and sessions, and the people that are left out.

        People who did not answer a question that is a column are left out. Raises DataRefused if somebody did not
        answer and the missing policy is to refuse, or if a group is too small.
        """
        people, name = self.material.people, self.material.name
        named, grouping = columns_named(settings), columns_named(settings, FACTORS)
        columns = people.named(table, (*named, *settings.where))
        chosen = matching(people.added(table, tuple(settings.where)), settings.where, name)
        table = people.added(_where(table, chosen), named)
        factors = [column for column in columns if column in named]
        silent = set(table.loc[table[factors].isna().any(axis=1), "participant"]) if factors else set()
        if silent and (getattr(settings, "missing", None) or self.plan.declared.missing) == "refuse":
            raise DataRefused(
                f"{settings.name!r}: no answer to {' or '.join(factors)} from {some(sorted(silent))}; leave such "
                "participants out with `missing: listwise`"
            )
        table = _where(table, ~table["participant"].isin(silent)) if silent else table
        groups = [column for column in columns if column in grouping or column in settings.where]
        if groups:
            ranges = {
                name: str(condition) for name, condition in settings.where.items() if isinstance(condition, Range)
            }
            one_group = {name: text for name, text in ranges.items() if name in groups and name not in grouping}
            alike = people.added(table, groups).assign(**one_group)
            refuse_small_groups(alike, groups, self.plan.declared.least_people, settings.name)
        return table, tuple(sorted(silent))

    def _keys(self, takes: str) -> tuple[str, ...]:
        """Return the columns that identify a row of this table within a session."""
        own = own_tables().get(takes) if is_plain(takes) else None
        return ANSWER if own is None else (*TRIAL, *(column.name for column in own.columns if column.key))

    def _table(self, settings: StatisticSettings | FigureSettings, takes: str) -> tuple[pd.DataFrame, Scale]:
        if takes == "table":
            if settings.table is None:
                raise DeclarationRefused(f"{settings.name!r} needs a table of the plan's own; name it with `table`")
            return self.tables[settings.table], None
        if takes == "words":
            return self.material.words, None
        if is_plain(takes):
            own = self.material.own.get(takes, pd.DataFrame())
            if not len(own):
                raise NoRows(f"{self.material.name!r} has no {takes}, which {settings.name!r} asks about")
            return own, None
        material = self.material
        if takes == "forms":
            # The questionnaire's items: an answer about the person (age, hand) is no outcome.
            questionnaire = None if material.study is None else material.study.questionnaire
            if questionnaire is None or not questionnaire.items:
                raise DeclarationRefused(f"{material.name!r} has no questionnaire, which {settings.name!r} asks about")
            order = {item.name: place for place, item in enumerate(questionnaire.items)}
            items = material.forms[material.forms["attribute"].isin(list(order))]
            ranked = items.assign(_rank=items["attribute"].map(order))
            ranked = ranked.sort_values(["_rank", "participant"], ignore_index=True)
            return ranked.drop(columns="_rank"), (1.0, float(questionnaire.points))
        if material.ratings is None:
            raise DeclarationRefused(f"{material.name!r} has no ratings, which {settings.name!r} asks about")
        how = settings.normalise or self.plan.declared.normalise
        table, scale = material.ratings.table, _ends(material.ratings)
        if how == "none":
            return table, scale
        from palpate.analysis.ratings.normalisation import normalised

        return normalised(table, scale, how)

    def _outcomes(
        self, settings: StatisticSettings | FigureSettings, table: pd.DataFrame, takes: str
    ) -> tuple[str, ...]:
        ratings = self.material.ratings
        if takes == "ratings" and ratings is not None:
            known = ratings.attributes
        elif takes == "forms":
            known = tuple(dict.fromkeys(table["attribute"]))
        else:
            return settings.outcomes or ()
        for name in settings.outcomes or ():
            if name not in known:
                raise DeclarationRefused(f"{settings.name!r}: no outcome {name!r}; {nearest(name, known)}")
        return tuple(name for name in known if settings.outcomes is None or name in settings.outcomes)


def all_ratings(ratings: Ratings) -> Selected:
    """Return all ratings of a data set, for a figure or a test outside a plan."""
    families = (ratings.families,) if ratings.families else ()
    named = ("participant", "attribute", *ratings.within, *ratings.between, *families)
    trials = ratings.table.drop(columns=list(OF_A_RATING), errors="ignore")
    return Selected(
        table=ratings.table,
        trials=trials.drop_duplicates(ignore_index=True),
        outcomes=ratings.attributes,
        levels=_levels({name: ratings.levels(name) for name in named}, ratings.table),
        scale=_ends(ratings),
        antonyms=ratings.antonyms,
        categories=ratings.categories,
    )


def refuse_repeated(table: pd.DataFrame, name: str, keys: tuple[str, ...] = ANSWER) -> None:
    """Raise DataRefused for a duplicate answer of a session, which would have double weight."""
    columns = [column for column in keys if column in table.columns]
    if "session" not in columns or not {"trial", "form"} & set(columns):
        return  # an imported table, whose repetitions its own design check counts
    repeated = table.duplicated(columns, keep=False)
    if repeated.any():
        first = ", ".join(f"{column} {value}" for column, value in table.loc[repeated, columns].iloc[0].items())
        raise DataRefused(f"{name!r}: {int(repeated.sum())} rows hold the same answers twice, the first: {first}")


def _where(table: pd.DataFrame, chosen: pd.Series[bool]) -> pd.DataFrame:
    """Return the chosen rows with a new index; the table itself if all rows of an indexed table are chosen."""
    if chosen.all() and table.index.equals(pd.RangeIndex(len(table))):
        return table
    return table[chosen].reset_index(drop=True)


def _ends(ratings: Ratings) -> Scale:
    return None if ratings.scale is None else (ratings.scale.low, ratings.scale.high)


def _levels(known: Mapping[str, tuple[str, ...]], table: pd.DataFrame) -> dict[str, tuple[str, ...]]:
    """Return the levels of each text column that occur here, in the study's order if it has one."""
    levels: dict[str, tuple[str, ...]] = {}
    for column in map(str, table.columns):
        if table[column].dtype == object or pd.api.types.is_string_dtype(table[column]):
            there = {str(level) for level in table[column].dropna().unique()}
            listed = [level for level in known.get(column, ()) if level in there]
            levels[column] = (*listed, *natural(there - set(listed)))
    return levels
