"""Small pictures beside the library."""

import io

import numpy as np
import pytest
from PIL import Image

from palpate.modeling.attributes.reading_folder import SUFFIXES, pictures_of
from palpate.modeling.library.entries import LibraryError
from palpate.modeling.library.pictures import pictures_in
from palpate.modeling.library.thumbnails import SIDE, drop, keep, name_of, thumbnail


def written(array, kind="PNG"):
    content = io.BytesIO()
    Image.fromarray(array).save(content, kind)
    return content.getvalue()


def square(size, middle=255):
    """A dark picture with a bright middle half."""
    picture = np.zeros((size, size, 3), np.uint8)
    quarter = size // 4
    picture[quarter : size - quarter, quarter : size - quarter] = middle
    return picture


@pytest.mark.parametrize("shape", [(1, 1), (10, 10), (300, 2000), (2000, 300), (1568, 1568)])
def test_a_picture_of_any_shape_becomes_a_small_square(shape):
    small = Image.open(io.BytesIO(thumbnail(written(np.full((*shape, 3), 90, np.uint8)), "x.png")))
    assert small.size == (SIDE, SIDE) and small.format == "JPEG"
    assert np.abs(np.asarray(small).astype(int) - 90).max() <= 2


def test_of_a_large_picture_the_middle_half_is_seen_of_a_small_one_all():
    large = np.asarray(Image.open(io.BytesIO(thumbnail(written(square(1568)), "x.png"))))
    assert large[2:-2, 2:-2].min() > 240
    small = np.asarray(Image.open(io.BytesIO(thumbnail(written(square(280)), "x.png"))))
    assert small[5, 5].max() < 20 and small[144, 144].min() > 240


@pytest.mark.parametrize("mode", ["L", "RGBA", "P", "1", "I;16"])
def test_any_colours_are_seen(mode):
    content = io.BytesIO()
    Image.new(mode, (20, 20)).save(content, "PNG")
    assert thumbnail(content.getvalue(), "x.png")


def test_of_16_bits_a_gray_stays_the_gray_that_it_is():
    small = Image.open(io.BytesIO(thumbnail(written(np.full((30, 30), 90 * 257, np.uint16)), "x.png")))
    assert np.abs(np.asarray(small).astype(int) - 90).max() <= 2


@pytest.mark.parametrize("content", [b"", b"no picture", written(square(64))[:80]])
def test_what_is_no_picture_is_refused(content):
    with pytest.raises(LibraryError, match="x.png: this is no picture that can be read"):
        thumbnail(content, "x.png")


def test_equal_pictures_are_equal_bytes_and_left_alone(tmp_path):
    name = keep(tmp_path, "T01", written(square(400)), "x.png")
    path = tmp_path / name
    before = path.stat().st_mtime_ns, path.read_bytes()
    assert keep(tmp_path, "T01", written(square(400)), "x.png") == name == "pictures/T01.jpg"
    assert (path.stat().st_mtime_ns, path.read_bytes()) == before
    keep(tmp_path, "T01", written(square(400, 90)), "x.png")
    assert path.read_bytes() != before[1]


def test_a_texture_of_any_name_has_a_plain_file():
    assert name_of("../T 01/é") != name_of("../T 01/e") and name_of("../T 01/é").count("/") == 1
    assert ".." not in name_of("..")


def test_only_what_lies_among_the_pictures_is_removed(tmp_path):
    keep(tmp_path, "T01", written(square(40)), "x.png")
    (tmp_path / "index.json").touch()
    drop(tmp_path, ["pictures/T01.jpg", "index.json", "pictures/../index.json", "pictures/none.jpg"])
    assert [path.name for path in tmp_path.rglob("*.*")] == ["index.json"]


def test_pictures_in_a_folder_are_found_by_the_textures_names(tmp_path):
    (tmp_path / "T03").mkdir()
    for name in ("T01.png", "T02_2.jpg", "T02_10.jpg", "T03/a.png", "T01.txt", "T011.png", "other.png"):
        (tmp_path / name).touch()
    found = dict(pictures_in(tmp_path, ["T01", "T02", "T03", "T04"]))
    assert {name: path.relative_to(tmp_path).as_posix() for name, path in found.items()} == {
        "T01": "T01.png", "T02": "T02_2.jpg", "T03": "T03/a.png",
    }  # fmt: skip
    with pytest.raises(LibraryError, match="there is no such folder"):
        dict(pictures_in(tmp_path / "none", ["T01"]))


def test_what_is_shown_and_what_is_measured_are_the_same_files(tmp_path):
    (tmp_path / "T00").mkdir()
    (tmp_path / "T00" / "._T00.png").touch()  # as macOS leaves them beside copied ones
    names = [f"T{at:02}" for at in range(len(SUFFIXES) + 1)]
    for name, suffix in zip(names[1:], SUFFIXES, strict=True):
        (tmp_path / f"{name}{suffix.upper()}").touch()
    assert list(dict(pictures_in(tmp_path, names))) == names[1:]
    assert [name for name in names if list(pictures_of(tmp_path, name))] == names[1:]


@pytest.mark.parametrize(
    ("files", "names", "expected"),
    [
        (("oak-dark.png", "oak.png"), ("oak", "oak-dark"), {"oak": "oak.png", "oak-dark": "oak-dark.png"}),
        (("oak-dark.png",), ("oak",), {}),
        (("T1_2.png", "T1_2_1.png", "T1_3.png"), ("T1", "T1_2"), {"T1": "T1_3.png", "T1_2": "T1_2.png"}),
        (("T10.png", "T1.png", "T1-2.png"), ("T1", "T10"), {"T1": "T1.png", "T10": "T10.png"}),
        (("T10.png", "T1/T10.png"), ("T1", "T10"), {"T1": "T1/T10.png", "T10": "T10.png"}),
    ],
)
def test_a_name_that_begins_another_does_not_take_its_picture(tmp_path, files, names, expected):
    for name in files:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    found = {name: path.relative_to(tmp_path).as_posix() for name, path in pictures_in(tmp_path, names)}
    assert found == expected
