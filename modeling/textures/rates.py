"""Signals of any rate on one grid of 1 kHz, and speed from positions (thesis 4.3.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.textures.recording import RATE_HZ, TextureDataError
from palpate.signals.aligning.aligned import Aligned, align, grid_points
from palpate.signals.aligning.methods import METHODS
from palpate.signals.aligning.refusals import AlignError
from palpate.signals.aligning.speed import slope, velocity
from palpate.signals.arrays import Array

SLOWEST_HZ = {"acceleration": 100.0, "force": 10.0, "position": 20.0, "speed": 10.0}
"""A signal with a lower rate does not contain what it is recorded for."""
FASTEST_HZ = 250_000.0
"""Faster than any sensor of touch, so the times must be in another unit."""
LONGEST_GAP_S = {"acceleration": 0.0015, "force": 0.02, "position": 0.02, "speed": 0.15}
"""Gaps up to this are bridged: one sample of vibration, half a period of 25 Hz, a marker hidden for a moment."""
JITTER = 0.05
"""The deviation from an even clock, as a share of a step, up to which times are as written; rounding is added."""
LOST = 1.5
"""The number of steps between two times from which samples were lost between them."""
SPEED_S = 0.05
"""Seconds of positions that a parabola is fitted to: 7 samples at 120 Hz (docs/reference/alignment.md)."""
DEGREE = 2


@dataclass(frozen=True)
class Sampled:
    """One signal: the quantity `what`, values (n, channels) at rising times (n,), at about `rate_hz`.

    `written_s` is the rounding of its written times. `where` names it in messages.
    """

    what: str
    times_s: Array
    values: Array
    rate_hz: float
    where: str
    written_s: float = 0.0

    @property
    def lasts_s(self) -> float:
        """The seconds from the first sample to the end of the last."""
        return float(self.times_s[-1] - self.times_s[0]) + 1.0 / self.rate_hz

    @property
    def known_s(self) -> float:
        """The seconds for which all its channels are finite."""
        return int(np.isfinite(self.values).all(axis=1).sum()) / self.rate_hz


def evenly(what: str, values: Array, rate_hz: float, where: str) -> Sampled:
    """Return a signal (n,) or (n, channels) that was sampled at exactly that rate from second 0 on."""
    table = np.asarray(values, dtype=np.float64)
    table = table[:, None] if table.ndim == 1 else table
    return Sampled(what, np.arange(len(table)) / rate_hz, table, float(rate_hz), where)


def on_grid(signals: Sequence[Sampled]) -> tuple[list[Array], NDArray[np.bool_], tuple[str, ...]]:
    """Return the signals at 1 kHz over their common time, (m, channels) each; where all are known (m,); and notes.

    Signals are low-passed before their rate is reduced; short gaps are bridged, long ones stay unknown. Raises
    TextureDataError on rates that are too low, implausible times, and signals without a common time.
    """
    evened = [_even(signal) for signal in signals]
    try:
        start = max(signal.times_s[0] for signal, _ in evened)
        stop = min(signal.times_s[-1] for signal, _ in evened)
        grid_s = grid_points(start, stop, RATE_HZ)
    except AlignError as error:
        raise TextureDataError(f"{signals[0].where}: its signals share no time: {error}") from None
    aligned = [_align(signal, grid_s, RATE_HZ, "bandlimited", LONGEST_GAP_S[signal.what]) for signal, _ in evened]
    known = np.logical_and.reduce([np.isfinite(signal.values).all(axis=1) for signal in aligned])
    notes = tuple(note for _, notes in evened for note in notes)
    bridged = [
        (signal.what, int(signal_values.bridged.sum())) for signal, signal_values in zip(signals, aligned, strict=True)
    ]
    return (
        [signal.values for signal in aligned],
        known,
        (*notes, *tuple(f"{what}: {count} samples bridged in short holes" for what, count in bridged if count)),
    )


def speed_from(position: Sampled, normal: Sequence[float] = (0.0, 0.0, 1.0)) -> Sampled:
    """Return the velocity (n, axes) in mm/s of positions in mm, in the plane with that normal; NaN where not known.

    Two axes are the plane themselves. The velocity's length is the speed; it must be computed at 1 kHz, which preserves
    the sharp minimum of a turn. Raises TextureDataError.
    """
    even, _ = _even(position)
    window = max(DEGREE + 1, 2 * (round(SPEED_S * even.rate_hz) // 2) + 1)
    breaks = np.flatnonzero(np.diff(even.times_s) > LOST / even.rate_hz) + 1
    try:
        estimate = slope(window, DEGREE, even.rate_hz, "middle")
        velocities = np.concatenate([velocity(stretch, estimate) for stretch in np.split(even.values, breaks)])
    except AlignError as error:
        raise TextureDataError(f"{position.where}: {error}") from None
    return replace(even, what="speed", values=projected(velocities, normal))


def projected(vectors: Array, normal: Sequence[float]) -> Array:
    """Return vectors (n, 3) projected on the plane with that normal; (n, 2) lie in it already."""
    if vectors.shape[1] < len(normal):
        return vectors
    unit = _unit(normal)
    return vectors - np.outer(vectors @ unit, unit)


def along(vectors: Array, normal: Sequence[float]) -> Array:
    """Return the part (n,) of vectors (n, 3) along a normal; (n, 1) is that part already."""
    return vectors[:, 0] if vectors.shape[1] == 1 else vectors @ _unit(normal)


def _unit(normal: Sequence[float]) -> Array:
    given = np.asarray(normal, dtype=np.float64)
    length = float(np.linalg.norm(given))
    if given.shape != (3,) or not (np.isfinite(length) and length > 0):
        raise TextureDataError(f"the normal {list(normal)} has no direction; three numbers are expected")
    return given / length


def _even(signal: Sampled) -> tuple[Sampled, tuple[str, ...]]:
    """Return the signal at times of an even clock: fitted to its written times, or with interpolated values."""
    _demand_rate(signal)
    steps = np.maximum(np.rint(np.diff(signal.times_s) * signal.rate_hz), 1.0)
    for places in (np.arange(len(signal.times_s), dtype=np.float64), np.r_[0.0, np.cumsum(steps)]):
        middle = places.mean()
        apart = places - middle
        spread = float(apart @ apart)
        pace = float(apart @ (signal.times_s - signal.times_s.mean())) / spread if spread else 0.0
        straight = np.asarray(signal.times_s.mean() + pace * apart)
        if float(np.abs(signal.times_s - straight).max()) <= JITTER / signal.rate_hz + signal.written_s:
            paced_hz = float((places[-1] - places[0]) / (straight[-1] - straight[0]))
            return replace(signal, times_s=straight, rate_hz=paced_hz), ()
    # bring samples of an uneven clock to even times of its mean rate; holes stay
    times_s = signal.times_s
    even_s = times_s[0] + np.arange(int((times_s[-1] - times_s[0]) * signal.rate_hz) + 1) / signal.rate_hz
    longest_gap_s = max(LONGEST_GAP_S[signal.what], LOST / signal.rate_hz)
    aligned = _align(signal, even_s, signal.rate_hz, "pchip", longest_gap_s)
    note = f"{signal.what}: its times are uneven; values between samples are interpolated (monotone cubics)"
    return replace(signal, times_s=even_s, values=aligned.values), (note,)


def _demand_rate(signal: Sampled) -> None:
    least = SLOWEST_HZ[signal.what]
    if not least <= signal.rate_hz <= FASTEST_HZ:
        raise TextureDataError(
            f"{signal.where}: {signal.what} at {signal.rate_hz:.4g} Hz: {least:g} to {FASTEST_HZ:g} Hz are expected;"
            " is the unit of the times right?"
        )
    if len(signal.times_s) < 2 or len(signal.times_s) != len(signal.values):
        raise TextureDataError(f"{signal.where}: {signal.what}: {len(signal.values)} samples: two or more are needed")
    if not np.isfinite(signal.times_s).all() or (np.diff(signal.times_s) < 0).any():
        raise TextureDataError(f"{signal.where}: {signal.what}: its times must be finite and rise")


def _align(signal: Sampled, grid_s: Array, grid_hz: float, method: str, longest_gap_s: float) -> Aligned:
    """Return the signal at the times of a grid. Raises TextureDataError where that is impossible."""
    try:
        return align(
            signal.times_s, signal.values, grid_s, METHODS[method], rate_hz=signal.rate_hz, grid_hz=grid_hz,
            longest_gap_s=longest_gap_s,
        )  # fmt: skip
    except AlignError as error:
        raise TextureDataError(f"{signal.where}: {signal.what}: {error}") from None
