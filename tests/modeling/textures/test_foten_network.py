"""The encoder's layers are those of the thesis: positions, attention, and a dropout that takes the share it should."""

from __future__ import annotations

import math

import pytest
import torch
from torch import nn

from palpate.modeling.textures.foten_network import (
    IMPULSE,
    Dropout,
    Embedding,
    Encoder,
    EncoderLayer,
    FourierBlock,
    inverse,
    positions,
    transform,
)
from palpate.modeling.textures.spectral_features import MelBlock, WaveletBlock, wavelet
from palpate.modeling.training.seeding import seeded

pytestmark = pytest.mark.needs("torch")


def test_positions_are_equations_4_2_and_4_3():
    encoded = positions(20, 64)
    assert encoded.shape == (20, 64)
    for place, dimension in ((0, 0), (7, 4), (19, 62)):
        turn = place / 10000 ** (dimension / 64)
        assert encoded[place, dimension].item() == pytest.approx(math.sin(turn), abs=1e-6)
        assert encoded[place, dimension + 1].item() == pytest.approx(math.cos(turn), abs=1e-6)


def test_a_layer_answers_as_the_stock_one_with_the_same_weights():
    ours = seeded(lambda: EncoderLayer(dropout=0.0), 1)
    stock = nn.TransformerEncoderLayer(64, 4, 128, dropout=0.0, batch_first=True)
    stock.load_state_dict({
        "self_attn.in_proj_weight": ours.mix.weight, "self_attn.in_proj_bias": ours.mix.bias,
        "self_attn.out_proj.weight": ours.out.weight, "self_attn.out_proj.bias": ours.out.bias,
        "linear1.weight": ours.wide.weight, "linear1.bias": ours.wide.bias,
        "linear2.weight": ours.narrow.weight, "linear2.bias": ours.narrow.bias,
        "norm1.weight": ours.after_attention.weight, "norm1.bias": ours.after_attention.bias,
        "norm2.weight": ours.after_forward.weight, "norm2.bias": ours.after_forward.bias,
    })  # fmt: skip
    x = torch.randn(3, 20, 64, generator=torch.Generator().manual_seed(2))
    assert torch.allclose(ours(x), stock.train()(x), atol=2e-6)


def test_three_layers_keep_the_shape():
    assert Encoder(3)(Embedding(15, 64)(torch.zeros(2, 15))).shape == (2, 15, 64)


def test_dropout_zeroes_a_fifth_and_keeps_the_mean():
    layer, x = Dropout(0.2), torch.ones(400, 1001)
    with torch.random.fork_rng():
        torch.manual_seed(5)
        output = layer(x)
        assert not torch.equal(output, layer(x))
    assert (output == 0).float().mean().item() == pytest.approx(51 / 256, abs=0.002)
    assert output.mean().item() == pytest.approx(1.0, abs=0.003)
    assert torch.equal(layer.eval()(x), x)


def test_dropout_leaves_something():
    with pytest.raises(ValueError, match="leaves nothing"):
        Dropout(1.0)


LENGTHS = (10, 15, 20, 25, 30)


def past(length):
    return torch.randn(7, length, generator=torch.Generator().manual_seed(length))


@pytest.mark.parametrize("length", LENGTHS)
def test_the_matrix_is_the_discrete_fourier_transform(length):
    matrix, offset = transform(length)
    x = past(length)
    bins = torch.addmm(offset, x, matrix.T)
    real, imaginary = bins[:, :length], bins[:, length:]
    expected = torch.fft.fft(x)
    assert torch.allclose(real, expected.real + IMPULSE, atol=1e-5)
    assert torch.allclose(imaginary, expected.imag, atol=1e-5)


@pytest.mark.parametrize("length", LENGTHS)
def test_the_way_back_is_the_real_part_of_the_inverse(length):
    bins = torch.complex(past(length), past(length).flip(0))
    signal = torch.cat([bins.real, bins.imag], dim=1) @ inverse(length).T
    assert torch.allclose(signal, torch.fft.ifft(bins).real, atol=1e-6)


def test_bins_that_are_real_by_nature_lie_above_the_cut():
    matrix, offset = transform(20)
    spectrum = torch.addmm(offset, -torch.ones(1, 20) + 0.5 * (-1.0) ** torch.arange(20), matrix.T)
    phase = torch.atan2(spectrum[0, 20:], spectrum[0, :20])
    assert phase[0].item() == pytest.approx(torch.pi)  # never -pi: the imaginary part is 1e-30
    assert phase[10].item() == pytest.approx(0.0)


@pytest.mark.parametrize("kind", [FourierBlock, MelBlock, WaveletBlock])
@pytest.mark.parametrize("size", [0.0, 1e-30, 1e-6, 1e6])
def test_gradients_are_finite_from_silence_to_a_spike(kind, size):
    block = seeded(lambda: kind(20, 0.0), 1)
    x = torch.full((2, 20), size, requires_grad=True)
    output = block(x)
    assert output.shape == (2, 20)
    output.square().sum().backward()
    for tensor in (output, x.grad, *(parameter.grad for parameter in block.parameters())):
        assert torch.isfinite(tensor).all()


def test_the_phase_of_silence_is_zero_and_not_that_of_a_rounding_error():
    block = seeded(lambda: FourierBlock(20, 0.0), 1).eval()
    silence, nearly = torch.zeros(1, 20), torch.full((1, 20), 1e-9)
    assert torch.allclose(block(silence), block(nearly), atol=1e-5)


def test_a_phase_that_is_turned_changes_the_answer():
    block = seeded(lambda: FourierBlock(20, 0.0), 1).eval()
    x = past(20)
    assert not torch.allclose(block(x), block(x.roll(1, dims=1)), atol=1e-3)


@pytest.mark.parametrize("length", LENGTHS)
def test_wavelets_go_there_and_back(length):
    there, back = wavelet(length)
    assert torch.allclose(back @ there, torch.eye(length), atol=1e-6)


def test_wavelets_leave_no_detail_of_a_constant():
    there, _ = wavelet(20)
    coefficients = there @ torch.ones(20)
    assert torch.allclose(coefficients[5:], torch.zeros(15), atol=1e-6)
    assert torch.allclose(coefficients[:5], torch.full((5,), 2.0), atol=1e-6)


def test_cepstral_coefficients_tell_a_low_tone_from_a_high_one():
    block = seeded(lambda: MelBlock(30, 0.0), 1)
    time = torch.arange(30) / 1000
    for hertz in (80.0, 400.0):
        tone = torch.sin(2 * torch.pi * hertz * time)[None]
        energy = ((tone @ block.spectrum.T).square() @ block.bands.T)[0]
        band = int(energy.argmax())
        low, high = (2595 * torch.log10(torch.tensor([1 + hertz / 700, 1 + 500 / 700]))).tolist()
        assert abs(band - (low / high * 17 - 1)) <= 1.0
