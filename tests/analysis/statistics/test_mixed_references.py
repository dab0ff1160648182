"""Mixed, factorial between and three-way within ANOVA against R 4.2.2 (afex 1.2.1, car 3.1.1), types II and III."""

from __future__ import annotations

from typing import Any

import pandas as pd
import pytest

from palpate.analysis.statistics.anova import rm_anova
from palpate.analysis.statistics.mixed_anova import mauchly_tests, mixed_anova
from palpate.analysis.statistics.references import reference_table, reference_values
from tests.analysis.statistics.anova_for_tests import NAMES, relative_error
from tests.analysis.statistics.variance_for_tests import R, r_table

SHIPPED = {name: entry for name, entry in reference_values("r_reference").items() if "effects" in entry}
OWN = [(name, kind) for name, entry in R["anova"].items() for kind in (("II", "III") if entry["between"] else ("III",))]


def check(result: pd.DataFrame, effects: dict[str, Any]) -> None:
    assert list(result.index) == list(effects)
    for effect, values in effects.items():
        compared = {key: column for key, column in NAMES.items() if values.get(key) is not None}
        assert {"SS", "SS_error", "F", "p", "pes", "ges"} <= set(compared)
        for key, column in compared.items():
            assert relative_error(result.at[effect, column], values[key]) < 1e-12, (effect, column)
        if "HF_eps_raw" in values:
            assert relative_error(result.at[effect, "eps_HF"], min(1.0, values["HF_eps_raw"])) < 1e-12


def check_sphericity(result: pd.DataFrame, effects: dict[str, Any]) -> None:
    tested = [effect for effect, values in effects.items() if "mauchly_W" in values and effect in result.index]
    assert tested == list(result.index)
    for effect in tested:
        assert relative_error(result.at[effect, "W"], effects[effect]["mauchly_W"]) < 1e-12
        assert relative_error(result.at[effect, "p"], effects[effect]["mauchly_p"]) < 1e-12


@pytest.mark.parametrize("name", SHIPPED)
def test_the_reference_sets(name: str) -> None:
    entry, table = SHIPPED[name], reference_table(f"csv/{SHIPPED[name]['csv']}")
    design: dict[str, Any] = {"within": entry["within"], "between": entry["between"], "subject": "subject"}
    design["aggregate"] = "mean"
    kind: Any = "I" * entry["type"]
    check(mixed_anova(table, "y", sum_of_squares=kind, **design).set_index("Source"), entry["effects"])
    check_sphericity(mauchly_tests(table, "y", **design).set_index("Source"), entry["effects"])


def test_the_reference_sets_hold_both_types_and_several_factors() -> None:
    mixed = {name: entry for name, entry in SHIPPED.items() if entry["between"]}
    assert set(mixed) == {"mixed_obk_full", *(f"mixed_{s}_type{i}" for s in ("obk", "sk") for i in (2, 3))}
    assert (mixed["mixed_obk_full"]["within"], mixed["mixed_obk_full"]["between"]) == (
        ["phase", "hour"],
        ["treatment", "gender"],
    )


@pytest.mark.parametrize(("name", "kind"), OWN)
def test_sets_made_for_this_test(name: str, kind: Any) -> None:
    entry = R["anova"][name]
    table, effects = r_table(entry["csv"]), entry[f"type{len(kind)}"]
    design: dict[str, Any] = {"within": entry["within"], "between": entry["between"], "subject": "subject"}
    check(mixed_anova(table, "y", sum_of_squares=kind, **design).set_index("Source"), effects)
    if entry["within"]:
        check_sphericity(mauchly_tests(table, "y", **design).set_index("Source"), effects)


def test_three_factors_within_by_the_call_for_repeated_measures() -> None:
    entry = R["anova"]["within_2x3x4"]
    result = rm_anova(r_table(entry["csv"]), "y", entry["within"], "subject").set_index("Source")
    assert len(result) == 7
    check(result, entry["type3"])


def test_the_two_types_differ_where_groups_do() -> None:
    entry = R["anova"]["two_by_two"]
    table = r_table(entry["csv"])
    two, three = (
        mixed_anova(table, "y", within=["A", "B"], between=["g", "h"], subject="subject", sum_of_squares=kind)
        for kind in ("II", "III")
    )
    assert two["F"].iloc[0] != pytest.approx(three["F"].iloc[0], rel=1e-3)
    last = two["Source"].tolist().index("g:h:A:B")
    assert two["F"].iloc[last] == three["F"].iloc[last]  # nothing contains the last effect
