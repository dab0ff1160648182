"""A missing cell under each policy, from a plan's file to its answers: never averaged away, never overlooked."""

import numpy as np
import pandas as pd
import pytest
import yaml

from palpate.analysis.plans.reading import read_plan
from palpate.analysis.plans.selecting import Selector, apply_exclusions
from palpate.analysis.regenerating.comparison import exact_checks
from palpate.analysis.regenerating.regeneration import cells_cut, run_tests
from tests.analysis.ratings_for_tests import recorded_material

GAP = {"participant": "P003", "car": "K3", "variant": "g3"}
BOTH = {"test": "anova", "within": ["car", "variant"]}
AVERAGED = {"test": "anova", "within": ["variant"]}
ONE_CAR = {"test": "anova", "within": ["variant"], "where": {"car": "K3"}}
PAIRS = {"test": "pairs", "factor": "variant"}
MODEL = {"test": "mixed_model", "fixed": ["variant"], "random": {"participant": [], "car": []}}


@pytest.fixture(scope="module")
def material():
    return recorded_material()


def answered(material, tmp_path, test, missing, left_out=None, tables=None):
    """The plan's one test, with these trials left out."""
    rules = [{"where": left_out, "because": "broken"}] if left_out else []
    test = {"name": "t", **test} if "table" in test else {"name": "t", "outcomes": ["Damped"], **test}
    declared = {"study": "doors_small", "missing": missing, "exclusions": rules, "tests": [test]}
    for name, table in (tables or {}).items():
        table.to_csv(tmp_path / f"{name}.csv", index=False)
        declared["tables"] = {name: f"{name}.csv"}
    file = tmp_path / "analysis.yaml"
    file.write_text(yaml.safe_dump(declared))
    plan = read_plan(file)
    left = apply_exclusions(material, plan.declared)
    return run_tests(Selector(left.material, plan, tables or {}))[0]


@pytest.mark.parametrize("test", [BOTH, AVERAGED, ONE_CAR, PAIRS, MODEL], ids=str)
def test_refused_with_the_cell_and_what_to_write_into_the_plan(material, tmp_path, test):
    result = answered(material, tmp_path, test, "refuse", GAP)
    assert result.answer is None
    assert "P003 lacks 1 of 6 cells (car K3, variant g3)" in result.refused
    assert "`missing: listwise`" in result.refused
    assert "--missing" not in result.refused


@pytest.mark.parametrize("test", [BOTH, AVERAGED, ONE_CAR, PAIRS, MODEL], ids=str)
def test_listwise_is_the_answer_without_that_participant(material, tmp_path, test):
    result = answered(material, tmp_path, test, "listwise", GAP)
    without = answered(material, tmp_path, test, "refuse", {"participant": "P003"})
    assert result.answer.rows == without.answer.rows
    assert result.answer.participants == 11
    assert result.missing.text() == "1 cell of 1 participant missing; left out listwise: P003"


@pytest.mark.parametrize("test", [BOTH, ONE_CAR, MODEL], ids=str)
def test_a_mixed_model_keeps_what_is_there(material, tmp_path, test):
    result = answered(material, tmp_path, test, "mixed_model", GAP)
    assert result.answer.method.startswith("Linear mixed model")
    assert result.answer.values == len(result.rows)
    assert result.answer.participants == 12
    assert result.missing.text() == "1 cell of 1 participant missing; answered from what is there"


def test_a_mixed_model_does_not_average_over_what_is_left_of_a_cell(material, tmp_path):
    result = answered(material, tmp_path, AVERAGED, "mixed_model", GAP)
    assert result.answer is None
    assert "in a cell of variant rests on up to 2 stimuli, and some are missing" in result.refused


def test_a_test_without_such_a_form_says_so(material, tmp_path):
    result = answered(material, tmp_path, PAIRS, "mixed_model", GAP)
    assert result.refused.startswith("1 cell of 1 participant missing, and 'pairs' has no form that takes gaps; give")


@pytest.mark.parametrize("policy", ["refuse", "listwise", "mixed_model"])
def test_somebody_without_any_of_a_tests_cells_is_not_overlooked(material, tmp_path, policy):
    """All of P003's trials with one car are left out; a test of that car has nothing of P003 any more."""
    result = answered(material, tmp_path, ONE_CAR, policy, {"participant": "P003", "car": "K3"})
    if policy == "refuse":
        assert "P003 lacks 3 of 6 cells" in result.refused
    else:
        assert result.missing.text().startswith("3 cells of 1 participant missing; ")
        assert result.answer.participants == 11


def test_a_gap_elsewhere_is_none_of_a_tests_business(material, tmp_path):
    other = {**ONE_CAR, "where": {"car": "BC3"}}
    assert answered(material, tmp_path, other, "refuse", GAP).answer.participants == 12
    own = {**AVERAGED, "where": {"participant": ["P001", "P002", "P004"]}}
    assert answered(material, tmp_path, own, "refuse", GAP).answer.participants == 3


def test_whoever_a_test_left_out_counts_nowhere(material, tmp_path):
    p, c = np.indices((5, 3)).reshape(2, -1)
    value = np.random.default_rng(3).normal(size=15)
    value[4] = np.nan
    table = pd.DataFrame({"participant": [f"P{i}" for i in p], "cond": [f"c{i}" for i in c], "value": value})
    test = {"test": "anova", "table": "own", "within": ["cond"]}
    result = answered(material, tmp_path, test, "listwise", tables={"own": table})
    assert result.answer.notes[0] == "Left out listwise: P1."
    assert (result.answer.participants, result.answer.values) == (4, 12)
    pairs = answered(material, tmp_path, {**PAIRS, "table": "own", "factor": "cond"}, "listwise", tables={"own": table})
    assert (pairs.answer.participants, pairs.answer.values) == (4, 12)
    assert all(check.difference < 1e-14 for check in exact_checks([result]))


@pytest.mark.parametrize("group", [None, ["", ""], ["1", "2"]])
def test_a_cell_that_where_takes_from_one_and_leaves_another_is_missing(group):
    trials = pd.DataFrame(
        {"participant": list("aabb"), "stimulus": list("stst"), "when": list("1221"), "attribute": "Soft", "value": 1.0}
    )
    if group is not None:
        trials["group"] = trials["participant"].map(dict(zip("ab", group, strict=True)))

    def cut(column, level):
        return cells_cut(trials[trials[column] == level], {column: level}, trials, ["a", "b"])

    assert cut("when", "1") == ({} if group == ["1", "2"] else {"a": 1, "b": 1})
    assert cut("stimulus", "s") == {}
    assert cut("participant", "a") == {}
