"""Where a door's hinge is, from one recorded swing of a marker, and how far the door is open (thesis 5.3.1.1)."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.signals import DeviceError

Array = NDArray[np.float64]
Point = tuple[float, float, float]
FEWEST = 30
NARROWEST_DEG = 10.0
LARGEST_RESIDUAL = 0.05
"""Of the radius: above it the marker did not go round a hinge."""
ROUNDS = 50


@dataclass(frozen=True)
class Hinge:
    """A hinge's axis, the circle that the marker goes on, and what the fit left over, in mm.

    Seen against `axis` the door opens counterclockwise from `closed`, a unit vector from the axis to the closed
    marker. `around_mm` is the RMS distance from the circle within its plane, `along_mm` the one along the axis.
    `centre_mm` is known to within `centre_error_mm` (standard error, the larger of the plane's two directions).
    """

    centre: Point
    axis: Point
    closed: Point
    radius_mm: float
    around_mm: float
    along_mm: float
    centre_error_mm: float
    arc_deg: float
    samples: int

    def save(self, path: Path) -> None:
        """Write it as JSON."""
        path.write_text(json.dumps(asdict(self), indent=1) + "\n", encoding="utf-8")

    @property
    def angle_error_deg(self) -> float:
        """Standard deviation of one angle by the noise that the calibration saw."""
        return math.degrees(self.around_mm / self.radius_mm)


def load_hinge(path: Path) -> Hinge:
    """Read what `save` wrote. Raises DeviceError."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        centre, axis, closed = (_point(found.pop(name)) for name in ("centre", "axis", "closed"))
        hinge = Hinge(centre, axis, closed, **found)
        numbers = [*hinge.centre, *hinge.axis, *hinge.closed, hinge.radius_mm]
        sound = all(map(math.isfinite, numbers)) and hinge.radius_mm > 0
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as problem:
        raise DeviceError(f"{path}: not a hinge's calibration: {problem}") from None
    if not sound:
        raise DeviceError(f"{path}: a hinge with finite numbers and a radius above 0 is expected.")
    return hinge


def fit_hinge(positions: Array, closed_samples: int = 10) -> Hinge:
    """Fit a circle in space to the marker's positions (n, 3) in mm during one slow swing that begins closed.

    Hidden samples (NaN) are left out. The plane comes from the singular values, the circle from the geometric distances
    (Gauss-Newton from an algebraic start). `closed_samples` seen ones at the beginning are the closed door.

    Raises:
        DeviceError: fewer than 30 seen samples, an arc under 10 degrees, positions that lie on no circle.
    """
    positions = np.asarray(positions, float)
    seen = positions[np.isfinite(positions).all(axis=1)]
    if len(seen) < max(FEWEST, closed_samples + 1):
        raise DeviceError(
            f"{len(seen)} seen samples of a swing; {max(FEWEST, closed_samples + 1)} at least are expected."
        )
    middle = seen.mean(axis=0)
    _, sizes, directions = np.linalg.svd(seen - middle, full_matrices=False)
    if sizes[1] <= 1e-9 * max(sizes[0], 1e-300):
        raise DeviceError("the marker did not swing: its positions lie on a line or on one spot.")
    flat = (seen - middle) @ directions[:2].T
    spot, radius, spread = _circle(flat)
    around = np.linalg.norm(flat - spot, axis=1) - radius
    along = (seen - middle) @ directions[2]
    rms = [float(np.sqrt(np.mean(each**2))) for each in (around, along)]
    centre, axis, closed = _oriented(seen, middle + spot @ directions[:2], directions[2], closed_samples)
    angles = _angles(seen, centre, axis, closed)
    hinge = Hinge(
        _point(centre), _point(axis), _point(closed), radius, rms[0], rms[1], rms[0] * spread,
        float(angles.max() - angles.min()), len(seen),
    )  # fmt: skip
    _demand_sound(hinge)
    return hinge


def opening_deg(positions: Array, hinge: Hinge) -> Array:
    """How far the door is open in degrees, of shape (n,); NaN where the marker was hidden, negative behind closed."""
    return _angles(np.asarray(positions, float), *map(np.array, (hinge.centre, hinge.axis, hinge.closed)))


def _angles(positions: Array, centre: Array, axis: Array, closed: Array) -> Array:
    from_axis = positions - centre
    return np.asarray(np.degrees(np.arctan2(from_axis @ np.cross(axis, closed), from_axis @ closed)))


def _oriented(seen: Array, centre: Array, axis: Array, closed_samples: int) -> tuple[Array, Array, Array]:
    """The axis turned so that the swing goes forward, and the direction in which the closed marker lies."""
    closed = seen[:closed_samples].mean(axis=0) - centre
    closed -= (closed @ axis) * axis
    closed /= np.linalg.norm(closed)
    turned = _angles(seen, centre, axis, closed)
    farthest = turned[np.argmax(np.abs(turned))]
    return centre, axis if farthest >= 0 else -axis, closed


def _circle(flat: Array) -> tuple[Array, float, float]:
    """Centre, radius and how far an error of 1 in each sample may move the centre: the geometric fit to (n, 2)."""
    scale = float(np.abs(flat).max())
    points = flat / scale
    solved = np.linalg.lstsq(np.column_stack([2 * points, np.ones(len(points))]), (points**2).sum(axis=1), rcond=None)[
        0
    ]
    at = np.array([*solved[:2], math.sqrt(max(solved[2] + solved[:2] @ solved[:2], 1e-12))])
    for _ in range(ROUNDS):
        jacobian, left = _linear(points, at)
        step = np.linalg.lstsq(jacobian, left, rcond=None)[0]
        at = at + step
        if np.abs(step).max() <= 1e-13 * max(1.0, np.abs(at).max()):
            break
    jacobian, _ = _linear(points, at)
    covariance = np.linalg.pinv(jacobian.T @ jacobian)
    return at[:2] * scale, float(abs(at[2]) * scale), float(np.sqrt(covariance.diagonal()[:2].max()))


def _linear(points: Array, at: Array) -> tuple[Array, Array]:
    """Jacobian and residuals of the distances from the circle (x, y, radius)."""
    off = points - at[:2]
    distance = np.linalg.norm(off, axis=1)
    return np.column_stack([off / distance[:, None], np.ones(len(points))]), distance - at[2]


def _demand_sound(hinge: Hinge) -> None:
    if hinge.arc_deg < NARROWEST_DEG:
        raise DeviceError(f"the door swung by {hinge.arc_deg:.1f} degrees; {NARROWEST_DEG:g} at least are needed.")
    worst = max(hinge.around_mm, hinge.along_mm)
    if not worst <= LARGEST_RESIDUAL * hinge.radius_mm:
        told = f"the marker went {worst:.1f} mm off a circle of {hinge.radius_mm:.0f} mm"
        raise DeviceError(f"{told}; was it fixed to the door, and the tracker at rest?")


def _point(vector: Iterable[float]) -> Point:
    x, y, z = map(float, vector)
    return x, y, z
