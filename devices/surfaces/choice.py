"""The choice of the simulated surface for a stimulus, by its columns in the stimulus table."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

from palpate.devices.surfaces.table import SPANS, Surface, SurfaceDataError, read_surfaces

BUMPS_UM = 8.0
"""RMS height of the large bumps per point of bumpiness (0 to 100)."""
PREFIX = "sim_"
AVERAGE = "50"
"""The value for a missing column: a lab's own samples need no simulation."""


def surface_for(stimulus: str, columns: Mapping[str, str]) -> Surface:
    """Return the surface with the stimulus' id, or else the nearest surface of its class by its sim_ columns.

    `columns` are the stimulus' own: class, sim_roughness, sim_bumpiness, sim_slipperiness, sim_softness. A missing
    column counts as 50, an unknown class as any class. Raises SurfaceDataError for anything but a number from 0 to 100
    in a sim_ column.
    """
    table = read_surfaces()
    if stimulus in table:
        return table[stimulus]
    estimate = estimate_of(columns, stimulus)
    kin = [surface for surface in table.values() if surface.category == columns.get("class")]

    def distance(surface: Surface) -> float:
        """Return how far a surface is from the estimate, in bumps and in stiffness."""
        stiffer = math.log10(surface.stiffness_N_mm / stiffness_N_mm(estimate)) / 3.4
        return abs(surface.bumps_um / BUMPS_UM - estimate.bumpiness) / 100 + abs(stiffer)

    near = min(kin or table.values(), key=distance)
    kinetic = estimate.friction
    return replace(
        near, id=stimulus, label=columns.get("label", stimulus), kinetic_friction=kinetic,
        static_friction=kinetic * near.static_friction / near.kinetic_friction,
        stiffness_N_mm=stiffness_N_mm(estimate), bumps_um=min(BUMPS_UM * estimate.bumpiness, SPANS["bumps_um"].high),
    )  # fmt: skip


def stiffness_N_mm(sample: Estimate) -> float:
    """Return the stiffness for sim_softness, 1000 N/mm (at 0) to 0.4 N/mm (at 100), as in the shipped table."""
    return float(10 ** (3.0 - 0.034 * sample.softness))


@dataclass(frozen=True)
class Estimate:
    """A sample from 0 (smooth, flat, sticky, hard) to 100 (rough, bumpy, slippery, soft).

    An engineering judgement for simulation only, not a measured property of any material.
    """

    roughness: float
    bumpiness: float
    slipperiness: float
    softness: float

    @property
    def friction(self) -> float:
        """Return the coefficient of friction: 0.9 where it is sticky, 0.15 where it is slippery."""
        return 0.9 - 0.0075 * self.slipperiness


def estimate_of(columns: Mapping[str, str], where: str) -> Estimate:
    """Return the estimate in a stimulus' columns sim_roughness, sim_bumpiness, sim_slipperiness and sim_softness.

    A missing column counts as 50. Raises SurfaceDataError that names the stimulus `where` and the column with anything
    but a number from 0 to 100.
    """
    values = []
    for name in (PREFIX + field.name for field in fields(Estimate)):
        text = columns.get(name, AVERAGE)
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not 0 <= value <= 100:
            raise SurfaceDataError(
                f"stimulus {where!r}: {text!r} in the column {name!r}; a simulated surface needs a number from 0 to 100"
            )
        values.append(value)
    return Estimate(*values)
