"""Three axes on one: energy, spectrum, phase, and what frames do to when it happened."""

import numpy as np
import pytest

from palpate.signals.filters import SignalError
from palpate.signals.one_axis import dft321, one_axis


def noise(n=1000, axes=3, seed=0):
    return np.random.default_rng(seed).standard_normal((n, axes))


@pytest.mark.parametrize("n", [1000, 999, 2, 1])
def test_the_spectrum_has_the_size_of_all_axes_and_the_phase_of_their_sum(n):
    axes = noise(n)
    one = np.fft.rfft(dft321(axes))
    spectra = np.fft.rfft(axes, axis=0)
    size = np.sqrt((np.abs(spectra) ** 2).sum(axis=1))
    np.testing.assert_allclose(np.abs(one), size, rtol=1e-12)
    np.testing.assert_allclose(one / np.abs(one), spectra.sum(axis=1) / np.abs(spectra.sum(axis=1)), atol=1e-10)


@pytest.mark.parametrize("mapped", [dft321, lambda axes: one_axis(axes, 1000.0)], ids=["whole", "frames"])
@pytest.mark.parametrize("scale", [1.0, 1e-200, 1e200])
def test_energy_is_preserved_at_any_size(mapped, scale):
    axes = noise(5000)
    one = mapped(axes * scale) / scale
    assert abs((one**2).sum() / (axes**2).sum() - 1) < 1e-10


@pytest.mark.parametrize("mapped", [dft321, lambda axes: one_axis(axes, 1000.0)], ids=["whole", "frames"])
def test_one_axis_is_given_back(mapped):
    axes = noise(3000, 1)
    np.testing.assert_array_equal(mapped(axes), axes[:, 0])
    beside_silence = np.hstack([np.zeros((3000, 1)), axes, np.zeros((3000, 1))])
    np.testing.assert_allclose(mapped(beside_silence), axes[:, 0], atol=1e-12)


def test_axes_that_cancel_out_still_give_their_energy():
    axis = noise(512, 1)
    one = dft321(np.hstack([axis, -axis]))
    assert np.isfinite(one).all()
    assert (one**2).sum() == pytest.approx(2 * (axis**2).sum())


def test_silence_is_silent_and_no_axis_or_number_is_refused():
    assert not one_axis(np.zeros((500, 3)), 1000.0).any()
    for bad in (np.zeros((5, 0)), np.zeros(5), np.array([[1.0, np.nan]])):
        with pytest.raises(SignalError):
            dft321(bad)


def test_frames_keep_energy_when_it_happened_and_one_spectrum_spreads_it():
    loud = np.where(np.arange(8000) % 2000 < 1000, 1.0, 0.02)[:, None]
    axes = noise(8000) * loud
    rest = np.zeros(8000, dtype=bool)
    rest[1200:1800] = True
    true = np.sqrt((axes[rest] ** 2).sum(axis=1).mean())
    in_frames, in_one = one_axis(axes, 1000.0)[rest], dft321(axes)[rest]
    assert in_frames.std() == pytest.approx(true, rel=0.05)
    assert in_one.std() > 5 * true
