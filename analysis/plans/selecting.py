"""From a study's material to the rows that one test or figure is asked about."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeAlias

import pandas as pd

from palpate.analysis.figures.figure_kind import FigureSettings
from palpate.analysis.plans.answers import FACTORS, Normalise, Selected, StatisticSettings, Takes, columns_named
from palpate.analysis.plans.exclusions import matching
from palpate.analysis.plans.material import OF_A_RATING, SESSION, Material, refuse_small_groups
from palpate.analysis.plans.reading import Plan
from palpate.analysis.plans.where import Range, Where
from palpate.analysis.ratings.dataset import DataRefused, Ratings, natural
from palpate.analysis.ratings.design import Faults, cell_faults
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import some

ANSWER = ("participant", "session", "trial", "form", "attribute", "kind", "word")
"""What tells one answer of a session from every other."""
Scale: TypeAlias = tuple[float, float] | None


@dataclass(frozen=True)
class Selecting:
    """What selections are made from: the material after exclusions, the plan, and the plan's own tables."""

    material: Material
    plan: Plan
    tables: Mapping[str, pd.DataFrame] = field(default_factory=dict)

    @cached_property
    def _faults(self) -> dict[bool, Faults]:
        return {}

    def faults(self, settings: StatisticSettings | None = None) -> Faults:
        """Every cell of the ratings that is missing, filled too often or not of the design.

        A test that names `session` is asked about the cells of each session.
        """
        ratings = self.material.ratings
        by_session = settings is not None and SESSION in (*columns_named(settings), *settings.where)
        if by_session not in self._faults:
            none = ratings is None or not len(ratings.table)
            self._faults[by_session] = Faults() if none or ratings is None else cell_faults(ratings, by_session)
        return self._faults[by_session]

    def of(self, settings: StatisticSettings | FigureSettings, takes: Takes) -> Selected:
        """The rows that are asked about, all outcomes together. Raises DataRefused where there are none."""
        takes = "table" if settings.table is not None else settings.source or takes
        table, scale = self._table(settings, takes)
        if takes != "table":
            refuse_repeated(table, self.material.name)
            table, silent = self._of_people(settings, table)
        else:
            silent = ()
            table = _where(table, matching(table, settings.where, self.material.name))
        outcomes = self._outcomes(settings, table, takes)
        if "attribute" in table.columns and takes != "table":
            table = _where(table, table["attribute"].isin(outcomes))
        if not len(table) and takes != "words":
            raise DataRefused(f"{self.material.name!r}: no rows are left for {settings.name!r}")
        return replace(self._selected(settings, table, outcomes, scale), unanswered=silent)

    def by_outcome(self, selected: Selected) -> Iterator[Selected]:
        """The selection of each outcome by itself; tests about all ratings of an outcome share one table."""
        ratings = self.material.ratings
        shared = self._of_outcomes if ratings is not None and selected.table is ratings.table else {}
        for outcome in selected.outcomes:
            if outcome not in shared:
                shared[outcome] = _where(selected.table, selected.table["attribute"] == outcome)
            yield replace(selected, table=shared[outcome], outcomes=(outcome,))

    @cached_property
    def _of_outcomes(self) -> dict[str, pd.DataFrame]:
        return {}

    def trials(self, where: Where) -> pd.DataFrame:
        """Return the trials of the study, with the columns of people and sessions that a `where` names."""
        return self.material.people.added(self.material.trials, tuple(where))

    def _of_people(
        self, settings: StatisticSettings | FigureSettings, table: pd.DataFrame
    ) -> tuple[pd.DataFrame, tuple[str, ...]]:
        """The rows of `where`, with the columns of people and sessions that are asked for, and who is left out.

        Left out are those who did not answer a question that is a column.

        Raises DataRefused where somebody did not answer and the missing policy is to refuse, or a group is too small.
        """
        people, name = self.material.people, self.material.name
        named, grouping = columns_named(settings), columns_named(settings, FACTORS)
        asked_of = people.named(table, (*named, *settings.where))
        chosen = matching(people.added(table, tuple(settings.where)), settings.where, name)
        table = people.added(_where(table, chosen), named)
        factors = [column for column in asked_of if column in named]
        silent = set(table.loc[table[factors].isna().any(axis=1), "participant"]) if factors else set()
        if silent and (getattr(settings, "missing", None) or self.plan.declared.missing) == "refuse":
            raise DataRefused(
                f"{settings.name!r}: no answer to {' or '.join(factors)} from {some(sorted(silent))}; leave such "
                "participants out with `missing: listwise`"
            )
        table = _where(table, ~table["participant"].isin(silent)) if silent else table
        groups = [column for column in asked_of if column in grouping or column in settings.where]
        if groups:
            ranges = {
                name: str(condition) for name, condition in settings.where.items() if isinstance(condition, Range)
            }
            one_group = {name: told for name, told in ranges.items() if name in groups and name not in grouping}
            alike = people.added(table, groups).assign(**one_group)
            refuse_small_groups(alike, groups, self.plan.declared.least_people, settings.name)
        return table, tuple(sorted(silent))

    def _selected(
        self,
        settings: StatisticSettings | FigureSettings,
        table: pd.DataFrame,
        outcomes: tuple[str, ...],
        scale: tuple[float, float] | None,
    ) -> Selected:
        material, declared = self.material, self.plan.declared
        study, ratings = material.study, material.ratings
        listed = study.adjectives.words if study is not None and study.adjectives is not None else ()
        trials = self.trials(settings.where)
        known = {column: level for column, level in settings.where.items() if column in trials.columns}
        return Selected(
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
        )

    def _table(self, settings: StatisticSettings | FigureSettings, takes: Takes) -> tuple[pd.DataFrame, Scale]:
        if takes == "table":
            if settings.table is None:
                raise DataRefused(f"{settings.name!r} needs a table of the plan's own; name it with `table`")
            return self.tables[settings.table], None
        if takes == "words":
            return self.material.words, None
        if takes == "forms":
            study = self.material.study
            points = None if study is None or study.questionnaire is None else (1.0, float(study.questionnaire.points))
            return _asked_forms(self.material, settings.name), points
        return self._ratings(settings.normalise or self.plan.declared.normalise, settings.name)

    def _ratings(self, how: Normalise, name: str) -> tuple[pd.DataFrame, Scale]:
        ratings = self.material.ratings
        if ratings is None:
            raise DataRefused(f"{self.material.name!r} has no ratings, which {name!r} asks about")
        scale = _ends(ratings)
        if how == "none":
            return ratings.table, scale
        from palpate.analysis.ratings.normalisation import normalised

        return normalised(ratings.table, scale, how)

    def _outcomes(
        self, settings: StatisticSettings | FigureSettings, table: pd.DataFrame, takes: Takes
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
                raise DataRefused(f"{settings.name!r}: no outcome {name!r}; {nearest(name, known)}")
        return tuple(name for name in known if settings.outcomes is None or name in settings.outcomes)


def all_ratings(ratings: Ratings) -> Selected:
    """Every rating of a data set as it stands: what a figure or a test that no plan names is asked about."""
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


def refuse_repeated(table: pd.DataFrame, name: str) -> None:
    """Raise DataRefused where one answer of a session stands twice: averaged, or counted, it would weigh double."""
    columns = [column for column in ANSWER if column in table.columns]
    if "session" not in columns or not {"trial", "form"} & set(columns):
        return  # an imported table, whose repetitions its own design check counts
    repeated = table.duplicated(columns, keep=False)
    if repeated.any():
        first = ", ".join(f"{column} {value}" for column, value in table.loc[repeated, columns].iloc[0].items())
        raise DataRefused(f"{name!r}: {int(repeated.sum())} rows hold the same answers twice, the first: {first}")


def _asked_forms(material: Material, name: str) -> pd.DataFrame:
    """The questionnaire's items: what was asked about the person (age, hand) is no outcome."""
    study = material.study
    items = study.questionnaire.items if study is not None and study.questionnaire is not None else ()
    if not items:
        raise DataRefused(f"{material.name!r} has no questionnaire, which {name!r} asks about")
    order = {item.name: place for place, item in enumerate(items)}
    found = material.forms[material.forms["attribute"].isin(list(order))]
    rank = found["attribute"].map(order)
    return found.assign(_rank=rank).sort_values(["_rank", "participant"], ignore_index=True).drop(columns="_rank")


def _where(table: pd.DataFrame, chosen: pd.Series[bool]) -> pd.DataFrame:
    """The chosen rows, numbered anew; where all rows of a numbered table are chosen, the table itself."""
    if chosen.all() and table.index.equals(pd.RangeIndex(len(table))):
        return table
    return table[chosen].reset_index(drop=True)


def _ends(ratings: Ratings) -> Scale:
    return None if ratings.scale is None else (ratings.scale.low, ratings.scale.high)


def _levels(known: Mapping[str, tuple[str, ...]], table: pd.DataFrame) -> dict[str, tuple[str, ...]]:
    """The levels of each text column that occur here, in the study's order where it has one."""
    found: dict[str, tuple[str, ...]] = {}
    for column in map(str, table.columns):
        if table[column].dtype == object or pd.api.types.is_string_dtype(table[column]):
            there = {str(level) for level in table[column].dropna().unique()}
            listed = [level for level in known.get(column, ()) if level in there]
            found[column] = (*listed, *natural(there - set(listed)))
    return found
