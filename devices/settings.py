"""What the settings of every kind of device share."""

from __future__ import annotations

from datetime import date
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field


def _day(told: str) -> str:
    """The date as it is, if there was or will be such a day. Raises ValueError."""
    return date.fromisoformat(told).isoformat()


Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Date = Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}$"), AfterValidator(_day)]
"""An ISO date, as 2026-11-21."""


class Strict(BaseModel):
    """Frozen, and no key that the kind does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid")
