"""The answer of a binomial mixed model: PSE, slope and JND of the population in each condition."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from scipy.special import logit, ndtr, ndtri

from palpate.analysis.choices.binomial_mixed import BinomialMixed, Counts, fit_binomial_mixed
from palpate.analysis.plans.answers import Answer, plain_row, require_columns
from palpate.analysis.plans.families.choices import BinomialMixedModel
from palpate.analysis.plans.families.function_summaries import PARTICIPANT
from palpate.analysis.plans.families.rows import parts_of
from palpate.analysis.plans.families.spaces_answers import numeric, sentences
from palpate.analysis.ratings.collected_choices import GUESSING, track_design
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.statistics.cells import coded
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadValue, NoEstimate

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import Row, Selected


def binomial_mixed_answer(selected: Selected, settings: BinomialMixedModel) -> Answer:
    """Return one row for each condition; differences between conditions and the participants' spread beside it."""
    table, level, hits, count, left_out = _rows(selected, settings)
    people = coded(table[PARTICIPANT], PARTICIPANT)
    conditions = None if settings.condition is None else coded(table[settings.condition], settings.condition)
    names = [""] if conditions is None else [str(label) for label in conditions.labels]
    which = np.zeros(len(table), dtype=np.int64) if conditions is None else conditions.codes
    middle, unit = float(level.mean()), float(level.std()) or 1.0
    # Trials of one participant, condition and level are counted together: the likelihood is the same, and faster.
    keys, cell = np.unique(np.column_stack([people.codes, which, level]), axis=0, return_inverse=True)
    hits, trials = (np.bincount(cell.ravel(), weights=part).astype(np.float64) for part in (hits, count))
    place, x = np.arange(len(keys)), (keys[:, 2] - middle) / unit
    fixed = np.zeros((len(keys), 2 * len(names)))
    fixed[place, 2 * keys[:, 1].astype(np.int64)] = 1.0
    fixed[place, 2 * keys[:, 1].astype(np.int64) + 1] = x
    random = [np.ones(len(keys))]
    if settings.random == "intercept_and_slope":
        random.append(x)
    elif settings.random == "intercept_and_condition":
        if len(names) != 2:
            raise DataRefused(
                f"{settings.name!r}: `random: intercept_and_condition` is for two conditions, and here are {len(names)}"
            )
        random.append(0.5 - keys[:, 1])
    counts = Counts(hits, trials, keys[:, 0].astype(np.int64), fixed, np.column_stack(random))
    fit = fit_binomial_mixed(counts, settings.link, settings.nodes)
    rows = [_condition(fit, i, name, middle, unit, settings) for i, name in enumerate(names)]
    spread: Row = {
        "sd_intercept": float(fit.sd[0]),
        "sd_slope": float(fit.sd[1]) / unit if settings.random == "intercept_and_slope" else None,
        "sd_condition": float(fit.sd[1]) if settings.random == "intercept_and_condition" else None,
        "correlation": fit.correlation,
        "at_level": middle,
        "log_likelihood": fit.log_likelihood,
    }
    confidence = f"{100 * settings.confidence:g}%"
    means = [
        f"{row['condition'] and row['condition'] + ': '}PSE {row['pse']:.3g}, slope {row['slope']:.3g}" for row in rows
    ]
    return Answer(
        rows=tuple(plain_row(row) for row in rows),
        method=f"Binomial mixed model, {settings.link}, participants random in "
        f"{settings.random.replace('_', ' ')} (Moscatelli et al. 2012), by maximum likelihood with adaptive "
        f"Gauss-Hermite quadrature of {settings.nodes} node(s) (Pinheiro & Bates 1995); {confidence} intervals by "
        "the delta method",
        kinds={
            "pse": "level at which half of the answers are hits, in the population",
            "slope": f"slope of the {settings.link} per unit of level, in the population",
            "jnd": "(x.75 - x.25) / 2 of the population's function",
            "p": "two-sided p of the slope against 0, Wald",
        },
        participants=fit.groups,
        values=int(count.sum()),
        headline="; ".join(means[:6]),
        notes=sentences([f"{left_out} trial(s) without a place in the function left out" if left_out else ""]),
        more={"spread": (spread,), "differences": tuple(_differences(fit, names, middle, unit))},
    )


def _rows(selected: Selected, settings: BinomialMixedModel) -> tuple[pd.DataFrame, Floats, Floats, Floats, int]:
    """Return the rows used, their levels, hits and trials, and how many choices are left out."""
    table = selected.table
    condition = () if settings.condition is None else (settings.condition,)
    if settings.table is not None:
        named = [name for name in (settings.level, settings.correct, settings.n) if name is not None]
        require_columns(table, [PARTICIPANT, *named, *condition])
        table = numeric(table, named)
        count = np.ones(len(table)) if settings.n is None else table[settings.n].to_numpy(dtype=np.float64)
        hits = table[settings.correct].to_numpy(dtype=np.float64)
        if not ((hits >= 0) & (hits <= count) & (hits == np.floor(hits))).all():
            raise BadValue(f"column {settings.correct!r} must count answers from 0 to n in whole numbers")
        return table, table[settings.level].to_numpy(dtype=np.float64), hits, count, 0
    require_columns(table, [PARTICIPANT, *condition])
    parts = []
    for _, part in parts_of(table, condition):
        design, used = track_design(part)
        if design.task == "forced_choice":
            raise DataRefused(GUESSING)
        parts.append(used.assign(_hit=used[design.hits]))
    used = pd.concat(parts, ignore_index=True)
    hits = used["_hit"].to_numpy(dtype=np.float64)
    return used, used["level"].to_numpy(dtype=np.float64), hits, np.ones(len(used)), len(table) - len(used)


def _condition(
    fit: BinomialMixed, i: int, name: str, middle: float, unit: float, settings: BinomialMixedModel
) -> dict[str, Any]:
    """Return the row of a condition; raises NoEstimate where the slope is 0, so that there is no PSE."""
    b0, b1 = fit.fixed[2 * i : 2 * i + 2].tolist()
    covariance = fit.covariance[2 * i : 2 * i + 2, 2 * i : 2 * i + 2]
    z = float(ndtri((1 + settings.confidence) / 2))
    se_slope = math.sqrt(covariance[1, 1])
    if abs(b1) < z * se_slope:
        raise NoEstimate(f"{name and name + ': '}the slope is not different from 0: there is no PSE")
    slope = b1 / unit
    gradient = np.array([-1 / b1, b0 / b1**2])
    pse, se_pse = middle - unit * b0 / b1, unit * math.sqrt(float(gradient @ covariance @ gradient))
    quarter = float(ndtri(0.75)) if settings.link == "probit" else float(logit(0.75))
    return {
        "condition": name, "pse": pse, "pse_low": pse - z * se_pse, "pse_high": pse + z * se_pse, "slope": slope,
        "slope_low": slope - z * se_slope / unit, "slope_high": slope + z * se_slope / unit,
        "jnd": quarter / abs(slope), "p": max(2 * float(ndtr(-abs(b1) / se_slope)), 1e-300),
    }  # fmt: skip


def _differences(fit: BinomialMixed, names: list[str], middle: float, unit: float) -> list[Row]:
    """Return the differences of PSE and slope between each two conditions, with Wald tests."""
    rows: list[Row] = []
    for i in range(len(names)):
        for j in range(i + 1, len(names)):
            for quantity in ("pse", "slope"):
                gradient = np.zeros(len(fit.fixed))
                values = []
                for k, sign in ((i, 1.0), (j, -1.0)):
                    b0, b1 = fit.fixed[2 * k : 2 * k + 2].tolist()
                    if quantity == "pse":
                        values.append(middle - unit * b0 / b1)
                        gradient[2 * k : 2 * k + 2] += sign * unit * np.array([-1 / b1, b0 / b1**2])
                    else:
                        values.append(b1 / unit)
                        gradient[2 * k + 1] += sign / unit
                se = math.sqrt(float(gradient @ fit.covariance @ gradient))
                difference = values[0] - values[1]
                z = difference / se
                rows.append(
                    {
                        "a": names[i], "b": names[j], "quantity": quantity, "difference": difference, "se": se, "z": z,
                        "p": max(2 * float(ndtr(-abs(z))), 1e-300),
                    }
                )  # fmt: skip
    return rows
