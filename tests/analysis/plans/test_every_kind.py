"""What holds for every kind of test, on the recorded studies: no order, label type or duplicate changes a number."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from palpate.analysis.plans import kinds
from palpate.analysis.plans.reading import read_plan
from palpate.analysis.plans.selecting import Selector, apply_exclusions
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.reading import read_material
from palpate.analysis.ratings.sources import gathered
from palpate.analysis.regenerating.regeneration import read_table
from palpate.studies.catalogue import SHIPPED
from palpate.studies.sessions.session_files import ledgers_in
from tests.recorded.make_many import MANY, PEOPLE

RELATIVE = 1e-9
FEWER = {
    "mds": {"replications": 19, "reference": 19, "starts": 2, "scree": 2},
    "vectors": {"draws": 19, "starts": 2},
}
"""Settings with which a kind draws fewer samples than the shipped plans ask for."""


def questions():
    """The first outcome of every test of every shipped plan that rests on answers, each kind once."""
    seen = set()
    for study in PEOPLE:
        plan = read_plan(SHIPPED / study / "analysis.yaml")
        for test in plan.tests:
            if test.test not in seen:
                seen.add(test.test)
                slow = test.test in ("mds", "vectors")  # they draw bootstrap samples of people
                yield pytest.param(study, test.name, id=test.test, marks=[pytest.mark.long] if slow else [])


QUESTIONS = list(questions())


@pytest.fixture(scope="module")
def selecting():
    selectors = {}

    def of(study):
        if study not in selectors:
            engine = gathered(ledgers_in(MANY, study), MANY)
            material = read_material(engine, study, digest=None, include_incomplete=False, simulated=None)
            engine.dispose()
            plan = read_plan(SHIPPED / study / "analysis.yaml")
            tables = {name: read_table(plan.table_path(name)) for name in plan.declared.tables}
            selectors[study] = Selector(apply_exclusions(material, plan.declared).material, plan, tables)
        return selectors[study]

    return of


@pytest.fixture(scope="module")
def question(selecting):
    """Return a function that returns a kind, its test, what it asks and the answer, which is computed once."""

    @cache
    def of(study, name):
        chosen = selecting(study)
        test = next(candidate for candidate in chosen.plan.tests if candidate.name == name)
        kind = kinds.TESTS[test.test]
        selected = chosen.of(test, kind)
        if kind.each == "outcome" and "attribute" not in (getattr(test, "factor", ""), *getattr(test, "within", ())):
            selected = next(chosen.by_outcome(selected))
        test = test.model_copy(update={"missing": "refuse", **FEWER.get(test.test, {})})
        selected = replace(selected, draws=100)
        return kind, test, selected, answered(kind, selected, test)

    return of


def answered(kind, selected, test):
    try:
        return kind.answer(selected, test)
    except ValueError as refusal:
        return str(refusal)


def same(one, other):
    """The same rows, numbers to 1e-9; a refusal counts as an answer of its own."""
    if isinstance(one, str) or isinstance(other, str):
        return one == other
    return len(one.rows) == len(other.rows) and all(
        set(a) == set(b) and all(near(a[key], b[key]) for key in a) for a, b in zip(one.rows, other.rows, strict=True)
    )


def near(a, b):
    if isinstance(a, float) and isinstance(b, float):
        return a == b or abs(a - b) <= RELATIVE * max(abs(a), abs(b)) + 1e-12
    return a == b


@pytest.mark.parametrize(("study", "name"), QUESTIONS)
def test_rows_and_columns_may_be_in_any_order(question, study, name):
    kind, test, selected, first = question(study, name)
    order = np.random.default_rng(3).permutation(len(selected.table))
    table = selected.table.iloc[order, ::-1].reset_index(drop=True)
    assert same(answered(kind, replace(selected, table=table), test), first)


@pytest.mark.parametrize(("study", "name"), QUESTIONS)
def test_labels_may_be_categories(question, study, name):
    kind, test, selected, first = question(study, name)
    table = selected.table.copy()
    for column in ("participant", "stimulus", "attribute"):
        if column in table.columns:
            table[column] = table[column].astype("category")
    assert same(answered(kind, replace(selected, table=table), test), first)


def doubled(table):
    return table.loc[[*table.index, table.index[0]]].reset_index(drop=True) if len(table) else table


@pytest.mark.parametrize(("study", "name"), QUESTIONS)
def test_a_repeated_answer_is_refused_and_never_weighs_double(selecting, study, name):
    chosen = selecting(study)
    material = chosen.material
    ratings = material.ratings
    twice = replace(
        material,
        ratings=None if ratings is None else replace(ratings, table=doubled(ratings.table)),
        words=doubled(material.words),
        forms=doubled(material.forms[material.forms["form"] == "likert"]),
    )
    test = next(candidate for candidate in chosen.plan.tests if candidate.name == name)
    with pytest.raises(DataRefused, match="2 rows hold the same answers twice, the first: participant P001, session"):
        Selector(twice, chosen.plan, chosen.tables).of(test, kinds.TESTS[test.test])


def test_every_kind_that_a_shipped_plan_asks_for_is_among_them():
    assert len(QUESTIONS) >= 20 <= len(kinds.TESTS)
