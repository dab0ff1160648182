"""Ratings beside their targets, and answers on points."""

from __future__ import annotations

import pandas as pd
import pytest

from palpate.analysis.figures.likert import LIKERT, point_colours
from palpate.analysis.figures.matching import MATCHING
from palpate.analysis.ratings.dataset import DataRefused
from tests.analysis.figures.specimens import data_of, draw_svg, inputs_of


def doors() -> pd.DataFrame:
    """Two participants rate two attributes at stimuli that were made for one of them."""
    rows = [
        (person, attribute, adjective, target, 50.0 if attribute != adjective else target + shift)
        for person, shift in (("P001", 4.0), ("P002", -6.0))
        for adjective in ("New", "Damped")
        for target in (10, 90)
        for attribute in ("Damped", "New")
    ]
    return pd.DataFrame(rows, columns=["participant", "attribute", "stimulus.attribute", "target", "value"])


def test_only_the_manipulated_attribute_counts_and_its_error_is_reported() -> None:
    data = data_of(MATCHING, inputs_of(doors(), levels={"attribute": ("New", "Damped")}, antonyms={"New": "Old"}))
    summaries = [row for row in data.rows if row["shows"] == "target"]
    assert [(row["attribute"], row["target"]) for row in summaries] == [
        ("New", 10.0), ("New", 90.0), ("Damped", 10.0), ("Damped", 90.0)
    ]  # fmt: skip
    assert {(row["n"], row["mae"]) for row in summaries} == {(2, 5.0)}
    assert [row["mean"] for row in summaries] == [9.0, 89.0, 9.0, 89.0]
    text, drawn = draw_svg(MATCHING, data)
    assert sum(mark.key == "P001" for mark in drawn.marks) == 4
    assert all(f'id="{mark.gid}"' in text for mark in drawn.marks)


def test_repeats_count_as_their_mean_and_row_order_as_nothing() -> None:
    twice = pd.concat([doors(), doors()]).sample(frac=1, random_state=1)
    first, again = data_of(MATCHING, inputs_of(doors())), data_of(MATCHING, inputs_of(twice))
    assert again.rows == first.rows
    assert draw_svg(MATCHING, again)[0] == draw_svg(MATCHING, first)[0]
    assert "the mean of up to 2 repeats" in again.caption


def test_targets_as_text_and_unknown_attributes() -> None:
    text = doors().astype({"target": str})
    assert data_of(MATCHING, inputs_of(text)).rows == data_of(MATCHING, inputs_of(doors())).rows
    with pytest.raises(DataRefused, match="names 'Newer', which is not rated; did you mean 'New'"):
        data_of(MATCHING, inputs_of(doors().assign(**{"stimulus.attribute": "Newer"})))
    with pytest.raises(DataRefused, match="no column 'stimulus.attribute'"):
        data_of(MATCHING, inputs_of(doors().drop(columns="stimulus.attribute")))


def forms(values: dict[str, list[float]]) -> pd.DataFrame:
    rows = [(f"P{i:03d}", "likert", item, v) for item, of in values.items() for i, v in enumerate(of, 1)]
    table = pd.DataFrame(rows, columns=["participant", "form", "attribute", "value"])
    return pd.concat([table, pd.DataFrame([("P001", "demographics", "age", 31.0)], columns=table.columns)])


def test_boxes_tell_quartiles_means_and_every_participant() -> None:
    data = data_of(
        LIKERT, inputs_of(forms({"Realism": [4, 5, 6, 7], "Ease": [1, 1, 1, 7]})), points=(1, 7), order="mean"
    )
    summaries = [row for row in data.rows if row["shows"] == "item"]
    assert [(row["item"], row["mean"], row["q1"], row["median"]) for row in summaries] == [
        ("Realism", 5.5, 4.75, 5.5), ("Ease", 2.5, 1.0, 1.0)
    ]  # fmt: skip
    _, drawn = draw_svg(LIKERT, data)
    assert sorted(mark.key for mark in drawn.marks) == sorted(
        [f"P00{i}" for i in (1, 2, 3, 4)] * 2 + ["Realism", "Ease"]
    )


def test_bars_hold_each_points_share_about_the_middle() -> None:
    data = data_of(LIKERT, inputs_of(forms({"Realism": [1, 4, 4, 7]})), points=(1, 7), style="bars")
    _, drawn = draw_svg(LIKERT, data)
    bars = [(p.get_x(), p.get_width()) for p in drawn.figure.axes[0].patches]
    assert bars == [(-0.5, 0.25), (-0.25, 0.5), (0.25, 0.25)]
    assert len(point_colours(7)) == 7 and len(point_colours(4)) == 4


def test_what_is_no_point_of_the_scale_is_refused() -> None:
    with pytest.raises(DataRefused, match=r"P002 answered Realism with 8; the scale goes from 1 to 7"):
        data_of(LIKERT, inputs_of(forms({"Realism": [4, 8]})), points=(1, 7))
    halves = pd.concat([forms({"Realism": [4, 5]}), forms({"Realism": [5, 5]})])
    assert "The mean of a participant's answers counts." in data_of(LIKERT, inputs_of(halves), points=(1, 7)).caption
    with pytest.raises(DataRefused, match="bars count points"):
        data_of(LIKERT, inputs_of(halves), points=(1, 7), style="bars")
    with pytest.raises(DataRefused, match="the scale is not known"):
        data_of(LIKERT, inputs_of(forms({"Realism": [4]})))
    with pytest.raises(DataRefused, match="no form 'liket'; did you mean 'likert'"):
        data_of(LIKERT, inputs_of(forms({"Realism": [4]})), points=(1, 7), form="liket")
