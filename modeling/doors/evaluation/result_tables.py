"""The tables of an evaluation by name, and its JSON file with every number."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from palpate.modeling.doors.ceiling import Ceiling
from palpate.modeling.doors.domain import door_code
from palpate.modeling.doors.evaluation.evaluate import DoorEvaluation
from palpate.modeling.doors.evaluation.method_rows import attainable, loop_rows, widths
from palpate.modeling.doors.evaluation.tables import (
    OVERALL,
    Row,
    cells_table,
    prediction_rows,
    variant_rows,
    waveform_error_rows,
    waveform_rows,
    waveform_table,
)
from palpate.modeling.doors.measured_door import measured_rows
from palpate.modeling.doors.results import MethodResults
from palpate.modeling.doors.scores import mae, r2, rmse
from palpate.modeling.evaluate.outputs import tables_as_json
from palpate.modeling.training.run_card import versions

PLAUSIBLE = ("greatest_N", "steepest_N_deg", "work_J_m", "distance_N", "beyond")
LONG = ("predictions", "waveforms", "learning_curves")
"""Tables with a row for each stimulus or epoch, which are written as CSV only."""


def tables(evaluation: DoorEvaluation) -> dict[str, list[Row]]:
    """Return every table of the evaluation by the name of its CSV file, without empty ones."""
    forward, inverse = evaluation.results.methods("forward"), evaluation.results.methods("inverse")
    within = attainable(inverse)
    every: dict[str, list[Row]] = {
        "methods_forward": list(evaluation.forward),
        "methods_inverse": list(evaluation.inverse),
        "table_5_3_mae": cells_table(forward, "mae"),
        "table_5_4_rmse": cells_table(forward, "rmse"),
        "table_5_5_r2": cells_table(forward, "r2"),
        "table_5_6_waveform": waveform_table(inverse),
        "variants_forward": [row for method in forward for row in variant_rows(method)],
        "variants_inverse": [row for method in inverse for row in waveform_rows(method, "variants")],
        "splits_forward": splits_forward(evaluation),
        "splits_inverse": splits_inverse(evaluation),
        "floors": list(evaluation.floors),
        "noise_ceiling": [row for ceiling in evaluation.ceilings for row in ceiling_rows(ceiling)],
        "loop": [row for method in inverse for row in loop_rows(method, within)],
        "corners": corner_rows(inverse),
        "one_slider": [row for method in inverse for row in slider_rows(method)],
        "plausibility": [plausible_row(method) for method in inverse],
        "measured_door": measured_rows(evaluation.measured, evaluation.data.attributes),
        "predictions": [row for method in forward for row in prediction_rows(method, widths(method))],
        "waveforms": [row for method in inverse for row in waveform_error_rows(method)],
        "learning_curves": [row for method in (*forward, *inverse) for row in curve_rows(method)],
    }
    return {name: rows for name, rows in every.items() if rows}


def splits_forward(evaluation: DoorEvaluation) -> list[Row]:
    """Return MAE, RMSE and R2 of every forward method on every split that it was evaluated on."""
    return [
        {"method": method.method, "split": method.split, "mae": mae(method.actual, method.predicted),
         "rmse": rmse(method.actual, method.predicted), "r2": r2(method.actual, method.predicted),
         "n": len(method.data)}
        for (way, _, _), method in evaluation.results.by_method.items() if way == "forward"
    ]  # fmt: skip


def splits_inverse(evaluation: DoorEvaluation) -> list[Row]:
    """Return the waveform's error of every inverse method on every split that it was evaluated on, in percent."""
    rows: list[Row] = []
    for (way, _, split), method in evaluation.results.by_method.items():
        if way == "inverse":
            last = next(row for row in waveform_rows(method) if row["door"] == OVERALL)
            rows.append(
                {
                    "method": method.method,
                    "split": split,
                    **{k: v for k, v in last.items() if k not in ("method", "door")},
                }
            )
    return rows


def ceiling_rows(ceiling: Ceiling) -> list[Row]:
    """Return a noise ceiling by attribute, and over all."""
    columns = ("half_r", "reliability", "mae", "rmse", "r2")
    return [
        {"predictor_knows": ceiling.of, "attribute": name,
         **{column: float(getattr(ceiling, column)[i]) for column in columns}}
        for i, name in enumerate((*ceiling.attributes, OVERALL))
    ]  # fmt: skip


def corner_rows(methods: Iterable[MethodResults]) -> list[Row]:
    """Return the results at all corners of the sliders, for each method."""
    names = (
        "corners",
        "corners_unplayable",
        "corners_had",
        "corners_off",
        "corners_greatest_N",
        "corners_steepest_N_deg",
    )
    return [
        {"method": method.method, **{name: method.number(name) for name in names}}
        for method in methods if method.number("corners") is not None
    ]  # fmt: skip


def slider_rows(results: MethodResults) -> list[Row]:
    """Return how much each slider's own rating and the others change when it goes from 10 to 90."""
    felt = next((result.arrays["alone"] for result in results.folds if "alone" in result.arrays), None)
    if felt is None:
        return []
    rows: list[Row] = []
    for at, attribute in enumerate(results.data.attributes):
        move = felt[2 * at + 1] - felt[2 * at]
        others = [abs(float(move[i])) for i in range(len(move)) if i != at]
        rows.append({"method": results.method, "attribute": attribute, "at_10": float(felt[2 * at, at]),
                     "at_90": float(felt[2 * at + 1, at]), "moved": float(move[at]),
                     "others_moved": sum(others) / len(others) if others else None})  # fmt: skip
    return rows


def plausible_row(results: MethodResults) -> Row:
    """Return the forces, slopes and work of a method's made profiles, and their distance to measured ones."""
    row: Row = {"method": results.method, "made": len(results.data)}
    for name in PLAUSIBLE:
        values = results.array(name)
        if values is not None:
            row |= {f"{name}_mean": float(values.mean()), f"{name}_max": float(values.max())}
    playable = results.array("playable")
    return row | {"unplayable": None if playable is None else int((playable == 0).sum())}


def curve_rows(results: MethodResults) -> list[Row]:
    """Return the learning curves of a method's folds."""
    rows: list[Row] = []
    for done in results.folds:
        columns = {
            name.removeprefix("curve_"): values for name, values in done.arrays.items() if name.startswith("curve_")
        }
        for i in range(len(columns.get("epoch", ()))):
            at = {name: float(values[i]) for name, values in columns.items()}
            rows.append({"direction": results.direction, "method": results.method, "fold": done.job.fold + 1, **at})
    return rows


def as_json(evaluation: DoorEvaluation) -> dict[str, Any]:
    """Return every number with its inputs, settings and software; NaN and infinity become null."""
    results, domain = evaluation.results, evaluation.results.domain
    return {
        "data": {"digest": domain.data.digest, "simulated": domain.data.simulated, "stimuli": len(domain.data),
                 "made_from": list(domain.data.made_from), "attributes": list(domain.data.attributes)},
        "split": results.options.split,
        "quick": results.options.quick,
        "seed": results.options.seed,
        "settings": {name: str(value) for name, value in domain.settings.items()},
        "scaling": {"force_N": list(domain.scaling.force_N), "rating": list(domain.scaling.rating)},
        "software": versions(),
        "code": door_code(),
        "seconds": results.seconds,
        "jobs": len(results.jobs),
        "jobs_kept": results.jobs.loaded,
        "default": {
            way: {"method": choice.method, "why": choice.why, "of_the_network": " ".join(choice.of_ours)}
            for way, choice in evaluation.choices.items()
        },
        "no_ceiling": evaluation.no_ceiling or None,
        "tables": tables_as_json(tables(evaluation), LONG),
    }  # fmt: skip
