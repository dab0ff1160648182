"""The exact self-check finds nothing to say of what is right, and says what it did not check."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.analysis.statistics import exact as checking
from palpate.analysis.statistics.exact import exact_mixed, exact_within, self_check
from palpate.analysis.statistics.mixed_anova import gather_design
from palpate.analysis.statistics.references import reference_table, reference_values
from tests.analysis.statistics.anova_for_tests import exact_one_way, long_table
from tests.analysis.statistics.variance_for_tests import UNEQUAL, R, design, r_table

SETS = {name: entry for name, entry in reference_values("r_reference").items() if "effects" in entry}


@pytest.mark.parametrize("name", SETS)
def test_every_reference_set_is_right_to_the_last_digits(name: str) -> None:
    entry = SETS[name]
    table, kind = reference_table(f"csv/{entry['csv']}"), "I" * entry["type"]
    design = {"within": entry["within"], "between": entry["between"], "subject": "subject", "aggregate": "mean"}
    result = self_check(table, "y", sum_of_squares=kind, **design)
    assert result["checked"].all()
    assert result["difference"].max() < 1e-15
    for effect, f in zip(result["Source"], result["exact_F"], strict=True):
        assert f == pytest.approx(entry["effects"][effect]["F"], rel=1e-12)


def test_the_oracles_agree() -> None:
    cells = np.round(np.random.default_rng(5).normal(50, 9, (6, 3, 2)), 1)
    wide = exact_within(cells.ravel().tolist(), cells.shape, ["A", "B"])
    assert exact_mixed(gather_design(long_table(cells), "y", ["A", "B"], None, "subject"), "III") == wide
    table = r_table(R["anova"]["between_3x2"]["csv"])
    one = exact_mixed(gather_design(table, "y", None, "g", "subject"), "II")[0]
    plain = exact_one_way([rows["y"].tolist() for _, rows in table.groupby("g")])
    assert (one.f, one.ss, one.np2) == (plain.f, plain.ss, plain.np2)


@pytest.mark.parametrize("design", [{"within": "A", "subject": "subject"}, {"between": "A"}], ids=["within", "between"])
def test_40_by_45(design: dict) -> None:
    cells = np.random.default_rng(40).normal(50, 9, (40, 45))
    result = self_check(long_table(cells), "y", **design)
    assert result["checked"].all()
    assert result["difference"].max() < 1e-15


def test_a_wrong_number_would_be_found(monkeypatch: pytest.MonkeyPatch) -> None:
    real = checking.mixed_effects

    def off(*arguments: object) -> list:
        return [(d, effect._replace(f=effect.f * (1 + 1e-9))) for d, effect in real(*arguments)]

    monkeypatch.setattr(checking, "mixed_effects", off)
    result = self_check(design(UNEQUAL), "y", within=["A", "B"], between=["g", "h"], subject="subject")
    assert (result["number"] == "f").all()
    np.testing.assert_allclose(result["difference"], 1e-9, rtol=1e-5)


def test_nothing_is_left_out_without_a_word() -> None:
    table = long_table(np.random.default_rng(1).normal(size=(5, 4)))
    result = self_check(table, "y", within="A", subject="subject", most=19)
    assert result["note"].tolist() == ["not checked: 20 values, more than 19"]
    assert not result["checked"].any()
    flat = self_check(table.assign(y=0.3), "y", within="A", subject="subject").iloc[0]
    assert (flat["checked"], flat["note"][:33]) == (False, "not checked: F is undefined: the ")
