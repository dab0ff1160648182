"""An evaluation of textures as rows of plain values: every method on every texture, and over all of them.

The thesis' printed numbers are shown for reference; they come from other people's private recordings and are no target.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from palpate.modeling.evaluate.outputs import printed_numbers
from palpate.modeling.textures.domain import Fit, Play
from palpate.modeling.textures.drive import Drive
from palpate.modeling.textures.evaluation.evaluate import TextureEvaluation
from palpate.modeling.textures.free_run import beyond
from palpate.modeling.textures.metrics import mean_of
from palpate.modeling.textures.registry import THESIS
from palpate.modeling.training.history import history_in
from palpate.signals.arrays import Array
from palpate.signals.textures.gate import sounds

FILE = Path(__file__).resolve().parent / "thesis_numbers.yaml"
PRINTED = "thesis"
Row = dict[str, Any]
STEP = ("mae", "mae_m_s2", "gfc", "explained", "test_samples")
FREE = (
    "level", "smoothed_gfc", "raw_gfc", "envelope", "with_speed", "with_force", "cycle", "cycle_excess", "felt_dB",
    "greatest", "played_s",
)  # fmt: skip
MEAN_ALONE = ", its mean alone"
TRUTH, CEILING = "truth", "another realisation"
VARIANTS = ("ten", "ten_mfcc", "ten_wavelet", "foten")
"""The variants in Table 4.2."""
PERCENT = 100.0
WARM_UP, FIRST = 100, 400
"""Samples after which a model must be accurate (thesis 4.8), and samples that Figure 4.6 shows."""


def _read() -> Mapping[str, Any]:
    return printed_numbers(FILE)


def printed_errors(method: str, metric: str) -> tuple[dict[str, float], float] | None:
    """Return a method's "mae" or "gfc" (percent) in table 4.1, by texture and their mean; None where it has none."""
    numbers = _read()["table_4_1"].get(method)
    if numbers is None:
        return None
    cells = dict(zip(_read()["textures"], map(float, numbers[metric]), strict=True))
    return cells, float(numbers[f"{metric}_mean"])


def printed_variant(method: str) -> Mapping[str, float] | None:
    """Return a variant's window, mean MAE and mean GFC (percent) in table 4.2; None where it has none."""
    numbers: Mapping[str, float] | None = _read()["table_4_2"].get(method)
    return numbers


def printed_times(method: str) -> Mapping[str, float] | None:
    """Return window, inference on GPU and CPU (ms) and seconds of an epoch in table 4.3; None where it has none."""
    numbers: Mapping[str, float] | None = _read()["table_4_3"].get(method)
    return numbers


def texture_rows(evaluation: TextureEvaluation) -> list[Row]:
    """Return a row for each method on each texture: one step ahead, in the free run, and the limits that it breaks."""
    rows: list[Row] = []
    for fit, done in evaluation.fits.items():
        if fit.of_the_grid:
            continue
        play = evaluation.plays[Play(fit)]
        numbers = {name: done.numbers.get(name) for name in ("window", "train_s", "epochs", "epoch_s", "bytes", *STEP)}
        rows.append(
            {
                "texture": fit.texture,
                "method": fit.method,
                "title": evaluation.method(fit.method).title,
                **numbers,
                **{name: play.numbers.get(name) for name in FREE},
                "beyond": " ".join(beyond(play.numbers, evaluation.ceilings.get(fit.texture, {}))),
                "refused": done.refused or play.refused or None,
            }
        )
    return rows


def free_rows(evaluation: TextureEvaluation) -> list[Row]:
    """Return the free runs by texture: the truth, another realisation, every method, ours also by its mean."""
    rows: list[Row] = []
    for texture in evaluation.drives:
        beside = ((TRUTH, evaluation.truths[texture]), (CEILING, evaluation.ceilings[texture]))
        rows += [_free_row(texture, name, name, numbers, {}) for name, numbers in beside if numbers]
        for play, done in evaluation.plays.items():
            if play.fit.texture == texture and not done.refused:
                alone = "" if play.sampled else MEAN_ALONE
                title = evaluation.method(play.fit.method).title + alone
                again = evaluation.ceilings[texture]
                rows.append(_free_row(texture, play.fit.method + alone, title, done.numbers, again))
    return rows


def _free_row(
    texture: str, method: str, title: str, numbers: Mapping[str, float | None], again: Mapping[str, float | None]
) -> Row:
    columns = {name: numbers.get(name) for name in FREE}
    return {"texture": texture, "method": method, "title": title, **columns, "beyond": " ".join(beyond(numbers, again))}


def warm_up_rows(evaluation: TextureEvaluation) -> list[Row]:
    """Return a row for each method that ran freely on a texture: its level against the truth's (RMS ratio).

    It is taken in the first 100 samples from where the hand touches and moves, and in the 300 after these (thesis 4.8:
    accurate after fewer than 100 iterations).
    """
    rows = []
    for play, done in evaluation.plays.items():
        if done.refused or not play.sampled or play.fit.texture not in evaluation.drives:
            continue
        begin, after = warm_up(evaluation.drives[play.fit.texture], done.array("made"))
        title = evaluation.method(play.fit.method).title
        rows.append({"texture": play.fit.texture, "method": play.fit.method, "title": title, "level_first_100": begin,
                     "level_next_300": after})  # fmt: skip
    return rows


def start_of(drive: Drive) -> int:
    """Return the first sample at which the hand touches and moves, where a model that is silent at rest begins."""
    return int(np.argmax(sounds(drive.speed, drive.force)))


def warm_up(drive: Drive, generated: Array) -> tuple[float | None, float | None]:
    """Return the RMS of `generated` (n,) over the truth's in samples 0 to 99 and 100 to 399 from `start_of`.

    None where the truth is silent.
    """
    levels = []
    for first, last in ((0, WARM_UP), (WARM_UP, FIRST)):
        part = slice(start_of(drive) + first, start_of(drive) + last)
        truth = float(np.sqrt(np.mean(drive.truth[part] ** 2)))
        own = float(np.sqrt(np.mean(generated[part].astype(np.float64) ** 2)))
        levels.append(own / truth if truth > 0 else None)
    return levels[0], levels[1]


def method_rows(evaluation: TextureEvaluation) -> list[Row]:
    """Return a row for each method over all textures: means, and the worst of the numbers that have a limit."""
    rows = texture_rows(evaluation)
    return [
        _method_row([row for row in rows if row["method"] == name], evaluation, name)
        for name in evaluation.options.names
    ]


def _method_row(rows: list[Row], evaluation: TextureEvaluation, name: str) -> Row:
    def mean(column: str) -> float | None:
        return mean_of(row[column] for row in rows)

    ran = [row for row in rows if row["level"] is not None]
    runtime, step = fastest(evaluation, name)
    return {
        "method": name,
        "title": evaluation.method(name).title,
        "window": mean("window"),
        "mae": mean("mae"),
        "gfc": mean("gfc"),
        "explained": mean("explained"),
        "kept": sum(not row["beyond"] for row in ran),
        "ran": len(ran),
        "level_low": least(row["level"] for row in ran),
        "level_high": most(row["level"] for row in ran),
        "smoothed_gfc": least(row["smoothed_gfc"] for row in ran),
        "envelope": least(row["envelope"] for row in ran),
        "cycle_excess": most(row["cycle_excess"] for row in ran),
        "felt_dB": mean("felt_dB"),
        "train_s": mean("train_s"),
        "epoch_s": mean("epoch_s"),
        "bytes": mean("bytes"),
        "runtime": runtime,
        "step_us": step,
        "refused": sum(row["refused"] is not None for row in rows),
        "source": evaluation.method(name).source,
    }


def fastest(evaluation: TextureEvaluation, method: str) -> tuple[str | None, float | None]:
    """Return the runtime with the least median time of a step, and that time in us."""
    steps = evaluation.steps.get(method)
    if not steps:
        return None, None
    name = min(steps, key=lambda runtime: steps[runtime][0])
    return name, steps[name][0]


def least(values: Iterable[float | None]) -> float | None:
    """Return the least of the numbers, None where there are none."""
    return min((value for value in values if value is not None), default=None)


def most(values: Iterable[float | None]) -> float | None:
    """Return the greatest of the numbers, None where there are none."""
    return max((value for value in values if value is not None), default=None)


def table_4_1(evaluation: TextureEvaluation) -> list[Row]:
    """Return MAE (SDs of the training part) and GFC (percent) by method and texture, each above the thesis' row."""
    rows: list[Row] = []
    for name in evaluation.options.names:
        for metric, gain in (("mae", 1.0), ("gfc", PERCENT)):
            values = {
                texture: evaluation.fits[Fit(texture, name)].numbers.get(metric) for texture in evaluation.textures
            }
            cells = {texture: None if value is None else gain * value for texture, value in values.items()}
            title = evaluation.method(name).title
            own = {"method": name, "title": title, "metric": metric, "printed": False}
            rows.append({**own, **cells, "mean": mean_of(cells.values())})
            printed = printed_errors(name, metric)
            if printed is not None:
                theirs = {texture: printed[0].get(texture) for texture in evaluation.textures}
                row = {
                    "method": f"{name}, {PRINTED}",
                    "title": f"{title}, {PRINTED}",
                    "metric": metric,
                    "printed": True,
                }
                rows.append({**row, **theirs, "mean": printed[1]})
    return rows


def table_4_2(evaluation: TextureEvaluation) -> list[Row]:
    """Return the variants of our network: window, mean MAE (SDs), mean GFC in percent, and the thesis' values."""
    rows: list[Row] = []
    overall = {row["method"]: row for row in method_rows(evaluation)}
    for name in VARIANTS:
        if name in overall:
            row, theirs = overall[name], printed_variant(name) or {}
            gfc = None if row["gfc"] is None else PERCENT * row["gfc"]
            rows.append(
                {"method": name, "title": row["title"], "window": row["window"], "mae": row["mae"], "gfc": gfc}
                | {f"thesis_{key}": theirs.get(key) for key in ("window", "mae", "gfc")}
            )
    return rows


def table_4_3(evaluation: TextureEvaluation) -> list[Row]:
    """Return times and errors, a row for each method and runtime, with the thesis' times.

    Times of a step (us) and an epoch; errors of felt levels (dB) and MAE (SDs) over the textures.
    """
    rows: list[Row] = []
    for row in method_rows(evaluation):
        theirs = printed_times(row["method"]) or {}
        known = {name: row[name] for name in ("window", "felt_dB", "mae", "epoch_s", "train_s")}
        steps = evaluation.steps.get(row["method"], {})
        for runtime, (median, p99, error) in steps.items() or ((None, (None, None, None)),):
            rows.append(
                {"method": row["method"], "title": row["title"], **known, "runtime": runtime, "median_us": median}
                | {"p99_us": p99, "error": error}
                | {f"thesis_{key}": theirs.get(key) for key in ("window", "gpu_ms", "cpu_ms", "epoch_s")}
            )
    return rows


def figure_4_5(evaluation: TextureEvaluation) -> list[Row]:
    """Return the mean MAE over the textures (SDs) for each window and loss of the thesis' network.

    Empty where they were not compared.
    """
    return [
        {name: row[name] for name in ("window", "loss", "mae", "textures")}
        for row in grid_rows(evaluation)
        if row["method"] == THESIS
    ]


def grid_rows(evaluation: TextureEvaluation) -> list[Row]:
    """Return a row for each method, window and loss that were compared (thesis 4.6.2, 4.6.3).

    Means over the textures of the test part's MAE (SDs) and GFC (percent), and of the validation part's MAE (m/s^2).

    `chosen` marks the window and loss of a method with the least MAE on the validation part: a choice by the test part
    would be biased towards the best of 25.
    """
    cells: dict[tuple[str, int, str], list[Mapping[str, float | None]]] = {}
    for fit, done in evaluation.fits.items():
        if fit.window is not None and fit.loss is not None:
            cells.setdefault((fit.method, fit.window, fit.loss), []).append(done.numbers)
    rows: list[Row] = []
    for (method, window, loss), results in cells.items():
        mae, gfc, validation = ([result.get(name) for result in results] for name in ("mae", "gfc", "validation_mae"))
        share = mean_of(gfc)
        rows.append(
            {"method": method, "window": window, "loss": loss, "mae": mean_of(mae),
             "gfc": None if share is None else PERCENT * share, "validation_mae": mean_of(validation),
             "textures": sum(value is not None for value in mae), "chosen": False}
        )  # fmt: skip
    for method in {row["method"] for row in rows}:
        tried = [row for row in rows if row["method"] == method and row["validation_mae"] is not None]
        for row in sorted(tried, key=lambda row: row["validation_mae"])[:1]:
            row["chosen"] = True
    return rows


def curve_rows(evaluation: TextureEvaluation) -> list[Row]:
    """Return the learning curves, a row for each epoch."""
    return [
        {"texture": fit.texture, "method": fit.method, **epoch.plain()}
        for fit, done in evaluation.fits.items()
        for epoch in history_in(done.arrays)
    ]
