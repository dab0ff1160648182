"""What the settings of every kind of device share."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Date = Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}$")]
"""An ISO date, as 2026-11-21."""


class Strict(BaseModel):
    """Frozen, and no key that the kind does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid")
