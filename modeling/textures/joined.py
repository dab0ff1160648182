"""A recording of several pieces: explorations of one texture, or what lies between holes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from palpate.modeling.textures.recording import Recording
from palpate.signals.arrays import Array


@dataclass(frozen=True)
class Joined(Recording):
    """A recording whose samples do not all follow one another: at each of `borders` something new begins."""

    borders: tuple[int, ...] = ()


def pieces_of(recording: Recording) -> tuple[tuple[int, int], ...]:
    """The stretches [start, stop) within which samples follow one another."""
    inner = recording.borders if isinstance(recording, Joined) else ()
    edges = (0, *inner, recording.signals.shape[1])
    return tuple(pairwise(edges))


def joined(
    texture: str, label: str, pieces: Sequence[Array], made_from: tuple[str, ...], notes: tuple[str, ...]
) -> Recording:
    """Pieces (3, n) as one recording."""
    signals = np.concatenate(pieces, axis=1)
    if len(pieces) == 1:
        return Recording(texture, label, signals, made_from, notes)
    borders = np.cumsum([piece.shape[1] for piece in pieces])[:-1]
    return Joined(texture, label, signals, made_from, notes, tuple(int(each) for each in borders))
