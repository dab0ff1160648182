"""The four kinds of test about ratings: plain rows, notes, and refusals."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from palpate.analysis.plans.answers import Answer, Selected
from palpate.analysis.plans.families.describing import KINDS
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.describe import describe
from tests.analysis.synthetic_ratings import door_ratings

MEANS, TRENDS, CATEGORIES, TARGET_ERROR = KINDS.values()


def door(people: int = 4, attributes: int = 7) -> Selected:
    ratings = door_ratings(people=people, attributes=attributes)
    table = ratings.table.assign(stimulus=ratings.table["car"] + "_" + ratings.table["variant"])
    columns = ("car", "variant", "augmentation", "group")
    return Selected(
        table=table,
        trials=table[["participant", "stimulus", *columns]].drop_duplicates(),
        outcomes=ratings.attributes,
        levels={name: ratings.levels(name) for name in columns},
        scale=(-10.0, 10.0),
        antonyms=ratings.antonyms,
        categories=ratings.categories,
    )


def answer_of(kind: object, selected: Selected, **settings: object) -> Answer:
    name = next(name for name in ("means", "trends", "categories", "target_error") if TESTS[name] is kind)
    return kind.answer(selected, kind.settings(name="x", test=name, **settings))  # type: ignore[attr-defined]


def test_means_are_describe_s_and_every_row_is_plain() -> None:
    selected = door(attributes=1)
    answer = answer_of(MEANS, selected, by=("variant",))
    expected = describe(door_ratings(people=4, attributes=1), ("attribute", "variant"), kind="over participants")
    assert [row["variant"] for row in answer.rows] == expected["variant"].tolist()
    for ours, theirs in (("n", "n"), ("mean", "mean"), ("sd", "sd")):
        assert [row[ours] for row in answer.rows] == pytest.approx(expected[theirs].tolist(), rel=1e-14)
    assert "3 ratings in a cell were averaged first" in answer.notes[0]
    assert (answer.participants, answer.values) == (8, 360)
    json.dumps(answer.rows, allow_nan=False)


def test_a_column_that_never_changes_within_a_participant_is_a_group() -> None:
    answer = answer_of(MEANS, door(attributes=1), by=("group", "car"))
    assert [(row["group"], row["car"]) for row in answer.rows][:4] == [
        ("1", "BC3"),
        ("1", "FORD"),
        ("1", "G90"),
        ("2", "K3"),
    ]
    assert "within each group" in " ".join(answer.notes)
    assert {row["n"] for row in answer.rows} == {4}


def test_trends_follow_every_attribute_then_every_category_in_families_of_their_own() -> None:
    answer = answer_of(TRENDS, door(), families="augmentation", pooled="variant")
    outcomes = list(dict.fromkeys((row["outcome"], row["of"]) for row in answer.rows))
    assert [name for name, of in outcomes if of == "category"] == ["physical", "emotional"]
    assert len(outcomes) == 9
    assert {row["family_size"] for row in answer.rows} == {5}
    against = answer.more["against_reference"]
    assert {row["reference"] for row in against} == {"g0"}
    assert len(against) == 9 * 14
    easy, damped, consistent, physical = ([row["mean"] for row in answer.rows if row["outcome"] == name] for name in
                                          ("Easy-to-pull", "Damped", "Consistent", "physical"))  # fmt: skip
    assert physical == pytest.approx(np.mean([easy, damped, consistent], axis=0).tolist(), abs=1e-12)
    json.dumps([answer.rows, against], allow_nan=False)


def test_an_attribute_turned_round_turns_its_slopes_round() -> None:
    settings = {"families": "augmentation", "pooled": "variant", "category": "none"}
    straight = answer_of(TRENDS, door(attributes=1), **settings)
    turned = answer_of(TRENDS, door(attributes=1), **settings, reversed=("Easy-to-pull",))
    assert [row["mean"] for row in turned.rows] == pytest.approx([-row["mean"] for row in straight.rows])
    assert "Turned round about 0" in " ".join(turned.notes)


def test_categories_compare_means_spreads_and_every_level() -> None:
    answer = answer_of(CATEGORIES, door(), by=("variant",))
    mean, spread = answer.rows
    assert mean["difference"] == pytest.approx(mean["emotional"] - mean["physical"])
    assert spread["ratio"] == pytest.approx(spread["emotional"] / spread["physical"])
    assert spread["ci_low"] < spread["ratio"] < spread["ci_high"]
    assert len(answer.more["levels"]) == 15
    assert [row["Source"] for row in answer.more["category_x_level"]] == ["category", "category:variant"]
    assert "ratio" in answer.headline
    with pytest.raises(DataRefused, match="1 category among the attributes"):
        answer_of(CATEGORIES, door(attributes=3), by=("variant",))


def test_a_missing_rating_is_refused_or_its_participant_is_left_out_with_a_note() -> None:
    selected = door()
    gap = replace(selected, table=selected.table.drop(index=17).reset_index(drop=True))
    settings = {"families": "augmentation", "pooled": "variant"}
    with pytest.raises(DataRefused, match=r"P100 lacks 1 rating"):
        answer_of(TRENDS, gap, **settings)
    answer = answer_of(TRENDS, gap, **settings, missing="listwise")
    assert {row["n"] for row in answer.rows} == {7}
    assert "Left out listwise: P100 (1 rating missing)." in answer.notes
    with pytest.raises(DataRefused, match=r"P100 lacks 1 rating; find the ratings, or"):
        answer_of(TRENDS, gap, **settings, missing="mixed_model")


def test_one_participant_has_means_and_slopes_and_no_test() -> None:
    selected = door()
    one = replace(selected, table=selected.table.query("participant == 'P100'").reset_index(drop=True))
    means = answer_of(
        MEANS, replace(one, table=one.table.query("attribute == 'Damped'"), outcomes=("Damped",)), by=("variant",)
    )
    assert {(row["n"], row["ci_low"], row["note"]) for row in means.rows} == {
        (1, None, "one participant has no spread")
    }
    slopes = answer_of(TRENDS, one, families="augmentation", pooled="variant")
    assert {(row["p"], row["p_corrected"], row["note"]) for row in slopes.rows} == {
        (None, None, "one participant has no spread")
    }


def test_errors_of_targets_have_ends_attributes_categories_and_all() -> None:
    selected = door(attributes=1)
    rows = selected.table["variant"].isin(["g1", "g2"])
    table = selected.table[rows].assign(
        **{"stimulus.attribute": "Easy-to-pull", "target": lambda t: t["variant"].map({"g1": "-8", "g2": "8"})}
    )
    answer = answer_of(TARGET_ERROR, replace(selected, table=table.reset_index(drop=True)))
    assert [(row["of"], row["end"], row["target"]) for row in answer.rows] == [
        ("attribute and end", "min", -8.0), ("attribute and end", "max", 8.0), ("attribute", None, None),
        ("category", None, None), ("all", None, None),
    ]  # fmt: skip
    expected = [
        (table["value"] - table["target"].astype(float)).abs()[table["variant"] == g].mean() for g in ("g1", "g2")
    ]
    assert [row["mean_absolute_error"] for row in answer.rows[:2]] == pytest.approx(expected)
    assert answer.rows[2]["mean_absolute_error"] == pytest.approx(sum(expected) / 2)
    with pytest.raises(DataRefused, match=r"no column 'stimulus\.attribute'"):
        answer_of(TARGET_ERROR, selected)


def test_an_unknown_column_is_answered_with_the_nearest() -> None:
    with pytest.raises(DataRefused, match="did you mean 'variant'"):
        answer_of(MEANS, door(attributes=1), by=("variants",))


def test_reading_the_settings_imports_neither_numpy_nor_pandas() -> None:
    code = (
        "import sys, palpate.analysis.plans.families.describing; print({'numpy', 'pandas', 'scipy'} & set(sys.modules))"
    )
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert process.stdout.strip() == "set()"
