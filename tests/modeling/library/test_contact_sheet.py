"""The contact sheet: every texture in its place, its attributes where they are, equal bytes for equal input."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image, ImageDraw

from palpate.modeling.library.contact_sheet import (
    DOT,
    FINE,
    GAP,
    HEAD,
    MORE,
    MOST,
    NEXT,
    PREDICTED,
    WIDE,
    WISHED,
    Pen,
    height_of,
    pictures_of,
    sheet,
    tiles_of,
    write_sheet,
)
from palpate.modeling.library.entries import LibraryError
from palpate.modeling.library.search import wishes_of
from tests.modeling.library.library_for_tests import entry, rated, small_library

LIBRARY = small_library()
RED = (200, 30, 40)


def picture(colour=RED, size=288):
    content = io.BytesIO()
    Image.new("RGB", (size, size), colour).save(content, "PNG")
    return content.getvalue()


def drawn(entries=LIBRARY.textures, pictures=None, wish="rough, a bit sticky", **beside):
    wishes = wishes_of(LIBRARY, [wish]) if wish else ()
    tiles = tiles_of(entries, LIBRARY, wishes, None, beside)
    return sheet(tiles, pictures or [None] * len(entries), "A title", ["below"])


def near(image, colour, box):
    """How many pixels of the part have that colour, about."""
    expected = (
        np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) if isinstance(colour, str) else np.array(colour)
    )
    return int((np.abs(np.asarray(image.crop(box)).astype(int) - expected).max(axis=2) < 12).sum())


def tile_box(k, attributes=4, columns=5):
    left, top = GAP + k % columns * (WIDE + GAP), HEAD + k // columns * (WIDE + height_of(attributes) + GAP)
    return left, top, left + WIDE, top + WIDE + height_of(attributes)


def test_equal_input_gives_equal_bytes(tmp_path):
    for name in ("a.png", "b.png", "a.jpg", "b.jpg"):
        write_sheet(tmp_path / name, drawn(pictures=[picture()] * 6))
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert (tmp_path / "a.jpg").read_bytes() == (tmp_path / "b.jpg").read_bytes()
    kinds = [Image.open(io.BytesIO((tmp_path / name).read_bytes())).format for name in ("a.png", "a.jpg")]
    assert kinds == ["PNG", "JPEG"]


def test_every_picture_stands_in_its_own_tile():
    colours = [(30 * k + 20, 60, 200) for k in range(6)]
    image = drawn(pictures=[picture(colour, 40) for colour in colours])
    for k, colour in enumerate(colours):
        left, top, right, _ = tile_box(k)
        assert near(image, colour, (left, top, right, top + WIDE)) == WIDE * WIDE


@pytest.mark.parametrize("broken", [None, b"", b"no picture", picture()[:80]])
def test_without_a_picture_there_is_a_plain_field_with_the_name(broken):
    left, top, right, _ = tile_box(0)
    field = (left, top, right, top + WIDE)
    image = drawn(pictures=[broken] + [picture()] * 5)
    assert near(image, "#f0f2f4", field) > 0.9 * WIDE * WIDE
    assert near(image, "#59636e", (left + 60, top + 100, right - 60, top + 160)) > 50


def test_a_value_is_marked_where_it_lies_and_the_wish_behind_it():
    one = entry("T01", rated=rated(0, 100, 50, 25, se=0.0))
    image = drawn([one], wish="rough")
    left, top, _, _ = tile_box(0, columns=1)
    for row, value in enumerate((0, 100, 50, 25)):
        x, y = left + 78 + (210 - 78) * value / 100, top + WIDE + height_of(0) + 19 * row - 4 + 9.5
        assert near(image, DOT, tuple(round(edge) for edge in (x - 3, y - 3, x + 3, y + 3))) >= 25
    assert near(image, WISHED, (left, top + WIDE, left + WIDE, top + WIDE + height_of(4))) > 100


def test_rated_and_predicted_look_different_and_only_what_is_there_is_in_the_legend():
    both = drawn()
    foot = (0, both.height - 30, both.width, both.height)
    assert near(both, DOT, foot) and near(both, PREDICTED, foot) and near(both, WISHED, foot)
    plain = drawn([LIBRARY.textures[0]], wish="")
    foot = (0, plain.height - 30, plain.width, plain.height)
    assert near(plain, DOT, foot) and not near(plain, PREDICTED, foot) and not near(plain, WISHED, foot)


def test_the_bar_is_as_long_as_the_fit():
    long, short = (drawn(T01=("text", fit)) for fit in (1.0, 0.25))
    left, top, right, _ = tile_box(0)
    bar = (left, top + WIDE + 46, right, top + WIDE + 50)
    assert near(short, "#1f2328", bar) == pytest.approx(near(long, "#1f2328", bar) / 4, rel=0.05)


@pytest.mark.long
@pytest.mark.parametrize("count", [1, 2, 5, 6, 20, 21, MOST])
def test_any_number_that_can_be_looked_at_has_room(count):
    many = [entry(f"T{k:03d}", rated=rated(10, 20, 30, 40)) for k in range(count)]
    image = sheet(tiles_of(many, LIBRARY), [None] * count, "t" * 400, ["b" * 800])
    assert image.width <= 8 * (WIDE + GAP) + GAP and max(image.size) * FINE < 60_000


@pytest.mark.parametrize("count", [0, MOST + 1])
def test_none_or_too_many_are_refused(count):
    many = [entry(f"T{k:03d}", rated=rated(10, 20, 30, 40)) for k in range(count)]
    with pytest.raises(LibraryError, match=f"1 to {MOST} textures; {count} were given"):
        sheet(tiles_of(many, LIBRARY), [None] * count, "")


def test_another_kind_of_file_is_refused(tmp_path):
    with pytest.raises(LibraryError, match=r"sheet.gif: a contact sheet is written as .png or .jpg"):
        write_sheet(tmp_path / "sheet.gif", drawn())


def test_a_sheet_that_cannot_be_written_leaves_the_earlier_one(tmp_path, monkeypatch):
    write_sheet(tmp_path / "a.png", drawn())
    before = (tmp_path / "a.png").read_bytes()
    monkeypatch.setattr("os.fsync", lambda _handle: (_ for _ in ()).throw(OSError(28, "No space left on device")))
    with pytest.raises(LibraryError, match="no space left"):
        write_sheet(tmp_path / "a.png", drawn(wish="smooth"))
    assert (tmp_path / "a.png").read_bytes() == before and len(list(tmp_path.iterdir())) == 1
    with pytest.raises(LibraryError, match="there is no folder"):
        write_sheet(tmp_path / "none" / "a.png", drawn())


def test_all_that_stands_below_the_title_has_room_and_the_foot_says_simulated():
    """A sheet of two textures is narrow: three long lines go below each other, and the pictures move down."""
    tiles = tiles_of(LIBRARY.textures[:2], LIBRARY)
    short, long = (sheet(tiles, [None] * 2, "t", ["b" * 60] * count, "simulated") for count in (1, 3))
    assert long.height - short.height == 2 * NEXT
    for line in range(3):
        top = 47 + NEXT * line
        assert near(long, "#59636e", (GAP, top - 12, long.width // 2, top + 3)) > 20
    bare = sheet(tiles, [None] * 2, "t", ["b" * 60])
    corner = (bare.width - 100, bare.height - 30, bare.width, bare.height)
    assert near(short, "#59636e", corner) > 20 and not near(bare, "#59636e", corner)


def test_pictures_are_read_beside_the_index_and_nowhere_else(tmp_path):
    folder = tmp_path / "library"
    (folder / "pictures").mkdir(parents=True)
    (folder / "pictures" / "T01.jpg").write_bytes(b"a")
    (tmp_path / "secret.jpg").write_bytes(b"s")
    own = [entry(f"T{k}", picture=name) for k, name in enumerate((None, "pictures/T01.jpg", "../secret.jpg", "none"))]
    assert pictures_of(own, folder) == [None, b"a", None, None]


PEN = Pen(ImageDraw.Draw(Image.new("RGB", (10, 10))))


@pytest.mark.parametrize("room", [0, 5, 20, 77.5, 200])
def test_a_text_is_cut_off_where_there_is_no_room_and_no_sooner(room):
    text = "sandpaper 3 of 5, coarse"
    fitted_text = PEN.fitted(text, room, 14, bold=True)
    if fitted_text == text:
        assert PEN.width(text, 14, bold=True) <= room
        return
    assert fitted_text.endswith(MORE) and text.startswith(fitted_text[:-1])
    assert PEN.width(fitted_text, 14, bold=True) <= room or fitted_text == MORE
    longer = text[: len(fitted_text[:-1]) + 2].rstrip() + MORE
    assert PEN.width(longer, 14, bold=True) > room


def test_what_fits_stays():
    assert PEN.fitted("T01", 400, 14) == "T01" and PEN.fitted("", 0, 14) == ""
