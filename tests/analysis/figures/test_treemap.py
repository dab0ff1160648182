"""A treemap's boxes have the areas that relevance asks for, fill the sheet and lie on nothing."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.analysis.figures.treemap import TREEMAP, squarify
from palpate.analysis.ratings.dataset import DataRefused
from tests.analysis.figures.specimens import answer, data_of, draw_svg, inputs_of
from tests.examples import examples

SIZES = st.lists(st.floats(1e-3, 1e3), min_size=1, max_size=70)


def relevant(shares: dict[str, float | None], least: float = 0.2) -> list[dict]:
    return [{"word": w, "relevance": s, "kept": s is not None and s >= least, "n": 12} for w, s in shares.items()]


@given(SIZES, st.floats(1, 100), st.floats(1, 100))
@settings(max_examples=examples(60), deadline=None)
def test_boxes_fill_the_rectangle_in_proportion_without_overlap(sizes: list[float], wide: float, tall: float) -> None:
    sizes.sort(reverse=True)
    boxes = squarify(sizes, wide, tall)
    unit = wide * tall / sum(sizes)
    assert [b.width * b.height for b in boxes] == pytest.approx([s * unit for s in sizes], rel=1e-9)
    assert all(b.left >= -1e-9 and b.left + b.width <= wide * (1 + 1e-9) for b in boxes)
    assert all(b.top >= -1e-9 and b.top + b.height <= tall * (1 + 1e-9) for b in boxes)
    for a, b in itertools.combinations(boxes, 2):
        across = min(a.left + a.width, b.left + b.width) - max(a.left, b.left)
        down = min(a.top + a.height, b.top + b.height) - max(a.top, b.top)
        assert min(across, down) <= 1e-9 * max(wide, tall)


def test_the_first_boxes_of_the_published_example_stand_as_in_the_paper() -> None:
    """Bruls, Huizing & van Wijk 2000, Figure 4: areas 6, 6, 4, 3, 2, 2, 1 in a rectangle of 6 x 4."""
    boxes = squarify([6, 6, 4, 3, 2, 2, 1], 6, 4)
    assert [(b.width, b.height) for b in boxes[:2]] == [(3.0, 2.0), (3.0, 2.0)]
    ratios = [max(b.width / b.height, b.height / b.width) for b in boxes]
    assert ratios == pytest.approx([3 / 2, 3 / 2, 49 / 36, 49 / 27, 25 / 18, 25 / 18, 25 / 9], rel=1e-12)


def test_words_stand_by_relevance_then_name_and_what_is_never_chosen_is_reported() -> None:
    shares = {"word 10": 0.1, "Heavy": 0.5, "word 2": 0.1, "Silent": 0.0, "Lost": None}
    data = data_of(TREEMAP, inputs_of(answers={"r": answer(relevant(shares))}), tests=("r",), threshold=0.2)
    assert [row["word"] for row in data.rows][:3] == ["Heavy", "word 2", "word 10"]
    assert "relevance 0: Silent" in data.caption
    assert "undefined relevance: Lost" in data.caption
    text, drawn = draw_svg(TREEMAP, data)
    assert [mark.key for mark in drawn.marks] == ["Heavy", "word 2", "word 10"]
    assert all(f'<g id="{mark.gid}">' in text for mark in drawn.marks)


def test_another_threshold_than_the_tests_is_refused() -> None:
    rows = relevant({"Heavy": 0.5, "Light": 0.3})
    with pytest.raises(DataRefused, match="'Light': relevance 0.3, kept: the test's threshold is not 0.4"):
        data_of(TREEMAP, inputs_of(answers={"r": answer(rows)}), tests=("r",), threshold=0.4)


@pytest.mark.parametrize("share", [1.2, -0.1, float("inf")])
def test_a_relevance_that_is_no_share_is_refused(share: float) -> None:
    with pytest.raises(DataRefused, match="'Heavy'"):
        data_of(TREEMAP, inputs_of(answers={"r": answer(relevant({"Heavy": share}))}), tests=("r",))


def test_without_any_choice_there_is_nothing_to_draw() -> None:
    with pytest.raises(DataRefused, match="no word has a relevance above 0"):
        data_of(TREEMAP, inputs_of(answers={"r": answer(relevant({"Heavy": 0.0}))}), tests=("r",))
