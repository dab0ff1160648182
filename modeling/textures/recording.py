"""One texture's recording as models see it: acceleration on one axis, speed and force, all at 1 kHz (thesis 4.3.3)."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from palpate.signals.arrays import Array

RATE_HZ = 1000.0
CHANNELS = 3
"""The order of the channels: acceleration in m/s^2, speed in mm/s, force in N."""


class TextureDataError(ValueError):
    """The data cannot be used to learn a texture; the message says where, why, and what to do."""


class TooShort(TextureDataError):
    """Trimming leaves nothing of the recording."""


@dataclass(frozen=True)
class Recording:
    """A recording that was filtered and brought to 1 kHz.

    `signals` is (3, n): acceleration (DFT321 of its axes, band-passed), speed and force (low-passed). `notes` describe
    its processing for the reader; `made_from` names its inputs with their SHA-256.
    """

    texture: str
    label: str
    signals: Array
    made_from: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.signals.ndim != 2 or len(self.signals) != CHANNELS:
            raise TextureDataError(f"{self.texture}: signals of shape {self.signals.shape}; (3, n) are expected.")
        if not np.isfinite(self.signals).all():
            raise TextureDataError(f"{self.texture}: a sample is not finite; correct or leave out its stretch.")

    @property
    def acceleration_m_s2(self) -> Array:
        """Acceleration in m/s^2, (n,)."""
        result: Array = self.signals[0]
        return result

    @property
    def speed_mm_s(self) -> Array:
        """Speed in mm/s, (n,), never below 0."""
        result: Array = self.signals[1]
        return result

    @property
    def force_N(self) -> Array:
        """Normal force in N, (n,)."""
        result: Array = self.signals[2]
        return result

    @property
    def seconds(self) -> float:
        """The duration in seconds."""
        return float(self.signals.shape[1] / RATE_HZ)


@dataclass(frozen=True)
class Parts:
    """Stretches [start, stop) of one recording, in order, none in two parts; no window reaches over a border."""

    train: tuple[tuple[int, int], ...]
    validation: tuple[tuple[int, int], ...]
    test: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Scale:
    """Mean and SD (3,) of the training part; a constant channel has SD 1."""

    mean: Array
    sd: Array

    def down(self, signals: Array) -> Array:
        """Standardise signals (..., 3, n)."""
        return (signals - self.mean[:, None]) / self.sd[:, None]


@dataclass(frozen=True)
class Windows:
    """Windows (n, 3, window) in units, oldest first, the acceleration (n,) that follows each, and its index."""

    given: NDArray[np.float64]
    target: Array
    at: NDArray[np.int64]


def recording_digest(recording: Recording) -> str:
    """Return the SHA-256 of a recording's name and samples."""
    digest = hashlib.sha256(f"{recording.texture} {recording.signals.shape}".encode())
    digest.update(np.ascontiguousarray(recording.signals, dtype="<f8").tobytes())
    return digest.hexdigest()


@dataclass(frozen=True)
class Joined(Recording):
    """A recording whose samples are not all consecutive: at each of `borders` a new piece begins."""

    borders: tuple[int, ...] = ()


def pieces_of(recording: Recording) -> tuple[tuple[int, int], ...]:
    """Return the stretches [start, stop) of consecutive samples."""
    inner = recording.borders if isinstance(recording, Joined) else ()
    edges = (0, *inner, recording.signals.shape[1])
    return tuple(pairwise(edges))


def joined(
    texture: str, label: str, pieces: Sequence[Array], made_from: tuple[str, ...], notes: tuple[str, ...]
) -> Recording:
    """Join pieces (3, n) into one recording, with borders between them."""
    signals = np.concatenate(pieces, axis=1)
    if len(pieces) == 1:
        return Recording(texture, label, signals, made_from, notes)
    borders = np.cumsum([piece.shape[1] for piece in pieces])[:-1]
    return Joined(texture, label, signals, made_from, notes, tuple(int(border) for border in borders))
