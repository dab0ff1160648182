"""The base of all schemas for files that are read."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Tensor = Annotated[str, Field(min_length=1)]
"""The name of an array in a model's weights file."""


class Strict(BaseModel):
    """A schema that refuses unknown keys and numbers that are not finite."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
