"""Checks for numbers that no sensor on a tool can measure, and for recordings that no model can learn from."""

from __future__ import annotations

import numpy as np

from palpate.modeling.textures.rates import Sampled
from palpate.modeling.textures.recording import Recording, TextureDataError
from palpate.signals.arrays import Array

LIMITS = {"acceleration": (2000.0, "m/s^2"), "speed": (5000.0, "mm/s"), "force": (200.0, "N")}
"""Numbers beyond these (200 g, 5 m/s, 20 kg) are a fault of a sensor or its unit, whatever the texture."""
STILL_M_S2 = 1e-6
"""Vibration below a sensor's resolution, which is no texture."""
REFUSED_CLIPPED, NOTED_CLIPPED = 0.05, 0.0005
"""Shares of clipped samples above which a recording is refused, and above which a note says so."""
AT_END, CROWDED, LEAST_CROWD = 0.003, 8.0, 4
"""Parameters of `clipped_share`."""
SPIKE = 12.0
"""A lone sample this many times larger than all others nearby is a sensor's fault."""


def demand_plausible(signal: Sampled) -> None:
    """Raise TextureDataError on implausible numbers, lone spikes, and clipped or constant axes of acceleration."""
    limit, unit = LIMITS[signal.what]
    size = np.abs(signal.values)
    place = np.argwhere(size > limit)
    if place.size:
        row, column = place[0]
        raise TextureDataError(
            f"{signal.where}: {signal.what}, sample {row + 1}, is {signal.values[row, column]:g} {unit}: at most"
            f" {limit:g} can be; is its unit right, or was a sensor at fault?"
        )
    if signal.what == "acceleration":
        _demand_no_spike(signal)
        values = signal.values[np.isfinite(signal.values).all(axis=1)]
        if len(values) < 2:
            raise TextureDataError(
                f"{signal.where}: {len(values)} of {len(signal.values)} samples of acceleration are finite numbers: two"
                " or more are needed"
            )
        # each axis must move: one that stands still would count as clipped all the time
        still = np.flatnonzero(np.ptp(values, axis=0) == 0) + 1
        axes = values.shape[1]
        if len(still) == axes:
            raise TextureDataError(f"{signal.where}: acceleration is constant; was the accelerometer connected?")
        if len(still):
            text = f"axis {still[0]} of {axes} is constant; was it connected?"
            if len(still) > 1:
                text = f"axes {' and '.join(map(str, still))} of {axes} are constant; were they connected?"
            raise TextureDataError(
                f"{signal.where}: acceleration, {text} Record again, or leave out what measured nothing"
            )
        share = clipped_share(values)
        if share > REFUSED_CLIPPED:
            raise TextureDataError(
                f"{signal.where}: {share:.1%} of the acceleration is clipped at the end of its sensor's range; at most"
                f" {REFUSED_CLIPPED:.0%} are accepted; press less, or use a sensor of a wider range"
            )


def clipped_share(values: Array) -> float:
    """Return the share of samples (n, axes) that accumulate at an end of an axis' range, as in a saturated sensor.

    They lie within 0.3 % of the range at its end, and are denser there by 8 times than in the next 1.2 % (a sine's
    peaks: 3.2 times), so that clipping is detected even with noise. The worst axis counts.
    """
    sound = values[np.isfinite(values).all(axis=1)]
    return max((_crowding(way * axis) for axis in sound.T for way in (1.0, -1.0)), default=0.0)


def _crowding(axis: Array) -> float:
    if len(axis) < 2:
        return 0.0
    below = (axis.max() - axis) / (np.ptp(axis) or 1.0)
    steps = np.diff(np.unique(below))
    band = max(AT_END, 0.5 * float(steps.min(initial=1.0)))  # a coarse converter's last value stands alone in it
    top, next_to_it = int((below <= band).sum()), int(((below > band) & (below <= 5 * band)).sum())
    return top / len(axis) if top >= LEAST_CROWD and top > CROWDED * next_to_it / 4 else 0.0


def demand_alive(recording: Recording) -> None:
    """Raise TextureDataError where the acceleration is silent or constant."""
    demand_level(recording.texture, float(recording.acceleration_m_s2.std()))


def demand_level(texture: str, level_m_s2: float) -> None:
    """Raise TextureDataError where acceleration of that RMS is silence."""
    if not level_m_s2 > STILL_M_S2:
        raise TextureDataError(
            f"{texture}: the acceleration between 20 and 500 Hz is silent ({level_m_s2:.2g} m/s^2 RMS); was the"
            " accelerometer connected, and the tool moved?"
        )


def oddities(recording: Recording) -> tuple[str, ...]:
    """Return notes on speed or force that is constant, so that no model can learn its effect."""
    return steady(recording.speed_mm_s, recording.force_N)


def steady(speed_mm_s: Array, force_N: Array) -> tuple[str, ...]:
    """Return the notes of `oddities` for speed and force (n,)."""
    notes = []
    for name, values, unit in (("speed", speed_mm_s, "mm/s"), ("force", force_N, "N")):
        if np.ptp(values) <= 1e-6 * max(1.0, float(np.abs(values).max())):
            notes.append(f"{name} never varies ({values.mean():.3g} {unit}): what it does cannot be learned")
    return tuple(notes)


def _demand_no_spike(signal: Sampled) -> None:
    """Raise TextureDataError on a sample far above the ten around it, and above the recording's own level."""
    values = signal.values[np.isfinite(signal.values).all(axis=1)]
    if len(values) < 12:
        return
    size = np.abs(values - np.median(values, axis=0)).max(axis=1)
    level = float(np.sqrt(np.mean(np.sort(size)[: int(0.999 * len(size)) or 1] ** 2)))
    for place in np.flatnonzero(size > SPIKE * level * 3):
        around = np.r_[size[max(0, place - 5) : place], size[place + 1 : place + 6]]
        if size[place] > SPIKE * around.max():
            raise TextureDataError(
                f"{signal.where}: acceleration, sample {place + 1}, is {values[place].tolist()} m/s^2, {SPIKE:g} times"
                " all around it: a fault of a sensor; leave that sample empty or record again"
            )
