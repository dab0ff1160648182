"""What the networks are shown: standardised by the training textures, arranged in time, drawn by the seed."""

import numpy as np
import pytest
import torch

from palpate.modeling.attributes.material import MaterialError, Rated, Texture, ratings_of
from palpate.modeling.attributes.network_training import (
    LIMIT,
    arrange_frames,
    even_rows,
    look_of,
    random_rows,
    target_of,
    texture_tensors,
)
from tests.modeling.attributes.material_for_tests import SIZES, simulated_material

pytestmark = pytest.mark.needs("torch")


def texture(name="A", touch=None, sight=None, rating=(50.0, 50.0)):
    rated = Rated(np.array(rating), np.ones(2), 5)
    return Texture(name, name, "wood", touch=touch or {}, sight=sight or {}, rated=rated)


def test_features_are_standardised_by_the_training_textures():
    textures = simulated_material(textures=8, segments=5).textures
    look = look_of(textures, "touch", ("mfcc", "hand"))
    rows = np.concatenate([texture.rows("touch", ("mfcc", "hand")) for texture in textures]).astype(float)
    np.testing.assert_allclose(look.mean, rows.mean(axis=0), atol=1e-6)
    np.testing.assert_allclose(1 / look.gain, rows.std(axis=0), rtol=1e-6)
    scaled = torch.cat([look.rows(texture) for texture in textures])
    assert scaled.mean(dim=0).abs().max() < 1e-5
    torch.testing.assert_close(scaled.std(dim=0, correction=0), torch.ones(526), rtol=1e-4, atol=1e-4)


def test_each_texture_counts_as_much_as_another():
    some = [texture("A", {"hand": np.zeros((9, 1), "f4")}), texture("B", {"hand": np.full((1, 1), 2, "f4")})]
    look = look_of(some, "touch", ("hand",))
    assert (look.mean[0], look.gain[0]) == (1.0, 1.0)


@pytest.mark.parametrize("value", [0.0, 0.1, 1e30, -7e-20])
def test_a_constant_column_is_nothing_whatever_it_is_elsewhere(value):
    rows = np.random.default_rng(0).standard_normal((6, 3)).astype("f4")
    rows[:, 1] = value
    look = look_of([texture("A", {"hand": rows[:4]}), texture("B", {"hand": rows[4:]})], "touch", ("hand",))
    other = look.rows(texture("C", {"hand": np.full((2, 3), 5, "f4")}))
    assert look.gain[1] == 0.0
    assert (other[:, 1] == 0).all()
    assert torch.isfinite(other).all()


def test_a_feature_far_beyond_what_was_seen_is_held_back():
    rows = np.random.default_rng(0).standard_normal((6, 2)).astype("f4")
    look = look_of([texture("A", {"hand": rows})], "touch", ("hand",))
    far = look.rows(texture("B", {"hand": np.array([[3e38, -3e38]], "f4")}))
    assert far.tolist() == [[LIMIT, -LIMIT]]


def test_cepstra_are_laid_out_in_time_with_the_hand_beside():
    look = look_of(simulated_material(textures=2).textures, "touch", ("mfcc", "hand"))
    rows = torch.arange(2 * 526.0).view(2, 526)
    result = arrange_frames(rows, look)
    assert result.shape == (2, 10, 19, 4)
    frames = rows[:, :520].view(2, 40, 13)  # thesis 3.4.1: 40 frames of 13 coefficients
    for step, place in ((0, 0), (0, 3), (6, 2), (9, 3)):
        torch.testing.assert_close(result[:, step, :13, place], frames[:, 4 * step + place])
        torch.testing.assert_close(result[:, step, 13:, place], rows[:, 520:])


@pytest.mark.parametrize(("kinds", "channels"), [(("dft",), 7), (("dwt", "hand"), 7), (("dwt",), 1), (("hand",), 6)])
def test_other_kinds_are_dealt_out_and_filled_up_with_zeros(kinds, channels):
    look = look_of(simulated_material(textures=2).textures, "touch", kinds)
    rows = torch.arange(1.0, 1 + sum(SIZES[kind] for kind in kinds))[None]
    result = arrange_frames(rows, look)
    assert result.shape == (1, 10, channels, 4)
    assert look.channels == channels
    assert set(rows.flatten().tolist()) == set(result.flatten().tolist()) - {0.0}


def test_ratings_are_scaled_by_one_sd_for_all_attributes():
    target = target_of([texture("A", rating=(20.0, 80.0)), texture("B", rating=(40.0, 60.0))])
    assert target.mean.tolist() == [30.0, 70.0]
    assert target.sd == pytest.approx(10.0)
    np.testing.assert_allclose(target.up(target.down(np.array([[20.0, 65.0]])).numpy()), [[20.0, 65.0]], rtol=1e-6)


def test_equal_ratings_have_a_scale_too():
    assert target_of([texture("A"), texture("B")]).sd == 1.0


def test_drawn_rows_are_pictures_and_segments_of_their_own_texture_alone():
    seen = [texture(name, {"hand": np.full((3, 2), n, "f4")}, {"glcm": np.full((2, 4), n, "f4")})
            for n, name in enumerate("ABC")]  # fmt: skip
    looks = look_of(seen, "sight", ("glcm",)), look_of(seen, "touch", ("hand",))
    tensors = [texture_tensors(texture, *looks) for texture in seen]
    rows = torch.tensor([2, 0])
    (sight, touch), targets = random_rows(tensors, torch.arange(3.0)[:, None], 5).batch(rows, torch.Generator())
    assert targets[:, 0].tolist() == [2.0, 0.0]
    assert (sight.shape, touch.shape) == ((2, 4), (2, 5, 10, 2, 4))
    for place, row in enumerate(rows.tolist()):
        assert (sight[place] == tensors[row].sight[0]).all()
        assert (touch[place] == tensors[row].touch[0]).all()


def test_the_seed_alone_decides_what_is_drawn_and_variants_are_among_it():
    textures = simulated_material(textures=2, pictures=2, variants=3).textures
    looks = look_of(textures, "sight", ("glcm",)), look_of(textures, "touch", ("hand",))
    assert len(texture_tensors(textures[0], *looks).sight) == 2
    source = random_rows(
        [texture_tensors(texture, *looks, variants=True) for texture in textures], torch.zeros(2, 1), 4
    )
    first, again, other = (
        source.batch(torch.zeros(60, dtype=torch.int64), torch.Generator().manual_seed(seed)) for seed in (1, 1, 2)
    )
    assert all(torch.equal(one, two) for one, two in zip(first[0], again[0], strict=True))
    assert not torch.equal(first[0][1], other[0][1])
    assert len(first[0][0].unique(dim=0)) == 8  # two pictures and three variants of each


def test_what_is_watched_is_spread_over_the_recording_and_always_the_same():
    rows = np.arange(20, dtype="f4")[:, None]
    one = texture("A", {"hand": rows}, {"glcm": np.arange(4, dtype="f4")[:, None]})
    looks = look_of([one], "sight", ("glcm",)), look_of([one], "touch", ("hand",))
    source = even_rows([texture_tensors(one, *looks)], torch.zeros(1, 1), 2, 5)
    (sight, touch), _ = source.batch(torch.arange(2), torch.Generator())
    place = (touch[:, :, 0, 0, 0] / torch.tensor(looks[1].gain[0]) + looks[1].mean[0]).round().tolist()
    assert place == [[0, 4, 8, 12, 16], [2, 6, 10, 14, 18]]
    assert len(sight.unique()) == 2


def test_the_digest_knows_every_number():
    textures = simulated_material(textures=2).textures
    looks = None, look_of(textures, "touch", ("hand",))
    tensors = [texture_tensors(texture, *looks) for texture in textures]
    other = [texture_tensors(texture, *looks) for texture in simulated_material(textures=2, seed=1).textures]
    digest = random_rows(tensors, torch.zeros(2, 1), 4).digest
    assert digest == random_rows(tensors, torch.zeros(2, 1), 4).digest
    digests = {digest, random_rows(tensors, torch.zeros(2, 1), 5).digest}
    digests |= {random_rows(other, torch.zeros(2, 1), 4).digest, random_rows(tensors, torch.ones(2, 1), 4).digest}
    assert len(digests) == 4


def test_what_cannot_be_looked_at_is_refused():
    textures = simulated_material(textures=3).textures
    look = look_of(textures, "touch", ("dwt",))
    with pytest.raises(MaterialError, match="T99: 3 features of touch"):
        look.down(np.zeros((2, 3), "f4"), "T99")
    with pytest.raises(MaterialError, match="A: not one segment"):
        look.rows(texture("A", {"dwt": np.zeros((0, 24), "f4")}))
    with pytest.raises(MaterialError, match="A: no glcm features"):
        look_of([texture("A")], "sight", ("glcm",))
    short = texture("A", {"dwt": np.zeros((2, 23), "f4")})
    with pytest.raises(MaterialError, match="rows of"):
        look_of([*textures, short], "touch", ("dwt",))
    with pytest.raises(MaterialError, match="a rating is not finite"):
        target_of([texture("A", rating=(float("nan"), 1.0))])
    assert ratings_of(textures).shape == (3, 4)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_features_that_are_not_finite_never_become_a_texture(value):
    with pytest.raises(MaterialError, match="finite rows"):
        texture("A", {"dwt": np.full((2, 24), value, "f4")})
