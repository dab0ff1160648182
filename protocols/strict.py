"""The bases of all schemas for files that are read."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Strict(BaseModel):
    """A frozen schema that refuses unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class StrictFinite(Strict):
    """A frozen schema that refuses unknown keys and numbers that are not finite."""

    model_config = ConfigDict(allow_inf_nan=False)
