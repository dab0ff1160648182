"""Co-occurrence: equal to scikit-image's own and to counting pair by pair; a checkerboard's by thought."""

import numpy as np
import pytest
from skimage.feature import graycomatrix

from palpate.analysis.features.glcm import glcm, levels
from palpate.analysis.features.pictures import PictureError
from tests.analysis.features.picture_specimens import grains

pytestmark = pytest.mark.needs("skimage")


def counted(values):
    """Pair by pair, with numpy alone: neighbours in eight directions, each direction pair a share of its own."""
    steps = np.minimum(np.floor(values.astype(float) * 16), 15).astype(int)
    matrix = np.zeros((16, 16))
    rows, columns = steps.shape
    for down, right in ((0, 1), (-1, 1), (-1, 0), (-1, -1)):
        one = steps[max(0, -down) : rows - max(0, down), max(0, -right) : columns - max(0, right)]
        other = steps[max(0, down) : rows + min(0, down), max(0, right) : columns + min(0, right)]
        both = np.zeros((16, 16))
        np.add.at(both, (one.ravel(), other.ravel()), 1)
        both += both.T
        matrix += both / both.sum() / 4
    return matrix.ravel()


def test_it_is_scikit_image_s_own_matrix_and_what_counting_gives():
    values = grains(301, seed=3).astype("f4") / 255
    matrix = glcm(values)
    assert matrix.shape == (256,) and matrix.dtype == np.float32
    theirs = graycomatrix(
        (grains(301, seed=3) // 16).astype("u1"), [1], [0, np.pi / 4, np.pi / 2, 3 * np.pi / 4], 16, True, True
    )
    np.testing.assert_allclose(matrix, theirs[:, :, 0, :].mean(axis=-1).ravel(), atol=1e-6, rtol=0)
    np.testing.assert_allclose(matrix, counted(values), atol=1e-7, rtol=0)
    assert matrix.sum() == pytest.approx(1, abs=1e-6)


def test_it_is_symmetric_and_does_not_change_by_a_quarter_turn_or_a_mirror():
    values = grains(100).astype("f4") / 255
    matrix = glcm(values)
    np.testing.assert_allclose(matrix, matrix.reshape(16, 16).T.ravel())
    for turned in (np.rot90(values), np.flip(values, 0)):
        np.testing.assert_allclose(glcm(turned), matrix, atol=1e-7)


def test_a_checkerboard_has_its_own_kind_along_the_diagonals_only():
    board = np.indices((8, 8)).sum(axis=0) % 2
    matrix = glcm(board.astype("f4")).reshape(16, 16)
    assert matrix[0, 15] + matrix[15, 0] == pytest.approx(0.5)
    assert matrix[0, 0] + matrix[15, 15] == pytest.approx(0.5)


@pytest.mark.parametrize(("level", "place"), [(0.0, 0), (1.0, 255), (0.5, 8 * 16 + 8)])
def test_one_brightness_is_one_cell(level, place):
    matrix = glcm(np.full((20, 20), level, np.float32))
    assert matrix[place] == 1 and np.count_nonzero(matrix) == 1


def test_levels_are_sixteenths():
    assert levels(np.array([0, 15 / 256, 16 / 256, 0.999, 1], "f4")).tolist() == [0, 0, 1, 15, 15]
    assert levels(np.arange(256, dtype="f4") / np.float32(255))[[15, 16, 255]].tolist() == [0, 1, 15]


@pytest.mark.parametrize("wrong", [np.full((4, 4), 1.1), np.full((4, 4), -0.1), np.full((4, 4), np.nan)])
def test_what_is_no_brightness_is_refused(wrong):
    with pytest.raises(PictureError, match="from 0 to 1"):
        glcm(wrong.astype("f4"))


def test_one_row_of_pixels_is_refused():
    with pytest.raises(PictureError, match="2 x 2 are the least"):
        glcm(np.zeros((1, 9), np.float32))
