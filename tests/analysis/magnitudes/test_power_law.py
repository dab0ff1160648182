"""Stevens' power law: exact on exact numbers, by hand on others, an interval that holds, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.magnitudes.power_law import power_law
from palpate.analysis.statistics.refusals import BadValue, TooFew

INTENSITIES = {"a": 1.0, "b": 10.0, "c": 100.0}


def numbers(people: dict[str, dict[str, list[float]]]) -> pd.DataFrame:
    """One row for each number: {participant: {stimulus: numbers}}."""
    rows = [(who, name, INTENSITIES[name], value) for who, own in people.items() for name in own for value in own[name]]
    return pd.DataFrame(rows, columns=["participant", "stimulus", "intensity", "number"])


def test_exact_power_laws_give_their_exponents_and_moduli() -> None:
    people = {who: {name: [modulus * x**exponent] for name, x in INTENSITIES.items()}
              for who, modulus, exponent in (("P1", 2.0, 0.4), ("P2", 50.0, 0.8))}  # fmt: skip
    law = power_law(numbers(people))
    assert law.people["exponent"].tolist() == pytest.approx([0.4, 0.8], abs=1e-12)
    assert law.people["modulus"].tolist() == pytest.approx([2.0, 50.0])
    assert law.people["r2"].tolist() == pytest.approx([1.0, 1.0])
    # mean 0.6, SD 0.4 / sqrt(2), SE 0.2; t of one degree of freedom is 12.706 (tables)
    assert (law.exponent, law.se) == pytest.approx((0.6, 0.2))
    assert (law.ci_low, law.ci_high) == pytest.approx((0.6 - 12.706 * 0.2, 0.6 + 12.706 * 0.2), abs=1e-3)
    # each person's geometric mean is brought to that of all: sqrt(2 * 10^0.4 * 50 * 10^0.8)
    centre = math.sqrt(2 * 10**0.4 * 50 * 10**0.8)
    assert law.stimuli["magnitude"].tolist() == pytest.approx([centre * 10 ** (0.6 * k) for k in (-1, 0, 1)])
    assert law.stimuli["intensity"].tolist() == [1.0, 10.0, 100.0]


def test_repeats_are_averaged_as_logarithms_and_the_slope_is_that_of_least_squares() -> None:
    law = power_law(numbers({"P1": {"a": [1.0, 4.0], "b": [10.0], "c": [40.0, 40.0]}}))
    # log10: 0.30103, 1, 1.60206 at 0, 1, 2: slope (1.60206 - 0.30103) / 2
    assert law.exponent == pytest.approx((math.log10(40) - math.log10(2)) / 2)
    assert math.isnan(law.se) and math.isnan(law.ci_low)
    assert law.people.loc[0, ["numbers", "stimuli"]].tolist() == [5, 3]
    residual = 1 - (math.log10(2) + 1 + math.log10(40)) / 3
    total = sum((y - (math.log10(2) + 1 + math.log10(40)) / 3) ** 2 for y in (math.log10(2), 1, math.log10(40)))
    assert law.people.loc[0, "r2"] == pytest.approx(1 - residual**2 * 1.5 / total)
    assert law.stimuli["magnitude"].tolist() == pytest.approx([2.0, 10.0, 40.0])


def test_the_interval_excludes_differences_of_modulus_alone() -> None:
    rng = np.random.default_rng(1)
    people = {f"P{n}": {name: [10 ** (rng.normal(0, 1)) * x**0.5] for name, x in INTENSITIES.items()} for n in range(6)}
    scaled = {who: {name: [1000.0**n * v for v in values] for name, values in own.items()}
              for n, (who, own) in enumerate(people.items())}  # fmt: skip
    plain, moved = power_law(numbers(people)).stimuli, power_law(numbers(scaled)).stimuli
    widths = [(t["ci_high"] / t["ci_low"]).tolist() for t in (plain, moved)]
    assert widths[0] == pytest.approx(widths[1])


def test_people_who_felt_different_stimuli_have_exponents_and_no_common_magnitudes() -> None:
    law = power_law(numbers({"P1": {"a": [1], "b": [3]}, "P2": {"b": [3], "c": [9]}}))
    assert law.exponent == pytest.approx(math.log10(3)) and law.stimuli.empty


@pytest.mark.long
def test_intervals_hold_the_population_s_exponent() -> None:
    rng, held = np.random.default_rng(7), 0
    for _ in range(400):
        exponents, moduli = rng.normal(0.7, 0.2, 8), rng.normal(1, 0.5, 8)
        people = {
            f"P{n}": {name: [10 ** (m + e * math.log10(x) + rng.normal(0, 0.15))] for name, x in INTENSITIES.items()}
            for n, (e, m) in enumerate(zip(exponents, moduli, strict=True))
        }
        law = power_law(numbers(people))
        held += law.ci_low <= 0.7 <= law.ci_high
    assert 0.92 <= held / 400 <= 0.98  # binomial SD 0.011


@pytest.mark.parametrize(
    ("people", "error", "message"),
    [
        ({"P1": {"a": [1.0], "b": [0.0]}}, BadValue, "row 2: number is 0; a number above 0"),
        ({"P1": {"a": [1.0], "b": [-3.0]}}, BadValue, "row 2: number is -3"),
        ({"P1": {"a": [1.0, 2.0]}}, TooFew, "participant P1 felt one intensity"),
    ],
)
def test_what_has_no_exponent_is_refused(people: dict, error: type[ValueError], message: str) -> None:
    with pytest.raises(error, match=message):
        power_law(numbers(people))


def test_a_stimulus_of_two_intensities_is_refused() -> None:
    table = numbers({"P1": {"a": [1.0], "b": [2.0]}, "P2": {"a": [1.0], "b": [2.0]}})
    table.loc[0, "intensity"] = 2.0
    with pytest.raises(BadValue, match="a: several intensities in column 'intensity'"):
        power_law(table)
