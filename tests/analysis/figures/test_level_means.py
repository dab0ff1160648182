"""The figures show describe's numbers, read nothing into names, and come out equal byte for byte."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.analysis.figures.level_means import LevelPlaces
from palpate.analysis.figures.rating_axes import move_apart
from palpate.analysis.figures.style import drawing, inline_svg, save, svg_text
from palpate.analysis.first_look.figures import Picture, pictures
from palpate.analysis.ratings.dataset import DataRefused, Ratings
from palpate.analysis.ratings.describe import describe
from tests.analysis.synthetic_ratings import door_ratings, reasoning, renamed


def report_picture(ratings: Ratings, name: str = "means") -> Picture:
    return {picture.name: picture for picture in pictures(ratings)}[name]


def drawn(ratings: Ratings, name: str = "means") -> Figure:
    picture = report_picture(ratings, name)
    with drawing("test"):
        return picture.draw(picture.data).figure


def bars(axes: Axes) -> list[float]:
    return [p.get_y() + p.get_height() for p in axes.patches]  # type: ignore[attr-defined]


def test_every_bar_is_a_described_mean_and_every_whisker_its_sd() -> None:
    ratings = door_ratings(people=3, attributes=1)
    expected = describe(ratings, ("attribute", "variant"), kind="over participants")
    axes = drawn(ratings).axes[0]
    assert bars(axes) == pytest.approx(expected["mean"].tolist(), abs=1e-12)
    spans = [span for lines in axes.collections for span in lines.get_segments()]  # type: ignore[attr-defined]
    assert [(high[1] - low[1]) / 2 for low, high in spans] == pytest.approx(expected["sd"].tolist(), abs=1e-12)


@pytest.mark.parametrize("ratings", [door_ratings(people=2), reasoning()], ids=["doors", "reasoning"])
def test_the_figures_show_the_described_numbers_to_the_last_digit_but_one(ratings: Ratings) -> None:
    for picture in pictures(ratings):
        by = ["attribute", *picture.data.words["by"]]
        expected = describe(ratings, by, kind="over participants").to_dict("records")
        for name in (*by, "n", "ratings_min", "ratings_max"):
            assert [row[name] for row in picture.data.rows] == [row[name] for row in expected]
        for name in ("mean", "sd"):
            close = pytest.approx([row[name] for row in expected], rel=4.5e-16, abs=0.0)
            assert [row[name] for row in picture.data.rows] == close


def test_each_panel_holds_its_own_attribute() -> None:
    ratings = door_ratings(people=2)
    expected = describe(ratings, ("attribute", "variant"), kind="over participants")
    panels = [axes for axes in drawn(ratings).axes if len(axes.patches) == 15]
    assert len(panels) == 7
    for axes in panels:
        attribute = axes.texts[1].get_text()  # the word at the low end names the attribute
        of = expected[expected["attribute"] == attribute]["mean"].tolist()
        assert bars(axes) == pytest.approx(of, abs=1e-12)
        assert axes.texts[0].get_text() == ratings.antonyms[attribute]


def test_trend_lines_are_the_described_means_family_by_family() -> None:
    ratings = door_ratings(people=2)
    figure = drawn(ratings, "trends")
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["Physical attributes", "Emotional attributes"]
    expected = describe(ratings, ("attribute", "variant"), kind="over participants").set_index(
        ["attribute", "variant"]
    )["mean"]
    lines = [line for line in figure.axes[0].lines if len(line.get_xdata()) == 3]
    assert len(lines) == 3 * 4  # three physical attributes, four families of three
    first = [expected["Easy-to-pull", f"g{i}"] for i in (1, 2, 3)]
    assert list(lines[0].get_ydata()) == pytest.approx(first, abs=1e-12)


def test_the_trends_have_no_whiskers_and_the_caption_says_so() -> None:
    ratings = door_ratings(people=2)
    incomplete = replace(ratings, table=ratings.table.drop(index=[0]).reset_index(drop=True))
    assert not any(axes.collections for axes in drawn(incomplete, "trends").axes)
    assert "Their spread is not drawn here." in report_picture(incomplete, "trends").data.caption


def test_the_original_is_the_reference_and_an_import_has_none() -> None:
    doors, imported = door_ratings(people=1, attributes=1), reasoning()
    assert LevelPlaces(report_picture(doors).data.words).reference == ("g0",)
    assert LevelPlaces(report_picture(imported).data.words).reference is None


def test_two_within_factors_make_families_of_the_first() -> None:
    ratings = reasoning()
    places = LevelPlaces(report_picture(ratings).data.words)
    assert list(places.members) == ["AC", "DA", "MP", "MT"]
    assert [places.written[key] for key in places.members["AC"]] == ["implausible", "plausible"]
    assert len(drawn(ratings).axes[0].patches) == 8
    assert "Lines join the levels of one inference." in report_picture(ratings, "trends").data.caption


def test_levels_that_no_family_gathers_have_no_trends() -> None:
    doors = door_ratings(people=1, attributes=1)
    for families in ("", "variant"):
        assert [picture.name for picture in pictures(replace(doors, families=families))] == ["means"]
    assert [picture.name for picture in pictures(doors)] == ["means", "trends"]


def test_equal_numbers_give_equal_bytes_whatever_was_drawn_before(tmp_path: Path) -> None:
    ratings = door_ratings(people=2, attributes=3)
    written = []
    for run in ("a", "b"):
        with drawing("means"):
            picture = report_picture(ratings)
            paths = save(picture.draw(picture.data).figure, tmp_path / run, "means")
        written.append([path.read_bytes() for path in paths])
        drawn(reasoning())
    assert written[0] == written[1]
    assert b"Date" not in written[0][0] and b"dc:date" not in written[0][0]


def test_drawing_leaves_the_users_settings_alone() -> None:
    before = dict(mpl.rcParams)
    drawn(reasoning())
    assert dict(mpl.rcParams) == before


def test_a_name_is_text_and_nothing_else() -> None:
    ratings = renamed(door_ratings(people=1, attributes=2), "Hard-to-pull", "<script>$x^{2}$ -->")
    with drawing("test"):
        picture = report_picture(ratings)
        svg = svg_text(picture.draw(picture.data).figure)
    assert "<script" not in svg
    assert "<script" not in inline_svg(svg, "f1")


def test_an_inline_svg_has_ids_of_its_own_and_no_size() -> None:
    with drawing("test"):
        picture = report_picture(reasoning())
        svg = svg_text(picture.draw(picture.data).figure)
    inline = inline_svg(svg, "f7")
    head = inline[: inline.index(">")]
    assert inline.startswith("<svg ") and "height=" not in head and "width=" not in head and "viewBox=" in head
    assert 'id="f7-figure_1"' in inline and 'id="figure_1"' not in inline
    assert "metadata" not in inline and "DOCTYPE" not in inline


def test_one_participant_has_a_bar_and_no_whisker() -> None:
    ratings = door_ratings(people=1, attributes=1)
    one = replace(ratings, table=ratings.table[ratings.table["group"] == "1"].reset_index(drop=True))
    axes = drawn(one).axes[0]
    assert len(axes.patches) == 15
    assert not axes.collections
    assert "15 of 15 means have no whisker: one participant has no spread." in report_picture(one).data.caption


def test_a_level_in_two_families_is_refused() -> None:
    ratings = door_ratings(people=1, attributes=1)
    table = ratings.table.copy()
    table.loc[0, "augmentation"] = "bump"
    broken = replace(ratings, table=table)
    with pytest.raises(DataRefused, match="'augmentation': 'g0' in bump and original; .* correct the stimulus table"):
        list(pictures(broken))


@given(st.lists(st.floats(-10, 10), min_size=1, max_size=12), st.floats(0.1, 3))
def test_spread_labels_never_overlap_and_keep_their_order(heights: list[float], step: float) -> None:
    placed = move_apart(heights, step)
    order = sorted(range(len(heights)), key=lambda i: (heights[i], i))
    gaps = [placed[b] - placed[a] for a, b in itertools.pairwise(order)]
    assert all(gap >= step * (1 - 1e-9) for gap in gaps)


def test_labels_with_room_stay_where_they_are() -> None:
    assert move_apart([3.0, -4.0, 0.0], 1.0) == [3.0, -4.0, 0.0]


def test_the_key_says_over_how_many_participants() -> None:
    notes = [text.get_text() for axes in drawn(door_ratings(people=2)).axes for text in axes.texts]
    assert "Bars: means over 4 participants.\nWhiskers: ± 1 standard deviation across participants." in notes
