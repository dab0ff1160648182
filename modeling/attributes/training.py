"""Training of a lab's model on all textures; its card has the errors of leaving each texture out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, cast

from palpate.modeling.attributes.domain import learning
from palpate.modeling.attributes.entries import Entry, Own
from palpate.modeling.attributes.evaluation.evaluate import AttributeEvaluation, AttributeOptions, evaluate_methods
from palpate.modeling.attributes.evaluation.report import banners
from palpate.modeling.attributes.evaluation.tables import RANDOM, method_rows, resnet_of, title_of
from palpate.modeling.attributes.folds import whole_fold
from palpate.modeling.attributes.material import FEW_READ, QUICK_LOOK, Material, MaterialError
from palpate.modeling.attributes.methods import Learning, Method
from palpate.modeling.attributes.model_file import NAME, ModelFileError, Saveable, read_card, write_model
from palpate.modeling.evaluate.intervals import COVERAGE, half_widths, needed
from palpate.modeling.training.history import history_of
from palpate.modeling.training.run_card import run_card
from palpate.modeling.training.trained_files import Written, write_trained
from palpate.protocols.progress import Report
from palpate.protocols.wording import count
from palpate.signals.models.card import Interval

METRICS = ("mae", "rmse", "within_jnd", "coverage")


@dataclass(frozen=True)
class WrittenAttributes(Written):
    """The model of attributes that was written, with half the width of its card's intervals, (attributes,).

    `banners` are warnings to show before its numbers. `resnet` names the weights of ResNet-50, where the method uses
    its features.
    """

    half_width: tuple[float, ...] = ()
    banners: tuple[str, ...] = ()
    resnet: str | None = None


def train_attributes(
    material: Material, method: str, options: AttributeOptions, folder: Path, methods: Mapping[str, Method], own: Own,
    report: Report = lambda _line: None,
) -> WrittenAttributes:  # fmt: skip
    """Fit a method to the rated textures and write it as texture-attributes into the folder.

    It is fitted to all textures; a method that stops early watches a tenth of them, which its card names. The card's
    metrics and intervals come from leaving each texture out, which is done first; finished results of an evaluation of
    the same textures are reused from `options.work`. Raises MaterialError where the method refuses the textures,
    ModelFileError where it cannot be saved.
    """
    from palpate.modeling.training.threads import limited

    evaluation = evaluate_methods(material, replace(options, methods=(method,), ablations=False), methods, own, report)
    entry = evaluation.entries[0]
    if why := evaluation.refused(entry):
        raise MaterialError(f"{method}: {why}")
    fold = whole_fold(evaluation.material, evaluation.options.seed)
    settings, seed = evaluation.options.settings, evaluation.options.seed
    data = learning(evaluation.material, fold, evaluation.method(entry), entry, seed, settings)
    report(f"fitting {method} to {_size_of(data)}")
    clock = evaluation.domain.clock
    start = clock()
    with limited(1):
        fitted = evaluation.method(entry).fit(data)
    seconds = clock() - start
    card = _card(evaluation, entry, data, seconds)
    write = partial(write_model, fitted=cast(Saveable, fitted), card=card, methods=methods)
    files = write_trained(folder, write, history_of(fitted), last=not data.held)
    interval = card["interval"]
    wide = () if interval is None else tuple(interval["half_width"])
    warnings = tuple(banners(evaluation))
    return WrittenAttributes(files[0], method, card["metrics"], files, wide, warnings, resnet_of(material, entry))


def demand_no_loss(folder: Path) -> None:
    """Raise ModelFileError where a quick training's model would replace one that was not trained with --quick."""
    path = folder / f"{NAME}.json"
    try:
        card = read_card(path)
    except ModelFileError:
        return
    if not card.quick:
        raise ModelFileError(
            f"{path}: this model ({card.method}, of {len(card.learned)} textures) was not trained with --quick, and a"
            " quick one would replace it: name another folder with --to, or let it be replaced with --replace"
        )


def _size_of(data: Learning) -> str:
    """Return the numbers of training and of watched textures as text."""
    watched = f", {len(data.held)} more are watched to stop early" if data.held else ""
    return f"{count(len(data.train), 'texture')}{watched}"


def _card(evaluation: AttributeEvaluation, entry: Entry, data: Learning, seconds: float) -> dict[str, Any]:
    """Return the fields of the model's card."""
    material = evaluation.material
    row = next(row for row in method_rows(evaluation) if row["method"] == entry.method)
    metrics = {name: float(row[name]) for name in METRICS if row[name] is not None}
    settings = {
        **evaluation.options.settings, "seed": evaluation.options.seed, "method": entry.method, "touch": entry.touch,
        "sight": entry.sight, "left_out": len(evaluation.tested),
        "watched": tuple(texture.id for texture in data.held),
    }  # fmt: skip
    interval = None
    if len(evaluation.tested) >= needed(COVERAGE):
        wide = half_widths(evaluation.predicted(entry) - evaluation.rated())
        method = f"quantile of {len(evaluation.tested)} errors, each of a texture that was left out"
        interval = Interval(method=method, coverage=COVERAGE, half_width=tuple(wide.tolist())).model_dump()
    return {
        "name": NAME,
        "title": f"How textures feel, by {title_of(evaluation, entry)}",
        "method": entry.method,
        "attributes": tuple((pair.low, pair.high) for pair in material.attributes),
        "touch": entry.touch,
        "sight": entry.sight,
        "weights": material.weights if "resnet" in entry.sight else "",
        "simulated": material.simulated,
        "metrics": metrics,
        "interval": interval,
        "learned": tuple(sorted(material.ids)),
        "training": run_card({"textures": evaluation.domain.digest}, settings, metrics, seconds),
        "notes": _notes(evaluation, entry, data),
    }


def _notes(evaluation: AttributeEvaluation, entry: Entry, data: Learning) -> tuple[str, ...]:
    """Return the notes of the model's card."""
    notes = [f"Fitted to {_size_of(data)}; the metrics are those of leaving one out."]
    if resnet_of(evaluation.material, entry) == RANDOM:
        notes.append("ResNet-50 had random weights: the metrics and the interval come from untrained features.")
    notes += [f"Not used: {line}." for line in evaluation.unused()]
    if evaluation.material.simulated:
        notes.append("Simulated raters: this model says nothing about how a texture feels to people.")
    if evaluation.options.quick:
        notes.append("A quick training, to try things out: few epochs, five textures left out. Nothing to go by.")
        notes += [f"Learned from: {note}" for note in evaluation.material.notes if note in (QUICK_LOOK, FEW_READ)]
    return tuple(notes)
