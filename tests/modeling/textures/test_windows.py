"""Windows of the past, what follows each, and the scale of the training part."""

import numpy as np
import pytest

from palpate.modeling.textures.recording import Parts, Recording, TextureDataError
from palpate.modeling.textures.splitting import split
from palpate.modeling.textures.windows import LENGTHS, scale_of, windows
from tests.modeling.textures.textures_for_tests import recording


@pytest.mark.parametrize("m", [1, *LENGTHS])
def test_a_window_holds_what_came_before_and_never_leaves_its_stretch(m):
    whole = recording(2000)
    windowed = windows(whole, ((0, 100), (500, 540)), m)
    assert len(windowed.at) == 140 - 2 * m
    for given, target, at in zip(windowed.given, windowed.target, windowed.at, strict=True):
        np.testing.assert_array_equal(given, whole.signals[:, at - m : at])
        assert target == whole.signals[0, at]
        assert m <= at < 100 or 500 + m <= at < 540


def test_parts_share_no_sample():
    whole = recording()
    parts = split(whole)
    seen = [
        {int(at) - k for at in windows(whole, part, 30).at for k in range(31)}
        for part in (parts.train, parts.validation, parts.test)
    ]
    assert not (seen[0] & seen[1] or seen[0] & seen[2] or seen[1] & seen[2])


def test_too_short_stretches_and_such_outside_are_refused():
    with pytest.raises(TextureDataError, match="no stretch is longer than a window of 30"):
        windows(recording(500), ((0, 30), (40, 50)), 30)
    for stretches in (((0, 501),), ((-1, 50),), ((60, 50),)):
        with pytest.raises(TextureDataError, match="a stretch"):
            windows(recording(500), stretches, 10)
    with pytest.raises(TextureDataError, match="at least 1"):
        windows(recording(500), ((0, 50),), 0)


def test_the_scale_is_of_the_training_part_and_a_channel_that_stands_still_is_only_moved():
    signals = np.stack([np.r_[np.arange(100.0), np.full(100, 1e6)], np.full(200, 1e9 + 0.1), np.full(200, 0.8)])
    scale = scale_of(Recording("t", "t", signals), Parts(((0, 100),), ((100, 150),), ((150, 200),)))
    np.testing.assert_allclose(scale.mean, [49.5, 1e9 + 0.1, 0.8], rtol=1e-15)
    assert scale.sd.tolist() == [pytest.approx(np.arange(100.0).std()), 1.0, 1.0]
    assert not scale.down(signals[:, :100])[1:].any()
