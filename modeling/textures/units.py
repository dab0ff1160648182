"""Units that signals come in, and what turns them into m/s^2, mm/s, mm, N and s."""

from __future__ import annotations

import re

from palpate.modeling.textures.recording import TextureDataError

G_M_S2 = 9.80665
UNITS: dict[str, dict[str, float]] = {
    "acceleration": {"m/s^2": 1.0, "g": G_M_S2, "mg": 1e-3 * G_M_S2, "mm/s^2": 1e-3},
    "speed": {"mm/s": 1.0, "cm/s": 10.0, "m/s": 1000.0},
    "position": {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 1e-3},
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
}
PLAIN = {"acceleration": "m/s^2", "speed": "mm/s", "position": "mm", "force": "N", "time": "s"}
"""What a number without a unit is taken to be in."""
OTHERWISE = {"²": "2", "⁻": "-", "¹": "1", "µ": "u", "μ": "u", "_": "/", "per": "/"}
ALSO = {"m/s/s": "m/s2", "m/s/2": "m/s2", "sec": "s", "seconds": "s"}


def scale_of_unit(what: str, unit: str, where: str) -> float:
    """What a number in that unit is multiplied by. Raises TextureDataError on a unit that is not known."""
    found = known_scale(what, unit)
    if found is None:
        raise TextureDataError(f"{where}: {what} in {unit!r}; known are {', '.join(UNITS[what])}")
    return found


def known_scale(what: str, unit: str) -> float | None:
    """As `scale_of_unit`; None where it is not known. m/s^2 may be written m/s², ms^-2, m s-2, m/s/s or m_s2."""
    return {_squeezed(name): scale for name, scale in UNITS[what].items()}.get(_squeezed(unit))


def _squeezed(unit: str) -> str:
    for written, meant in OTHERWISE.items():
        unit = unit.replace(written, meant)
    bare = re.sub(r"[\s^*·.]", "", unit)
    return ALSO.get(bare) or re.sub(r"^(c?m|mm)s-([12])$", lambda found: f"{found[1]}/s{found[2].strip('1')}", bare)
