"""Links of cumulative models: the log probability of an interval of the latent scale and its derivatives.

Everything is in logarithms, so that an interval far out in a tail keeps its digits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from scipy.special import log_expit, log_ndtr, ndtri

from palpate.analysis.statistics.doubles import Floats

Link: TypeAlias = Literal["logit", "probit"]
LINKS = ("logit", "probit")
HALF_LOG_TAU = math.log(2 * math.pi) / 2
END = 1e100  # stands for infinity at the outer ends, where density and slope are 0


@dataclass(frozen=True)
class Interval:
    """log P(low < Z <= high) and, in units of P, the densities at its ends and the densities' slopes.

    With p = F(high) - F(low): `f_high` = F'(high) / p, `s_high` = F''(high) / p, the same for the low end.
    """

    log_p: Floats
    f_high: Floats
    f_low: Floats
    s_high: Floats
    s_low: Floats


def interval(high: Floats, low: Floats, link: Link) -> Interval:
    """The interval's log probability and derivatives; `high` > `low` everywhere, END or -END for an open end."""
    log_p = _log_p(high, low, link)
    f_high, f_low = (np.exp(_log_density(end, link) - log_p) for end in (high, low))
    return Interval(log_p, f_high, f_low, f_high * _relative_slope(high, link), f_low * _relative_slope(low, link))


def latent_quantile(share: Floats, link: Link) -> Floats:
    """Where the latent scale is cut so that this share lies below."""
    found: Floats = np.log(share) - np.log1p(-share) if link == "logit" else ndtri(share)
    return found


def _log_p(high: Floats, low: Floats, link: Link) -> Floats:
    if link == "logit":
        found: Floats = log_expit(high) + log_expit(-low) + np.log(-np.expm1(low - high))
        return found
    flip = low > 0  # where both ends are above 0 the upper tail holds the digits
    top, bottom = log_ndtr(np.where(flip, -low, high)), log_ndtr(np.where(flip, -high, low))
    below: Floats = np.minimum(bottom - top, -math.ulp(0.0))
    return np.asarray(top + np.log(-np.expm1(below)), dtype=np.float64)


def _log_density(x: Floats, link: Link) -> Floats:
    found: Floats = log_expit(x) + log_expit(-x) if link == "logit" else -x * x / 2 - HALF_LOG_TAU
    return found


def _relative_slope(x: Floats, link: Link) -> Floats:
    """F''(x) / F'(x)."""
    found: Floats = -np.tanh(x / 2) if link == "logit" else np.where(np.abs(x) < END, -x, 0.0)
    return found
