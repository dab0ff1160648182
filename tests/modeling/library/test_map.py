"""The map: thesis Figure 3.3c of a library, and what was found on it."""

import pytest
from matplotlib.patches import Circle

from palpate.analysis.figures.bubbles import RADII
from palpate.analysis.figures.style import drawing
from palpate.modeling.library.entries import LibraryError
from palpate.modeling.library.map import FADED, FOUND, draw_map, map_data, roles_of, write_map
from tests.modeling.library.library_for_tests import PAIRS, entry, rated, small_library

LIBRARY = small_library(
    entry("T01", rated=rated(0, 0, 0, 0)), entry("T02", rated=rated(100, 100, 100, 100)),
    entry("T03", rated=rated(50, 50, 50, 50)),
)  # fmt: skip


def circles(ids=()):
    with drawing("test"):
        drawn = draw_map(map_data(LIBRARY.textures, LIBRARY), ids)
    by_gid = {mark.gid: mark.key for mark in drawn.marks}
    patches = [patch for patch in drawn.figure.axes[0].patches if isinstance(patch, Circle)]
    return {by_gid[patch.get_gid()]: patch for patch in patches}, drawn.figure.axes[0]


def test_the_axes_are_those_of_figure_3_3c():
    roles = {role: (ends["low"], ends["high"]) for role, ends in roles_of(PAIRS).items()}
    assert roles == {"x": ("Hard", "Soft"), "y": ("Flat", "Bumpy"), "size": ("Smooth", "Rough"),
                     "colour": ("Slippery", "Sticky")}  # fmt: skip


def test_a_rough_flat_hard_texture_is_large_and_below_on_the_left():
    circle_of, _ = circles()
    assert circle_of["T01"].radius == pytest.approx(RADII[1]) and circle_of["T02"].radius == pytest.approx(RADII[0])
    assert circle_of["T01"].center[0] < circle_of["T03"].center[0] < circle_of["T02"].center[0]
    assert circle_of["T01"].center[1] < circle_of["T03"].center[1] < circle_of["T02"].center[1]
    assert [row["0-"] for row in map_data(LIBRARY.textures, LIBRARY).rows] == [100, -100, 0]


def test_what_was_found_stands_out_with_its_name():
    from matplotlib.colors import to_hex

    circle_of, axes = circles(["T03"])
    assert to_hex(circle_of["T03"].get_edgecolor()).upper() == FOUND and circle_of["T03"].get_alpha() == 1
    assert circle_of["T01"].get_alpha() == FADED and "T03" in {text.get_text() for text in axes.texts}


def test_what_was_found_has_its_name_also_where_there_is_no_room():
    crowd = [entry(f"T{k:02d}", rated=rated(30, 50, 50, 50)) for k in range(12)]
    library = small_library(*crowd)
    with drawing("test"):
        axes = draw_map(map_data(crowd, library), [texture.id for texture in crowd]).figure.axes[0]
    assert {texture.id for texture in crowd} <= {text.get_text() for text in axes.texts}


def test_it_says_how_many_there_are_and_that_they_are_simulated():
    simulated = small_library(*LIBRARY.textures, simulated=True)
    with drawing("test"):
        figures = [draw_map(map_data(library.textures, library), ["T01"]).figure for library in (LIBRARY, simulated)]
    titles = [figure.axes[0].get_title("left") for figure in figures]
    assert titles == ["3 textures; with a red edge: found", "3 textures, simulated; with a red edge: found"]


def test_equal_libraries_are_equal_files(tmp_path):
    data = map_data(LIBRARY.textures, LIBRARY)
    first = [path.read_bytes() for path in write_map(tmp_path / "map.png", data, ["T01"])]
    again = [path.read_bytes() for path in write_map(tmp_path / "map.svg", data, ["T01"])]
    assert first == again and sorted(path.name for path in tmp_path.iterdir()) == ["map.png", "map.svg"]
    with pytest.raises(LibraryError, match="written as .svg and .png"):
        write_map(tmp_path / "map.pdf", data)


def test_other_attributes_take_the_places_that_are_free():
    roles = roles_of([("Dry", "Wet"), ("Soft", "Hard"), ("Cold", "Warm")])
    assert {role: ends["high"] for role, ends in roles.items()} == {"x": "Soft", "y": "Wet", "size": "Warm"}
    assert roles["x"]["name"] == "1-" and roles["y"]["name"] == "0+"
    with pytest.raises(LibraryError, match="a plane needs two attributes; this library has 1"):
        roles_of([("Dry", "Wet")])


def test_a_texture_without_an_attribute_is_not_drawn():
    incomplete = entry("T09", rated=rated(1, 2, 3, 4).model_copy(update={"mean": (None, 2.0, 3.0, 4.0)}))
    assert len(map_data([*LIBRARY.textures, incomplete], LIBRARY).rows) == 3
    with pytest.raises(LibraryError, match="nothing to draw"):
        map_data([incomplete], LIBRARY)
