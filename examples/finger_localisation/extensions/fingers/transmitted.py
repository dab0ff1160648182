"""The test: how much the answers tell about the touches, in bits, with percent right and the confusion matrix.

T = sum of p(i, j) log2(p(i, j) / (p(i) p(j))) over touched i and named j (Miller & Nicely 1955). Few answers make T too
large by about (r - 1)(c - 1) / (2 n ln 2), for r touched and c named fingers in n answers (Miller 1955): it is taken
away. The interval is the percentile bootstrap over people (Efron & Tibshirani 1993).
"""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from palpate.analysis.plans.answers import Answer, Confidence, Kind, Row, Selected, StatisticSettings, require_columns
from palpate.analysis.statistics.draws import generator
from palpate.analysis.statistics.refusals import TooFew

Counts = NDArray[np.float64]
TABLE = "fingers_answers"
FEWEST_PEOPLE = 2


class Settings(StatisticSettings):
    """The settings of transmitted information: `confidence` is that of the interval."""

    test: Literal["fingers.transmitted"]
    confidence: Confidence = 0.95


def confusion_matrices(selected: Selected) -> tuple[list[str], tuple[str, ...], Counts]:
    """Return people, fingers in the study's order, and counts by person, touched finger and named finger."""
    table = selected.table
    require_columns(table, ("participant", "touched", "named"))
    there = {*table["touched"], *table["named"]}
    in_order = dict.fromkeys((*selected.levels.get("finger", ()), *sorted(there)))
    fingers = tuple(finger for finger in in_order if finger in there)
    people = sorted(set(table["participant"]))
    counts = np.zeros((len(people), len(fingers), len(fingers)))
    for who, touched, named in zip(table["participant"], table["touched"], table["named"], strict=True):
        counts[people.index(who), fingers.index(touched), fingers.index(named)] += 1
    return people, fingers, counts


def bits(counts: Counts) -> float:
    """Return the transmitted information of a confusion matrix, rows touched and columns named, in bits."""
    p = counts / counts.sum()
    expected = p.sum(axis=1, keepdims=True) * p.sum(axis=0, keepdims=True)
    met = p > 0
    return float((p[met] * np.log2(p[met] / expected[met])).sum())


def corrected_bits(counts: Counts) -> float:
    """Return the transmitted information less its bias; a finger that was neither touched nor named is no category."""
    rows, columns = (int((counts.sum(axis=axis) > 0).sum()) for axis in (1, 0))
    return bits(counts) - (rows - 1) * (columns - 1) / (2 * math.log(2) * float(counts.sum()))


def transmitted_answer(selected: Selected, settings: Settings) -> Answer:
    """Return a row for all people together, and in `more` one for each of them and the confusion matrix."""
    people, fingers, counts = confusion_matrices(selected)
    if len(people) < FEWEST_PEOPLE:
        raise TooFew(f"an interval over people needs {FEWEST_PEOPLE} of them, and there is {len(people)}")
    everybody = counts.sum(axis=0)
    drawn = generator(selected.seed, "transmitted").integers(0, len(people), (selected.draws, len(people)))
    resampled = [corrected_bits(counts[who].sum(axis=0)) for who in drawn]
    tail = (1 - settings.confidence) / 2
    low, high = np.quantile(resampled, (tail, 1 - tail))
    whole = {**_row(everybody), "ci_low": float(low), "ci_high": float(high)}
    confusions: list[Row] = [
        {"touched": touched, "named": named, "answers": int(everybody[i, j])}
        for i, touched in enumerate(fingers)
        for j, named in enumerate(fingers)
    ]
    interval = f"{settings.confidence:.0%} percentile interval over people, {selected.draws} draws"
    return Answer(
        rows=(whole,),
        method="Transmitted information (Miller & Nicely 1955), less its bias (Miller 1955).",
        kinds={
            "percent_right": "right answers in percent",
            "bits": "transmitted information in bits",
            "bits_corrected": "the same, less its bias",
            "bits_touched": "information of the touches in bits: the most that can be transmitted",
            "ci_low": f"{interval}, of bits_corrected",
            "ci_high": f"{interval}, of bits_corrected",
        },
        participants=len(people),
        values=int(counts.sum()),
        headline=(
            f"{whole['percent_right']:.1f}% right; {whole['bits_corrected']:.2f} of {whole['bits_touched']:.2f} bits"
            f" transmitted, {settings.confidence:.0%} CI [{low:.2f}, {high:.2f}]."
        ),
        notes=("The answers of all people are counted in one matrix; `people` has the numbers of each.",),
        more={
            "people": tuple({"participant": who, **_row(own)} for who, own in zip(people, counts, strict=True)),
            "confusions": tuple(confusions),
        },
    )


def _row(counts: Counts) -> dict[str, Any]:
    p = counts.sum(axis=1) / counts.sum()
    return {
        "answers": int(counts.sum()),
        "percent_right": 100 * float(np.trace(counts) / counts.sum()),
        "bits": bits(counts),
        "bits_corrected": corrected_bits(counts),
        "bits_touched": float(-(p[p > 0] * np.log2(p[p > 0])).sum()),
    }


TRANSMITTED = Kind("transmitted information", Settings, transmitted_answer, takes=TABLE, each="all")
