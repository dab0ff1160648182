"""Stevens' power law from magnitude estimates: an exponent of each person, their mean, and normalised magnitudes.

A person's numbers are proportional to intensity ** exponent (Stevens 1957). Logarithms make it a line, whose slope is
the exponent and whose height is the person's own modulus. The population's exponent is the mean of people's exponents,
with Student's interval over people, who are the random sample; pooled numbers would count each number as independent.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from palpate.analysis.ratings.within_intervals import mean_intervals
from palpate.analysis.statistics.cells import check_columns, numbers_of
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.f_and_t import checked_confidence, t_critical
from palpate.analysis.statistics.refusals import BadValue, TooFew

NAN = math.nan


@dataclass(frozen=True)
class PowerLaw:
    """The power law of a sample.

    `exponent` is the mean over people, with its standard error and interval (NaN with one person). `people` has a row
    each: participant, exponent, modulus (the number at intensity 1), r2 (of logarithms), numbers, stimuli. `stimuli`
    has a row each: stimulus, intensity, magnitude (geometric mean of the numbers, after log normalisation: each
    person's numbers are multiplied by a factor so that all people have the same geometric mean over stimuli), ci_low,
    ci_high, people. It is empty where people felt different stimuli.
    """

    exponent: float
    se: float
    ci_low: float
    ci_high: float
    people: pd.DataFrame
    stimuli: pd.DataFrame


def power_law(
    data: pd.DataFrame,
    number: str = "number",
    intensity: str = "intensity",
    *,
    participant: str = "participant",
    stimulus: str = "stimulus",
    confidence: float = 0.95,
) -> PowerLaw:
    """Return the power law of numbers, one row each in `data`; a person's repeats of a stimulus are averaged first.

    Numbers and intensities are above 0; intensities are in the stimulus' physical unit. Raises BadValue for others,
    and for a stimulus with two intensities; TooFew where a person felt fewer than two intensities.
    """
    check_columns(data, [number, intensity, participant, stimulus])
    checked_confidence(confidence)
    table = pd.DataFrame({
        "participant": data[participant].astype(str), "stimulus": data[stimulus].astype(str),
        "value": _logarithms(data, number), "log_intensity": _logarithms(data, intensity),
    })  # fmt: skip
    several = table.groupby("stimulus")["log_intensity"].nunique()
    if bad := [str(name) for name in several[several > 1].index]:
        raise BadValue(f"{bad[0]}: several intensities in column {intensity!r}; one is expected for each stimulus")
    means = table.groupby(["participant", "stimulus"], sort=True)[["value", "log_intensity"]].mean().reset_index()
    counts = table.groupby("participant").size()
    people = pd.DataFrame([
        {"participant": who, **_line(own), "numbers": int(counts[who]), "stimuli": len(own)}
        for who, own in means.groupby("participant", sort=True)
    ])  # fmt: skip
    exponents = people["exponent"].to_numpy(dtype=np.float64)
    n, mean = len(exponents), float(exponents.mean())
    se = float(exponents.std(ddof=1) / math.sqrt(n)) if n > 1 else NAN
    half = t_critical(n - 1, confidence) * se if n > 1 else NAN
    return PowerLaw(mean, se, mean - half, mean + half, people, _normalised(means, confidence))


def _logarithms(data: pd.DataFrame, name: str) -> Floats:
    """Return the decimal logarithms of a column. Raises BadValue for a number that is not above 0."""
    values = numbers_of(data[name], name)
    if (bad := np.flatnonzero(~(values > 0))).size:
        raise BadValue(f"row {int(bad[0]) + 1}: {name} is {values[bad[0]]:g}; a number above 0 is expected")
    logs: Floats = np.log10(values)
    return logs


def _line(own: pd.DataFrame) -> dict[str, float]:
    """Return a person's exponent, modulus and r2: least squares on logarithms, one mean for each stimulus."""
    x, y = (own[name].to_numpy(dtype=np.float64) for name in ("log_intensity", "value"))
    dx, dy = x - x.mean(), y - y.mean()
    spread = float(dx @ dx)
    if spread == 0.0:
        who = own["participant"].iloc[0]
        raise TooFew(f"participant {who} felt one intensity; two or more are expected for an exponent")
    slope = float(dx @ dy) / spread
    total = float(dy @ dy)
    return {
        "exponent": slope,
        "modulus": float(10 ** (y.mean() - slope * x.mean())),
        "r2": 1.0 if total == 0.0 else float(slope**2 * spread / total),
    }


def _normalised(means: pd.DataFrame, confidence: float) -> pd.DataFrame:
    """Return the geometric mean of each stimulus, with an interval that leaves out differences of modulus."""
    columns = ["stimulus", "intensity", "magnitude", "ci_low", "ci_high", "people"]
    people, stimuli = means["participant"].nunique(), means["stimulus"].nunique()
    if len(means) != people * stimuli:
        return pd.DataFrame(columns=columns)
    if people == 1:
        rows = means.assign(mean=means["value"], ci_low=NAN, ci_high=NAN, n=1)
    else:
        rows = mean_intervals(means, by=["stimulus"], method="cousineau_morey", confidence=confidence)
    intensity = means.drop_duplicates("stimulus").set_index("stimulus")["log_intensity"]
    table = pd.DataFrame({
        "stimulus": rows["stimulus"].astype(str), "intensity": 10 ** intensity[rows["stimulus"]].to_numpy(),
        "magnitude": 10 ** rows["mean"], "ci_low": 10 ** rows["ci_low"], "ci_high": 10 ** rows["ci_high"],
        "people": rows["n"].astype(int),
    })  # fmt: skip
    return table.sort_values(["intensity", "stimulus"], kind="stable").reset_index(drop=True)[columns]
