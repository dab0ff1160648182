"""What a stimulus table says of a sample that no simulated surface is made for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

from palpate.devices.surfaces.table import SurfaceDataError

PREFIX = "sim_"
AVERAGE = "50"
"""What a surface is taken for where its table says nothing: a lab's own samples need no simulation."""


@dataclass(frozen=True)
class Estimate:
    """A sample from 0 (smooth, flat, sticky, hard) to 100 (rough, bumpy, slippery, soft).

    Engineering judgement for simulation only: no measured property of any material.
    """

    roughness: float
    bumpiness: float
    slipperiness: float
    softness: float

    @property
    def friction(self) -> float:
        """Coefficient of friction: 0.9 where it is sticky, 0.15 where it is slippery."""
        return 0.9 - 0.0075 * self.slipperiness


def estimate_of(columns: Mapping[str, str], where: str) -> Estimate:
    """The estimate in the columns sim_roughness, sim_bumpiness, sim_slipperiness and sim_softness of a stimulus.

    A column that is not there counts as 50. Raises SurfaceDataError naming the stimulus `where` and the column that
    holds anything but a number from 0 to 100.
    """
    return Estimate(*(_number(columns, PREFIX + field.name, where) for field in fields(Estimate)))


def _number(columns: Mapping[str, str], name: str, where: str) -> float:
    text = columns.get(name, AVERAGE)
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 <= value <= 100:
        raise SurfaceDataError(
            f"stimulus {where!r}: {text!r} in the column {name!r}; a simulated surface needs a number from 0 to 100"
        )
    return value
