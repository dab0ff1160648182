"""Numbers that are undefined, as rows, JSON and files hold them: None."""

from __future__ import annotations

import math


def nan_to_none(value: float) -> float | None:
    """Return the value, None where it is not a number; an infinite one stays."""
    return None if math.isnan(value) else value


def finite_or_none(value: float) -> float | None:
    """Return the value, None where it is infinite or not a number."""
    return value if math.isfinite(value) else None
