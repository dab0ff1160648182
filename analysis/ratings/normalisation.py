"""Rescaling of ratings by a named rule: one for all, or each participant's own."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Literal, TypeAlias, get_args

import numpy as np
import pandas as pd

from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.statistics.cells import check_columns, coded, numbers_of
from palpate.analysis.statistics.doubles import ROUNDING_ULPS, Floats, centred, scaled
from palpate.analysis.statistics.refusals import listed
from palpate.protocols.did_you_mean import nearest

How: TypeAlias = Literal["none", "to_0_100", "to_-100_100", "z_within_participant", "range_within_participant"]
Ends: TypeAlias = tuple[float, float]
ENDS: Mapping[str, Ends] = MappingProxyType(
    {"to_0_100": (0.0, 100.0), "to_-100_100": (-100.0, 100.0), "range_within_participant": (0.0, 100.0)}
)


def normalised(table: pd.DataFrame, scale: Ends | None, how: How) -> tuple[pd.DataFrame, Ends | None]:
    """Return a copy of a long table with `value` on another scale, and the ends of that scale (None: it has none).

    - `none`: as it is.
    - `to_0_100`, `to_-100_100`: the declared ends of `scale` go to the new ends, all between them in proportion.
    - `z_within_participant`: (value - mean) / SD of the same participant and attribute, SD with n - 1; no scale.
    - `range_within_participant`: the participant's lowest rating of the attribute becomes 0, the highest 100.

    A missing value (NaN) stays missing and takes no part in a mean, an SD or a range. `participant` and, where there
    is one, `attribute` say whose a value is. Raises DataRefused on an unknown rule, where a rule needs a scale and
    there is none, on values beyond the scale, and where a participant has no spread or range (one value, or equal
    ones: then neither z nor range exists); BadValue or UnknownColumn on a column that is no column of numbers.
    """
    if how not in get_args(How):
        raise DataRefused(f"normalisation {how!r} is not known; {nearest(str(how), get_args(How))}")
    if how == "none":
        return table.copy(), scale
    check_columns(table, ["participant", "value"])
    values = numbers_of(table["value"], "value")
    if how in ("to_0_100", "to_-100_100"):
        ends = ENDS[how]
        if scale is None:
            raise DataRefused(
                f"normalisation {how!r} needs the ends of the rating scale, and none is declared; declare a scale in"
                " the study, or choose z_within_participant or range_within_participant"
            )
        if not (math.isfinite(scale[0]) and math.isfinite(scale[1]) and scale[0] < scale[1]):
            raise DataRefused(f"a scale from {scale[0]:g} to {scale[1]:g}: two finite ends, the lower one first")
        beyond = np.flatnonzero((values < scale[0]) | (values > scale[1])).tolist()
        if beyond:
            people = table["participant"].tolist()
            listing = listed((f"{values[row]:g} of {people[row]} in row {row + 1}" for row in beyond), len(beyond))
            raise DataRefused(
                f"ratings beyond the declared scale from {scale[0]:g} to {scale[1]:g}: {listing};"
                " correct them or declare the scale that they were given on"
            )
        return table.assign(value=rescaled_values(values, scale, ends)), ends
    rule = _z if how == "z_within_participant" else _ranged
    return table.assign(value=_own(values, table, rule, how)), ENDS.get(how)


def rescaled_values(values: Floats, old: Ends, new: Ends) -> Floats:
    """Return values rescaled from one pair of ends to another; both ends and every representable middle are exact."""
    if old == new:
        return values.copy()
    stretched: Floats = (new[1] - new[0]) * (values - old[0]) / (old[1] - old[0]) + new[0]
    return np.where(values == old[1], new[1], stretched)


def _own(values: Floats, table: pd.DataFrame, rule: Callable[[Floats], Floats | str], how: str) -> Floats:
    """Return the values by every participant's own rule, by attribute; those without a rule are named in the error."""
    names = ["participant", *(["attribute"] if "attribute" in table.columns else [])]
    axes = [coded(table[name], name) for name in names]
    scaled = np.full(len(values), np.nan)
    refused: list[str] = []
    flat = axes[0].codes
    for axis in axes[1:]:
        flat = flat * len(axis.labels) + axis.codes
    order = np.argsort(flat, kind="stable")
    starts = np.flatnonzero(np.diff(flat[order], prepend=-1))
    for rows in np.split(order, starts[1:]):
        known = rows[~np.isnan(values[rows])]
        own = rule(values[known]) if len(known) else values[known]
        if isinstance(own, str):
            whose = " on ".join(str(axis.labels[int(axis.codes[rows[0]])]) for axis in axes)
            refused.append(f"{whose} ({own})")
        else:
            scaled[known] = own
    if refused:
        raise DataRefused(
            f"normalisation {how!r} is undefined for {listed(refused, len(refused))}; leave these participants out"
            " by an exclusion, or choose to_0_100"
        )
    return scaled


def _varied(values: Floats) -> str:
    """Return the reason if these values have neither spread nor range, else ""."""
    if len(values) < 2:
        return "one rating"
    if values.max() - values.min() <= ROUNDING_ULPS * np.spacing(np.abs(values).max()):
        return f"all {len(values)} ratings are {values[0]:g}"
    return ""


def _z(values: Floats) -> Floats | str:
    """Return z values, by differences before squares: an offset costs no digit, and order does not matter."""
    if why := _varied(values):
        return why
    order = np.argsort(values, kind="stable")
    small, _ = scaled(values[order])
    deviations = centred(small - small[0], 0)
    spread = math.sqrt(math.fsum((deviations * deviations).tolist()) / (len(values) - 1))
    z = np.empty_like(values)
    z[order] = deviations / spread
    return z


def _ranged(values: Floats) -> Floats | str:
    if why := _varied(values):
        return why
    small, _ = scaled(values)
    return rescaled_values(small, (float(small.min()), float(small.max())), ENDS["range_within_participant"])
