"""Random fields over a sample that repeats at its borders: random numbers, spectra, lattices.

Random numbers come from the raw stream of PCG64, which NumPy keeps unchanged between versions (NEP 19): its 53 leading
bits are the number. So a field is the same on every machine but for the rounding of the Fourier transform.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from palpate.protocols.keyed import Key, keyed_bits

Field = NDArray[np.float32]
SIZE_MM = 100.0
"""Side of a sample (thesis 3.3.1)."""
PIXELS = 1568
"""Points along a side: 64 um apart, and the side of a photo (3.4.2)."""


def chance(count: int, *key: Key) -> NDArray[np.float64]:
    """Return uniform random numbers in [0, 1), seeded by the key."""
    raw = np.random.PCG64(keyed_bits(*key)).random_raw(count)
    return np.asarray((raw >> np.uint64(11)) * 2.0**-53, dtype=np.float64)


def wave_numbers(pixels: int) -> tuple[Field, Field]:
    """Return the wave numbers in cycles/mm along x (columns of rfft2) and y (which points up, as rows go down)."""
    along_x = scipy.fft.rfftfreq(pixels, SIZE_MM / pixels).astype(np.float32)
    along_y = -scipy.fft.fftfreq(pixels, SIZE_MM / pixels).astype(np.float32)
    return along_x[np.newaxis, :], along_y[:, np.newaxis]


def noise(pixels: int, *key: Key) -> NDArray[np.complex64]:
    """Return white noise, seeded by the key, as its Fourier transform (rfft2)."""
    drawn = chance(pixels * pixels, *key).astype(np.float32).reshape(pixels, pixels)
    return np.asarray(scipy.fft.rfft2(drawn, workers=-1), dtype=np.complex64)


def coloured(pixels: int, amplitude: Field, spectrum: NDArray[np.complex64]) -> Field:
    """Return white noise shaped by an amplitude over wave numbers; mean 0, RMS 1."""
    spectrum = spectrum * amplitude
    spectrum[0, 0] = 0
    shaped = scipy.fft.irfft2(spectrum, s=(pixels, pixels), overwrite_x=True, workers=-1)
    field = np.asarray(shaped, dtype=np.float32)
    field /= np.float32(max(float(field.std()), 1e-30))
    return field


def self_affine(
    pixels: int, correlation_mm: float, hurst: float, finest_mm: float, stretch: float, grain_deg: float, *key: Key
) -> Field:
    """Return a self-affine field of RMS 1, stretched `stretch` times along the grain.

    Its power falls as (1 + (2 pi q L)^2)^-(1+H) beyond the correlation length L, and is cut off at the finest
    wavelength. Source: the k-correlation (ABC) surface spectrum.
    """
    shape = k_correlation(pixels, correlation_mm, hurst, finest_mm, stretch, grain_deg)
    return coloured(pixels, shape, noise(pixels, *key))


def k_correlation(
    pixels: int, correlation_mm: float, hurst: float, finest_mm: float, stretch: float, grain_deg: float
) -> Field:
    """Return the amplitude of `self_affine` over wave numbers."""
    along, across = turned(*wave_numbers(pixels), grain_deg)
    # Drawn out along the grain: its wave numbers count `stretch` times more.
    square = (along * np.float32(stretch)) ** 2 + across**2
    fall = np.log1p(np.float32((2 * math.pi * correlation_mm) ** 2) * square)
    fall *= np.float32(-0.5 * (1 + hurst))
    square *= np.float32(-0.5 * finest_mm**2)
    fall += square
    return np.asarray(np.exp(fall, out=fall), dtype=np.float32)


def narrow(pixels: int, wavelength_mm: float, *key: Key) -> Field:
    """Return a field of about one wavelength in every direction (Gaussian band of 25 %). RMS 1."""
    x, y = wave_numbers(pixels)
    off = (np.hypot(x, y) * np.float32(wavelength_mm) - 1) / np.float32(0.25)
    return coloured(pixels, np.exp(-0.25 * off**2).astype(np.float32), noise(pixels, *key))


def felted(pixels: int, width_mm: float, length_mm: float, layers: int, *key: Key) -> tuple[Field, Field]:
    """Return pressed fibres in all directions: the highest of several stretched fields (0..1), and which is on top.

    The layers share one noise: each keeps waves of another direction, so they have little in common.
    """
    top, which = np.full((pixels, pixels), -9, np.float32), np.zeros((pixels, pixels), np.float32)
    spectrum = noise(pixels, *key, "fibres")
    for layer in range(layers):
        degrees = 180 * (layer + 0.6 * float(chance(1, *key, layer)[0])) / layers
        shape = k_correlation(pixels, width_mm, 1.0, width_mm / 2, length_mm / width_mm, degrees)
        one = coloured(pixels, shape, spectrum)
        np.copyto(which, np.float32(layer / (layers - 1)), where=one > top)
        np.maximum(top, one, out=top)
    return np.clip((top + np.float32(0.5)) / 3, 0, 1), which


def turned(x: Field, y: Field, degrees: float) -> tuple[Field, Field]:
    """Return the coordinates along a direction and across it."""
    cosine, sine = np.float32(math.cos(math.radians(degrees))), np.float32(math.sin(math.radians(degrees)))
    return x * cosine + y * sine, y * cosine - x * sine


def shares(pixels: int) -> tuple[Field, Field]:
    """Return where each point lies, as shares of the side: x to the right, y up."""
    middle = ((np.arange(pixels) + 0.5) / pixels).astype(np.float32)
    return middle[np.newaxis, :], middle[::-1, np.newaxis]


def lattice(
    pixels: int, pitch_mm: float, aspect: float, degrees: float, irregular: float, repeat: int, *key: Key
) -> tuple[Field, Field]:
    """Return coordinates counted in periods, along a direction (`pitch_mm`) and across it (`pitch_mm` times `aspect`).

    Multiples of `repeat` periods fit the sample: pitch and direction are the nearest that repeat at its borders.
    `irregular` shifts each place by that many periods (RMS), smoothly over about three periods.
    """
    x, y = shares(pixels)
    radians = math.radians(degrees)
    directions = (
        (math.cos(radians), math.sin(radians), pitch_mm),
        (-math.sin(radians), math.cos(radians), pitch_mm * aspect),
    )
    counted = []
    for axis, (to_x, to_y, pitch) in enumerate(directions):
        along_x, along_y = (repeat * round(SIZE_MM * axis / pitch / repeat) for axis in (to_x, to_y))
        place = np.float32(along_x) * x + np.float32(along_y) * y
        if irregular > 0:
            place = place + np.float32(irregular) * narrow(pixels, 3 * pitch_mm * max(1, aspect), *key, axis)
        counted.append(place)
    return counted[0], counted[1]
