"""A three-axis analogue accelerometer, the ADXL335: volts to m/s^2, its calibration in six positions, its limits.

Its output is ratiometric: sensitivity and zero-g voltage grow with the supply (Analog Devices, ADXL335 data sheet,
Rev. B, page 12).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import repeat
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.devices.daq.twin import PIECE, Ideal
from palpate.devices.daq.voltage_check import VoltageCheck
from palpate.devices.device import DeviceError, DeviceFault, Reading, Signal
from palpate.protocols.wording import count
from palpate.signals import GRAVITY_M_S2
from palpate.signals.arrays import Array

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

AXES = ("x", "y", "z")
POSITIONS = ("+x", "-x", "+y", "-y", "+z", "-z")
"""The axis that points up, and so measures one g, in the order of a calibration's readings."""
MISPLACED_G = 0.05
"""A larger residual is not a mounting error: a position was swapped, or the sensor moved."""
SHARE_OF_SUPPLY = (0.07, 0.13)
"""Plausible range of the sensitivity per g as a share of the supply; the data sheet's is 0.09 to 0.11."""
ONE_G = 0.05
"""Greatest deviation of the mean's length from one g at rest; the calibrated data sheet's zero-g errors are smaller."""
NOISY_G = 0.05
"""Greatest noise floor per axis of a sensor at rest; 300 ug/sqrt(Hz) over 1600 Hz are 0.015 g."""
SETTLED = 1e-9


@dataclass(frozen=True)
class Scaling:
    """Volts per g and volts at no acceleration, per axis, both of shape (3,), at the supply voltage of the
    calibration.
    """

    sensitivity_V: Array
    zero_V: Array
    supply_V: float

    def at(self, supply_V: float) -> Scaling:
        """Return the same sensor at another supply voltage: zero and sensitivity scale with it."""
        ratio = supply_V / self.supply_V
        return Scaling(self.sensitivity_V * ratio, self.zero_V * ratio, supply_V)


@dataclass(frozen=True)
class SixPositions:
    """A calibration: the scaling, and its residual in each position (RMS over the axes, in g)."""

    scaling: Scaling
    residual_g: Mapping[str, float]

    @property
    def worst_g(self) -> float:
        """Return the residual of the worst position."""
        return max(self.residual_g.values())


def acceleration(volts: Array, scaling: Scaling) -> Array:
    """Return the acceleration in m/s^2, including gravity, in the shape of the volts (n, 3)."""
    return np.asarray((volts - scaling.zero_V) * (GRAVITY_M_S2 / scaling.sensitivity_V), np.float64)


def calibrate(readings: Mapping[str, ArrayLike], supply_V: float) -> SixPositions:
    """Fit sensitivity and zero-g volts per axis to six positions at rest (`POSITIONS`: the axis that points up).

    Each reading holds volts of shape (n, 3) or their mean of shape (3,). Per axis and by least squares over all six,
    volts = zero + sensitivity x {+1, -1, 0, 0, 0, 0}; the residuals show how upright the axes were.

    Raises:
        DeviceError: a missing position, a voltage that is not finite, an implausible sensitivity, or a position with a
            residual above 0.05 g.
    """
    means = np.empty((len(POSITIONS), 3))
    for row, position in enumerate(POSITIONS):
        if position not in readings:
            raise DeviceError(f"six positions: {position} is missing; measure with each axis up and down")
        volts = np.atleast_2d(np.asarray(readings[position], np.float64))
        if volts.ndim != 2 or volts.shape[1] != 3 or not volts.size:
            raise DeviceError(f"six positions: {position} has volts of shape {volts.shape}; (n, 3) is expected")
        if not np.isfinite(volts).all():
            raise DeviceError(f"six positions: {position} holds a value that is not a number; measure it again")
        means[row] = volts.mean(axis=0)
    felt = np.repeat(np.eye(3), 2, axis=0) * np.tile([1.0, -1.0], 3)[:, np.newaxis]
    zero, sensitivity = means.mean(axis=0), (means * felt).sum(axis=0) / 2
    low, high = (share * supply_V for share in SHARE_OF_SUPPLY)
    for axis, per_g in zip(AXES, sensitivity, strict=True):
        if not low <= per_g <= high:
            raise DeviceError(
                f"six positions: {axis} gives {per_g:.3f} V per g at a supply of {supply_V:g} V;"
                f" {low:.2g} to {high:.2g} are expected: see that each axis was up and down, the wires, and the supply"
            )
    off = (means - zero) / sensitivity - felt
    residual = dict(zip(POSITIONS, np.sqrt((off**2).mean(axis=1)).tolist(), strict=True))
    worst = max(residual, key=lambda position: residual[position])
    if residual[worst] > MISPLACED_G:
        raise DeviceError(
            f"six positions: {worst} is off by {residual[worst]:.3f} g (RMS); were two positions swapped, did it move,"
            f" or is it tilted? At most {MISPLACED_G:g} g are let pass; measure again"
        )
    return SixPositions(Scaling(sensitivity, zero, supply_V), residual)


@dataclass
class Accelerometer:
    """A transducer from volts of three axes to m/s^2. Samples beyond the maker's `full_scale_g` count as clipped."""

    device: str
    signal: Signal
    scaling: Scaling
    watch: VoltageCheck
    full_scale_g: float
    clipped_s: float
    calibrated: str | None
    clipped: int = 0
    longest: int = 0
    run: NDArray[np.int64] = field(default_factory=lambda: np.zeros(3, np.int64))

    def begin(self) -> None:
        """Reset the state, because the samples begin anew."""
        self.watch.begin()
        self.clipped, self.longest, self.run = 0, 0, np.zeros(3, np.int64)

    def rows(self, volts: Array) -> Array:
        """Return the acceleration of shape (n, 3); clipped samples are counted and returned unchanged.

        Raises DeviceFault: not_a_number, stuck, over_range (clipped without a break for `clipped_s`).
        """
        at_end = self.watch.see(volts)
        rows = acceleration(volts, self.scaling)
        over = at_end | (np.abs(rows) > self.full_scale_g * GRAVITY_M_S2)
        self.clipped += int(over.any(axis=1).sum())
        runs = np.array([_longest(over[:, axis], int(self.run[axis])) for axis in range(3)])
        self.run, self.longest = runs[:, 1], max(self.longest, int(runs[:, 0].max()))
        axis = int(runs[:, 0].argmax())
        if runs[axis, 0] >= max(1.0, self.clipped_s * self.signal.rate_hz):
            raise DeviceFault(
                self.device,
                "over_range",
                f"{self.device}: {AXES[axis]} is clipped at {volts[-1, axis]:.3g} V for {self.clipped_s:g} s; it was"
                " shaken too hard, or its supply or cable is broken",
            )
        return rows

    def zero(self, _volts: Array, /) -> None:
        """Raise DeviceError, because gravity always acts on the sensor."""
        raise DeviceError(f"{self.device}: an accelerometer has no zero to take; calibrate it in six positions")

    def complaint(self, reading: Reading) -> str | None:
        """Return what is wrong with a reading that should be one g and quiet; None if nothing is."""
        length = float(np.linalg.norm(reading.mean)) / GRAVITY_M_S2
        noisy = max(reading.noise) / GRAVITY_M_S2
        if abs(length - 1) > ONE_G:
            return f"it feels {length:.3f} g at rest; 1 is expected: calibrate it, and see its supply"
        if noisy > NOISY_G:
            return f"it is noisy: {noisy:.3f} g (SD) at rest; did it move, or is its supply noisy?"
        return f"{count(self.clipped, 'sample')} clipped at rest" if self.clipped else None

    def describe(self) -> Mapping[str, Any]:
        """Return the scaling in use and the limits."""
        return {
            "sensitivity_V_per_g": self.scaling.sensitivity_V.tolist(),
            "zero_g_V": self.scaling.zero_V.tolist(),
            "supply_V": self.scaling.supply_V,
            "full_scale_g": self.full_scale_g,
        }

    @property
    def facts(self) -> Mapping[str, str]:
        """Return how many samples were clipped since the start, and for how long at a time."""
        return {
            "samples clipped": str(self.clipped),
            "longest clipping": f"{1000 * self.longest / self.signal.rate_hz:.3g} ms",
        }


def acceleration_volts(scaling: Scaling, bandwidth_hz: Sequence[float]) -> Ideal:
    """Return the sensor's ideal volts in a scene: first-order low-pass per axis, scaling, limits of its supply."""

    def volts(scene: Scene | None, rate_hz: float) -> Iterator[Array]:
        rest = np.tile([0.0, 0.0, GRAVITY_M_S2], (PIECE, 1))
        pieces = repeat(rest) if scene is None else scene.acceleration_m_s2(rate_hz)
        for felt in _low_passed(pieces, [np.exp(-2 * np.pi * band_hz / rate_hz) for band_hz in bandwidth_hz]):
            free = scaling.zero_V + felt * (scaling.sensitivity_V / GRAVITY_M_S2)
            yield np.clip(free, 0.0, scaling.supply_V)

    return volts


def _low_passed(pieces: Iterator[Array], holds: Sequence[float]) -> Iterator[Array]:
    """Yield y[n] = hold y[n-1] + (1 - hold) x[n] per axis, computed as a sum, from rest at the first sample."""
    # After so many samples what is held has gone.
    taps = [1 if hold <= SETTLED else 1 + int(np.ceil(np.log(SETTLED) / np.log(hold))) for hold in holds]
    kernels = [(1 - hold) * hold ** np.arange(count) for hold, count in zip(holds, taps, strict=True)]
    long = max(map(len, kernels))
    before: Array | None = None
    for piece in pieces:
        if not len(piece):
            continue
        past = np.repeat(piece[:1], long - 1, axis=0) if before is None else before
        joined = np.concatenate([past, piece])
        before = joined[len(joined) - (long - 1) :]
        yield np.stack(
            [
                np.convolve(joined[long - len(kernel) :, axis], kernel, "valid") / kernel.sum()
                for axis, kernel in enumerate(kernels)
            ],
            axis=1,
        )


def _longest(over: NDArray[np.bool_], before: int) -> tuple[int, int]:
    """Return the longest run of true values, after `before` of them at the start, and the run at the end."""
    gaps = np.flatnonzero(~over)
    if not gaps.size:
        return before + len(over), before + len(over)
    runs = np.diff(gaps, prepend=-1, append=len(over)) - 1
    runs[0] += before
    return int(runs.max()), int(runs[-1])
