"""Comparison of the methods: error, calibration, time and size of each in one row."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress

import numpy as np

from palpate.modeling.doors.data import TOP
from palpate.modeling.doors.evaluation.tables import Row, waveform_errors
from palpate.modeling.doors.methods import Method
from palpate.modeling.doors.plausibility import TOLERANCE
from palpate.modeling.doors.registry import Direction
from palpate.modeling.doors.results import DoorResults, MethodResults
from palpate.modeling.doors.scores import mae, r2, rmse, share_within, share_within_sd
from palpate.modeling.evaluate.intervals import COVERAGE, half_widths, nested_coverage
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.signals.arrays import Array, Mask

BY = ("judge", "fresh", "felt")
"""The raters of a made profile: the forward model; fresh people; the same people without bias, gain, noise and steps.
"""
FILE_NUMBERS = ("file_ms", "file_p99_ms", "file_bytes", "file_difference")


def method_rows(results: DoorResults, way: Direction) -> tuple[Row, ...]:
    """Return a row for each method of a direction on the split that counts."""
    evaluated, methods = results.methods(way), results.domain.methods[way]
    if way == "forward":
        return tuple(forward_row(result, methods[result.method]) for result in evaluated)
    within = attainable(evaluated)
    return tuple(inverse_row(result, methods[result.method], within) for result in evaluated)


def forward_row(results: MethodResults, method: Method) -> Row:
    """Return a method's errors of ratings on 0..100 over all stimuli, each predicted by a model that had not seen it.

    `mae_of_folds_sd` is the SD of the folds' MAE; `coverage` and `half_width` are of nested conformal intervals that
    should hold 90 %; `scaled_coverage` of those scaled by the model's own SD, where it has one.
    """
    actual, predicted = results.actual, results.predicted
    folds = [mae(actual[results.fold == k], predicted[results.fold == k]) for k in np.unique(results.fold)]
    return {
        "method": results.method,
        "title": method.title,
        "mae": mae(actual, predicted),
        "mae_of_folds_sd": float(np.std(folds, ddof=1)) if len(folds) > 1 else None,
        "rmse": rmse(actual, predicted),
        "r2": r2(actual, predicted),
        "within_jnd": share_within(predicted, actual).overall,
        "within_sd": share_within_sd(predicted, actual, results.sd).overall if np.isfinite(results.sd).all() else None,
        **_calibration(results),
        "train_s": results.total("train_s"),
        **files(results),
        "source": method.source,
    }


def inverse_row(results: MethodResults, method: Method, within: Mask | None = None) -> Row:
    """Return a method's errors of made profiles: waveform in percent of the range of forces, loop on 0..100.

    `within` (n,) marks the attainable wishes (see `attainable`), None where that is not known.
    """
    errors = waveform_errors(results)
    return {
        "method": results.method,
        "title": method.title,
        "waveform_mae": float(errors[0].mean()),
        "waveform_mae_sd": float(errors[0].std(ddof=1)) if len(errors[0]) > 1 else None,
        "waveform_rmse": float(errors[1].mean()),
        **loop_numbers(results, within),
        "unplayable": unplayable(results),
        "made": len(results.data),
        "corners_unplayable": results.total("corners_unplayable") if _has(results, "corners_unplayable") else None,
        "corners": results.total("corners") if _has(results, "corners") else None,
        "train_s": results.total("train_s"),
        "forward_s": results.total("forward_s") or None,
        **files(results),
        "source": method.source,
    }


def files(results: MethodResults) -> Row:
    """Return the numbers of the exported file: time of an answer, bytes, difference from the trained model.

    `trained_ms` is one answer's share of the time that the trained model itself took for all rows at once.
    """
    notes = dict.fromkeys(note for result in results.folds for note in result.notes)
    trained = {"trained_ms": 1e3 * results.total("asked_s") / len(results.data)}
    return {**trained, **{name: results.number(name) for name in FILE_NUMBERS}, "note": "; ".join(notes) or None}


def attainable(methods: Iterable[MethodResults]) -> Mask | None:
    """Return which wishes (n,) are attainable: some method's profile comes within TOLERANCE in every attribute.

    The ratings are those of the forward model of the training side, which saw neither the wish's door nor any rating of
    the made profile. None where no profile was made.
    """
    masks: list[Mask] = []
    for method in methods:
        wish, rated = method.array("wish"), method.array("loop_judge")
        if wish is not None and rated is not None:
            masks.append(np.all(np.abs(np.clip(rated, 0.0, TOP) - wish) <= TOLERANCE, axis=1))
    return np.any(masks, axis=0) if masks else None


def loop_numbers(results: MethodResults, within: Mask | None = None) -> Row:
    """Return the mean absolute difference between wished ratings and those of the made profile.

    Also over the wishes `within` alone, by fresh people where there are any and else by the forward model.
    """
    numbers: Row = {
        name: None if values is None else float(np.mean(values))
        for name, values in _loop_errors(results, within).items()
    }
    return numbers | {"attainable": None if within is None else int(within.sum())}


def loop_rows(results: MethodResults, within: Mask | None = None) -> list[Row]:
    """Return `loop_numbers` by attribute, a row each."""
    off = _loop_errors(results, within)
    return [
        {"method": results.method, "attribute": attribute}
        | {name: None if values is None else float(np.mean(values[:, column])) for name, values in off.items()}
        for column, attribute in enumerate(results.data.attributes)
    ]


def _loop_errors(results: MethodResults, within: Mask | None) -> dict[str, Array | None]:
    """Return |rating - wish| (n, attributes) by judge, None where it did not rate, also for the wishes `within`."""
    wish, off = results.array("wish"), dict[str, Array | None]()
    for judge in BY:
        rated = results.array(f"loop_{judge}")
        off[f"loop_{judge}"] = None if wish is None or rated is None else np.abs(rated - wish)
    counts = off["loop_judge"] if off["loop_fresh"] is None else off["loop_fresh"]
    off["loop_attainable"] = None if within is None or counts is None or not within.any() else counts[within]
    return off


def unplayable(results: MethodResults) -> int | None:
    """Return the number of made profiles that the door would refuse; None where none was scored."""
    playable = results.array("playable")
    return None if playable is None else int(np.sum(playable == 0))


def widths(results: MethodResults, coverage: float = COVERAGE) -> Array | None:
    """Return half widths (n, attributes), calibrated on the other folds; None where there are too few stimuli."""
    residual, width = results.predicted - results.actual, np.empty_like(results.actual)
    try:
        for fold in np.unique(results.fold):
            own = results.fold == fold
            width[own] = half_widths(residual[~own], coverage)
    except ModelDataError:
        return None
    return width


def _calibration(results: MethodResults) -> Row:
    """Return coverage and mean half width of nested intervals; None where there are too few stimuli."""
    residual, folds = results.predicted - results.actual, results.fold.tolist()
    numbers: Row = {"coverage": None, "half_width": None, "scaled_coverage": None}
    with suppress(ModelDataError):
        plain = nested_coverage(residual, folds)
        numbers |= {"coverage": plain.overall, "half_width": float(np.mean(plain.half_width))}
        if (sd := results.array("deviation")) is not None:
            numbers["scaled_coverage"] = nested_coverage(residual, folds, sd=sd).overall
    return numbers


def _has(results: MethodResults, name: str) -> bool:
    return results.number(name) is not None
