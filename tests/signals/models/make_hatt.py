"""Write the small texture in the toolkit's format that the tests read: python -m tests.signals.models.make_hatt."""

from __future__ import annotations

from pathlib import Path

import numpy as np

FILE = Path(__file__).parent / "data" / "Models_Small.xml"
POINTS = ((0.0, 0.0), (120.0, 0.0), (120.0, 2.0), (0.0, 2.0), (60.0, 1.0))
TRIANGLES = ((1, 2, 5), (2, 3, 5), (3, 4, 5), (4, 1, 5))
AR = ((0.30, 0.62, 1.10, 2.20), (0.35, 0.80, 1.40, 2.30), (0.40, 0.90, 1.60, 2.50), (0.28, 0.70, 1.20, 2.10),
      (0.33, 0.75, 1.30, 2.25))  # fmt: skip
MA = ((0.9, 1.9), (1.0, 2.0), (1.1, 2.1), (0.95, 1.95), (1.05, 2.05))
VARIANCE, GAIN = (0.0, 0.02, 0.08, 0.01, 0.04), (1.5, 2.0, 2.5, 1.8, 2.1)


def polynomial(frequencies) -> list[float]:
    """The coefficients that the file also holds; only the frequencies are read."""
    halves = [np.array([1.0, 1.0]), np.array([1.0, -1.0])]
    for place, frequency in enumerate(frequencies):
        halves[place % 2] = np.convolve(halves[place % 2], [1, -2 * np.cos(frequency), 1])
    return list((halves[0] + halves[1])[: len(frequencies) + 1] / 2)


def values(name: str, numbers, indent: str) -> str:
    inner = "".join(f"{indent}   <value>{number:.6f}</value>\n" for number in numbers)
    return f"{indent}<{name}>\n{inner}{indent}</{name}>\n"


def listed(name: str, numbers) -> str:
    return values(name, numbers, "   ").replace(f"<{name}>", f'<{name} type="array">', 1)


def model(place: int) -> str:
    parts = [("ARcoeff", polynomial(AR[place])), ("ARlsf", AR[place]), ("MAcoeff", polynomial(MA[place])),
             ("MAlsf", MA[place])]  # fmt: skip
    lists = "".join(values(*part, "      ") for part in parts)
    speed, force = POINTS[place]
    return (
        f"   <model>\n      <modNum>{place + 1}</modNum>\n{lists}      <var>{VARIANCE[place]:.6f}</var>\n"
        f"      <gain>{GAIN[place]:.6f}</gain>\n      <speedMod>{speed:.6f}</speedMod>\n"
        f"      <forceMod>{force:.6f}</forceMod>\n   </model>\n"
    )


def text() -> str:
    triangles = "".join(
        '   <tri type="array">\n' + "".join(f"      <value>{index}</value>\n" for index in row) + "   </tri>\n"
        for row in TRIANGLES
    )
    lists = listed("speedList", [speed for speed, _ in POINTS]) + listed("forceList", [force for _, force in POINTS])
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n<modelSet texture="1">\n   <material>Small Sample</material>\n'
        "   <AccelUnits>m/s^2</AccelUnits>\n   <SpeedUnits>mm/s</SpeedUnits>\n   <ForceUnits>N</ForceUnits>\n"
        "   <SampleRate>1000</SampleRate>\n   <mu>0.400000</mu>\n   <numMod>5</numMod>\n   <numTri>4</numTri>\n"
        f"   <maxSpeed>120.000000</maxSpeed>\n   <maxForce>2.000000</maxForce>\n{lists}{triangles}"
        f"   <numARCoeff>4</numARCoeff>\n   <numMACoeff>2</numMACoeff>\n{''.join(map(model, range(5)))}</modelSet>\n"
    )


if __name__ == "__main__":
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_text(text())
