"""Intervals, trends, categories, targets and order where data are odd: the right number, or a refusal that says why."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.analysis.plans.families.rows import without_gaps
from palpate.analysis.ratings.categories import category_cells, turned
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.disagreement import disagreement
from palpate.analysis.ratings.one_sample import one_sample
from palpate.analysis.ratings.order_effects import order_effect
from palpate.analysis.ratings.target_errors import target_errors
from palpate.analysis.ratings.trends import trends
from palpate.analysis.ratings.within_intervals import mean_intervals
from palpate.analysis.statistics.refusals import BadOption, BadValue, DuplicatedCells, IncompleteCells
from tests.examples import examples


def long(grid: list[list[float]], offset: float = 0.0, name: object = str) -> pd.DataFrame:
    """participants x levels as a long table; every second level belongs to a family of its own after the first."""
    rows = [
        (name(i), f"g{j}", "start" if j == 0 else "rest", value + offset)  # type: ignore[operator]
        for i, row in enumerate(grid)
        for j, value in enumerate(row)
    ]
    return pd.DataFrame(rows, columns=["participant", "level", "family", "value"])


GRID = [[1.0, 3.0, 4.0, 8.0], [2.0, 2.0, 6.0, 7.0], [5.0, 9.0, 7.0, 12.0]]


@pytest.mark.parametrize("method", ["cousineau_morey", "loftus_masson", "between"])
def test_an_offset_of_a_billion_changes_no_interval(method: str) -> None:
    near = mean_intervals(long(GRID), by=("level",), method=method)["half"]
    far = mean_intervals(long(GRID, 1e9), by=("level",), method=method)["half"]
    np.testing.assert_allclose(far, near, rtol=1e-14)


def test_participants_a_billion_apart_change_no_within_participant_interval() -> None:
    apart = [[value + 1e9 * i for value in row] for i, row in enumerate(GRID)]
    halves = mean_intervals(long(apart), by=("level",))["half"]
    np.testing.assert_allclose(halves, mean_intervals(long(GRID), by=("level",))["half"], rtol=1e-14)


@settings(max_examples=examples(12), deadline=None)
@given(st.permutations(range(12)), st.sampled_from([str, int, lambda i: f"P{i}"]))
def test_neither_row_order_nor_label_type_changes_intervals_or_trends(order: list[int], name: object) -> None:
    data = long(GRID, name=name).iloc[list(order)].reset_index(drop=True)
    first = long(GRID)
    pd.testing.assert_frame_equal(mean_intervals(data, by=("level",)), mean_intervals(first, by=("level",)))
    options = {"level": "level", "family": "family"}
    pd.testing.assert_frame_equal(trends(data, **options).slopes, trends(first, **options).slopes)
    pd.testing.assert_frame_equal(trends(data, **options).levels, trends(first, **options).levels)


def test_one_participant_and_one_level_have_no_interval_and_say_so() -> None:
    one = mean_intervals(long(GRID[:1]), by=("level",))
    assert one["half"].isna().all()
    assert set(one["note"]) == {"one participant has no spread"}
    single = long([[row[0]] for row in GRID])
    assert "one cell within participants" in mean_intervals(single, by=("level",))["note"][0]


def test_constant_ratings_have_an_interval_of_no_width_and_a_trend_without_t() -> None:
    data = long([[0.3, 0.3, 0.3, 0.3]] * 3)
    assert mean_intervals(data, by=("level",))["half"].tolist() == [0.0] * 4
    (slope,) = trends(data, level="level", family="family").slopes.to_dict("records")
    assert (slope["mean"], slope["note"]) == (0.0, "t is undefined: the slopes do not vary")
    assert math.isnan(slope["p"])
    rounding = trends(long([[0.1, 0.1, 0.3, 0.3], [0.1, 0.1, 0.3, 0.1 + 0.2]]), level="level", family="family")
    assert "vary only by rounding" in rounding.slopes["note"][0]


def test_a_missing_cell_is_refused_or_its_participant_is_left_out() -> None:
    data = long(GRID).drop(index=5).reset_index(drop=True)
    with pytest.raises(IncompleteCells, match="participant '1' at level 'g1'"):
        mean_intervals(data, by=("level",))
    with pytest.raises(IncompleteCells, match="participant '1' at level 'g1'"):
        trends(data, level="level", family="family")
    assert set(mean_intervals(data, by=("level",), missing="listwise")["n"]) == {2}
    assert trends(data, level="level", family="family", missing="listwise").slopes["n"].tolist() == [2]
    assert mean_intervals(data, by=("level",), method="between")["n"].tolist() == [3, 2, 3, 3]


def test_groups_have_intervals_of_their_own_and_nobody_is_in_two() -> None:
    data = long(GRID * 2, name=lambda i: i).assign(group=["a"] * 12 + ["b"] * 12)
    alone = mean_intervals(data[data["group"] == "a"], by=("level",))["half"].tolist()
    both = mean_intervals(data, by=("group", "level"), between=("group",))
    assert both["half"].tolist() == alone * 2
    with pytest.raises(DuplicatedCells, match="participants in more than one group of group: 0"):
        mean_intervals(data.assign(participant=0), by=("group", "level"), between=("group",))


def test_an_impossible_request_is_refused_by_name() -> None:
    with pytest.raises(BadOption, match="confidence 95"):
        mean_intervals(long(GRID), by=("level",), confidence=95)
    with pytest.raises(DataRefused, match="'g1' in rest and start"):
        trends(long(GRID).assign(family=lambda t: np.where(t.index == 1, "start", t["family"])), level="level",
               family="family")  # fmt: skip
    with pytest.raises(DataRefused, match="no level 'g9'"):
        trends(long(GRID), level="level", family="family", reference="g9")
    with pytest.raises(BadOption, match="a family of 0 is fixed"):
        trends(long(GRID), level="level", family="family", size=0)
    with pytest.raises(BadValue, match="inf"):
        mean_intervals(long([[math.inf, 1.0], [1.0, 2.0]]), by=("level",))
    with pytest.raises(BadValue, match="both occur in column 'participant'"):
        mean_intervals(pd.concat([long(GRID), long(GRID, name=int)]), by=("level",))


def test_p_of_a_perfect_trend_is_never_zero() -> None:
    result = one_sample(np.array([1e200, 1e200 * (1 + 1e-15), 1e200 * (1 - 1e-15)]))
    assert 0 < result.p < 1e-20
    assert one_sample(np.array([1.0] * 400 + [1.0 + 1e-13])).p > 0


def rated(values: dict[tuple[str, str, str], float]) -> pd.DataFrame:
    rows = [(*key, value) for key, value in values.items()]
    return pd.DataFrame(rows, columns=["participant", "attribute", "stimulus", "value"])


def test_turning_an_attribute_goes_about_the_middle_of_the_scale_and_back() -> None:
    data = rated({("P1", "a", "s", ): 3.0, ("P1", "b", "s"): 9.0})  # fmt: skip
    there = turned(data, ["a"], (0.0, 10.0))
    assert there["value"].tolist() == [7.0, 9.0]
    assert turned(there, ["a"], (0.0, 10.0))["value"].tolist() == [3.0, 9.0]
    assert turned(data, ["a"], None)["value"].tolist() == [-3.0, 9.0]
    with pytest.raises(DataRefused, match="no attribute 'c'"):
        turned(data, ["c"], None)


def test_attributes_of_a_category_count_equally_and_a_missing_one_leaves_no_mean() -> None:
    data = rated({("P1", "a", "s"): 1.0, ("P1", "b", "s"): 5.0, ("P2", "a", "s"): 1.0, ("P1", "c", "s"): 0.0})
    cells = category_cells(data, {"a": "x", "b": "x", "c": "y"}, ("stimulus",))
    assert cells.cells == (("x", "s"), ("y", "s"))
    np.testing.assert_array_equal(cells.values, [[3.0, 0.0], [np.nan, np.nan]])
    with pytest.raises(DataRefused, match="no category is declared for c"):
        category_cells(data, {"a": "x", "b": "x"}, ("stimulus",))


def test_without_spread_the_ratio_of_two_spreads_is_undefined() -> None:
    people = [(f"P{i}", a, "s") for i in range(4) for a in "ab"]
    flat = rated({key: 5.0 if key[1] == "a" else float(place) for place, key in enumerate(people)})
    result = disagreement(flat, {"a": "x", "b": "y"}, ("x", "y"))
    assert math.isnan(result.ratio)
    assert "no spread between participants" in result.note
    assert result.second > 0 == result.first


def test_a_scale_s_unit_and_offset_change_no_ratio_of_spreads() -> None:
    draw = np.random.Generator(np.random.PCG64(5))
    keys = [(f"P{i}", a, s) for i in range(6) for a in "ab" for s in "st"]
    data = rated({key: float(draw.integers(0, 50)) for key in keys})
    near = disagreement(data, {"a": "x", "b": "y"}, ("x", "y"))
    far = disagreement(data.assign(value=data["value"] * 8 + 1e9), {"a": "x", "b": "y"}, ("x", "y"))
    assert (far.ratio, far.low, far.p) == pytest.approx((near.ratio, near.low, near.p), rel=1e-12)
    assert far.first == pytest.approx(8 * near.first, rel=1e-12)


THESIS = {  # mean absolute errors of 5.7.1.3 as 12 participants in steps of 10 give them: sums over them, at 10 and 90
    "Easy-to-pull": (80, 60), "Damped": (70, 100), "Consistent": (80, 80), "Comfort": (150, 70),
    "Pleasant": (95, 95), "New": (100, 200), "Luxurious": (200, 200),
}  # fmt: skip
PHYSICAL = ("Easy-to-pull", "Damped", "Consistent", "Comfort")


def matching() -> pd.DataFrame:
    rows = []
    for attribute, sums in THESIS.items():
        for target, total in zip((10, 90), sums, strict=True):
            for person in range(12):
                error = total / 12
                value = target + error if target == 10 else target - error
                rows.append((f"P{person}", attribute, value, attribute, str(target)))
                rows.append((f"P{person}", "Other", 0.0, attribute, str(target)))
    return pd.DataFrame(rows, columns=["participant", "attribute", "value", "stimulus.attribute", "target"])


def test_the_published_errors_of_the_attributes_give_the_published_averages() -> None:
    """5.7.1.3: attributes 5.83, 7.08, 6.67, 9.17, 7.92, 12.50, 16.67; physical 7.19, emotional 12.36, all 9.40."""
    categories = {name: "physical" if name in PHYSICAL else "emotional" for name in THESIS}
    errors = target_errors(matching(), scale=(0, 100), categories=categories)
    means = {(error.of, error.attribute, error.end): round(error.error.mean, 2) for error in errors}
    published = {"Easy-to-pull": 5.83, "Damped": 7.08, "Consistent": 6.67, "Comfort": 9.17, "Pleasant": 7.92,
                 "New": 12.5, "Luxurious": 16.67}  # fmt: skip
    assert {name: means["attribute", name, ""] for name in THESIS} == published
    assert (means["category", "physical", ""], means["category", "emotional", ""]) == (7.19, 12.36)
    assert abs(means["all", "all attributes", ""] - 9.40) <= 0.01  # the mean of the seven rounded errors is 9.406
    ends = [means["attribute and end", "Comfort", end] for end in ("min", "max")]
    assert ends == [12.5, 5.83]
    assert [means["attribute and end", "New", "max"], means["attribute and end", "Damped", "max"]] == [16.67, 8.33]


def test_targets_on_another_scale_are_brought_to_the_ratings_own() -> None:
    data = matching()
    doubled = data.assign(value=data["value"] * 2 - 100)
    with pytest.raises(DataRefused, match="no rating is on the attribute"):
        target_errors(data[data["attribute"] == "Other"])
    with pytest.raises(DataRefused, match="targets beyond the ratings' scale from -10 to 10: 90"):
        target_errors(data.assign(value=0.0), scale=(-10, 10))
    errors = target_errors(doubled, scale=(-100, 100), target_scale=(0, 100))
    assert errors[-1].error.mean == pytest.approx(2 * target_errors(data, scale=(0, 100))[-1].error.mean)


def test_one_order_for_all_cannot_tell_position_from_stimulus() -> None:
    data = pd.DataFrame(
        [(f"P{i}", k, f"s{k}", float(i + k * k)) for i in range(4) for k in range(1, 6)],
        columns=["participant", "trial", "stimulus", "value"],
    )
    with pytest.raises(DataRefused, match="all participants had the stimuli in the same order"):
        order_effect(data)
    assert order_effect(data, adjust="none", bins=5).slope.mean == pytest.approx(6.0)
    with pytest.raises(BadOption, match="carry_over needs"):
        order_effect(data, adjust="none", carry_over=True)


def test_a_drift_is_found_whatever_the_stimuli_do_and_whatever_the_offset() -> None:
    draw = np.random.Generator(np.random.PCG64(3))
    rows = [
        (f"P{i}", k + 1, f"s{s}", 1e9 + 1000.0 * s * s + 7 * i + 0.5 * (k + 1))
        for i in range(6)
        for k, s in enumerate(draw.permutation(8))
    ]
    data = pd.DataFrame(rows, columns=["participant", "trial", "stimulus", "value"])
    effect = order_effect(data.sample(frac=1, random_state=1), bins=4)
    assert effect.slope.mean == pytest.approx(0.5, abs=1e-6)


def test_a_participant_without_a_rating_that_others_of_the_group_gave_is_named_or_left_out() -> None:
    keys = [(f"P{i}", a, s) for i in range(3) for a in "ab" for s in "st"]
    data = rated(dict.fromkeys(keys, 1.0)).assign(group="1")
    data.loc[3, "value"] = math.nan
    with pytest.raises(DataRefused, match="P0 lacks 1 rating; find"):
        without_gaps(data)
    complete, dropped = without_gaps(data, "listwise")
    assert dropped == {"P0": 1}
    assert set(complete["participant"]) == {"P1", "P2"}
    other = rated({("P9", "a", "u"): 1.0}).assign(group="2")
    assert without_gaps(pd.concat([data.dropna(), other]).query("participant != 'P0'"))[1] == {}
