"""Tables of models as plain text."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

from palpate.devices.models.comparing import Apart
from palpate.devices.models.finding import Listed
from palpate.devices.models.words import direction, size_words
from palpate.signals.models.card import Card, Port
from palpate.signals.models.runtime import Model

ERRORS = ("mae", "loop_fresh", "loop_judge", "waveform_mae")
"""The metrics that stand for a model in the list, the first that there is."""


ASKED = {"ratings": "profiles", "acceleration": "windows, for the mean of the next acceleration,", "spectrum": "hands"}
"""What models that give this are compared on."""


def aligned(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Columns side by side, the first lines over them; the last column as long as it is."""
    widths = [max(len(row[place]) for row in (heads, *rows)) for place in range(len(heads))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in (heads, *rows)]
    return "\n".join(line.rstrip() for line in lines)


def list_row(model: Listed) -> dict[str, Any]:
    """One model of the list; a broken one with its complaint."""
    row = {"name": model.path.stem, "where": model.owner, "file": str(model.path)}
    card = model.card
    if card is None:
        empty = dict.fromkeys(("method", "direction", "error", "made", "size"), "-")
        return {**row, **empty, "title": model.other or f"BROKEN: {model.wrong}"}
    return {
        **row, "method": card.method, "direction": direction(card), "error": _error(card), "made": _made(model, card),
        "size": size_words(card.weights.bytes), "title": card.title,
    }  # fmt: skip


def metrics_words(names: Sequence[str], models: Sequence[Model], milliseconds: Sequence[float]) -> str:
    """Every metric that a card has, a column for each model, and the time of one answer on this machine."""
    metrics = dict.fromkeys(metric for model in models for metric in model.card.metrics)
    rows = [["method", *(model.card.method for model in models)]]
    rows += [[metric, *(_number(model.card.metrics.get(metric)) for model in models)] for metric in metrics]
    rows += [["one answer here, ms", *(f"{ms:.3g}" for ms in milliseconds)]]
    rows += [["size", *(size_words(model.card.weights.bytes) for model in models)]]
    return aligned(("", *names), rows)


def apart_words(told: Sequence[Apart], port: Port, count: int) -> str:
    """How far each pair of models is apart."""
    what = f"{count} {ASKED.get(port.kind, 'wishes')}"
    heads = ("", "", "mean", "greatest", "at")
    rows = [[pair.first, pair.second, f"{pair.mean:.3g}", f"{pair.greatest:.3g}", pair.at] for pair in told]
    lines = [f"\nanswers to the same {what} are apart by ({port.unit}):", aligned(heads, rows)]
    if port.names:
        named = [[f"{pair.first} - {pair.second}", *(f"{far:.2f}" for far in pair.by_name.values())] for pair in told]
        lines += ["\nmean by attribute:", aligned(("", *port.names), named)]
    return "\n".join(lines)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _error(card: Card) -> str:
    name = next((name for name in ERRORS if name in card.metrics), None)
    if name is None:
        return "-"
    return f"{card.metrics[name]:.2f}" if name == "mae" else f"{card.metrics[name]:.2f} ({name})"


def _made(model: Listed, card: Card) -> str:
    """The day that the training wrote down, else the file's; a shipped file's day is that of the installation."""
    told = card.training.get("made")
    if isinstance(told, str) or model.owner != "lab":
        return told[:10] if isinstance(told, str) else "-"
    return datetime.fromtimestamp(model.path.stat().st_mtime, UTC).date().isoformat()
