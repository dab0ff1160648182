"""Six figures of ratings: their tables are the numbers, their marks are in the drawing, their bytes never change."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.figures.figure_kind import DrawnFigure, FigureData, FigureInput
from palpate.analysis.figures.label_places import Bubble, place_beside_bubbles
from palpate.analysis.figures.lettering import elide, format_signed, width_pt
from palpate.analysis.figures.rating_axes import fit_labels, move_apart, quarters
from palpate.analysis.figures.rating_heatmap import similar_order
from palpate.analysis.figures.style import drawing, svg_text
from palpate.analysis.plans.answers import Selected
from palpate.analysis.plans.kinds import FIGURES
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.within_intervals import mean_intervals

KINDS = ("bubbles", "means", "trends", "raincloud", "rating_heatmap", "order_effect")
BY = {"means": {"by": ("stimulus",)}, "trends": {"by": ("stimulus",)}, "raincloud": {"by": ("stimulus",)}}


def rated(
    stimuli: int = 4, people: int = 5, attributes: int = 2, name: Callable[[int], str] = "s{:02d}".format, seed: int = 1
) -> Selected:
    draw = np.random.Generator(np.random.PCG64(seed))
    named = [f"low {a}" for a in range(attributes)]
    rows = []
    for person in range(people):
        for place, stimulus in enumerate(draw.permutation(stimuli).tolist()):
            for a, attribute in enumerate(named):
                value = float(np.clip(round(50 + 30 * math.sin(stimulus + a) + draw.normal(0, 9), 2), 0, 100))
                who, session = f"P{person:02d}", f"S/P{person:02d}/1"
                rows.append(
                    (who, "1", attribute, value, name(stimulus), f"f{stimulus // 2}", session, place + 1, 2.0 + a)
                )
    columns = [
        "participant",
        "group",
        "attribute",
        "value",
        "stimulus",
        "family",
        "session",
        "trial",
        "response_time_s",
    ]
    table = pd.DataFrame(rows, columns=columns)
    return Selected(
        table=table,
        trials=table[["participant", "session", "trial", "group", "stimulus"]].drop_duplicates(),
        outcomes=tuple(named),
        levels={"stimulus": tuple(name(s) for s in range(stimuli))},
        scale=(0.0, 100.0),
        antonyms={low: f"high {a}" for a, low in enumerate(named)},
    )


def draw_figure(kind: str, selected: Selected, **settings: object) -> tuple[FigureData, DrawnFigure, str]:
    figure_kind = FIGURES[kind]
    settings_of = figure_kind.settings(name="x", figure=kind, **BY.get(kind, {}), **settings)
    data = figure_kind.data(FigureInput(selected), settings_of)
    with drawing("x"):
        drawn = figure_kind.draw(data)
        return data, drawn, svg_text(drawn.figure)


@pytest.mark.parametrize("kind", KINDS)
def test_same_bytes_whatever_the_order_of_rows_and_columns_and_every_mark_is_drawn(kind: str) -> None:
    selected = rated()
    data, drawn, svg = draw_figure(kind, selected)
    mixed = selected.table.sample(frac=1, random_state=2)[sorted(selected.table.columns)].reset_index(drop=True)
    again = draw_figure(kind, replace(selected, table=mixed))
    assert again[2] == svg
    assert again[0] == data
    gids = [mark.gid for mark in drawn.marks]
    assert len(set(gids)) == len(gids) > 0
    assert set(gids) <= set(re.findall(r'id="([^"]+)"', svg))
    for row in data.rows:
        assert all(value is None or type(value) in (str, int, float, bool) for value in row.values())
        assert not any(isinstance(value, float) and math.isnan(value) for value in row.values())


@pytest.mark.parametrize("kind", KINDS)
def test_one_participant_is_drawn(kind: str) -> None:
    data, _, _ = draw_figure(kind, rated(people=1))
    assert data.rows


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "bubbles"])
def test_two_stimuli_and_one_attribute_are_drawn(kind: str) -> None:
    assert draw_figure(kind, rated(stimuli=2, attributes=1))[1].marks


@pytest.mark.parametrize("kind", ["bubbles", "means", "rating_heatmap"])
def test_long_names_in_odd_letters_are_names_not_formulas(kind: str) -> None:
    selected = rated(name=lambda s: f"$\\frac{{{s}}}$ <b>&amp; a very long name of a stimulus that never ends {s}")
    _, drawn, svg = draw_figure(kind, selected)
    assert "<b>" not in svg
    assert drawn.marks[0].details


def test_bars_are_means_and_their_whiskers_what_the_caption_says() -> None:
    selected = rated()
    part = selected.table[selected.table["attribute"] == "low 1"]
    for whiskers, column in (("sd", "sd"), ("cousineau_morey", "half"), ("between", "half")):
        method = "none" if whiskers == "sd" else whiskers
        expected = mean_intervals(part, by=("stimulus",), method=method)
        data, _, _ = draw_figure("means", selected, whiskers=whiskers)
        rows = [row for row in data.rows if row["attribute"] == "low 1"]
        assert [row["mean"] for row in rows] == expected["mean"].tolist()
        halves = [(row["high"] - row["low"]) / 2 for row in rows]
        assert halves == pytest.approx(expected[column].tolist(), rel=1e-12)
    assert "(Student)" in data.caption


def test_a_family_is_a_band_and_the_first_alone_is_the_reference() -> None:
    selected = rated(stimuli=5)
    table = selected.table.assign(family=np.where(selected.table["stimulus"] == "s00", "original", "changed"))
    data, drawn, _ = draw_figure("trends", replace(selected, table=table), families="family", whiskers="none")
    assert "mark s00, the reference" in data.caption
    words = [text.get_text() for axes in drawn.figure.axes for text in axes.texts]
    assert {"original", "changed"} <= set(words)
    torn = table.assign(family=np.where(table.index == 3, "changed", table["family"]))
    with pytest.raises(DataRefused, match="one family for each stimulus"):
        draw_figure("trends", replace(selected, table=torn), families="family")


def test_bubbles_stand_on_minus_100_to_100_and_turn_on_request() -> None:
    selected = rated(attributes=4)
    straight, _, _ = draw_figure("bubbles", selected, x="low 2")
    turned, _, _ = draw_figure("bubbles", selected, x="low 2", reversed=("low 2",))
    means = selected.table[selected.table["attribute"] == "low 2"].groupby("stimulus")["value"].mean()
    assert [row["low 2"] for row in straight.rows] == pytest.approx((2 * means - 100).tolist())
    assert [row["low 2"] for row in turned.rows] == pytest.approx((100 - 2 * means).tolist())
    assert turned.words["roles"]["x"]["low"] == "high 2"
    assert list(straight.words["roles"]) == ["x", "y", "size", "colour"]
    with pytest.raises(DataRefused, match="a plane needs two attributes"):
        draw_figure("bubbles", rated(attributes=1))
    with pytest.raises(DataRefused, match="no attribute 'low 9'"):
        draw_figure("bubbles", selected, size="low 9")


def test_missing_cells_are_counted_and_hatched() -> None:
    selected = rated(stimuli=6, people=4, attributes=1)
    gaps = replace(selected, table=selected.table.drop(index=[0, 7]).reset_index(drop=True))
    data, drawn, _ = draw_figure("rating_heatmap", gaps)
    assert sum(row["mean"] is None for row in data.rows) == 2
    assert "Hatched: 2 cells of 24 without a rating." in data.caption
    assert ("rating", "missing") in {line for mark in drawn.marks for line in mark.details}
    assert "Hatched" not in draw_figure("rating_heatmap", selected)[0].caption


def test_alike_participants_stand_together_and_groups_apart() -> None:
    values = np.array([[0.0, 9.0, 0.0], [9.0, 0.0, 9.0], [1.0, 9.0, 0.0], [9.0, 1.0, np.nan]])
    order = similar_order(values)
    assert {frozenset(order[:2]), frozenset(order[2:])} == {frozenset((0, 2)), frozenset((1, 3))}
    selected = rated(people=6)
    table = selected.table.assign(group=np.where(selected.table["participant"].isin(["P01", "P04"]), "a", "b"))
    data, _, _ = draw_figure("rating_heatmap", replace(selected, table=table))
    assert set(data.words["participants"][:2]) == {"P01", "P04"}
    assert draw_figure("rating_heatmap", selected, order="number")[0].words["participants"] == [
        f"P0{i}" for i in range(6)
    ]


def test_the_drift_in_the_picture_is_the_drift_in_the_data() -> None:
    selected = rated(people=12, attributes=1)
    table = selected.table.assign(value=lambda t: t["value"] / 2 + 3.0 * t["trial"])
    before, _, _ = draw_figure(
        "order_effect", replace(selected, table=selected.table.assign(value=lambda t: t["value"] / 2))
    )
    after, _, _ = draw_figure("order_effect", replace(selected, table=table), carry_over=True)
    slopes = [next(row for row in data.rows if row["kind"] == "slope per 10 trials") for data in (before, after)]
    assert slopes[1]["value"] - slopes[0]["value"] == pytest.approx(30.0, rel=1e-9)
    assert {row["kind"] for row in after.rows} == {"bin", "slope per 10 trials", "carry-over"}
    assert {row["measure"] for row in after.rows} == {"low 0", "response time"}


def test_a_cloud_has_every_participant_s_mean() -> None:
    selected = rated(attributes=1)
    data, drawn, _ = draw_figure("raincloud", selected)
    expected = selected.table.groupby(["stimulus", "participant"])["value"].mean()
    assert {(row["stimulus"], row["participant"]): row["mean"] for row in data.rows} == expected.to_dict()
    assert {mark.key for mark in drawn.marks} >= {"s00", "P00"}


def test_names_never_cover_a_bubble_or_each_other() -> None:
    draw = np.random.Generator(np.random.PCG64(4))
    bubbles = [Bubble(*draw.uniform(0, 300, 2).tolist(), 8.0, f"name {i}") for i in range(60)]
    spots = place_beside_bubbles(bubbles, 300.0, 7.0)
    assert 10 < len(spots) < 60
    boxes = [(spot.x, spot.y - 4.0, spot.x + width_pt(spot.text, 7.0), spot.y + 4.0) for spot in spots]
    for left, low, right, high in boxes:
        assert 0 <= left < right <= 300
        near = [math.hypot(b.x - min(max(b.x, left), right), b.y - min(max(b.y, low), high)) for b in bubbles]
        assert min(near) >= 8.0
    for a, b in itertools.combinations(boxes, 2):
        assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]


def test_a_whisker_that_does_not_exist_is_reported_or_refused_in_the_words_of_a_plan() -> None:
    data, _, _ = draw_figure("trends", rated(people=1))
    assert "8 of 8 means have no whisker: one participant has no spread." in data.caption
    gap = rated()
    with pytest.raises(DataRefused, match=r"figure 'x', low 0: no value for .*choose `whiskers: sd`") as refused:
        draw_figure("trends", replace(gap, table=gap.table.iloc[1:]))
    assert "pass missing" not in str(refused.value)
    draw_figure("trends", replace(gap, table=gap.table.iloc[1:]), whiskers="sd")


def test_an_undefined_trace_is_reported_as_missing_an_effect_not_participants() -> None:
    same = rated()
    data, _, _ = draw_figure("order_effect", replace(same, table=same.table.assign(value=3.0)), carry_over=True)
    notes = {row["note"] for row in data.rows if row["kind"] == "carry-over"}
    assert notes == {"no stimulus has an effect"}


def test_ticks_far_from_zero_differ_and_others_stay_short() -> None:
    ends = (1e9, 1e9 + 4)
    assert len({format_signed(value, ends) for value in quarters(ends)}) == 5
    assert [format_signed(value, (-10.0, 10.0)) for value in (-5.0, 0.0, 10 / 3)] == ["−5", "0", "+3.33333"]


def test_one_panel_s_title_is_whole_where_there_is_room() -> None:
    one = rated(attributes=1)
    _, drawn, _ = draw_figure("rating_heatmap", replace(one, antonyms={"low 0": "Completely the same as before"}))
    assert drawn.figure.axes[0].get_title(loc="left") == "low 0 → Completely the same as before"


def test_titles_of_neighbouring_panels_do_not_touch_in_korean() -> None:
    wide = rated(attributes=2, people=9)
    korean = dict.fromkeys(wide.outcomes, "거칠고 불쾌하며 매우 무거운 느낌의 문손잡이")
    for kind in ("rating_heatmap", "order_effect"):
        _, drawn, _ = draw_figure(kind, replace(wide, antonyms=korean))
        with drawing("x"):
            drawn.figure.draw_without_rendering()
            boxes = [axes._left_title.get_window_extent() for axes in drawn.figure.axes[:2]]
        assert boxes[0].x1 < boxes[1].x0, kind


def test_letters_find_their_room() -> None:
    assert elide("딱딱한 문손잡이", 10) == "딱딱…손잡이"
    assert elide("Thoroughly expensive car 07", 16).endswith("car 07")
    assert elide("short", 16) == "short"
    many = fit_labels(list(range(90)), [f"stimulus {i}" for i in range(90)], 10.0)
    assert many.rotation == 90
    assert fit_labels([0, 1], ["a", "b"], 4.0).rotation == 0
    assert move_apart([1.0, 1.0, 5.0], 1.0) == [0.5, 1.5, 5.0]
