"""What every fitted model of any kind gives when it is to become a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from palpate.signals.models.card import Step


@dataclass(frozen=True)
class Exported:
    """A fitted model as steps and the tensors that they name: from the card's input to its output."""

    steps: tuple[Step, ...]
    tensors: Mapping[str, NDArray[Any]]
