"""Further versions of a picture: decided by content and seed, of the same brightness, turned, mirrored and noisy."""

import numpy as np
import pytest

from palpate.analysis.features.augmenting import chance_of, varied
from tests.analysis.features.picture_specimens import grains

VALUES = grains(128).astype("f4") / 255


class Drawn:
    """Chance that was drawn before: an angle, and whether to mirror."""

    def __init__(self, angle_deg, *mirrors):
        self.angle_deg, self.mirrors = angle_deg, list(mirrors)

    def uniform(self, low, high):
        return self.angle_deg

    def random(self):
        return 0.0 if self.mirrors.pop(0) else 1.0

    def standard_normal(self, shape, dtype):
        return np.ones(shape, dtype)


def test_content_version_and_seed_decide_and_nothing_else():
    one = varied(VALUES, chance_of("ab", 1))
    assert one.dtype == np.float32 and one.shape == VALUES.shape
    np.testing.assert_array_equal(one, varied(VALUES, chance_of("ab", 1)))
    for other in (chance_of("ab", 2), chance_of("ac", 1), chance_of("ab", 1, seed=1)):
        assert np.abs(varied(VALUES, other) - one).mean() > 0.05


@pytest.mark.parametrize(
    ("angle_deg", "mirrors", "same"),
    [(0, (False, False), lambda v: v), (90, (False, False), np.rot90), (0, (True, False), lambda v: np.flip(v, 0)),
     (180, (False, True), lambda v: np.flip(v, 0))],
)  # fmt: skip
def test_turns_and_mirrors_are_those_that_were_drawn(angle_deg, mirrors, same):
    result = varied(VALUES, Drawn(angle_deg, *mirrors), noise_sd=0.0)
    np.testing.assert_allclose(result, same(VALUES), atol=1e-4)


def test_noise_is_added_and_brightness_stays_brightness():
    result = varied(VALUES, Drawn(0, False, False), noise_sd=0.25)
    np.testing.assert_allclose(result, np.minimum(VALUES + 0.25, 1), atol=1e-6)
    for level in (0.0, 1.0):
        flat = varied(np.full((64, 64), level, np.float32), chance_of("ab", 1), noise_sd=0.1)
        assert flat.min() >= 0 and flat.max() <= 1 and np.ptp(flat) > 0.1


def test_noise_has_the_sd_that_was_requested():
    flat = varied(np.full((200, 200), 0.5, np.float32), chance_of("ab", 1), noise_sd=0.02)
    assert flat.std() == pytest.approx(0.02, rel=0.02)


def test_the_corners_of_a_turned_picture_are_filled_from_it():
    halves = np.ones((64, 64), np.float32)
    halves[:, :32] = 0.5
    result = varied(halves, Drawn(45, False, False), noise_sd=0.0)
    assert result.min() >= 0.5 and np.isfinite(result).all()
