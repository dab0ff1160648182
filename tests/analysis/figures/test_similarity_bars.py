"""Bars, their whiskers, and brackets that stand over one another."""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.analysis.figures.significance import stack_brackets, stars
from palpate.analysis.figures.similarity_bars import SIMILARITY_BARS
from palpate.analysis.ratings.dataset import DataRefused
from tests.analysis.figures.specimens import answer, data_of, draw_svg, inputs_of


def rated(people: int = 6, methods: int = 3) -> pd.DataFrame:
    draw = np.random.Generator(np.random.PCG64(7)).integers(0, 20, size=(people, 2, methods))
    rows = [
        (f"P{i:03d}", texture, f"m{j}", float(20 * j + draw[i, t, j]))
        for i in range(people)
        for t, texture in enumerate(("mesh", "cloth"))
        for j in range(methods)
    ]
    table = pd.DataFrame(rows, columns=["participant", "texture", "method", "value"])
    return table.assign(attribute="likeness", stimulus=table["texture"] + "_" + table["method"])


def pairs(p: dict[str, float | None]) -> list[dict]:
    return [{"a": names[:2], "b": names[2:], "p_holm": value} for names, value in p.items()]


def test_every_mean_is_over_participants_and_all_together_over_complete_ones() -> None:
    table = rated().drop(index=0)  # P000 has no answer for mesh with m0
    data = data_of(SIMILARITY_BARS, inputs_of(table))
    means = {(row["cluster"], row["bar"]): row for row in data.rows if row["shows"] == "mean"}
    cell = table[(table["texture"] == "mesh") & (table["method"] == "m0")]["value"]
    assert means["mesh", "m0"]["n"] == 5
    assert means["mesh", "m0"]["mean"] == pytest.approx(cell.mean(), rel=1e-14)
    assert means["mesh", "m0"]["high"] == pytest.approx(cell.mean() + cell.std(), rel=1e-14)
    whole = table[table["participant"] != "P000"].groupby(["participant", "method"])["value"].mean().unstack()
    assert means[None, "m1"]["n"] == 5
    assert means[None, "m1"]["mean"] == pytest.approx(whole["m1"].mean(), rel=1e-14)
    assert means["cloth", "m2"]["stimulus"] == "cloth_m2"
    assert "With a value in every cell: 5" in data.caption


def test_stars_brackets_and_the_words_for_what_is_not_drawn() -> None:
    test = answer(pairs({"m0m1": 0.03, "m1m2": 0.2, "m0m2": 0.0004}))
    data = data_of(SIMILARITY_BARS, inputs_of(rated(), {"t": test}), tests=("t",))
    assert "(* p < .05, ** p < .01, *** p < .001)" in data.caption
    assert "Not significant: m1 and m2 (p = .200)." in data.caption
    text, drawn = draw_svg(SIMILARITY_BARS, data)
    compared = [dict(mark.details)["pair"] for mark in drawn.marks if "pair" in dict(mark.details)]
    assert compared == ["m0 and m1", "m0 and m2"]
    assert all(f'id="{mark.gid}"' in text for mark in drawn.marks)


def test_no_star_stands_above_the_plans_alpha() -> None:
    test = answer(pairs({"m0m1": 0.03, "m1m2": 0.002, "m0m2": None}))
    data = data_of(SIMILARITY_BARS, inputs_of(rated(), {"t": test}, alpha=0.01), tests=("t",))
    stars = {row["a"] + row["b"]: row["stars"] for row in data.rows if row["shows"] == "pair"}
    assert stars == {"m0m1": "", "m1m2": "*", "m0m2": None}
    assert "(* p < .01, ** p < .001)" in data.caption
    assert "Undefined: m0 and m2." in data.caption


def test_no_significant_pair_and_all_of_nine_methods() -> None:
    none = data_of(SIMILARITY_BARS, inputs_of(rated(), {"t": answer(pairs({"m0m1": 0.5}))}), tests=("t",))
    assert "No pair differs significantly." in none.caption
    every = answer([{"a": f"m{i}", "b": f"m{j}", "p": 1e-9} for i, j in itertools.combinations(range(9), 2)])
    data = data_of(SIMILARITY_BARS, inputs_of(rated(3, 9), {"t": every}), clusters=None, tests=("t",))
    _, drawn = draw_svg(SIMILARITY_BARS, data)
    assert sum("pair" in dict(mark.details) for mark in drawn.marks) == 36


@given(st.lists(st.tuples(st.integers(0, 8), st.integers(0, 8)).filter(lambda s: s[0] < s[1]), max_size=30))
def test_brackets_of_one_storey_never_overlap(spans: list[tuple[int, int]]) -> None:
    storeys = stack_brackets(spans)
    for (i, a), (j, b) in itertools.combinations(enumerate(spans), 2):
        if storeys[i] == storeys[j]:
            assert a[1] <= b[0] or b[1] <= a[0]


def test_stars_count_thresholds() -> None:
    assert [stars(p, (0.05, 0.01, 0.001)) for p in (0.05, 0.049, 0.001, 5e-324)] == ["", "*", "**", "***"]


def test_a_test_of_other_levels_and_two_for_one_place_are_refused() -> None:
    other = answer([{"a": "m0", "b": "elsewhere", "p": 0.1}])
    with pytest.raises(DataRefused, match="'elsewhere'"):
        data_of(SIMILARITY_BARS, inputs_of(rated(), {"t": other}), tests=("t",))
    two = {name: answer(pairs({"m0m1": 0.1})) for name in ("t", "u")}
    with pytest.raises(DataRefused, match="t and u cannot both stand over all clusters"):
        data_of(SIMILARITY_BARS, inputs_of(rated(), two), tests=("t", "u"))
    apart = data_of(SIMILARITY_BARS, inputs_of(rated(), two), tests=("t", "u"), each={"mesh": "u"})
    assert {row["cluster"] for row in apart.rows if row["shows"] == "pair"} == {None, "mesh"}


def test_long_names_of_methods_and_of_the_scale_find_their_room() -> None:
    table = rated().replace({"method": {"m0": "another", "m1": "one method", "m2": "a third one"}})
    table = table.assign(attribute="same")
    high = "Remarkably effortless and thoroughly pleasant to operate each time"
    given = inputs_of(table, outcomes=("same",), antonyms={"same": high}, scale=(0.0, 100.0))
    _, drawn = draw_svg(SIMILARITY_BARS, data_of(SIMILARITY_BARS, given))
    over = drawn.figure.axes[-1]
    boxes = [label.get_window_extent() for label in over.get_xticklabels()]
    assert all(a.x1 < b.x0 for a, b in itertools.pairwise(boxes))
    axis = drawn.figure.axes[0].yaxis.label.get_window_extent()
    assert axis.height < drawn.figure.bbox.height


def test_one_participant_has_no_whisker() -> None:
    data = data_of(SIMILARITY_BARS, inputs_of(rated(1)), whiskers="cousineau_morey")
    assert {row["low"] for row in data.rows if row["shows"] == "mean"} == {None}
    assert "No whiskers" in data.caption
    draw_svg(SIMILARITY_BARS, data)
