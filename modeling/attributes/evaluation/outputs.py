"""The files of an evaluation: tables, a JSON file with every number, figures and the report."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from palpate.modeling.attributes.entries import FEELING, SEEING
from palpate.modeling.attributes.evaluation.evaluate import DEFAULT, RULE, AttributeEvaluation, usable
from palpate.modeling.attributes.evaluation.report import choice_of, reached
from palpate.modeling.attributes.evaluation.tables import (
    Row,
    attribute_rows,
    class_rows,
    curve_rows,
    fold_rows,
    method_rows,
    prediction_rows,
    table_rows,
)
from palpate.modeling.attributes.joining import modalities_of
from palpate.modeling.attributes.material import Material, digest_of
from palpate.modeling.evaluate.intervals import COVERAGE
from palpate.modeling.evaluate.outputs import Choice, evaluation_folder, read_results, tables_as_json, write_evaluation
from palpate.modeling.training.run_card import versions
from palpate.protocols.progress import Report, silent

NAME = "attributes"
LONG = ("learning_curves", "predictions")
"""Tables with many rows, which are written as CSV only."""


def tables(evaluation: AttributeEvaluation) -> dict[str, list[Row]]:
    """Return the tables of the evaluation by the names of their CSV files, without empty ones."""
    every = {
        "methods": method_rows(evaluation),
        "attributes": attribute_rows(evaluation),
        "classes": class_rows(evaluation),
        "table_3_2": table_rows(evaluation, "mae"),
        "table_3_3": table_rows(evaluation, "rmse"),
        "table_3_4": table_rows(evaluation, "same_features"),
        "table_3_5": table_rows(evaluation, "kinds"),
        "folds": fold_rows(evaluation),
        "predictions": prediction_rows(evaluation),
        "learning_curves": curve_rows(evaluation),
    }
    return {name: rows for name, rows in every.items() if rows}


def as_json(evaluation: AttributeEvaluation) -> dict[str, Any]:
    """Return every number with its inputs, settings and software; NaN and infinity become null."""
    chosen, material = choice_of(evaluation), evaluation.material
    return {
        "data": {
            "digest": evaluation.domain.digest, "textures": list(material.ids), "weights": material.weights,
            "attributes": [[pair.low, pair.high] for pair in material.attributes], "notes": list(material.notes),
        },
        "simulated": material.simulated,
        "tested": list(evaluation.tested),
        "not_used": dict(evaluation.left_out),
        "quick": evaluation.options.quick,
        "epochs": evaluation.options.epochs,
        "early_stopping": evaluation.options.early_stopping,
        "folds": evaluation.options.folds,
        "seed": evaluation.options.seed,
        "software": versions(),
        "seconds": evaluation.seconds,
        "jobs": len(evaluation.results),
        "jobs_kept": evaluation.results.loaded,
        "feature_seconds": dict(evaluation.times),
        "default": chosen.as_json(RULE),
        "reached": [list(point) for point in reached(evaluation)],
        "intervals": {"coverage": COVERAGE, "half_width": intervals(evaluation)},
        "tables": tables_as_json(tables(evaluation), LONG),
    }  # fmt: skip


def intervals(evaluation: AttributeEvaluation) -> dict[str, dict[str, float]]:
    """Return half widths (0..100) of the 90 % intervals by method and attribute; empty with too few textures."""
    half_widths: dict[str, dict[str, float]] = {}
    for row in attribute_rows(evaluation):
        if row["half_width"] is not None:
            half_widths.setdefault(row["method"], {})[row["attribute"]] = row["half_width"]
    return half_widths


def write_all(
    evaluation: AttributeEvaluation, folder: Path, report: Report = silent, drawings: bool = True
) -> list[Path]:
    """Write tables, figures, results and the report, and return the paths, the report last; see `write_evaluation`."""
    from palpate.modeling.attributes.evaluation.figures import figures
    from palpate.modeling.attributes.evaluation.report import report_html

    return write_evaluation(
        folder, tables(evaluation), partial(figures, evaluation) if drawings else None,
        partial(report_html, evaluation), partial(as_json, evaluation), report,
    )  # fmt: skip


def default_of(lab: Path, material: Material) -> Choice:
    """Return the method that the lab's evaluation of the same textures chose, else the shipped default; and the reason.

    The evaluation does not count if it was quick, had few folds, other epochs or other early stopping than the methods'
    own, or did not include the shipped default. It counts if the shipped default was refused, as for pictures alone.
    Where the textures have one modality only, the shipped default is the network's branch for it.
    """
    has_touch, has_sight = modalities_of(material.textures)
    shipped = DEFAULT if has_touch == has_sight else FEELING if has_touch else SEEING
    results = read_results(evaluation_folder(lab, NAME))
    if not results:
        return Choice(shipped, "the shipped default, for this lab has no evaluation that can be read.")
    try:
        against = _reasons_against(results, material)
        if not against:
            why = f"this lab's evaluation of {len(results['tested'])} textures: {results['default']['why']}"
            return Choice(str(results["default"]["method"]), why)
    except (KeyError, TypeError, AttributeError):
        against = ["is not as this version writes it"]
    why = f"the shipped default, for this lab's evaluation {' and '.join(against)}: it does not decide."
    return Choice(shipped, why)


def _reasons_against(results: Mapping[str, Any], material: Material) -> list[str]:
    """Return the reasons why an evaluation does not choose the method; empty where it does."""
    tested, textures = len(results["tested"]), len(results["data"]["textures"])
    reasons = {
        "was quick": results["quick"],
        f"had --epochs {results['epochs']}": results["epochs"] is not None,
        "had --early-stopping": results["early_stopping"],
        f"left {tested} of {textures} textures out": tested != textures and not results["quick"],
        f"was without {DEFAULT}": DEFAULT not in {row["method"] for row in results["tables"]["methods"]},
    }
    against = [why for why, holds in reasons.items() if holds]
    if not against and results["data"]["digest"] != digest_of(usable(material)[0]):
        return ["was of other textures, features or ratings"]
    return against
