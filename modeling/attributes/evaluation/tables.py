"""The tables of an evaluation, as rows of plain values.

The thesis' printed numbers are shown for reference; they come from other people's private data and are no target."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from palpate.modeling.attributes.domain import LeaveOut, textures_named
from palpate.modeling.attributes.entries import KINDS, MAIN, PROPOSED, SAME, Entry
from palpate.modeling.attributes.evaluation.evaluate import AttributeEvaluation
from palpate.modeling.attributes.feature_times import steps_of
from palpate.modeling.attributes.material import Material
from palpate.modeling.attributes.scores import Errors, by_class, difference, errors
from palpate.modeling.evaluate.intervals import COVERAGE, half_widths, needed, nested_coverage
from palpate.modeling.evaluate.outputs import printed_numbers
from palpate.modeling.training.history import COLUMNS

FILE = Path(__file__).resolve().parent / "thesis_numbers.yaml"
PRINTED = "thesis"
Which = Literal["mae", "rmse", "same_features", "kinds"]
Row = dict[str, Any]
PRETRAINED = "pre-trained"
"""The thesis' ResNet-50 (3.4.2)."""
RANDOM = "random"
"""The beginning of a material's description of untrained weights of ResNet-50."""


def printed(which: Which, method: str, features: str = "") -> Mapping[str, float] | None:
    """Return the thesis' line of Table 3.2 ("mae"), 3.3 ("rmse"), 3.4 or 3.5 by attribute, with their `mean`.

    The mean is computed here, since the thesis does not print it. None where the thesis has no such line. For "kinds",
    `features` are named as those of our entries.
    """
    numbers: Mapping[str, Any] = printed_numbers(FILE)
    line = numbers[which]["cells"].get(method)
    if isinstance(line, Mapping):
        line = line.get(features)
    if line is None:
        return None
    cells = {name: float(value) for name, value in zip(numbers["attributes"], line, strict=True)}
    return {**cells, "mean": sum(cells.values()) / len(cells)}


def number_of(which: Which) -> str:
    """Return the table's number in the thesis."""
    return str(printed_numbers(FILE)[which]["table"])


def names_of(evaluation: AttributeEvaluation) -> list[str]:
    """Return the attributes' names in tables."""
    return [pair.name for pair in evaluation.domain.attributes]


def scored(evaluation: AttributeEvaluation, entry: Entry) -> Errors | None:
    """Return an entry's errors; None where it was refused."""
    return None if evaluation.refused(entry) else errors(evaluation.predicted(entry), evaluation.rated())


def method_rows(evaluation: AttributeEvaluation) -> list[Row]:
    """Return a row for each method with its own features: errors, intervals, times, and differences from others.

    `best_*` is the paired difference of MAE from the best method, `ours_*` from the thesis' network, both over
    textures; positive where the row's method has the larger error. All intervals of both hold jointly with 95 %.
    """
    main = evaluation.of(MAIN)
    scores = {entry: off for entry in main if (off := scored(evaluation, entry)) is not None}
    best = min(scores, key=lambda entry: scores[entry].mean_mae, default=None)
    ours = next((entry for entry in scores if entry.method == PROPOSED), None)
    # the compared pairs of methods; that of the best method and the thesis' network counts once
    pairs = {frozenset((entry, other)) for entry in scores for other in (best, ours) if other not in (None, entry)}
    compared = len(pairs)
    rows = []
    for entry in main:
        own = scores.get(entry)
        beside = {name: None if other is None else scores[other] for name, other in (("best", best), ("ours", ours))}
        of: Row = {"method": entry.method, "title": title_of(evaluation, entry), "features": features_of(entry)}
        of |= {"resnet": resnet_of(evaluation.material, entry)}
        if own is None:
            of |= dict.fromkeys(("mae", "rmse", "within_jnd"))
        else:
            of |= {"mae": own.mean_mae, "rmse": own.mean_rmse, "within_jnd": own.all_within}
        rows.append({**of, **_interval(evaluation, entry, own is not None), **_times(evaluation, entry),
                     **_differences(evaluation, own, beside, compared), "refused": evaluation.refused(entry) or None,
                     "source": evaluation.method(entry).source})  # fmt: skip
    return rows


def features_of(entry: Entry) -> str:
    """Return the kinds of features, "mfcc+hand+resnet+glcm"."""
    return "+".join((*entry.touch, *entry.sight))


def resnet_of(material: Material, entry: Entry) -> str | None:
    """Return the weights of ResNet-50, RANDOM or a file's name; None where the entry has no features of it."""
    if "resnet" not in entry.sight:
        return None
    return RANDOM if material.weights.startswith(RANDOM) else material.weights.partition(",")[0] or "not told"


def title_of(evaluation: AttributeEvaluation, entry: Entry) -> str:
    """Return the method's title, with a remark where its features come from an untrained ResNet-50."""
    title = evaluation.method(entry).title
    return f"{title}, random ResNet-50" if resnet_of(evaluation.material, entry) == RANDOM else title


def _differences(
    evaluation: AttributeEvaluation, own: Errors | None, beside: dict[str, Errors | None], compared: int
) -> Row:
    row: Row = {}
    for name, other in beside.items():
        off = None
        if own is not None and other is not None and own is not other:
            off = difference(own.texture_mae, other.texture_mae, evaluation.groups(), compared)
        ends = (None, None, None) if off is None else (off.mean, off.low, off.high)
        row |= dict(zip((f"{name}_less", f"{name}_low", f"{name}_high"), ends, strict=True))
        row[f"{name}_chance"] = None if off is None else off.chance
    return row


def _interval(evaluation: AttributeEvaluation, entry: Entry, answered: bool) -> Row:
    """Return the half width of 90 % intervals (mean over the attributes), and the share of ratings in such intervals.

    For `coverage` the intervals of each group of textures are computed from the residuals of the other groups.
    """
    blank: Row = {"half_width": None, "coverage": None}
    if not answered or len(evaluation.tested) < needed(COVERAGE):
        return blank
    residual = evaluation.predicted(entry) - evaluation.rated()
    row = {**blank, "half_width": float(half_widths(residual).mean())}
    groups = evaluation.groups()
    if min(sum(group != own for group in groups) for own in groups) < needed(COVERAGE):
        return row
    return {**row, "coverage": nested_coverage(residual, groups).overall}


def _times(evaluation: AttributeEvaluation, entry: Entry) -> Row:
    """Return the seconds of a method's features for one texture, of one training, and of one prediction."""
    done = [result.numbers for result in evaluation.results_of(entry) if not result.refused]
    steps = steps_of((*entry.touch, *entry.sight))
    features = (
        sum(evaluation.times[step] for step in steps) if all(step in evaluation.times for step in steps) else None
    )
    return {
        "features_s": features,
        "train_s": float(np.median([numbers["train_s"] for numbers in done])) if done else None,
        "all_train_s": float(np.sum([numbers["train_s"] for numbers in done])) if done else None,
        "answer_s": float(np.median([numbers["asked_s"] for numbers in done])) if done else None,
    }


def attribute_rows(evaluation: AttributeEvaluation) -> list[Row]:
    """Return MAE, RMSE, share within the JND and half width of the 90 % interval, by method and attribute."""
    rows: list[Row] = []
    for entry in evaluation.of(MAIN):
        if (scores := scored(evaluation, entry)) is None:
            continue
        wide: Sequence[float | None] = [None] * len(scores.mae)
        if len(evaluation.tested) >= needed(COVERAGE):
            wide = half_widths(evaluation.predicted(entry) - evaluation.rated()).tolist()
        for name, *values in zip(names_of(evaluation), scores.mae, scores.rmse, scores.within, wide, strict=True):
            numbers = dict(zip(("mae", "rmse", "within_jnd", "half_width"), values, strict=True))
            rows.append({"method": entry.method, "title": title_of(evaluation, entry), "attribute": name, **numbers})
    return rows


def class_rows(evaluation: AttributeEvaluation) -> list[Row]:
    """Return MAE, RMSE and share within the JND by method, class and attribute, with a row over all attributes."""
    rows: list[Row] = []
    classes = [texture.category for texture in textures_named(evaluation.material, evaluation.tested)]
    for entry in evaluation.of(MAIN):
        if evaluation.refused(entry):
            continue
        for name, (count, scores) in by_class(evaluation.predicted(entry), evaluation.rated(), classes).items():
            own = {"method": entry.method, "title": title_of(evaluation, entry), "class": name, "textures": count}
            for place, attribute in enumerate(names_of(evaluation)):
                rows.append({**own, "attribute": attribute, "mae": scores.mae[place], "rmse": scores.rmse[place],
                             "within_jnd": scores.within[place]})  # fmt: skip
            rows.append({**own, "attribute": "all", "mae": scores.mean_mae, "rmse": scores.mean_rmse,
                         "within_jnd": scores.all_within})  # fmt: skip
    return rows


def table_rows(evaluation: AttributeEvaluation, which: Which) -> list[Row]:
    """Return table 3.2 ("mae"), 3.3 ("rmse"), 3.4 ("same_features") or 3.5 ("kinds").

    There is a row for each entry, followed by the thesis' row if it has one.
    """
    table = {"same_features": SAME, "kinds": KINDS}.get(which, MAIN)
    rows: list[Row] = []
    for entry in evaluation.of(table):
        scores = scored(evaluation, entry)
        values = None if scores is None else scores.mae if which == "mae" else scores.rmse
        title, names = title_of(evaluation, entry), names_of(evaluation)
        own = {"method": entry.method, "title": title, "features": features_of(entry),
               "resnet": resnet_of(evaluation.material, entry), "printed": False}  # fmt: skip
        cells = dict.fromkeys((*names, "mean")) if values is None else {**dict(zip(names, values, strict=True)),
                                                                         "mean": float(np.mean(values))}  # fmt: skip
        rows.append({**own, **cells})
        theirs = printed(which, entry.method, features_of(entry))
        if theirs is not None and all(name in theirs for name in names):
            printed_row: Row = {
                "method": f"{entry.method}, {PRINTED}",
                "title": f"{evaluation.method(entry).title}, {PRINTED}",
            }
            printed_row |= {"printed": True, "resnet": PRETRAINED if "resnet" in entry.sight else None}
            rows.append({**own, **printed_row, **{name: theirs[name] for name in (*names, "mean")}})
    return rows


def prediction_rows(evaluation: AttributeEvaluation) -> list[Row]:
    """Return every prediction with its rating, both on 0..100, by method, texture and attribute."""
    rows: list[Row] = []
    for entry in evaluation.of(MAIN):
        if evaluation.refused(entry):
            continue
        for texture in textures_named(evaluation.material, evaluation.tested):
            done, rated = evaluation.results[LeaveOut(entry, texture.id)], texture.rated
            for place, attribute in enumerate(names_of(evaluation)):
                rows.append({
                    "method": entry.method, "title": title_of(evaluation, entry), "texture": texture.id,
                    "class": texture.category, "attribute": attribute,
                    "rated": None if rated is None else float(rated.mean[place]),
                    "rated_sd": None if rated is None or not math.isfinite(rated.sd[place]) else float(rated.sd[place]),
                    "predicted": float(done.predicted[place]), "spread": float(done.arrays["spread"][place]),
                })  # fmt: skip
    return rows


def curve_rows(evaluation: AttributeEvaluation) -> list[Row]:
    """Return the learning curves of the methods with their own features, a row for each epoch."""
    rows: list[Row] = []
    for entry in evaluation.of(MAIN):
        for done in evaluation.results_of(entry):
            columns = [done.arrays[f"curve_{name}"].tolist() for name in COLUMNS if f"curve_{name}" in done.arrays]
            rows += [{"method": entry.method, "without": done.job.test, **dict(zip(COLUMNS, values, strict=True))}
                     for values in zip(*columns, strict=True)]  # fmt: skip
    return rows


def fold_rows(evaluation: AttributeEvaluation) -> list[Row]:
    """Return the folds: the tested texture, the number of training textures, the held ones, and those apart."""
    return [
        {"test": fold.test, "known": len(fold.known), "held": " ".join(fold.held if evaluation.watching else ()),
         "apart": " ".join(fold.apart)}
        for fold in evaluation.domain.folds.values()
    ]  # fmt: skip
