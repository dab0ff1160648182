"""The replacements of the Fourier block in Table 4.2: mel-frequency cepstral coefficients, and wavelets.

Both are an encoder between fixed matrices, from (batch, length) to the same shape, as the Fourier block is.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from palpate.modeling.textures.foten_network import SpectrumEncoder
from palpate.modeling.textures.recording import RATE_HZ

BANDS, COEFFICIENTS = 16, 13
FLOOR = 1e-6
"""Added to the energy of every mel band, in squared SDs of the acceleration, so that the log of silence is finite."""
TIMES = 2
"""The factor by which the window is padded before its spectrum, since bands are narrower than its bins."""
LEVELS = 2
"""Levels of the wavelet decomposition."""
DB2 = (1 + math.sqrt(3), 3 + math.sqrt(3), 3 - math.sqrt(3), 1 - math.sqrt(3))
"""Daubechies' filter of four taps, times 4 sqrt(2) (Daubechies 1988)."""


def mel(hz: Tensor) -> Tensor:
    """Return the mel scale of HTK and most libraries: 2595 log10(1 + hz / 700)."""
    return 2595 * torch.log10(1 + hz / 700)


def mel_bands(bins: int) -> Tensor:
    """Return triangular filters (BANDS, bins), equally wide in mel from 0 Hz to Nyquist, for a real spectrum."""
    hz = torch.linspace(0, RATE_HZ / 2, bins, dtype=torch.float64)
    corners = torch.linspace(0, float(mel(hz[-1:])), BANDS + 2, dtype=torch.float64)
    low, middle, high = corners[:-2, None], corners[1:-1, None], corners[2:, None]
    here = mel(hz)
    return torch.minimum((here - low) / (middle - low), (high - here) / (high - middle)).clamp(min=0).float()


def cosines(rows: int, columns: int) -> Tensor:
    """Return the first rows of the orthonormal discrete cosine transform of type II."""
    turns = torch.outer(torch.arange(rows).double(), torch.arange(columns).double() + 0.5) * math.pi / columns
    matrix = math.sqrt(2 / columns) * turns.cos()
    matrix[0] /= math.sqrt(2)
    return matrix.float()


class MelBlock(nn.Module):
    """A block that encodes the window's mel-frequency cepstral coefficients (Davis and Mermelstein 1980).

    Hann window; power of the padded spectrum; 16 mel bands; log; cosine transform; 13 coefficients; encoder; dense
    layer back to the window.
    """

    spectrum: Tensor
    bands: Tensor
    floor: Tensor
    cosines: Tensor

    def __init__(self, length: int, dropout: float) -> None:
        super().__init__()
        padded = TIMES * length
        taper = torch.hann_window(length + 2, periodic=False, dtype=torch.float64)[1:-1]
        turns = (
            torch.outer(torch.arange(padded // 2 + 1).double(), torch.arange(length).double()) * 2 * math.pi / padded
        )
        bands = mel_bands(padded // 2 + 1)
        self.register_buffer("spectrum", (torch.cat([turns.cos(), turns.sin()]) * taper).float())
        self.register_buffer("bands", torch.cat([bands, bands], dim=1))
        self.register_buffer("floor", torch.full((1,), FLOOR))
        self.register_buffer("cosines", cosines(COEFFICIENTS, BANDS))
        self.encoder = SpectrumEncoder(COEFFICIENTS, dropout)
        self.dense = nn.Linear(COEFFICIENTS, length)

    def forward(self, x: Tensor) -> Tensor:
        """Return the output for (batch, length), in the same shape."""
        energy = (x @ self.spectrum.T).square() @ self.bands.T + self.floor
        result: Tensor = self.dense(self.encoder(energy.clamp(min=1e-10).log() @ self.cosines.T))
        return result


def wavelet(length: int) -> tuple[Tensor, Tensor]:
    """Return Daubechies' four-tap wavelet transform (padded, length) and its inverse (length, padded).

    It is periodic; the length is padded to a multiple of 4 with the newest sample. Coarsest scale first.
    """
    padded = 2**LEVELS * math.ceil(length / 2**LEVELS)
    whole = torch.eye(padded, dtype=torch.float64)
    for level in range(LEVELS):
        size = padded >> level
        # one level: smooth halves above, details below; an orthogonal matrix
        low = torch.tensor(DB2, dtype=torch.float64) / (4 * math.sqrt(2))
        high = low.flip(0) * torch.tensor([1.0, -1.0, 1.0, -1.0], dtype=torch.float64)
        stage = torch.zeros(size, size, dtype=torch.float64)
        for row in range(size // 2):
            for tap in range(4):
                place = (2 * row + tap) % size
                stage[row, place] += low[tap]
                stage[size // 2 + row, place] += high[tap]
        whole[:size] = stage @ whole[:size]
    repeat = torch.eye(padded, length, dtype=torch.float64)
    repeat[length:, -1] = 1
    return (whole @ repeat).float(), whole.T[:length].float()


class WaveletBlock(nn.Module):
    """A block that encodes the window's wavelet coefficients and applies the inverse transform."""

    matrix: Tensor
    back: Tensor

    def __init__(self, length: int, dropout: float) -> None:
        super().__init__()
        matrix, back = wavelet(length)
        self.register_buffer("matrix", matrix)
        self.register_buffer("back", back)
        self.encoder = SpectrumEncoder(len(matrix), dropout)

    def forward(self, x: Tensor) -> Tensor:
        """Return the output for (batch, length), in the same shape."""
        result: Tensor = self.encoder(x @ self.matrix.T) @ self.back.T
        return result
