"""Units that signals come in, and what turns them into m/s^2, mm/s, mm, N and s."""

from __future__ import annotations

from modeling.textures.recording import TextureDataError

G_M_S2 = 9.80665
UNITS: dict[str, dict[str, float]] = {
    "acceleration": {"m/s^2": 1.0, "m/s2": 1.0, "m/s²": 1.0, "m s-2": 1.0, "m_s2": 1.0, "g": G_M_S2,
                     "mg": 1e-3 * G_M_S2, "mm/s^2": 1e-3},
    "speed": {"mm/s": 1.0, "mm_s": 1.0, "cm/s": 10.0, "cm_s": 10.0, "m/s": 1000.0, "m_s": 1000.0},
    "position": {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 1e-3},
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
}  # fmt: skip
PLAIN = {"acceleration": "m/s^2", "speed": "mm/s", "position": "mm", "force": "N", "time": "s"}
"""What a number without a unit is taken to be in."""


def scale_of_unit(what: str, unit: str, where: str) -> float:
    """What a number in that unit is multiplied by. Raises TextureDataError on a unit that is not known."""
    known = UNITS[what]
    if unit.strip() not in known:
        raise TextureDataError(f"{where}: {what} in {unit!r}; known are {', '.join(known)}")
    return known[unit.strip()]
