"""What holds for every kind of test, on the recorded studies: no order, label type or duplicate changes a number."""

from dataclasses import replace

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


def questions():
    """The first outcome of every test of every shipped plan that rests on answers, each kind once."""
    seen = set()
    for study in PEOPLE:
        plan = read_plan(SHIPPED / study / "analysis.yaml")
        for asked in plan.tests:
            if asked.test not in seen:
                seen.add(asked.test)
                slow = asked.test in ("mds", "vectors")  # they draw bootstrap samples of people
                yield pytest.param(study, asked.name, id=asked.test, marks=[pytest.mark.long] if slow else [])


QUESTIONS = list(questions())


@pytest.fixture(scope="module")
def selecting():
    made = {}

    def of(study):
        if study not in made:
            engine = gathered(ledgers_in(MANY, study), MANY)
            material = read_material(engine, study, digest=None, include_incomplete=False, simulated=None)
            engine.dispose()
            plan = read_plan(SHIPPED / study / "analysis.yaml")
            tables = {name: read_table(plan.table_path(name)) for name in plan.declared.tables}
            made[study] = Selector(apply_exclusions(material, plan.declared).material, plan, tables)
        return made[study]

    return of


def question(selecting, study, name):
    chosen = selecting(study)
    asked = next(each for each in chosen.plan.tests if each.name == name)
    kind = kinds.TESTS[asked.test]
    selected = chosen.of(asked, kind.takes)
    if kind.each == "outcome" and "attribute" not in (getattr(asked, "factor", ""), *getattr(asked, "within", ())):
        selected = next(chosen.by_outcome(selected))
    return kind, asked.model_copy(update={"missing": "refuse"}), replace(selected, draws=100)


def answered(kind, selected, asked):
    try:
        return kind.answer(selected, asked)
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
def test_rows_and_columns_may_stand_in_any_order(selecting, study, name):
    kind, asked, selected = question(selecting, study, name)
    first = answered(kind, selected, asked)
    order = np.random.default_rng(3).permutation(len(selected.table))
    table = selected.table.iloc[order, ::-1].reset_index(drop=True)
    assert same(answered(kind, replace(selected, table=table), asked), first)


@pytest.mark.parametrize(("study", "name"), QUESTIONS)
def test_labels_may_be_categories(selecting, study, name):
    kind, asked, selected = question(selecting, study, name)
    table = selected.table.copy()
    for column in ("participant", "stimulus", "attribute"):
        if column in table.columns:
            table[column] = table[column].astype("category")
    assert same(answered(kind, replace(selected, table=table), asked), answered(kind, selected, asked))


def doubled(table):
    return table.loc[[*table.index, table.index[0]]].reset_index(drop=True) if len(table) else table


@pytest.mark.parametrize(("study", "name"), QUESTIONS)
def test_an_answer_that_stands_twice_is_refused_and_never_weighs_double(selecting, study, name):
    chosen = selecting(study)
    material = chosen.material
    ratings = material.ratings
    twice = replace(
        material,
        ratings=None if ratings is None else replace(ratings, table=doubled(ratings.table)),
        words=doubled(material.words),
        forms=doubled(material.forms[material.forms["form"] == "likert"]),
    )
    asked = next(each for each in chosen.plan.tests if each.name == name)
    with pytest.raises(DataRefused, match="2 rows hold the same answers twice, the first: participant P001, session"):
        Selector(twice, chosen.plan, chosen.tables).of(asked, kinds.TESTS[asked.test].takes)


def test_every_kind_that_a_shipped_plan_asks_for_is_among_them():
    assert len(QUESTIONS) >= 20 <= len(kinds.TESTS)
