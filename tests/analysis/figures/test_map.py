"""A map's points, ellipses and vectors."""

from __future__ import annotations

import math

import pandas as pd
import pytest

from palpate.analysis.figures.label_places import area_about, place_beside_points
from palpate.analysis.figures.map import MAP
from palpate.analysis.ratings.dataset import DataRefused
from tests.analysis.figures.specimens import answer, data_of, draw_svg, inputs_of

PLACES = [{"stimulus": f"T{i}", "dim1": float(i), "dim2": float(i % 3)} for i in range(1, 13)]
ELLIPSE = {"stimulus": "T1", "centre_1": 1.0, "centre_2": 1.0, "semi_major": 2.0, "semi_minor": 1.0, "angle_deg": 30.0}
VECTORS = [
    {"attribute": "Rough", "direction_1": 0.6, "direction_2": 0.8, "r2": 0.81, "p": 0.001},
    {"attribute": "Flat", "direction_1": 1.0, "direction_2": 0.0, "r2": 0.2, "p": 0.3},
    {"attribute": "Same", "direction_1": None, "direction_2": None, "r2": None, "p": None},
]


def configuration() -> dict:
    return {
        "map": answer(PLACES, "Kruskal.", headline="Stress-1 = 0.08", more={"ellipses": (ELLIPSE,)}),
        "words": answer(VECTORS),
    }


def test_points_ellipses_and_vectors_are_drawn_where_the_tests_put_them() -> None:
    classes = pd.DataFrame({"stimulus": [f"T{i}" for i in range(1, 13)], "class": ["wood", "foam", "mesh"] * 4})
    levels = {"attribute": ("Rough", "Flat", "Same")}
    given = inputs_of(classes, configuration(), antonyms={"Rough": "Smooth"}, levels=levels)
    data = data_of(MAP, given, tests=("map", "words"), class_column="class")
    assert "Stress-1 = 0.08." in data.caption
    assert "Without a direction: Same." in data.caption
    text, drawn = draw_svg(MAP, data)
    axes = drawn.figure.axes[0]
    assert axes.get_aspect() == 1.0
    ellipse = axes.patches[0]
    assert (ellipse.get_center(), ellipse.width, ellipse.height, ellipse.angle) == ((1.0, 1.0), 4.0, 2.0, 30.0)
    assert [mark.key for mark in drawn.marks][:3] == ["Rough", "Flat", "T1"]
    assert all(f'id="{mark.gid}"' in text for mark in drawn.marks)
    written = {t.get_text() for t in axes.texts}
    assert {"Smooth", "Rough", "Flat", "T1"} <= written
    arrows = [a.arrow_patch for a in axes.texts if getattr(a, "arrow_patch", None) is not None]
    assert [a.get_linestyle() for a in arrows] == ["-", (0, (4, 2))]


def test_an_arrows_length_is_its_multiple_correlation() -> None:
    _, drawn = draw_svg(MAP, data_of(MAP, inputs_of(answers=configuration()), tests=("map", "words")))
    axes = drawn.figure.axes[0]
    ring = next(p for p in axes.patches if type(p).__name__ == "Circle")
    tips = [a.xy for a in axes.texts if getattr(a, "arrow_patch", None) is not None]
    lengths = [math.dist(tip, ring.center) / ring.radius for tip in tips]
    assert lengths == pytest.approx([math.sqrt(0.2), 0.9], rel=1e-12)  # Flat, Rough


def test_dimensions_are_found_however_they_are_written() -> None:
    first = data_of(MAP, inputs_of(answers={"m": answer(PLACES)}), tests=("m",)).rows
    for one, two in (("Dim1", "Dim2"), ("dimension_1", "dimension_2"), ("PC1", "PC2")):
        rows = [{"stimulus": r["stimulus"], one: r["dim1"], two: r["dim2"]} for r in PLACES]
        assert data_of(MAP, inputs_of(answers={"m": answer(rows)}), tests=("m",)).rows == first
    assert data_of(MAP, inputs_of(answers={"m": answer(PLACES[::-1])}), tests=("m",)).rows == first


def test_points_may_be_of_another_column_than_the_stimulus() -> None:
    places = [{"texture": row["stimulus"], "dim1": row["dim1"], "dim2": row["dim2"]} for row in PLACES]
    ellipse = {"texture": "T1", **{name: value for name, value in ELLIPSE.items() if name != "stimulus"}}
    rows = data_of(
        MAP, inputs_of(answers={"m": answer(places, more={"ellipses": (ellipse,)})}), tests=("m",), over="texture"
    )
    assert [row["stimulus"] for row in rows.rows if row["shows"] == "ellipse"] == ["T1"]


def test_vectors_of_another_map_are_refused() -> None:
    elsewhere = tuple({**row, "dim1": -row["dim1"]} for row in PLACES)
    given = {"map": answer(PLACES), "words": answer(VECTORS, more={"configuration": elsewhere})}
    with pytest.raises(DataRefused, match="fitted to another map than it shows .T1, T2 and T3 lie elsewhere"):
        data_of(MAP, inputs_of(answers=given), tests=("map", "words"))
    given["words"] = answer(VECTORS, more={"configuration": tuple(PLACES)})
    assert data_of(MAP, inputs_of(answers=given), tests=("map", "words")).rows[-1]["shows"] == "vector"


def test_tests_without_places_and_ambiguous_classes_are_refused() -> None:
    with pytest.raises(DataRefused, match="must name a test whose rows have `stimulus`"):
        data_of(MAP, inputs_of(answers={"words": answer(VECTORS)}), tests=("words",))
    with pytest.raises(DataRefused, match="m and n would be drawn in one place"):
        data_of(MAP, inputs_of(answers={"m": answer(PLACES), "n": answer(PLACES)}), tests=("m", "n"))
    both = pd.DataFrame({"stimulus": ["T1", "T1"], "class": ["wood", "foam"]})
    with pytest.raises(DataRefused, match="several levels for T1"):
        data_of(MAP, inputs_of(both, {"m": answer(PLACES)}), tests=("m",), class_column="class")


def test_a_named_test_that_the_map_would_not_show_is_refused() -> None:
    given = inputs_of(answers=configuration() | {"more": answer([{"p": 0.5}])})
    with pytest.raises(DataRefused, match="a map shows one test with places and one of vectors"):
        data_of(MAP, given, tests=("map", "words", "more"))
    with pytest.raises(DataRefused, match="whose rows have `word`"):
        data_of(MAP, given, tests=("map", "words"), items="word")


def test_free_names_cover_neither_points_nor_each_other() -> None:
    points = [(50.0 + 37 * (i % 7), 40.0 + 29 * (i // 7)) for i in range(28)]
    names = [f"name {i}" for i in range(28)]
    places = place_beside_points(points, names, 7.0)
    areas = [
        area_about((x + spot.x, y + spot.y), 7.0 * 3, 7.0)
        for (x, y), spot in zip(points, places, strict=True)
        if spot.free
    ]
    assert len(areas) > 20
    assert all(a.shared(b) < 1 for i, a in enumerate(areas) for b in areas[:i])
