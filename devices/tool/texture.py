"""What the simulated tool needs to know of a surface."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

PREFIX = "sim_"
AVERAGE = "50"
"""What a surface is taken for where its table says nothing: a lab's own samples need no simulation."""


class ToolDataError(ValueError):
    """A texture or a recording that the simulated tool cannot be given; the message says what is expected."""


@dataclass(frozen=True)
class Texture:
    """A surface from 0 (smooth, flat, sticky, hard) to 100 (rough, bumpy, slippery, soft).

    Engineering judgement for simulation only: no measured property of any material.
    """

    roughness: float
    bumpiness: float
    slipperiness: float
    softness: float

    @property
    def wavelength_mm(self) -> float:
        """Distance between the surface's bumps: 0.3 mm where it is flat, 3 mm where it is bumpy."""
        return 0.3 + 0.027 * self.bumpiness

    @property
    def level_m_s2(self) -> float:
        """Vibration (RMS) at 100 mm/s and 1 N; a soft surface swallows up to 70 % of it."""
        return (0.2 + 0.03 * self.roughness) * (1 - 0.007 * self.softness)

    @property
    def bandwidth_hz(self) -> float:
        """Width of the vibration's spectrum: a hard surface rings, a soft one does not."""
        return 20 + 1.2 * self.softness

    @property
    def friction(self) -> float:
        """Coefficient of friction: 0.9 where it is sticky, 0.15 where it is slippery."""
        return 0.9 - 0.0075 * self.slipperiness


def texture_of(columns: Mapping[str, str], where: str) -> Texture:
    """The texture in the columns sim_roughness, sim_bumpiness, sim_slipperiness and sim_softness of a stimulus.

    A column that is not there counts as 50. Raises ToolDataError naming the stimulus `where` and the column that holds
    anything but a number from 0 to 100.
    """
    return Texture(*(_estimate(columns, PREFIX + field.name, where) for field in fields(Texture)))


def _estimate(columns: Mapping[str, str], name: str, where: str) -> float:
    text = columns.get(name, AVERAGE)
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 <= value <= 100:
        raise ToolDataError(
            f"stimulus {where!r}: {text!r} in the column {name!r}; the simulated tool needs a number from 0 to 100"
        )
    return value
