"""A virtual texture played for a simulated hand by the renderer's own loop, and how similar it feels to the real one.

The same hand is compared on both: what the tool vibrates with on the surface, and what the renderer plays for that
hand's speed and force, by level, spectrum and friction. The weights of the three were not measured with people: they
are the study's assumption (studies/texture_similarity/README.md).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from palpate.protocols.tables import Mistake, TableFormat, read_table
from palpate.signals.arrays import Array
from palpate.signals.textures.gate import sounds
from palpate.signals.vibration_threshold import BANDS_HZ, band_edges_hz, threshold_m_s2
from palpate.studies.sessions.rig import RigError
from palpate.studies.stimuli.renderings import MET, SEED, Alike, Rendered, model_metadata

if TYPE_CHECKING:
    from palpate.signals.textures.voice import Voice

COLUMNS = ("acceleration_m_s2", "speed_mm_s", "force_N")
"""The columns of a file of a hand and what it feels on the real surface."""


def _no_numbers(wrong: Mistake) -> str:
    problem = wrong.problem or repr(wrong.column)
    return f"{wrong.path}: numbers in the columns {', '.join(COLUMNS)} are expected ({problem})"


FELT = TableFormat(
    error=RigError, unreadable=None, encoding=_no_numbers, quoting=None, missing=_no_numbers, number=_no_numbers
)
RATE_HZ = 1000.0
FRAME, HOP = 256, 128
"""Samples in the frames whose spectra are averaged, and between the starts of two frames."""
FEWEST = 3
GLASS = 0.2
"""Kinetic friction of a stylus' nib on a tablet's glass: an assumption. No method renders friction (thesis 4.8)."""
DECIMALS = 3


def render(voice: Voice, card: Path, felt: Array, friction: float | None) -> Rendered:
    """Play a voice for the hand of `felt` (3, n), and compare, except where `friction` is None."""
    from palpate.devices.render.hands import Scripted
    from palpate.devices.render.loop import AtOnce, Loop
    from palpate.devices.render.sinks import RecordingSink

    sink, hand = RecordingSink(), Scripted(felt[1].tolist(), felt[2].tolist())
    loop = Loop(voice, hand, sink, AtOnce())
    loop.run(len(hand) - 1)  # one more was made as it began
    likeness = None if friction is None else alike(felt[0], np.array(sink.samples), felt[1:], friction)
    late = {"steps": loop.made, "late": loop.ready.late, "underruns": 0, "clock": "virtual"}
    met = {name: getattr(voice.tally, name) for name in MET}
    how = {"runtime": voice.runs.runtime, "seed": SEED, "deadlines": late, "met": met}
    return Rendered({**model_metadata(card, voice.card), **how}, likeness)


def read_felt(file: Path) -> Array:
    """Return (3, n) at 1 kHz from a file with the columns t_s and COLUMNS. Raises RigError."""
    felt = np.array(list(read_table(file, COLUMNS, FELT).numbers(COLUMNS, finite=False).values()))
    if not felt.size or not np.isfinite(felt).all():
        raise RigError(f"{file}: {felt.shape[1]} rows; rows of finite numbers are expected")
    return felt


def alike(real: Array, played: Array, hand: Array, friction: float) -> Alike:
    """Compare accelerations (n,) in m/s^2 at 1 kHz under one hand (2, n), in mm/s and N; `friction` as in `Alike`.

    Only times at which the hand touches and moves count. Raises RigError on fewer than three frames of 256 ms of them,
    and on signals of other lengths or with values that are not finite.
    """
    if real.shape != played.shape or hand.shape != (2, *real.shape) or real.ndim != 1:
        raise RigError(f"{real.shape} real, {played.shape} played, hand {hand.shape}: (n,), (n,), (2, n) are expected")
    if not all(np.isfinite(signal).all() for signal in (real, played, hand)):
        raise RigError("a texture is compared with a value that is not a number")
    # the starts of frames in which the hand touches and moves throughout
    moves = sounds(*hand)
    starts = np.arange(0, max(0, len(moves) - FRAME + 1), HOP)
    frames = np.array([start for start in starts if moves[start : start + FRAME].all()], dtype=np.intp)
    if len(frames) < FEWEST:
        raise RigError(f"the hand strokes through {len(frames)} frames of {FRAME} ms; {FEWEST} at least are expected")
    one, other = _band_levels(real, frames), _band_levels(played, frames)
    felt = (one > 0) | (other > 0)
    off = (one - other)[felt]
    spectrum = float(np.sqrt(np.mean((off - off.mean()) ** 2))) if off.size else 0.0
    return Alike(_rounded(abs(_whole(one) - _whole(other))), _rounded(spectrum), _rounded(friction))


def friction_apart(kinetic: float) -> float:
    """Return how far a surface's kinetic friction is from that of the tablet's glass."""
    return abs(math.log(kinetic / GLASS))


def _band_levels(signal: Array, frames: NDArray[np.intp]) -> Array:
    """Return the level of each third octave in dB above the threshold, at least 0."""
    window = np.hanning(FRAME + 1)[:-1]
    pieces = sliding_window_view(signal, FRAME)[frames] * window
    power = (np.abs(np.fft.rfft(pieces)) ** 2).mean(axis=0) * 2 / (RATE_HZ * float(window @ window))
    hertz = np.fft.rfftfreq(FRAME, 1 / RATE_HZ)
    step = float(hertz[1])
    levels = []
    for middle in BANDS_HZ:
        low, high = band_edges_hz(middle)
        share = np.clip((np.minimum(hertz + step / 2, high) - np.maximum(hertz - step / 2, low)) / step, 0.0, 1.0)
        over = math.sqrt(float(share @ power) * step) / threshold_m_s2(middle)
        levels.append(20 * math.log10(over) if over > 1 else 0.0)
    return np.array(levels)


def _whole(levels: Array) -> float:
    """Return the level of all perceptible bands together, in dB above the threshold."""
    felt = levels[levels > 0]
    return 10 * math.log10(float(np.sum(10 ** (felt / 10)))) if felt.size else 0.0


def _rounded(value: float) -> float:
    return round(value, DECIMALS) + 0.0
