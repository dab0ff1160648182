"""Test-retest: agreement of people's answers with their later answers to the same stimuli."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.special import chdtri

from palpate.analysis.reliability.correlating import normal_upper, pearson
from palpate.analysis.reliability.crossed import combine_labels
from palpate.analysis.reliability.intraclass import demand_confidence, iccs
from palpate.analysis.statistics.cells import Coded, Codes, check_columns, name_list, numbers_of
from palpate.analysis.statistics.doubles import ROUNDING, Floats, deviation_ss, difference, rescaled, scaled
from palpate.analysis.statistics.f_and_t import t_critical
from palpate.analysis.statistics.refusals import DuplicatedCells, TooFew, listed
from palpate.protocols.wording import count

NO_INTERVAL = "no interval is computed for this measure"


class Measure(NamedTuple):
    """One number with its interval; NaN if undefined, and `note` says why."""

    measure: str
    value: float
    ci_low: float
    ci_high: float
    note: str = ""


@dataclass(frozen=True)
class Retest:
    """First against second answers: `measures` of all pairs together, by person in `people`, and the `pairs`.

    `further` counts presentations after the second, which are not used, and `incomplete` the pairs without a value.
    """

    measures: pd.DataFrame
    people: pd.DataFrame
    pairs: pd.DataFrame
    further: int
    incomplete: int
    confidence: float


def retest(
    data: pd.DataFrame,
    dv: Hashable,
    subject: Hashable,
    targets: Hashable | Iterable[Hashable],
    order: Hashable | Iterable[Hashable],
    *,
    confidence: float = 0.95,
) -> Retest:
    """Return the agreement of a participant's second answer to a target with the first; `order` sorts the answers.

    Measures: Pearson's r, ICC(A,1) and ICC(C,1) of first and second, the bias (second minus first), the SD of the
    differences, the limits of agreement (Bland & Altman 1999), the standard error of measurement and the smallest
    detectable change (Weir 2005; de Vet et al. 2006), each for consistency (from the SD of the differences) and for
    agreement (the bias counts as error). Limits of agreement and detectable changes are those of 95 % whatever the
    confidence of their intervals. Raises a StatisticsError, TooFew if nobody had a target twice.
    """
    demand_confidence(confidence)
    names, places = name_list(targets), name_list(order)
    check_columns(data, [dv, subject, *names, *places])
    y = numbers_of(data[dv], dv)
    meetings, turn = combine_labels(data, [subject, *names]), combine_labels(data, places)
    first, second, further = _first_and_second(meetings, turn)
    whole = ~(np.isnan(y[first]) | np.isnan(y[second]))
    first, second = first[whole], second[whole]
    labels: list[Any] = [meetings.labels[int(code)] for code in meetings.codes[first]]
    columns = {str(name): [label[i] for label in labels] for i, name in enumerate((subject, *names))}
    pairs = pd.DataFrame({**columns, "first": y[first], "second": y[second], "difference": y[second] - y[first]})
    if len(pairs) < 2:
        raise TooFew(
            f"{count(len(pairs), 'pair')} of answers to the same {' and '.join(map(str, names))} by one {subject}; "
            "two or more are needed: repeat stimuli"
        )
    measures = pd.DataFrame(_measures(pairs["first"].to_numpy(), pairs["second"].to_numpy(), confidence))
    return Retest(measures, _people(pairs, str(subject)), pairs, further, int((~whole).sum()), confidence)


def _first_and_second(meetings: Coded, turn: Coded) -> tuple[Codes, Codes, int]:
    """Return the rows of each first and second presentation of a target to a participant, and the number of later ones.

    Raises DuplicatedCells if two presentations have the same place in the order.
    """
    rows = np.lexsort((turn.codes, meetings.codes))
    same = meetings.codes[rows][1:] == meetings.codes[rows][:-1]
    at_once = same & (turn.codes[rows][1:] == turn.codes[rows][:-1])
    if at_once.any():
        repeated = [str(meetings.labels[int(meetings.codes[row])]) for row in rows[1:][at_once]]
        raise DuplicatedCells(
            f"several answers at the same moment: {listed(repeated, len(repeated))}; take repeats out"
        )
    starts = np.concatenate(([True], ~same))
    place = np.arange(len(rows)) - np.maximum.accumulate(np.where(starts, np.arange(len(rows)), 0))
    second = np.flatnonzero(place == 1)
    return rows[second - 1], rows[second], int((place > 1).sum())


def _people(pairs: pd.DataFrame, subject: str) -> pd.DataFrame:
    """Return one row per participant: number of pairs, r, bias and mean absolute difference."""
    people = []
    for who, own in pairs.groupby(subject, sort=False, observed=True):
        correlation = pearson(own["first"].to_numpy(), own["second"].to_numpy())
        away = own["difference"].tolist()
        people.append(
            {
                **{subject: who, "pairs": len(own), "r": correlation.r, "bias": math.fsum(away) / len(away)},
                **{"mean_absolute_difference": math.fsum(map(abs, away)) / len(away), "note": correlation.note},
            }
        )
    return pd.DataFrame(people)


def _measures(first: Floats, second: Floats, confidence: float) -> Iterator[Measure]:
    r = pearson(first, second, confidence)
    yield Measure("Pearson r", r.r, r.ci_low, r.ci_high, r.note)
    for coefficient in iccs(np.stack((first, second), axis=1), confidence):
        if coefficient.type in ("ICC2", "ICC3"):
            yield Measure(coefficient.name, coefficient.icc, coefficient.ci_low, coefficient.ci_high, coefficient.note)
    n, tail = len(first), (1 - confidence) / 2
    x, exponent = scaled(np.stack((first, second)))
    apart, rest = difference(x[1], x[0])
    bias = math.fsum([*apart.tolist(), *rest.tolist()]) / n
    ss = deviation_ss(apart + rest)
    ss = ss if ss > x.size * ROUNDING**2 else 0.0
    sd, square = math.sqrt(ss / (n - 1)), ss / n + bias * bias
    z, t = normal_upper(0.025), t_critical(n - 1, confidence)  # limits of agreement hold 95 % by convention
    wide = t * sd * math.sqrt(1 / n + z * z / (2 * (n - 1)))
    low, high = (math.sqrt((n - 1) / float(chdtri(n - 1, at))) for at in (tail, 1 - tail))
    same = "the differences do not vary: a constant shift" if sd == 0 else ""
    error, both = sd / math.sqrt(2), math.sqrt(square / 2)
    half = t * sd / math.sqrt(n)
    rows = (
        Measure("bias, second - first", bias, bias - half, bias + half, same),
        Measure("SD of the differences", sd, sd * low, sd * high, same),
        Measure("lower limit of agreement", bias - z * sd, bias - z * sd - wide, bias - z * sd + wide, same),
        Measure("upper limit of agreement", bias + z * sd, bias + z * sd - wide, bias + z * sd + wide, same),
        Measure("SEM, consistency", error, error * low, error * high, same),
        Measure("SEM, agreement", both, math.nan, math.nan, NO_INTERVAL),
        Measure("smallest detectable change, consistency", z * sd, z * sd * low, z * sd * high, same),
        Measure("smallest detectable change, agreement", z * math.sqrt(square), math.nan, math.nan, NO_INTERVAL),
    )
    for name, value, lower, upper, note in rows:
        own, least, most = (rescaled(limit, exponent) for limit in (value, lower, upper))
        yield Measure(name, own, least, most, note)
