"""Undefined numbers as None, for rows, JSON and files."""

from __future__ import annotations

import math


def nan_to_none(value: float) -> float | None:
    """Return the value, None if it is NaN; an infinite value stays."""
    return None if math.isnan(value) else value


def finite_or_none(value: float) -> float | None:
    """Return the value, None if it is infinite or NaN."""
    return value if math.isfinite(value) else None
