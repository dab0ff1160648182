"""The mean of one value per participant with its t interval and test, or the reason why there is none."""

from __future__ import annotations

import math
import statistics
from typing import NamedTuple

import numpy as np

from palpate.analysis.statistics.doubles import Floats, scaled
from palpate.analysis.statistics.f_and_t import p_note, t_critical, t_two_sided
from palpate.analysis.statistics.refusals import BadOption

NAN = math.nan


class OneSample(NamedTuple):
    """Mean, SD (n - 1), standard error, t against 0 with df and p, interval, size (mean / SD), and a note."""

    n: int
    mean: float
    sd: float
    se: float
    t: float
    df: float
    p: float
    low: float
    high: float
    dz: float
    note: str


def one_sample(values: Floats, *, floor: float = 0.0, confidence: float = 0.95, what: str = "values") -> OneSample:
    """Return Student's one-sample t of the values that are not NaN; mean and SD are rounded once.

    `floor` is the variation that rounding alone could make: at or below it t is undefined, with a note. Raises
    BadOption unless `confidence` is between 0 and 1.
    """
    check_confidence(confidence)
    known = np.sort(values[~np.isnan(values)])
    n = len(known)
    if n == 0:
        return OneSample(0, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, "no participant has a value here")
    mean = statistics.mean(known.tolist())
    if n == 1:
        return OneSample(1, mean, NAN, NAN, NAN, 0.0, NAN, NAN, NAN, NAN, "one participant has no spread")
    small, exponent = scaled(known)
    sd = math.ldexp(statistics.stdev(small.tolist()), exponent)
    se = sd / math.sqrt(n)
    half = t_critical(n - 1, confidence) * se
    if sd <= floor:
        note = f"t is undefined: the {what} " + ("do not vary" if sd == 0 else "vary only by rounding")
        return OneSample(n, mean, sd, se, NAN, n - 1.0, NAN, mean - half, mean + half, NAN, note)
    t = mean / se
    p = t_two_sided(t, n - 1)
    return OneSample(n, mean, sd, se, t, n - 1.0, p, mean - half, mean + half, mean / sd, p_note([p]))


def columns_of(sample: OneSample) -> dict[str, float | int]:
    """Return the test as columns of a table."""
    return {
        "n": sample.n,
        "mean": sample.mean,
        "sd": sample.sd,
        "ci_low": sample.low,
        "ci_high": sample.high,
        "t": sample.t,
        "df": sample.df,
        "dz": sample.dz,
        "p": sample.p,
    }


def check_confidence(confidence: float) -> None:
    """Raise BadOption unless the confidence is between 0 and 1."""
    if not 0 < confidence < 1:
        raise BadOption(f"confidence {confidence!r}: a share between 0 and 1, as 0.95, is expected")
