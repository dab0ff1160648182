"""Tests of reliability in plans: raters, items and repetitions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field

from palpate.analysis.plans.answers import (
    Answer,
    Confidence,
    Kind,
    Row,
    Selected,
    StatisticSettings,
    missing_without_effect,
)
from palpate.analysis.plans.idle import ON_RANKS, Idle, outcomes_of_own_table
from palpate.protocols.registry import lazy_function
from palpate.protocols.wording import count

if TYPE_CHECKING:
    import pandas as pd

_OF_STUDY = "palpate.analysis.plans.families.problems_of_study"


class IccSpec(StatisticSettings):
    """The settings of intraclass correlations: `raters` rate `targets`, with the ratings in `value`."""

    test: Literal["icc"]
    targets: str = "stimulus"
    raters: str = "participant"
    value: str = "value"
    confidence: Confidence = 0.95


class AlphaSpec(StatisticSettings):
    """The settings of Cronbach's alpha: `items` is the column of items, `cases` are those of cases (None: who rated
    what).

    Items in `reverse` are reverse-keyed. `missing: listwise` leaves out cases with gaps.
    """

    test: Literal["cronbach_alpha"]
    items: str = "attribute"
    cases: tuple[str, ...] | None = None
    reverse: tuple[str, ...] = ()
    value: str = "value"
    confidence: Confidence = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        yield from outcomes_of_own_table(self)


class ConcordanceSpec(StatisticSettings):
    """The settings of Kendall's W; `p` is "auto" (exact if it can be enumerated), "exact", "permutation" or "chi2"."""

    test: Literal["kendall_w"]
    targets: str = "stimulus"
    raters: str = "participant"
    value: str = "value"
    p: Literal["auto", "exact", "permutation", "chi2"] = "auto"

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        if self.raters == "participant":
            yield Idle("normalise", ON_RANKS)


class KrippendorffSpec(StatisticSettings):
    """The settings of Krippendorff's alpha; a unit is a combination of `units`, gaps are allowed."""

    not_columns: ClassVar[frozenset[str]] = frozenset({"level"})
    test: Literal["krippendorff_alpha"]
    level: Literal["nominal", "ordinal", "interval", "ratio"]
    units: tuple[str, ...] = ("stimulus",)
    raters: str = "participant"
    value: str = "value"
    confidence: Confidence = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        yield from missing_without_effect(self, "on Krippendorff's alpha, which takes gaps as they are")


class RetestSpec(StatisticSettings):
    """The settings of test-retest: first against second answers to the same `targets`, in the order of `order`."""

    test: Literal["retest"]
    targets: tuple[str, ...] = ("stimulus",)
    order: tuple[str, ...] = ("session", "trial")
    confidence: Confidence = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        yield from missing_without_effect(self, "on pairs of answers, which are left out where one is missing")


class RatersSpec(StatisticSettings):
    """The settings of each participant against the others, flagged below a correlation of `least_r` (our choice)."""

    test: Literal["raters"]
    targets: tuple[str, ...] = ("stimulus",)
    least_r: Annotated[float, Field(ge=-1, le=1)] = 0.3

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        yield from missing_without_effect(self, "on raters, who are compared on what they rated")


def icc_answer(selected: Selected, settings: IccSpec) -> Answer:
    """Return the six intraclass correlations of one outcome."""
    from palpate.analysis.plans.answers import averaged, plain_rows, require_columns, with_interval
    from palpate.analysis.reliability.intraclass import icc

    require_columns(selected.table, (settings.targets, settings.raters, settings.value))
    result = icc(
        selected.table,
        settings.value,
        settings.targets,
        settings.raters,
        confidence=settings.confidence,
        aggregate="mean",
    )
    rows = plain_rows(result, finite=True)
    headline = "; ".join(
        with_interval(str(row["name"]), row["ICC"], row["ci_low"], row["ci_high"], settings.confidence)
        for row in rows
        if row["type"] in ("ICC2", "ICC2k")
    )
    sizes = f"{result.attrs['targets']} × {settings.targets}, {result.attrs['raters']} × {settings.raters}"
    kinds = {
        "ICC": "intraclass correlation of the row's type",
        "F": "F of no correlation, between targets over within (ICC1) or residual mean square",
        "p": "p of F, not adjusted",
        **_limits(settings.confidence, "exact (ICC1, ICC3) or Satterthwaite (ICC2)"),
    }
    method = "Intraclass correlations (Shrout & Fleiss 1979; names and limits: McGraw & Wong 1996)."
    notes = averaged(result.attrs.get("values_per_cell", (1, 1)))
    return _answer(selected, settings.value, rows, method, kinds, f"{headline} ({sizes}).", notes)


def alpha_answer(selected: Selected, settings: AlphaSpec) -> Answer:
    """Return Cronbach's alpha of all outcomes (or items) together: one row, with the items in `more`."""
    from palpate.analysis.plans.answers import averaged, plain_rows, plain_value, require_columns, with_interval
    from palpate.analysis.reliability.consistency import cronbach_alpha

    known = [name for name in ("participant", "stimulus") if name in selected.table.columns]
    cases = list(settings.cases or known)
    require_columns(selected.table, (settings.items, *cases, settings.value))
    missing: Any = "drop_cases" if settings.missing == "listwise" else "raise"
    options: dict[str, Any] = {"reverse": settings.reverse, "confidence": settings.confidence, "missing": missing}
    result = cronbach_alpha(selected.table, settings.value, settings.items, cases, aggregate="mean", **options)
    names = ("alpha", "ci_low", "ci_high", "standardised", "average_r", "cases", "note")
    row: Row = {name: plain_value(getattr(result, name), finite=True) for name in names} | {"items": len(result.items)}
    headline = with_interval("Cronbach's alpha", result.alpha, result.ci_low, result.ci_high, settings.confidence)
    notes = [*averaged(result.values_per_cell)]
    if result.dropped:
        notes.append(f"{count(len(result.dropped), 'case')} without a value for every item left out.")
    if len(cases) > 1:
        notes.append("Cases of one participant are not independent: the interval is too narrow by an unknown amount.")
    kinds = {
        "alpha": "Cronbach's alpha, raw",
        "standardised": "alpha of the items' z scores",
        "average_r": "mean correlation of two items",
        "item_total": "correlation of an item with the sum of all items",
        "item_rest": "correlation of an item with the sum of the others",
        **_limits(settings.confidence, "Feldt 1965"),
    }
    return _answer(
        selected,
        settings.value,
        (row,),
        "Cronbach's alpha (Cronbach 1951) with Feldt's interval (1965).",
        kinds,
        f"{headline} ({count(len(result.items), 'item')}, {count(result.cases, 'case')}).",
        notes,
        {"items": plain_rows(result.items, finite=True)},
    )


def concordance_answer(selected: Selected, settings: ConcordanceSpec) -> Answer:
    """Return Kendall's W of one outcome."""
    from palpate.analysis.plans.answers import averaged, coefficient, plain_rows, require_columns
    from palpate.analysis.reliability.concordance import kendall_w
    from palpate.analysis.statistics.apa import apa_p, number

    require_columns(selected.table, (settings.targets, settings.raters, settings.value))
    options: dict[str, Any] = {"p": settings.p, "aggregate": "mean"}
    if settings.p != "chi2":
        options |= {"draws": selected.draws, "seed": selected.seed}
    result = kendall_w(selected.table, settings.value, settings.targets, settings.raters, **options)
    row = result.iloc[0]
    kind = {"chi2": "χ²", "none": "no p"}.get(row["p_kind"], row["p_kind"])
    headline = f"Kendall's W is undefined: {row['note']}."
    if row["W"] >= 0:
        statistic = f"χ²({row['df']}) = {number(row['chi2'])}"
        headline = f"Kendall's W = {coefficient(row['W'])}, {statistic}, {apa_p(row['p'])} ({kind})."
    kinds = {
        "W": "Kendall's coefficient of concordance, corrected for ties",
        "mean_rank_r": "(m W - 1) / (m - 1), m raters",
        "p_chi2": "p of chi squared, not adjusted",
        "p": "p of the kind that p_kind names, not adjusted",
    }
    notes = [*averaged(result.attrs.get("values_per_cell", (1, 1)))]
    if row["p_kind"] == "permutation":
        notes.append(f"p from {selected.draws} shuffles of each rater's ranks, seed {selected.seed}.")
    method = "Kendall's W (Kendall & Babington Smith 1939; ties: Kendall 1970)."
    return _answer(selected, settings.value, plain_rows(result, finite=True), method, kinds, headline, notes)


def krippendorff_answer(selected: Selected, settings: KrippendorffSpec) -> Answer:
    """Return Krippendorff's alpha of one outcome, which may have gaps."""
    from dataclasses import asdict

    from palpate.analysis.plans.answers import averaged, plain_value, require_columns, with_interval
    from palpate.analysis.plans.families.rows import demand_once
    from palpate.analysis.reliability.krippendorff import krippendorff_alpha

    require_columns(selected.table, (*settings.units, settings.raters, settings.value))
    if settings.level in ("nominal", "ordinal"):
        demand_once(selected.table, (*settings.units, settings.raters), settings.level)
    mean: Literal["mean"] | None = "mean" if settings.level in ("interval", "ratio") else None
    options: dict[str, Any] = {"draws": selected.draws, "seed": selected.seed, "confidence": settings.confidence}
    columns = (list(settings.units), settings.raters, settings.level)
    result = krippendorff_alpha(selected.table, settings.value, *columns, aggregate=mean, **options)
    name = f"Krippendorff's alpha ({settings.level})"
    headline = with_interval(name, result.alpha, result.ci_low, result.ci_high, settings.confidence)
    sizes = f"{count(result.units, 'unit')}, {count(result.raters, 'rater')}, {count(result.missing, 'value')} missing"
    kinds = {
        "alpha": f"Krippendorff's alpha, {settings.level}",
        **_limits(settings.confidence, f"percentile bootstrap over units, {result.draws} draws, seed {result.seed}"),
    }
    method = "Krippendorff's alpha (Krippendorff 2011); gaps are allowed, a unit with one value says nothing."
    row = {key: plain_value(value, finite=True) for key, value in asdict(result).items() if key != "values_per_cell"}
    notes = averaged(result.values_per_cell)
    return _answer(selected, settings.value, (row,), method, kinds, f"{headline} ({sizes}).", notes)


def retest_answer(selected: Selected, settings: RetestSpec) -> Answer:
    """Return the agreement of first and second answers of one outcome, with people and pairs in `more`."""
    from palpate.analysis.plans.answers import plain_rows, require_columns, with_interval
    from palpate.analysis.reliability.repeated import retest

    require_columns(selected.table, (*settings.targets, *settings.order))
    columns = ("participant", list(settings.targets), list(settings.order))
    result = retest(selected.table, "value", *columns, confidence=settings.confidence)
    rows = plain_rows(result.measures, finite=True)
    headline = "; ".join(
        with_interval(str(row["measure"]), row["value"], row["ci_low"], row["ci_high"], settings.confidence)
        for row in rows
        if row["measure"] in ("ICC(A,1)", "Pearson r")
    )
    notes = ["Pairs of one participant are not independent: intervals are too narrow by an unknown amount."]
    if result.further:
        notes.append(f"{result.further} answers at third and later meetings are not used.")
    if result.incomplete:
        notes.append(f"{result.incomplete} pairs lack a value and are left out.")
    kinds = {"value": "the number that `measure` names", **_limits(settings.confidence, "of the row's own kind")}
    method = (
        "Test-retest of first and second meetings: ICC (McGraw & Wong 1996), limits of agreement (Bland & Altman 1999),"
        " standard error of measurement and smallest detectable change (Weir 2005; de Vet et al. 2006)."
    )
    more = {"people": plain_rows(result.people, finite=True), "pairs": plain_rows(result.pairs, finite=True)}
    sizes = f"{count(len(result.pairs), 'pair')}, {count(len(result.people), 'participant')}"
    return _answer(selected, "value", rows, method, kinds, f"{headline} ({sizes}).", notes, more)


def raters_answer(selected: Selected, settings: RatersSpec) -> Answer:
    """Return each participant against the others in each outcome, with diagnostics of the answers in `more`."""
    import pandas as pd

    from palpate.analysis.plans.answers import averaged, plain_rows, require_columns
    from palpate.analysis.reliability.rater_signs import rater_signs
    from palpate.analysis.reliability.sessions import compared_within, session_signs

    require_columns(selected.table, settings.targets)
    parts, sizes = [], []
    pools = compared_within(selected.table, settings.targets)
    for outcome in selected.outcomes:
        for rows in pools:
            own = rows[rows["attribute"] == outcome]
            result = rater_signs(own, "value", list(settings.targets), "participant", aggregate="mean")
            parts.append(result.rename(columns={"rater": "participant"}).assign(attribute=outcome))
            sizes.append(result.attrs.get("values_per_cell", (1, 1)))
    table = pd.concat(parts, ignore_index=True)
    table["flagged"] = table["r_others"] < settings.least_r
    signs = session_signs(selected.table, selected.scale)
    flagged = sorted(set(table.loc[table["flagged"], "participant"]) | set(signs.loc[signs["flagged"], "participant"]))
    headline = f"{len(flagged)} of {selected.table['participant'].nunique()} participants have a flag" + (
        f": {', '.join(map(str, flagged))}." if flagged else "."
    )
    notes = [
        "A flag asks to look; it excludes nobody.",
        f"r_others is flagged below {settings.least_r:g}: our judgement.",
    ]
    notes += averaged((min(least for least, _ in sizes), max(most for _, most in sizes)))
    if len(pools) > 1:
        notes.append("The groups met different stimuli: participants are compared within their group.")
    if selected.scale is None:
        notes.append("The ratings have no declared scale: only the comparison with the others is made.")
    kinds = {
        "r_others": "Pearson's r with the mean of the other participants over shared targets",
        "shift": "mean difference from the others' mean, in units of the rating",
        "spread": "SD over targets, as a multiple of the other participants' (root mean square)",
    }
    method = "Rater diagnostics: each participant against the mean of the others, and signs of how each session went."
    more = {"signs": plain_rows(signs, finite=True)}
    return _answer(selected, "value", plain_rows(table, finite=True), method, kinds, headline, notes, more)


def _limits(confidence: float, how: str) -> dict[str, str]:
    return dict.fromkeys(("ci_low", "ci_high"), f"{confidence:.0%} interval, {how}")


def _answer(
    selected: Selected,
    value: str,
    rows: tuple[Row, ...],
    method: str,
    kinds: dict[str, str],
    headline: str,
    notes: Any = (),
    more: Any = None,
) -> Answer:
    table: pd.DataFrame = selected.table
    people = int(table["participant"].nunique()) if "participant" in table.columns else 0
    return Answer(rows, method, kinds, people, int(table[value].notna().sum()), headline, tuple(notes), more or {})


def _whole_targets(settings: IccSpec | ConcordanceSpec) -> tuple[str, ...]:
    return (settings.targets,) if settings.raters == "participant" else ()


KINDS: Mapping[str, Kind] = {
    "icc": Kind(
        "intraclass correlation",
        IccSpec,
        icc_answer,
        complete=_whole_targets,
        problems=lazy_function(f"{_OF_STUDY}:crossing_problems"),
    ),
    "cronbach_alpha": Kind(
        "Cronbach's alpha", AlphaSpec, alpha_answer, each="all", problems=lazy_function(f"{_OF_STUDY}:alpha_problems")
    ),
    "kendall_w": Kind(
        "Kendall's W",
        ConcordanceSpec,
        concordance_answer,
        complete=_whole_targets,
        problems=lazy_function(f"{_OF_STUDY}:crossing_problems"),
    ),
    "krippendorff_alpha": Kind("Krippendorff's alpha", KrippendorffSpec, krippendorff_answer),
    "retest": Kind(
        "test and retest", RetestSpec, retest_answer, problems=lazy_function(f"{_OF_STUDY}:retest_problems")
    ),
    "raters": Kind("rater diagnostics", RatersSpec, raters_answer, each="all"),
}
