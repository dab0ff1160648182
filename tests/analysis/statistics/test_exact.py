"""The exact oracle against other exact values (30 digits) and against what can be worked out by hand."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from typing import Any

import pytest

from palpate.analysis.statistics.cells import gather
from palpate.analysis.statistics.exact import exact_within
from palpate.analysis.statistics.references import (
    edge_cases,
    edge_table,
    nist_table,
    nist_values,
    reference_table,
    reference_values,
)
from tests.analysis.statistics.anova_for_tests import exact_one_way

SETS = {name: entry for name, entry in reference_values("exact_reference").items() if "effects" in entry}
EDGE = reference_values("edge_cases_exact")
NAMES = {"SS": "ss", "SS_error": "ss_error", "F": "f", "GG_eps": "eps", "pes": "np2", "ges": "ng2"}


def agree(result: Fraction | None, expected: Any) -> bool:
    if expected is None:
        return result is None
    value = Fraction(Decimal(expected))
    return result is not None and abs(result - value) <= abs(value) * Fraction(1, 10**24)


@pytest.mark.parametrize("name", edge_cases())
def test_edge_cases_to_24_digits(name: str) -> None:
    cells = gather(edge_table(name), "y", "cond", "subject").values
    effect = exact_within(cells.ravel().tolist(), cells.shape, ["cond"])[0]
    if min(cells.shape) == 1:
        assert effect.f is None
        return
    for key, attribute in NAMES.items():
        if key in EDGE[name]:
            assert agree(getattr(effect, attribute), EDGE[name][key]), key


@pytest.mark.parametrize("name", [name for name in SETS if name not in ("obk_hour", "obk_phase_hour")])
def test_reference_sets(name: str) -> None:
    entry = SETS[name]
    cells = gather(reference_table(f"csv/{entry['csv']}"), "y", entry["within"], "subject").values
    for effect in exact_within(cells.ravel().tolist(), cells.shape, entry["within"]):
        values = entry["effects"][effect.source]
        assert (effect.df1, effect.df2) == (int(values["df1"]), int(values["df2"]))
        for key, attribute in NAMES.items():
            if key in values:
                assert agree(getattr(effect, attribute), values[key]), (effect.source, key)


@pytest.mark.parametrize("name", ["AtmWtAg", "SiRstv", "SmLs01", "SmLs07"])
def test_one_way_against_the_exact_f_of_nists_doubles(name: str) -> None:
    table = nist_table(name)
    effect = exact_one_way([rows["y"].tolist() for _, rows in table.groupby("group")])
    value = Fraction(Decimal(nist_values()[name]["exact_of_doubles"]["F"]))
    assert effect.f is not None
    assert abs(effect.f - value) <= value * Fraction(1, 10**23)


def test_by_hand() -> None:
    # Three participants, two conditions, differences 1, 2, 3: t = 2 / (1 / sqrt 3), so F = t^2 = 12 on 1 and 2.
    effect = exact_within([0, 1, 0, 2, 0, 3], (3, 2), ["A"])[0]
    assert (effect.f, effect.eps, effect.df1, effect.df2) == (Fraction(12), Fraction(1), 1, 2)
    assert effect.np2 == Fraction(12, 14)
    groups = exact_one_way([[1, 2, 3], [2, 3, 4]])
    assert (groups.f, groups.np2) == (Fraction(3, 2), Fraction(3, 11))


def test_without_epsilon_and_without_variation() -> None:
    assert exact_within([0, 1, 0, 2, 0, 3], (3, 2), ["A"], epsilon=False)[0].eps is None
    effect = exact_within([0.1] * 6, (3, 2), ["A"])[0]
    assert (effect.f, effect.eps, effect.np2, effect.ng2) == (None, None, None, None)
