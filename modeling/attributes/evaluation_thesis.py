"""The numbers that the thesis printed, to stand beside ours: other people's private data, never a target."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from palpate.modeling.files.printed_numbers import printed_numbers

FILE = Path(__file__).resolve().parent / "thesis_numbers.yaml"
SAID = "thesis"
Which = Literal["mae", "rmse", "same_features", "kinds"]


def printed(which: Which, method: str, features: str = "") -> Mapping[str, float] | None:
    """Return a line of Table 3.2 ("mae"), 3.3 ("rmse"), 3.4 or 3.5 by attribute ("Rough-Smooth"), with their `mean`.

    The thesis does not print the mean. None where it has no such line. Of "kinds", `features` are named as our entries
    are.
    """
    numbers: Mapping[str, Any] = printed_numbers(FILE)
    line = numbers[which]["cells"].get(method)
    if isinstance(line, Mapping):
        line = line.get(features)
    return None if line is None else _named(numbers["attributes"], line)


def number_of(which: Which) -> str:
    """Return the table's number in the thesis."""
    return str(printed_numbers(FILE)[which]["table"])


def _named(attributes: Sequence[str], line: Sequence[float]) -> dict[str, float]:
    cells = {name: float(value) for name, value in zip(attributes, line, strict=True)}
    return {**cells, "mean": sum(cells.values()) / len(cells)}
