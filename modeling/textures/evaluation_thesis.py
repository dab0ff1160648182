"""The numbers that the thesis printed, to stand beside ours: other people's private recordings, never a target."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from palpate.modeling.files.printed_numbers import printed_numbers

FILE = Path(__file__).resolve().parent / "thesis_numbers.yaml"
SAID = "thesis"


def _read() -> Mapping[str, Any]:
    return printed_numbers(FILE)


def printed_errors(method: str, metric: str) -> tuple[dict[str, float], float] | None:
    """Table 4.1: a method's "mae" or "gfc" (percent) by texture, and their printed mean; None where it has none."""
    numbers = _read()["table_4_1"].get(method)
    if numbers is None:
        return None
    cells = dict(zip(_read()["textures"], map(float, numbers[metric]), strict=True))
    return cells, float(numbers[f"{metric}_mean"])


def printed_variant(method: str) -> Mapping[str, float] | None:
    """Table 4.2: a variant's window, mean MAE and mean GFC in percent; None where it has none."""
    numbers: Mapping[str, float] | None = _read()["table_4_2"].get(method)
    return numbers


def printed_times(method: str) -> Mapping[str, float] | None:
    """Table 4.3: window, inference on GPU and CPU in ms, seconds of one epoch; None where it has none."""
    numbers: Mapping[str, float] | None = _read()["table_4_3"].get(method)
    return numbers
