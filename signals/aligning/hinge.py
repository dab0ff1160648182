"""A door's angle from the positions of a marker on it, by the circle that its path lies on (thesis 5.3.1.1).

The thesis tracked the hinge once for each car; the path alone gives it as well, because it is an arc about the hinge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.signals.aligning.refusals import AlignError
from palpate.signals.arrays import Array

LEAST_ARC_DEG = 10.0
"""On a shorter arc the noise of the tracker, not the door, decides the centre."""
LARGEST_MISFIT = 0.02
"""Greatest RMS distance of the path from the circle, in radii; beyond it the marker did not turn about a hinge."""
ROUNDS = 20


@dataclass(frozen=True)
class Hinge:
    """A circle in space, in the positions' unit; `misfit` is the path's RMS distance from it.

    `across` and `ahead` span its plane: angles count from `across` towards `ahead`.
    """

    centre: Array
    across: Array
    ahead: Array
    radius: float
    misfit: float

    def angle_deg(self, positions: Array) -> Array:
        """Return the angles (n,) of positions (n, 3) in degrees; 0 at the start of the fitted path, NaN where unknown.

        Angles rise in the direction of the fitted path.
        """
        from_centre = positions - self.centre
        turned = np.arctan2(from_centre @ self.ahead, from_centre @ self.across)
        return np.asarray(np.degrees(turned))


def fit_hinge(positions: Array) -> Hinge:
    """Fit the circle closest to a path (n, 3) by geometric distance; rows that are not finite are left out.

    Raises:
        AlignError: fewer than three positions, an arc of less than 10 degrees (a marker at rest) or more than 180,
            or a path that is not an arc.
    """
    sound = positions[np.isfinite(positions).all(axis=1)]
    if len(sound) < 3:
        raise AlignError(f"{len(sound)} positions are known: three or more are needed to find the hinge")
    middle = sound.mean(axis=0)
    _, sizes, axes = np.linalg.svd(sound - middle, full_matrices=False)
    if sizes[0] <= 1e-9 * (1 + np.abs(sound).max()) * np.sqrt(len(sound)):
        raise AlignError("the marker did not move: no hinge can be found")
    flat = (sound - middle) @ axes[:2].T
    centre, radius = _circle(flat)
    centre_3d = middle + centre @ axes[:2]
    across = (flat[0] - centre) / np.hypot(*(flat[0] - centre))
    ahead = np.array([-across[1], across[0]])
    turned = np.unwrap(np.arctan2((flat - centre) @ ahead, (flat - centre) @ across))
    far = float(turned[np.abs(turned).argmax()])
    ahead = ahead if far >= 0 else -ahead
    misfit = float(np.sqrt(np.mean((np.linalg.norm(sound - centre_3d, axis=1) - radius) ** 2)))
    hinge = Hinge(centre_3d, across @ axes[:2], ahead @ axes[:2], radius, misfit)
    arc_deg = np.degrees(np.ptp(turned))
    if hinge.misfit > LARGEST_MISFIT * hinge.radius:
        raise AlignError(
            f"the path is no arc: it strays {hinge.misfit:.3g} from a circle of radius {hinge.radius:.3g}, and up to "
            f"{LARGEST_MISFIT * hinge.radius:.3g} is expected. Did the marker rest, or slip?"
        )
    if not LEAST_ARC_DEG <= arc_deg <= 180:
        raise AlignError(
            f"the path is an arc of {arc_deg:.1f} degrees: from {LEAST_ARC_DEG:g} to 180 are needed to find the hinge"
        )
    return hinge


def _circle(flat: Array) -> tuple[Array, float]:
    """Return the centre and radius, by Kasa's algebraic circle and then Gauss-Newton on the distances."""
    scale = np.sqrt((flat**2).sum(axis=1).mean())
    points = flat / scale
    rows = np.column_stack([2 * points, np.ones(len(points))])
    solved = np.linalg.lstsq(rows, (points**2).sum(axis=1), rcond=None)[0]
    centre, radius = solved[:2], np.sqrt(max(solved[2] + solved[:2] @ solved[:2], 0.0))
    for _ in range(ROUNDS):
        apart = points - centre
        distance = np.maximum(np.linalg.norm(apart, axis=1), 1e-12)
        slopes = np.column_stack([-apart / distance[:, None], -np.ones(len(points))])
        step = np.linalg.lstsq(slopes, radius - distance, rcond=None)[0]
        centre, radius = centre + step[:2], radius + step[2]
        if np.abs(step).max() < 1e-12:
            break
    return centre * scale, float(radius * scale)
