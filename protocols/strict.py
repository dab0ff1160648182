"""What every part of a file that is read is checked by."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Tensor = Annotated[str, Field(min_length=1)]
"""The name of an array in a model's weights file."""


class Strict(BaseModel):
    """Unknown keys are refused, and so are numbers that are none."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
