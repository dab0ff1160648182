"""The numbers that the thesis printed, to stand beside ours: other people's private data, never a target."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.modeling.files.printed_numbers import printed_numbers

FILE = Path(__file__).resolve().parent / "thesis_numbers.yaml"
SAID = "thesis (private data, other people)"
Cells = Mapping[tuple[str, str], float]


@dataclass(frozen=True)
class Printed:
    """One of Tables 5.3 to 5.5: its number, its cells by attribute and door, and its printed margins."""

    table: str
    cells: Cells
    by_attribute: Mapping[str, float]
    by_door: Mapping[str, float]

    @property
    def overall(self) -> float:
        """The mean of all cells, which the thesis does not print."""
        return sum(self.cells.values()) / len(self.cells)


@dataclass(frozen=True)
class PrintedWaveforms:
    """Table 5.6: mean and SD of the waveform's MAE and RMSE by door."""

    table: str
    by_door: Mapping[str, Mapping[str, float]]

    def overall(self, measure: str) -> float:
        """Return the mean over the doors."""
        return sum(door[measure] for door in self.by_door.values()) / len(self.by_door)


def _read() -> Mapping[str, Any]:
    return printed_numbers(FILE)


def printed(measure: str) -> Printed:
    """Table 5.3 ("mae"), 5.4 ("rmse") or 5.5 ("r2")."""
    numbers, attributes, doors = _read()["forward"][measure], _read()["attributes"], _read()["doors"]
    cells = {
        (attribute, door): value
        for attribute, line in zip(attributes, numbers["cells"], strict=True)
        for door, value in zip(doors, line, strict=True)
    }
    margins = _named(attributes, numbers["by_attribute"]), _named(doors, numbers["by_door"])
    return Printed(str(numbers["table"]), cells, *margins)


def printed_waveforms() -> PrintedWaveforms:
    """Table 5.6."""
    numbers, doors = _read()["inverse"], _read()["doors"]
    measures = ("mae", "mae_sd", "rmse", "rmse_sd")
    by_door = {door: {name: float(numbers[name][i]) for name in measures} for i, door in enumerate(doors)}
    return PrintedWaveforms(str(numbers["table"]), by_door)


def _named(names: Sequence[str], values: Sequence[float]) -> dict[str, float]:
    return {name: float(value) for name, value in zip(names, values, strict=True)}
