"""What holds for each of the kinds: equal bytes, a table of plain values, ids for marks, refusals that help."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable

import pandas as pd
import pytest

from palpate.analysis.figures.figure_kind import FigureData, FigureInput
from palpate.analysis.figures.style import drawing, inline_svg
from palpate.analysis.plans.kinds import FIGURES
from palpate.analysis.ratings.dataset import DataRefused
from tests.analysis.figures import (
    test_estimates,
    test_function_figures,
    test_map,
    test_matching_and_likert,
    test_power_law_figure,
    test_predictions,
    test_similarity_bars,
)
from tests.analysis.figures.specimens import answer, data_of, draw_svg, inputs_of
from tests.analysis.figures.test_treemap import relevant

KINDS: dict[str, tuple[Callable[[], FigureInput], dict]] = {
    "treemap": (lambda: inputs_of(answers={"r": answer(relevant({"<b>&": 0.5, "$x_1$": 0.1}))}), {"tests": ("r",)}),
    "predicted": (lambda: inputs_of(test_predictions.table()), {"panels": "car", "colour": "attribute"}),
    "class_heatmap": (lambda: inputs_of(test_predictions.table()), {"by": "car"}),
    "violins": (lambda: inputs_of(test_predictions.table()), {"by": "car"}),
    "similarity_bars": (lambda: inputs_of(test_similarity_bars.rated()), {}),
    "matching": (lambda: inputs_of(test_matching_and_likert.doors()), {}),
    "likert": (lambda: inputs_of(test_matching_and_likert.forms({"Realism": [4, 5, 5]})), {"points": (1, 7)}),
    "map": (lambda: inputs_of(answers=test_map.configuration()), {"tests": ("map", "words")}),
    "psychometric": (lambda: inputs_of(answers={"f": test_function_figures.functions()}), {"tests": ("f",)}),
    "track": (lambda: inputs_of(answers={"f": test_function_figures.functions()}), {"tests": ("f",), "columns": 2}),
    "posterior": (lambda: inputs_of(answers={"f": test_function_figures.functions()}), {"tests": ("f",)}),
    "power_law": (lambda: inputs_of(answers={"l": test_power_law_figure.law()}), {"tests": ("l",)}),
    "estimates": (lambda: inputs_of(answers={"s": answer(test_estimates.ROWS)}), {"tests": ("s",)}),
}
RATED = [
    name
    for name in KINDS
    if name not in ("treemap", "map", "psychometric", "track", "posterior", "estimates", "power_law")
]


@pytest.mark.parametrize("name", KINDS)
def test_equal_data_give_equal_bytes_and_every_mark_its_own_group(name: str) -> None:
    make, settings = KINDS[name]
    kind = FIGURES[name]
    first, drawn = draw_svg(kind, data_of(kind, make(), **settings))
    assert draw_svg(kind, data_of(kind, make(), **settings))[0] == first
    inline = inline_svg(first, "f1")
    assert len({mark.gid for mark in drawn.marks}) == len(drawn.marks) > 0
    assert all(inline.count(f'<g id="f1-{mark.gid}"') == 1 for mark in drawn.marks)
    assert all(mark.details and all(text for pair in mark.details for text in pair) for mark in drawn.marks)
    assert "nan" not in "".join(text for mark in drawn.marks for pair in mark.details for text in pair).lower().split()


@pytest.mark.long
@pytest.mark.parametrize("name", KINDS)
def test_a_figure_is_drawn_from_its_table_as_a_file_would_hold_it(name: str) -> None:
    """Every row has the same columns of plain values, finite where they are numbers."""
    make, settings = KINDS[name]
    kind = FIGURES[name]
    data = data_of(kind, make(), **settings)
    assert len({tuple(row) for row in data.rows}) == 1
    assert all(type(v) in (float, int, str, bool, type(None)) for row in data.rows for v in row.values())
    assert all(math.isfinite(v) for row in data.rows for v in row.values() if isinstance(v, float))
    copy = FigureData(tuple(dict(row) for row in data.rows), data.title, data.caption, dict(data.words))
    assert draw_svg(kind, copy)[0] == draw_svg(kind, data)[0]
    writer = csv.DictWriter(io.StringIO(), list(data.rows[0]))
    writer.writerows(data.rows)


@pytest.mark.parametrize("name", KINDS)
def test_png_bytes_are_equal_too(name: str) -> None:
    make, settings = KINDS[name]
    kind = FIGURES[name]
    pictures = []
    for _ in range(2):
        with drawing(name):
            buffer = io.BytesIO()
            kind.draw(data_of(kind, make(), **settings)).figure.savefig(buffer, format="png", dpi=50)
        pictures.append(buffer.getvalue())
    assert pictures[0] == pictures[1]


@pytest.mark.parametrize("name", RATED)
def test_row_and_column_order_and_the_type_of_labels_change_nothing(name: str) -> None:
    make, settings = KINDS[name]
    kind, given = FIGURES[name], make()
    table = given.selected.table
    first = data_of(kind, given, **settings)
    turned = table.sample(frac=1, random_state=5)[list(table)[::-1]]
    for other in (turned, turned.astype({c: "category" for c in turned if turned[c].dtype == object})):
        assert data_of(kind, inputs_of(other), **settings).rows == first.rows


@pytest.mark.parametrize("name", RATED)
def test_an_empty_table_is_refused_by_the_figures_name(name: str) -> None:
    make, settings = KINDS[name]
    empty = make().selected.table.iloc[:0]
    with pytest.raises(DataRefused, match="figure 'made'"):
        data_of(FIGURES[name], inputs_of(empty), **settings)


def test_labels_that_look_like_no_value_are_labels() -> None:
    table = test_predictions.table().assign(car=["None"] * 4 + ["nan"] * 4)
    data = data_of(FIGURES["predicted"], inputs_of(table), panels="car")
    assert [row["panel"] for row in data.rows][::4] == ["None", "nan"]
    numbered = test_predictions.table().assign(car=[1] * 4 + [2] * 4)
    by_text = numbered.assign(car=numbered["car"].astype(str))
    rows = data_of(FIGURES["predicted"], inputs_of(numbered), panels="car").rows
    assert rows == data_of(FIGURES["predicted"], inputs_of(by_text), panels="car").rows
    assert (
        rows == data_of(FIGURES["predicted"], inputs_of(numbered.assign(car=numbered["car"] / 1.0)), panels="car").rows
    )
    with pytest.raises(ValueError, match="car"):
        data_of(
            FIGURES["predicted"], inputs_of(numbered.assign(car=pd.Series([1, "1"] * 4, dtype=object))), panels="car"
        )
