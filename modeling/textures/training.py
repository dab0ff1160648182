"""Training of a lab's textures: one model file each, with the scores of the test part and a free run in its card."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from palpate.modeling.evaluate.engine import evaluate
from palpate.modeling.textures.domain import Fit, Play, TextureDomain, TextureResult, drive_for
from palpate.modeling.textures.evaluation.evaluate import TextureOptions, domain_for, waves
from palpate.modeling.textures.methods import Method
from palpate.modeling.textures.recording import Recording, TextureDataError, recording_digest
from palpate.modeling.textures.registry import METHODS
from palpate.modeling.textures.simulator import TextureSimulator
from palpate.modeling.training.history import history_in
from palpate.modeling.training.run_card import run_card
from palpate.modeling.training.trained_files import Written, write_trained
from palpate.protocols.progress import Report

ONE_STEP = ("mae", "mae_m_s2", "gfc", "explained")
FREE = ("level", "smoothed_gfc", "envelope", "cycle", "cycle_excess", "felt_dB")
"""The metrics of both in a card; the latter as free_level and so on."""


@dataclass(frozen=True)
class WrittenTexture(Written):
    """The model of a texture that was written.

    `cautions` are sentences on missed aims of its training, and on numbers that are not held-out ones.
    """

    texture: str
    cautions: tuple[str, ...] = ()


def train_textures(
    recordings: Sequence[Recording], simulator: TextureSimulator, options: TextureOptions, folder: Path,
    report: Report = lambda _line: None, methods: Mapping[str, Method] = METHODS,
) -> tuple[WrittenTexture, ...]:  # fmt: skip
    """Fit the requested methods to every texture, run each freely, and write texture-TEXTURE-METHOD into the folder.

    A model learns from the training part and is stopped by the validation part; the card's metrics are those of the
    test part (mae in SDs, mae_m_s2, gfc, explained) and of the free run (free_level, free_smoothed_gfc, ...); its
    `measured_on` describes hand and truth of the free run. Finished results of an earlier, equal command or evaluation
    are loaded from `options.work`. Raises TextureDataError for a recording that cannot be split, or where a method
    refuses one.
    """
    domain = domain_for(recordings, simulator, options, methods)
    for why in domain.left_out.values():
        raise TextureDataError(why)
    fits = [Fit(texture, name) for texture in domain.recordings for name in options.names]
    results = evaluate(domain, waves(domain, fits, [Play(fit) for fit in fits]), options, report)
    for fit in fits:
        if results[fit].refused:
            raise TextureDataError(f"{fit.name}: {results[fit].refused}")
    return tuple(_write(fit, results[fit], results[Play(fit)], domain, folder) for fit in fits)


def _write(
    fit: Fit, fitted: TextureResult, played: TextureResult, domain: TextureDomain, folder: Path
) -> WrittenTexture:
    """Write the evaluated model again, with its metrics and a description of their data in its card."""
    from safetensors.numpy import load_file

    from palpate.modeling.files.model_files import Exported, write_model
    from palpate.signals.models.card import Card

    if not fitted.files:
        raise TextureDataError(f"{fit.name}: there is no file of it.")
    scores = {name: fitted.numbers.get(name) for name in ONE_STEP}
    scores |= {f"free_{name}": played.numbers.get(name) for name in FREE}
    metrics = {name: float(value) for name, value in scores.items() if value is not None and math.isfinite(value)}
    card = Card.model_validate_json(fitted.files[0].read_bytes(), strict=True)
    drive = None if played.refused else drive_for(fit.texture, domain)
    measured_on = {"one step ahead": "the test part, which it was not trained on"}
    if drive is not None:
        measured_on["free"] = f"{drive.described}; {domain.seconds:g} s"
    exported = Exported(card.steps, load_file(fitted.files[1]))
    recording, parts = domain.recordings[fit.texture], domain.parts[fit.texture]
    settings = {
        **domain.settings, "seed": domain.seed, "method": fit.method, "made_from": list(recording.made_from),
        "parts": {name: list(map(list, getattr(parts, name))) for name in ("train", "validation", "test")},
        **{name: fitted.numbers[name] for name in ("window", "epochs") if fitted.numbers.get(name) is not None},
    }  # fmt: skip
    seconds = fitted.numbers.get("train_s") or 0.0
    training = run_card({"data": recording_digest(recording)}, settings, metrics, seconds)
    notes = [*card.notes, *([f"It was not run free: {played.refused}"] if played.refused else [])]
    if domain.settings.get("quick"):
        notes.append("A quick training, to try things out: few epochs. Its numbers are nothing to go by.")
    write = partial(
        write_model, name=card.name, exported=exported, title=card.title, method=card.method, takes=card.takes,
        gives=card.gives, texture=card.texture, metrics=metrics, measured_on=measured_on, missed=card.missed,
        training=training, notes=tuple(notes),
    )  # fmt: skip
    seen = (f"running free on {measured_on['free']}",) if drive is not None and drive.seen else ()
    files = write_trained(folder, write, history_in(fitted.arrays))
    return WrittenTexture(files[0], fit.method, metrics, files, fit.texture, (*card.missed, *seen))
