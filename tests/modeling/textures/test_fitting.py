"""Rows at rest, noise on the past, and the rate of the steps: what a training is augmented with and how it is led."""

import numpy as np
import pytest
import torch

from palpate.modeling.textures.fitting import Augmentation, add_rest, augmented, fit_windows, rows_of, settings_for
from palpate.modeling.textures.foten_network import Foten, mse
from palpate.modeling.textures.methods import Learning
from palpate.modeling.textures.recording import Parts, TextureDataError
from palpate.modeling.training.optimisers import Cosine, cosine, share_of
from palpate.modeling.training.settings import Settings
from tests.modeling.textures.recording_for_tests import parts, recording

pytestmark = pytest.mark.needs("torch")


def rows():
    whole = recording(1.5)
    return rows_of(Learning(whole, parts(whole)), 10)


def test_training_rows_are_centred_with_an_sd_of_one():
    inputs = rows().train.inputs
    assert inputs.shape[1:] == (3, 10)
    assert torch.allclose(inputs.mean(dim=(0, 2)), torch.zeros(3), atol=0.1)
    assert torch.allclose(inputs.std(dim=(0, 2)), torch.ones(3), atol=0.1)


def test_rows_at_rest_have_no_speed_no_force_and_silence_to_follow():
    windows_of_parts = rows()
    more = add_rest(windows_of_parts.train, 0.1, windows_of_parts.scale, 3)
    added = len(more) - len(windows_of_parts.train)
    assert added == round(0.1 * len(windows_of_parts.train))
    resting = (
        more.inputs[-added:].double().numpy() * windows_of_parts.scale.sd[:, None]
        + windows_of_parts.scale.mean[:, None]
    )
    assert np.abs(resting[:, 1:]).max() < 1e-4
    assert np.abs(resting[:, 0]).max() > 0.1 * windows_of_parts.scale.sd[0]
    silence = more.targets[-added:].double().numpy() * windows_of_parts.scale.sd[0] + windows_of_parts.scale.mean[0]
    assert np.abs(silence).max() < 0.05 * windows_of_parts.scale.sd[0]
    assert add_rest(windows_of_parts.train, 0.1, windows_of_parts.scale, 3).digest == more.digest
    assert add_rest(windows_of_parts.train, 0.1, windows_of_parts.scale, 4).digest != more.digest


def test_noise_falls_on_the_past_acceleration_alone_and_anew_each_time():
    windows_of_parts = rows()
    source, chance = augmented(windows_of_parts, Augmentation(noise=0.1), 1), torch.Generator().manual_seed(1)
    chosen = torch.arange(200)
    (one, targets), (other, _) = source.batch(chosen, chance), source.batch(chosen, chance)
    plain = windows_of_parts.train.inputs[:200]
    assert (one[:, 0] - plain[:, 0]).std().item() == pytest.approx(0.1, rel=0.1)
    assert torch.equal(one[:, 1:], plain[:, 1:])
    assert torch.equal(targets, windows_of_parts.train.targets[:200])
    assert not torch.equal(one, other)


def test_a_windows_speed_and_force_are_moved_as_a_whole():
    windows_of_parts = rows()
    source, chance = augmented(windows_of_parts, Augmentation(hand=0.2), 1), torch.Generator().manual_seed(1)
    (given, targets), plain = source.batch(torch.arange(400), chance), windows_of_parts.train.inputs[:400]
    moved = given[:, 1:] - plain[:, 1:]
    assert torch.allclose(moved, moved[..., :1].expand_as(moved), atol=1e-5)
    assert moved[..., 0].std(dim=0).numpy() == pytest.approx([0.2, 0.2], rel=0.15)
    assert torch.equal(given[:, 0], plain[:, 0])
    assert torch.equal(targets, windows_of_parts.train.targets[:400])


def test_mirrored_rows_turn_the_sign_of_the_acceleration_before_and_after_and_of_nothing_else():
    windows_of_parts = rows()
    source, chance = augmented(windows_of_parts, Augmentation(mirrored=True), 1), torch.Generator().manual_seed(1)
    plain, chosen = windows_of_parts.train.inputs[:400], torch.arange(400)
    (given, targets), (again, _) = source.batch(chosen, chance), source.batch(chosen, chance)
    turned = (given[:, 0] != plain[:, 0]).all(dim=1)
    sign = torch.where(turned, -1.0, 1.0)[:, None]
    assert torch.equal(given[:, 0], sign * plain[:, 0])
    assert torch.equal(targets, sign * windows_of_parts.train.targets[:400])
    assert torch.equal(given[:, 1:], plain[:, 1:])
    assert 150 < int(turned.sum()) < 250
    assert not torch.equal(given, again)
    assert source.digest != augmented(windows_of_parts, Augmentation(), 1).digest


def test_a_quick_training_takes_few_epochs_and_many_rows_at_a_time_by_default():
    default = Settings(epochs=100, batch=16)

    def settings_of(**given):
        return settings_for(Learning(recording(), parts(recording()), settings=given), default)

    assert (settings_of(quick=True).epochs, settings_of(quick=True).batch) == (2, 128)
    assert (settings_of(quick=True, epochs=5, batch=8).epochs, settings_of(quick=True, batch=8).batch) == (5, 8)
    assert (settings_of().epochs, settings_of().batch) == (100, 16)


def test_the_rate_rises_and_falls_along_a_cosine():
    shares = [share_of(done, 200) for done in range(260)]
    assert max(shares) == shares[10] == 1.0
    assert shares[0] < 0.1
    assert share_of(105, 200) == pytest.approx(0.5, abs=0.01)
    assert shares[199] == shares[259] == 0.01


def test_a_step_has_its_own_rate_and_leaves_the_trainers():
    weight = torch.nn.Parameter(torch.zeros(1))
    optimiser = Cosine([weight], 0.1, 40)
    moves = []
    for _ in range(40):
        before = weight.item()
        weight.grad = torch.ones(1)
        optimiser.step()
        moves.append(before - weight.item())
        assert optimiser.param_groups[0]["lr"] == 0.1
    assert moves[0] < moves[2] == pytest.approx(0.1, rel=0.02)
    assert moves[-1] < 0.01


def test_a_training_that_was_cut_off_and_resumed_comes_to_the_same_bits(tmp_path):
    whole = recording(0.4)

    def fitted(epochs, checkpoint):
        given = Learning(whole, parts(whole), settings={"epochs": epochs, "checkpoint": checkpoint})
        how = Settings(batch=128, plateau_patience=None)
        return fit_windows(
            Foten, given, mse, how, window=10, augmentation=Augmentation(0.05, 0.1), optimiser=cosine(6)
        ).network

    fitted(1, tmp_path / "cut")
    one, other = fitted(2, tmp_path / "cut").state_dict(), fitted(2, tmp_path / "whole").state_dict()
    assert all(torch.equal(one[name], other[name]) for name in one)


def test_a_part_without_a_window_is_refused():
    whole = recording(1.2)
    with pytest.raises(TextureDataError, match="window of 10 samples"):
        rows_of(Learning(whole, Parts(((0, 500),), ((500, 508),), ((600, 700),))), 10)
