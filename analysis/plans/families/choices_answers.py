"""The answers about psychometric functions and scales: one row per function, participant or item."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from palpate.analysis.choices.bradley_terry import bradley_terry
from palpate.analysis.choices.posterior import posterior_of
from palpate.analysis.choices.psychometric import fit_function
from palpate.analysis.choices.scales import SUM_ZERO, Scale, differences
from palpate.analysis.choices.specification import gather_levels
from palpate.analysis.choices.staircase import Staircase, staircase
from palpate.analysis.choices.thurstone import thurstone
from palpate.analysis.choices.triads import circular_triads
from palpate.analysis.plans.answers import Answer, plain_row, require_columns
from palpate.analysis.plans.families.function_summaries import HOW, PARTICIPANT, fitted_numbers, summary_rows
from palpate.analysis.plans.families.rows import parts_of
from palpate.analysis.plans.families.spaces_answers import numeric, rows_of, sentences
from palpate.analysis.plans.idle import idle_note
from palpate.analysis.ratings.collected_choices import compared_pairs
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.statistics.apa import apa_p
from palpate.analysis.statistics.refusals import StatisticsError

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import Row, Selected
from palpate.analysis.plans.families.choices import BradleyTerry, PsychometricFunction, Thurstone

NUMBERS = (
    "threshold", "threshold_low", "threshold_high", "share_at", "jnd", "jnd_low", "jnd_high", "slope", "guess", "lapse",
)  # fmt: skip
MOST_NAMED = 6
SUMMED = ("threshold", "jnd", "reversal_threshold")
NO_TASK = (
    "The plan declares no task, so the rates are those of plans before tasks were declared: where answers lapse to "
    "both sides, or there are false alarms, thresholds are biased and intervals too narrow. Declare `task: symmetric`, "
    "`forced_choice` (with `alternatives`) or `yes_no`"
)


def psychometric_answer(selected: Selected, settings: PsychometricFunction) -> Answer:
    """Return one row per function; a function without an estimate has a row with the reason."""
    if settings.of_choices:
        from palpate.analysis.plans.families.collected_answers import collected_answer

        return collected_answer(selected, settings)
    by = _by(selected, settings)
    named = (settings.level, settings.correct, settings.n, settings.order, *by, *settings.staircase)
    require_columns(selected.table, [name for name in named if name is not None])
    table = numeric(
        selected.table, [n for n in (settings.level, settings.correct, settings.n, settings.order) if n is not None]
    )
    rows: list[dict[str, Any]] = []
    levels: list[pd.DataFrame] = []
    reversals: list[pd.DataFrame] = []
    for where, part in parts_of(table, by):
        row, shown, turned = _one(selected, settings, part)
        rows.append({**where, **row})
        levels += [] if shown is None else [shown.assign(**where)]
        reversals += [own.assign(**where) for own in turned]
    if all(row["threshold"] is None and row.get("reversal_threshold") is None for row in rows):
        raise StatisticsError(f"no threshold could be estimated: {rows[0]['note']}")
    more: dict[str, tuple[Row, ...]] = {"summary": tuple(summary_rows(rows, by, SUMMED, settings.confidence))}
    for name, tables in (("levels", levels), ("reversals", reversals)):
        if tables:
            joined = pd.concat(tables, ignore_index=True)
            more[name] = rows_of(joined[[*by, *(column for column in joined if column not in by)]])
    return _answer(selected, settings, rows, more)


def _by(selected: Selected, settings: PsychometricFunction) -> tuple[str, ...]:
    if settings.by is not None:
        return settings.by
    return (PARTICIPANT,) if PARTICIPANT in selected.table.columns else ()


def _one(
    selected: Selected, settings: PsychometricFunction, part: pd.DataFrame
) -> tuple[dict[str, Any], pd.DataFrame | None, list[pd.DataFrame]]:
    """Return a row, the levels with the function's expected shares, and the reversals."""
    row: dict[str, Any] = {"trials": 0, **dict.fromkeys(NUMBERS), "deviance": None, "df": None, "p_deviance": None}
    stairs, turned, notes = _staircases(settings, part) if settings.method == "staircase" else ({}, [], [])
    shown = None
    try:
        given = gather_levels(part, settings.level, settings.correct, settings.n)
        row["trials"] = int(given.trials.sum())
        model = settings.model()
        if settings.interval_kind == "posterior":
            posterior = posterior_of(given, model, True, settings.confidence)
            row |= {
                "threshold": posterior.threshold,
                "threshold_low": posterior.threshold_interval[0],
                "threshold_high": posterior.threshold_interval[1],
                "share_at": posterior.guess + (1 - posterior.guess - posterior.lapse) * posterior.at,
                "jnd": posterior.jnd,
                "jnd_low": posterior.jnd_interval[0],
                "jnd_high": posterior.jnd_interval[1],
                "guess": posterior.guess,
                "lapse": posterior.lapse,
                "overdispersion": posterior.eta,
            }
        else:
            fit = fit_function(given, model)
            numbers, why, lost = fitted_numbers(selected, settings, fit, settings.interval_kind)
            row |= {**numbers, "share_at": fit.share_at}
            why += [f"{lost:.0%} of the simulated answers had no slope"] if lost > 0.01 else []
            notes += [*why, *fit.notes]
            shown = fit.table
    except StatisticsError as refusal:
        notes.append(str(refusal))
    return {**row, **stairs, "note": "; ".join(note for note in notes if note)}, shown, turned


def _staircases(
    settings: PsychometricFunction, part: pd.DataFrame
) -> tuple[dict[str, Any], list[pd.DataFrame], list[str]]:
    """Return the mean over a participant's staircases of the means of their last reversals."""
    staircases: list[Staircase] = []
    turned: list[pd.DataFrame] = []
    notes: list[str] = []
    for where, rows in parts_of(part, settings.staircase):
        which = ", ".join(f"{name} {label}" for name, label in where.items())
        try:
            one = staircase(rows, settings.level, settings.correct, settings.order, settings.last)
        except StatisticsError as refusal:
            notes.append(f"{which or 'staircase'}: {refusal}")
            continue
        staircases.append(one)
        turned.append(one.reversals.assign(**where))
        notes += [f"{which}: {note}" if which else note for note in one.notes]
    rules = {None if staircase.rule is None else (staircase.rule.down, staircase.rule.up) for staircase in staircases}
    rule = staircases[0].rule if len(rules) == 1 and staircases else None
    return (
        {
            "staircases": len(staircases),
            "reversals_used": sum(staircase.used for staircase in staircases),
            "reversal_threshold": float(np.mean([staircase.threshold for staircase in staircases]))
            if staircases
            else None,
            "rule": None if rule is None else f"{rule.down} down, {rule.up} up",
            "converges_at": None
            if rule is None
            else float(np.mean([e.rule.converges_at for e in staircases if e.rule])),
        },
        turned,
        notes,
    )


def _headline(summary: tuple[Row, ...], by: tuple[str, ...], confidence: float) -> str:
    """Return the mean of each quantity, its interval, and the number of functions."""
    parts = []
    for row in summary:
        where = ", ".join(f"{name} {row[name]}" for name in by if name != PARTICIPANT)
        name = {"jnd": "JND"}.get(str(row["quantity"]), str(row["quantity"]).replace("_", " "))
        low, high = row["ci_low"], row["ci_high"]
        ends = "" if low is None or high is None else f"{100 * confidence:g}% interval {low:.3g} to {high:.3g}, "
        of = int(row["n"] or 0) + int(row["without_estimate"] or 0)
        parts.append(f"{where and where + ': '}{name} {row['mean']:.3g} ({ends}n = {row['n']} of {of})")
    return f"Mean {'; '.join(parts[:MOST_NAMED])}" + ("; ..." if len(parts) > MOST_NAMED else "")


def _answer(
    selected: Selected,
    settings: PsychometricFunction,
    rows: list[dict[str, Any]],
    more: dict[str, tuple[Row, ...]],
) -> Answer:
    lacking = [row for row in rows if row["threshold"] is None]
    interval = settings.interval_kind
    how = "posterior on a grid (Schütt et al. 2016)" if interval == "posterior" else "maximum likelihood"
    jnd = "(x.75 - x.25) / 2 of F" if settings.jnd == "half_interquartile" else "x.84 - x.50 of F"
    idle = (
        settings.confidence != type(settings).model_fields["confidence"].default
        and settings.interval_kind == "none"
        and all(row["ci_low"] is None for row in more["summary"])
    )
    people = selected.table["participant"].nunique() if "participant" in selected.table.columns else 0
    return Answer(
        rows=tuple(plain_row(row) for row in rows),
        method=f"Psychometric function ({settings.function}; {settings.model().assumed}) by {how}; "
        f"threshold where F = {settings.threshold:g}; JND = {jnd}; "
        f"{100 * settings.confidence:g}% intervals: {HOW[interval]}",
        kinds={
            "threshold": f"level where F = {settings.threshold:g}",
            "share_at": "share of hits that the function expects at the threshold",
            "jnd": f"just noticeable difference, {jnd}",
            "slope": "slope of the function at the threshold, per unit of level",
            "deviance": "deviance against free shares",
            "p_deviance": "p of the deviance, Monte Carlo",
            "reversal_threshold": f"mean of the last {settings.last} reversals",
            "converges_at": "share of hits at which the staircase's rule comes to rest",
        },
        participants=int(people),
        values=sum(row["trials"] for row in rows),
        headline=_headline(more["summary"], _by(selected, settings), settings.confidence),
        notes=sentences(
            [
                NO_TASK if settings.task is None else "",
                f"{len(lacking)} of {len(rows)} functions have no estimate (see `note`)" if lacking else "",
                idle_note("confidence", "with `interval: none` and no mean over several functions") if idle else "",
            ]
        ),
        more=more,
    )


KINDS = {
    "wins": "times chosen",
    "losses": "times the other was chosen",
    "comparisons": "times compared",
}
NOT_INDEPENDENT = (
    "Several choices of one participant count as independent: where participants differ, standard errors are too small"
)


def bradley_terry_answer(selected: Selected, settings: BradleyTerry) -> Answer:
    """Return one row per item with its log odds."""
    table, same = _comparisons(selected, settings, (settings.tie, settings.first))
    reference = SUM_ZERO if settings.reference is None else settings.reference
    tie = settings.tie
    if settings.of_choices:
        tie = "tie" if table["tie"].any() else None
    scale = bradley_terry(
        table, settings.winner, settings.loser, tie, settings.first, settings.count, reference, settings.confidence,
        _people_left_out(settings, table),
    )  # fmt: skip
    kinds = {"value": "log odds", "worth": "share of the summed odds", "ties": "times tied", **KINDS}
    sources = "Bradley & Terry 1952" + ("" if tie is None else "; Davidson 1970")
    method = f"{scale.model} by maximum likelihood ({sources})"
    return _scale_answer(settings, table, scale, method, kinds, tie, same)


def thurstone_answer(selected: Selected, settings: Thurstone) -> Answer:
    """Return one row per item with its value in standard deviations of a difference."""
    table, same = _comparisons(selected, settings, ())
    if settings.of_choices and table["tie"].any():
        raise DataRefused(
            f"Thurstone's scale has no ties, and {table['tie'].sum()} pairs were equal; ask bradley_terry"
        )
    reference = SUM_ZERO if settings.reference is None else settings.reference
    scale = thurstone(
        table, settings.winner, settings.loser, settings.count, settings.method, reference, settings.confidence,
        _people_left_out(settings, table),
    )  # fmt: skip
    kinds = {"value": "in standard deviations of a difference of two items", **KINDS}
    method = f"{scale.model} (Thurstone 1927; Mosteller 1951)"
    return _scale_answer(settings, table, scale, method, kinds, None, same)


def _comparisons(
    selected: Selected, settings: BradleyTerry | Thurstone, more: tuple[str | None, ...]
) -> tuple[pd.DataFrame, int]:
    """Return the comparisons, and how many pairs of an item with itself a study's choices have beside them."""
    if settings.of_choices:
        return compared_pairs(selected.table)
    named = (settings.winner, settings.loser, settings.count, settings.participant, *more)
    require_columns(selected.table, [name for name in named if name is not None])
    return numeric(selected.table, () if settings.count is None else (settings.count,)), 0


def _participant(settings: BradleyTerry | Thurstone, table: pd.DataFrame) -> str | None:
    """Return the column that says who compared; None where none does."""
    return settings.participant or (PARTICIPANT if PARTICIPANT in table.columns else None)


def _people_left_out(settings: BradleyTerry | Thurstone, table: pd.DataFrame) -> str | None:
    """Return the column of the people who are left out in turn for standard errors; None where choices are."""
    return _participant(settings, table) if settings.independent == "participants" else None


def _scale_answer(
    settings: BradleyTerry | Thurstone,
    table: pd.DataFrame,
    scale: Scale,
    method: str,
    kinds: dict[str, str],
    tie: str | None,
    same: int,
) -> Answer:
    ranked = scale.values.sort_values("value", ascending=False, kind="stable")["item"].tolist()
    fit = f"deviance({scale.df}) = {scale.deviance:.2f}, {apa_p(scale.p)}" if scale.df else "no test of fit"
    who = _participant(settings, table)
    triads = circular_triads(table, settings.winner, settings.loser, who, tie, settings.count)
    zero = "values sum to 0" if settings.reference is None else f"{settings.reference} is 0"
    if scale.people:
        se = f"standard error, each of {scale.people} people left out in turn"
        interval = f"Student's t interval of the value, over {scale.people} people"
    else:
        se, interval = "standard error, inverse information", "normal interval of the value"
    interval = f"{100 * settings.confidence:g} % {interval}"
    covariance = scale.covariance.set_axis([str(name) for name in scale.covariance], axis=1).reset_index(names="item")
    more: dict[str, tuple[Row, ...]] = {
        "fit": ({"deviance": scale.deviance, "df": scale.df, "p": scale.p if scale.df else None},),
        "differences": rows_of(differences(scale, settings.correction)),
        "covariance": rows_of(covariance),
        "pairs": rows_of(scale.pairs),
        "triads": rows_of(triads),
    }
    people = int(table[who].nunique()) if who else 0
    circular, of = (triads[name].tolist()[0] for name in ("circular", "triads"))
    return Answer(
        rows=rows_of(scale.values.drop(columns=["ties"] if settings.test == "thurstone" else [])),
        method=f"{method}; {zero}",
        kinds=kinds | {"se": se, "ci_low": interval, "ci_high": interval},
        participants=people,
        values=int(scale.values["comparisons"].sum()) // 2,
        headline=f"Most to least: {', '.join(map(str, ranked))}; fit: {fit}; "
        f"{circular} of {of} triads circular (all choices together)",
        notes=sentences(
            [
                *scale.notes,
                "" if people == 1 or scale.people else NOT_INDEPENDENT,
                idle_note("independent", "without a column that names two participants or more")
                if people < 2 and settings.independent == "choices"
                else "",
                f"{same} pair(s) of a stimulus with itself left out" if same else "",
            ]
        ),
        more=more | ({"effects": rows_of(scale.effects)} if len(scale.effects) else {}),
    )
