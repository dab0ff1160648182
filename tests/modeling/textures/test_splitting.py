"""Frames in three parts: sizes, that they share speeds and forces, determinism, short and joined recordings."""

import numpy as np
import pytest

from palpate.modeling.textures.recording import Joined, Recording, TextureDataError, joined, pieces_of
from palpate.modeling.textures.splitting import NAMES, fit_of, frames_of, split, split_notes
from tests.modeling.textures.textures_for_tests import recording


def sizes(parts):
    return [len(part) for part in (parts.train, parts.validation, parts.test)]


def all_of(parts):
    return sorted((*parts.train, *parts.validation, *parts.test))


def test_twenty_frames_are_shared_out_and_cover_everything_once():
    parts = split(recording())
    assert sizes(parts) == [14, 4, 2]
    assert all_of(parts) == [(1000 * k, 1000 * k + 1000) for k in range(20)]
    assert split_notes(recording(), parts) == ()


def test_the_same_recording_gives_the_same_parts_whatever_was_split_before():
    assert split(recording(seed=3)) == split(recording(seed=3))


@pytest.mark.parametrize("seed", range(3))
def test_parts_are_more_alike_in_speed_and_force_than_by_chance_and_than_in_order(seed):
    whole = recording(seed=seed)
    best = fit_of(whole, split(whole)).distance
    assert best[2] < 0.25
    cut = frames_of(whole)
    chance = np.random.default_rng(0)
    for _ in range(8):
        order = chance.permutation(20)
        by = [tuple(sorted(cut[k] for k in order[a:b])) for a, b in ((0, 14), (14, 18), (18, 20))]
        assert sum(fit_of(whole, type(split(whole))(*by)).distance) >= sum(best)


def test_a_short_recording_has_fewer_frames_and_says_so():
    short = recording(1900)
    parts = split(short)
    assert sizes(parts) == [7, 2, 1]
    assert split_notes(short, parts) == ("10 frames instead of 20: the recording is short",)
    shorter = recording(700)
    assert sizes(split(shorter)) == [2, 1, 1]
    assert "parts of 50% / 25% / 25%" in split_notes(shorter, split(shorter))[1]
    with pytest.raises(TextureDataError, match="three frames of 150 samples"):
        split(recording(440))


def test_speed_and_force_that_never_vary_still_give_parts_spread_over_time():
    still = Recording("still", "still", np.stack([recording().signals[0], np.full(20_000, 50.0), np.ones(20_000)]))
    parts = split(still)
    assert sizes(parts) == [14, 4, 2]
    assert parts.test[1][0] - parts.test[0][1] > 5000
    assert fit_of(still, parts).distance == (0.0, 0.0, 0.0)


def test_no_frame_of_a_joined_recording_crosses_a_border():
    whole = joined("t", "t", [recording(7300).signals, recording(100).signals, recording(9000, 1).signals], (), ())
    assert isinstance(whole, Joined)
    assert pieces_of(whole) == ((0, 7300), (7300, 7400), (7400, 16400))
    for start, stop in all_of(split(whole)):
        assert any(a <= start and stop <= b for a, b in pieces_of(whole))


def test_settings_that_cannot_be_are_refused():
    for shares in ((0.7, 0.3), (0.5, 0.5, 0.0), (0.7, 0.2, 0.2)):
        with pytest.raises(TextureDataError, match="sum to 1"):
            split(recording(), shares=shares)
    with pytest.raises(TextureDataError, match="frames"):
        split(recording(), frames=len(NAMES) - 1)
