"""Repeated-measures ANOVA against R 4.2.2 (afex 1.2.1, car 3.1.1) and against exact rational arithmetic."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from palpate.analysis import rm_anova
from palpate.analysis.statistics.exact import exact_within
from palpate.analysis.statistics.references import reference_table, reference_values
from tests.analysis.statistics.anova_for_tests import NAMES, long_table, relative_error

R = reference_values("r_reference")
EXACT = reference_values("exact_reference")
WITHIN = [name for name, entry in R.items() if "effects" in entry and not entry["between"]]


def result(entry: dict[str, Any]) -> pd.DataFrame:
    table = reference_table(f"csv/{entry['csv']}")
    within = entry["within"]
    repeated = table.duplicated(["subject", *within]).any()
    return rm_anova(table, "y", within, "subject", aggregate="mean" if repeated else None).set_index("Source")


def test_there_are_references() -> None:
    assert len(WITHIN) == 9
    assert set(WITHIN) == {name for name, entry in EXACT.items() if "effects" in entry}


@pytest.mark.parametrize("source", [R, EXACT], ids=["R", "exact"])
@pytest.mark.parametrize("name", WITHIN)
def test_every_number_within_1e_12(name: str, source: dict[str, Any]) -> None:
    table = result(R[name])
    effects = source[name]["effects"]
    assert list(table.index) == list(R[name]["effects"])
    for effect, values in effects.items():
        compared = {key: column for key, column in NAMES.items() if key in values}
        assert {"SS", "F", "p", "pes", "ges"} <= set(compared)
        for key, column in compared.items():
            expected = float(values[key])
            assert relative_error(table.at[effect, column], expected) < 1e-12, (effect, column)


@pytest.mark.parametrize("name", WITHIN)
def test_huynh_feldt_epsilon_is_rs_clipped_at_one(name: str) -> None:
    table = result(R[name])
    for effect, values in R[name]["effects"].items():
        if "HF_eps_raw" in values:
            assert relative_error(table.at[effect, "eps_HF"], min(1.0, values["HF_eps_raw"])) < 1e-12
        else:
            assert table.at[effect, "eps_HF"] == table.at[effect, "eps"] == 1.0


def test_three_factors_against_exact_fractions() -> None:
    cells = np.round(np.random.default_rng(3).normal(50, 9, (7, 2, 3, 4)), 1)
    table = rm_anova(long_table(cells), "y", ["A", "B", "C"], "subject").set_index("Source")
    exact = exact_within(cells.ravel().tolist(), cells.shape, ("A", "B", "C"))
    assert list(table.index) == ["A", "B", "C", "A:B", "A:C", "B:C", "A:B:C"]
    for effect in exact:
        row = table.loc[effect.source]
        pairs = {"SS": effect.ss, "SS_error": effect.ss_error, "F": effect.f, "eps": effect.eps, "np2": effect.np2}
        for column, expected in (pairs | {"ng2": effect.ng2}).items():
            assert expected is not None
            assert relative_error(row[column], float(expected)) < 1e-13, (effect.source, column)


def test_columns_and_types() -> None:
    table = rm_anova(reference_table("csv/md_15.1.csv"), dv="y", within="time", subject="subject")
    assert list(table.columns) == [
        *("Source", "SS", "ddof1", "ddof2", "MS", "F", "p_unc", "p_GG_corr", "p_HF_corr"),
        *("eps", "np2", "ng2", "eps_HF", "SS_error", "note"),
    ]
    assert table["ddof1"].dtype == table["ddof2"].dtype == "int64"
    assert table["Source"].tolist() == ["time"]
    assert table["note"].tolist() == [""]
    assert table["MS"].iloc[0] == 184.0
    assert table.attrs == {"participants": 12, "dropped": []}
