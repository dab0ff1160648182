"""The square that is looked at: cut, gray, sized; every mode of a picture that there is; what shows nothing."""

import io
import warnings

import numpy as np
import pytest
from PIL import Image

from palpate.analysis.features.pictures import Looking, PictureError, patches, square
from tests.analysis.features.picture_specimens import file_of, grains

SIDE = 256


def shown(data, side=SIDE):
    return square(data, "T07, light 3", side)


def test_forty_nine_patches_lie_side_by_side_in_the_square_of_the_thesis():
    looking = Looking()
    values = np.arange(1568 * 1568, dtype=np.float32).reshape(1568, 1568)
    result = patches(values, looking)
    assert looking.starts == (0, 224, 448, 672, 896, 1120, 1344)
    assert result.shape == (49, 224, 224)
    whole = np.block([[result[7 * row + column] for column in range(7)] for row in range(7)])
    np.testing.assert_array_equal(whole, values)


def test_patches_overlap_by_a_shorter_stride_and_are_fewer_by_a_grid():
    assert len(patches(np.zeros((1568, 1568), np.float32), Looking(stride=112))) == 13**2
    assert Looking(grid=1).starts == (672,)
    assert Looking(grid=2).starts == (0, 1344)
    assert Looking(grid=3).starts == (0, 672, 1344)
    assert Looking(grid=7).starts == Looking().starts


@pytest.mark.parametrize("wrong", [{"grid": 8}, {"grid": 0}, {"stride": 0}, {"patch": 1569}])
def test_patches_that_there_are_not_are_refused(wrong):
    with pytest.raises(PictureError, match="patch"):
        Looking(**wrong)
    with pytest.raises(PictureError, match="1568 x 1568 are expected"):
        patches(np.zeros((1568, 1567), np.float32), Looking())


def test_the_middle_of_a_picture_that_is_no_square():
    wide = grains(256, width=400)
    np.testing.assert_array_equal(shown(file_of(wide)).values, wide[:, 72:328].astype("f4") * np.float32(1 / 255))
    tall = grains(400, width=256)
    np.testing.assert_array_equal(shown(file_of(tall)).values, tall[72:328].astype("f4") * np.float32(1 / 255))


def test_a_turned_camera_is_turned_back():
    exif = Image.Exif()
    exif[0x0112] = 6
    values = shown(file_of(grains(), "PNG", exif=exif)).values
    np.testing.assert_array_equal(values, np.rot90(shown(file_of(grains())).values, -1))


@pytest.mark.parametrize("mode", ["RGB", "RGBA", "LA", "CMYK", "P", "I;16"])
def test_every_mode_shows_the_same_gray(mode):
    gray = grains()
    image = Image.fromarray(gray).convert("L" if mode == "I;16" else mode)
    if mode == "I;16":
        image = Image.fromarray(gray.astype("u2") * 257)
    data = file_of(image, "TIFF" if mode == "CMYK" else "PNG")
    assert np.abs(shown(data).values - gray / 255).max() <= 1.1 / 255


@pytest.mark.parametrize("kind", ["BMP", "TIFF", "WEBP"])
def test_a_format_without_loss_shows_what_png_does(kind):
    lossless = {"lossless": True} if kind == "WEBP" else {}
    colours = Image.fromarray(grains()).convert("RGB")
    np.testing.assert_array_equal(shown(file_of(colours, kind, **lossless)).values, shown(file_of(grains())).values)


def test_sixteen_bits_stay_sixteen_bits():
    fine = np.arange(256 * 256, dtype="u2").reshape(256, 256)
    values = shown(file_of(fine)).values
    assert len(np.unique(values)) == 65536
    np.testing.assert_allclose(values, fine / 65535, atol=1e-7)


def test_colours_are_weighed_as_itu_r_601_says():
    colours = np.zeros((256, 256, 3), "u1")
    colours[:, :86, 0], colours[:, 86:171, 1], colours[:, 171:, 2] = 255, 255, 255
    values = shown(file_of(colours)).values[0, [0, 100, 255]]
    np.testing.assert_allclose(values, [0.299, 0.587, 0.114], atol=0.5 / 255)


def test_another_size_is_resampled_and_enlarging_is_reported():
    smooth = (127 + 120 * np.sin(np.arange(512) / 40)[:, None] * np.ones(512)).astype("u1")
    less = shown(file_of(smooth), 256)
    assert less.values.shape == (256, 256) and less.notes == ()
    np.testing.assert_allclose(less.values, (smooth[::2] / 2 + smooth[1::2] / 2)[:, ::2] / 255, atol=0.02)
    more = shown(file_of(smooth), 1568)
    assert more.values.shape == (1568, 1568)
    assert more.notes == ("T07, light 3: 512 pixels made 1568: nothing finer than that was seen",)
    assert more.values.min() >= 0 and more.values.max() <= 1


@pytest.mark.parametrize("level", [0, 255])
def test_black_and_white_are_right_and_reported(level):
    picture = shown(file_of(np.full((256, 256), level, "u1")), 300)
    assert np.unique(picture.values).tolist() == [level / 255]
    assert "it shows nothing" in picture.notes[1]


def test_ten_pixels_are_refused_with_the_least_size():
    with pytest.raises(PictureError, match="T07, light 3: 10 x 300 pixels: 224 on the shorter side are the least"):
        shown(file_of(grains(300, width=10)))


def test_what_cannot_be_read_to_its_end_is_refused():
    whole = {kind: file_of(grains(600), kind) for kind in ("PNG", "JPEG", "TIFF")}
    for data in whole.values():
        shown(data)
        for share in (0.02, 0.5, 0.97):
            with pytest.raises(PictureError, match="T07, light 3: "):
                shown(data[: int(share * len(data))])
    for text in (b"", b"a text that is named .jpg", b"FOVb raw"):
        with pytest.raises(PictureError, match="no picture|raw format"):
            shown(text)


def test_damaged_bytes_never_come_out_as_anything_but_a_picture_or_a_refusal():
    data, chance = file_of(grains(300), "PNG"), np.random.default_rng(1)
    refused = 0
    for _ in range(60):
        bad = bytearray(data)
        for place in chance.integers(0, 400, 4):
            bad[place] = chance.integers(256)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                assert shown(bytes(bad)).values.shape == (SIDE, SIDE)
            except PictureError:
                refused += 1
    assert refused > 30


def test_parts_that_are_transparent_or_of_unknown_white_are_refused():
    rgba = np.dstack([grains()] * 3 + [np.full((256, 256), 255, "u1")])
    shown(file_of(rgba))
    rgba[128, 128, 3] = 254
    with pytest.raises(PictureError, match="transparent"):
        shown(file_of(rgba))
    with pytest.raises(PictureError, match="whose white is not known"):
        shown(file_of(Image.fromarray(np.ones((256, 256), "f4")), "TIFF"))
    with pytest.raises(PictureError, match="from 0 to 65536"):
        wide = np.zeros((256, 256), "i4")
        wide[0, 0] = 65536
        shown(file_of(Image.fromarray(wide), "TIFF"))


def test_a_transparent_colour_of_a_palette_is_refused_only_where_it_is_seen():
    image = Image.fromarray(grains()).convert("P")
    out = io.BytesIO()
    image.save(out, "PNG", transparency=int(np.asarray(image)[128, 128]))
    with pytest.raises(PictureError, match="transparent"):
        shown(out.getvalue())
