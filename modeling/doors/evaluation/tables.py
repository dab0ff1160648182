"""Tables 5.3 to 5.6 of the thesis and their further divisions, for every method, as rows of plain values.

The thesis' printed numbers are shown for reference; they come from other people's private data and are no target.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.modeling.doors.data import rows_by_label
from palpate.modeling.doors.results import MethodResults
from palpate.modeling.doors.scores import mae, r2, rmse
from palpate.modeling.evaluate.outputs import printed_numbers
from palpate.signals.arrays import Array

FILE = Path(__file__).resolve().parent / "thesis_numbers.yaml"
THESIS = "thesis (private data, other people)"
Cells = Mapping[tuple[str, str], float]
Row = dict[str, Any]
Measure = Callable[[Array, Array], float | None]
MEASURES: dict[str, Measure] = {"mae": mae, "rmse": rmse, "r2": r2}
AVERAGE = "average"
OVERALL = "(all)"


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
    """Return table 5.3 ("mae"), 5.4 ("rmse") or 5.5 ("r2") as printed in the thesis."""
    numbers, attributes, doors = _read()["forward"][measure], _read()["attributes"], _read()["doors"]
    cells = {
        (attribute, door): value
        for attribute, line in zip(attributes, numbers["cells"], strict=True)
        for door, value in zip(doors, line, strict=True)
    }
    margins = _named(attributes, numbers["by_attribute"]), _named(doors, numbers["by_door"])
    return Printed(str(numbers["table"]), cells, *margins)


def printed_waveforms() -> PrintedWaveforms:
    """Return table 5.6 as printed in the thesis."""
    numbers, doors = _read()["inverse"], _read()["doors"]
    measures = ("mae", "mae_sd", "rmse", "rmse_sd")
    by_door = {door: {name: float(numbers[name][i]) for name in measures} for i, door in enumerate(doors)}
    return PrintedWaveforms(str(numbers["table"]), by_door)


def _named(names: Sequence[str], values: Sequence[float]) -> dict[str, float]:
    return {name: float(value) for name, value in zip(names, values, strict=True)}


def mean_of(values: Iterable[float | None]) -> float | None:
    """Return the mean of the values that are numbers, None if there are none."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def cell_rows(results: MethodResults, measure: str) -> list[Row]:
    """Return a row for each attribute with a column for each door; margins are means of cells, as in the thesis."""
    doors = rows_by_label(results.data.doors)
    error = MEASURES[measure]
    rows: list[Row] = []
    for column, attribute in enumerate(results.data.attributes):
        cells = {
            door: error(results.actual[members][:, [column]], results.predicted[members][:, [column]])
            for door, members in doors.items()
        }
        rows.append({"method": results.method, "attribute": attribute, **cells, AVERAGE: mean_of(cells.values())})
    last: Row = {"method": results.method, "attribute": AVERAGE}
    last |= {door: mean_of(row[door] for row in rows) for door in doors}
    last[AVERAGE] = mean_of(row[AVERAGE] for row in rows)
    return [*rows, last]


def thesis_rows(measure: str, attributes: Sequence[str], doors: Sequence[str]) -> list[Row]:
    """Return the thesis' table in the form of `cell_rows`; empty where it has none of these attributes."""
    theirs = printed(measure)
    rows: list[Row] = []
    for attribute in (name for name in attributes if name in theirs.by_attribute):
        cells = {door: theirs.cells.get((attribute, door)) for door in doors}
        rows.append({"method": THESIS, "attribute": attribute, **cells, AVERAGE: theirs.by_attribute[attribute]})
    if rows:
        last = {door: theirs.by_door.get(door) for door in doors}
        rows.append({"method": THESIS, "attribute": AVERAGE, **last, AVERAGE: theirs.overall})
    return rows


def cells_table(methods: Sequence[MethodResults], measure: str) -> list[Row]:
    """Return table 5.3, 5.4 or 5.5 for each method, and the thesis' own below."""
    rows = [row for results in methods for row in cell_rows(results, measure)]
    if methods:
        data = methods[0].data
        rows += thesis_rows(measure, data.attributes, list(dict.fromkeys(data.doors)))
    return rows


def waveform_errors(results: MethodResults) -> tuple[Array, Array]:
    """Return the MAE and RMSE of each made profile, in percent of the range of all forces."""
    off = results.predicted - results.actual
    return np.mean(np.abs(off), axis=1), np.sqrt(np.mean(off**2, axis=1))


def waveform_rows(results: MethodResults, by: str = "doors") -> list[Row]:
    """Return table 5.6: mean and SD of the waveform's MAE and RMSE by door (or `by` "variants"), and over all."""
    levels: dict[str, list[int]] = rows_by_label(getattr(results.data, by))
    errors = waveform_errors(results)
    every = list(range(len(results.data)))
    return [
        {"method": results.method, by.removesuffix("s"): level, **_spread("mae", errors[0][rows]),
         **_spread("rmse", errors[1][rows]), "n": len(rows)}
        for level, rows in (*levels.items(), (OVERALL, every))
    ]  # fmt: skip


def waveform_table(methods: Sequence[MethodResults]) -> list[Row]:
    """Return table 5.6 for each method, and the thesis' own below."""
    rows = [row for results in methods for row in waveform_rows(results)]
    if methods:
        theirs = printed_waveforms()
        doors = [door for door in dict.fromkeys(methods[0].data.doors) if door in theirs.by_door]
        rows += [{"method": THESIS, "door": door, **theirs.by_door[door], "n": None} for door in doors]
    return rows


def _spread(name: str, values: Array) -> Row:
    sd = float(np.std(values, ddof=1)) if len(values) > 1 else None
    return {name: float(np.mean(values)), f"{name}_sd": sd}


def variant_rows(results: MethodResults) -> list[Row]:
    """Return MAE, RMSE and R2 over all attributes, by profile type g0 to g14 (thesis 5.5.4)."""
    rows = []
    for variant, which in rows_by_label(results.data.variants).items():
        actual, predicted = results.actual[which], results.predicted[which]
        scores = {name: measure(actual, predicted) for name, measure in MEASURES.items()}
        rows.append({"method": results.method, "variant": variant, **scores, "n": len(which)})
    return rows


def prediction_rows(results: MethodResults, half_width: Array | None = None) -> list[Row]:
    """Return every prediction of the ratings: the mean rating, the prediction, its interval and the raters' SD."""
    data, rows = results.data, []
    for i in range(len(data)):
        for j, attribute in enumerate(data.attributes):
            cell = {"actual": float(results.actual[i, j]), "predicted": float(results.predicted[i, j])}
            if half_width is not None:
                reach = float(half_width[i, j])
                cell |= {"low": cell["predicted"] - reach, "high": cell["predicted"] + reach}
            sd = float(results.sd[i, j])
            named = {"stimulus": data.ids[i], "door": data.doors[i], "variant": data.variants[i]}
            rows.append({"method": results.method, **named, "attribute": attribute, "fold": int(results.fold[i]) + 1,
                         **cell, "sd": sd if np.isfinite(sd) else None})  # fmt: skip
    return rows


def waveform_error_rows(results: MethodResults) -> list[Row]:
    """Return every made profile: its MAE and RMSE in percent."""
    errors, data = waveform_errors(results), results.data
    return [
        {"method": results.method, "stimulus": data.ids[i], "door": data.doors[i], "variant": data.variants[i],
         "fold": int(results.fold[i]) + 1, "mae": float(errors[0][i]), "rmse": float(errors[1][i])}
        for i in range(len(data))
    ]  # fmt: skip
