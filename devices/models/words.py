"""A model's card as text, and tables of models as plain text."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from textwrap import wrap
from typing import Any

from palpate.devices.models.comparison import Apart
from palpate.devices.models.lookup import Listed
from palpate.signals.models.card import Card, Conv, Dense, Forest, Kernel, Mean, Nearest, Port, Residual, Step, Texture
from palpate.signals.models.card_steps import (
    Add,
    Attention,
    Autoregression,
    Cartesian,
    Join,
    Keep,
    Lstm,
    Norm,
    Part,
    Polar,
    Recall,
    Turn,
)
from palpate.signals.models.form import Values
from palpate.signals.models.runtime import Model

KINDS = {
    "force_profile": "a force profile", "ratings": "ratings", "texture_window": "a texture's last samples",
    "acceleration": "the next acceleration", "texture_drive": "speed, force and noise", "spectrum": "a spectrum",
}  # fmt: skip
NAME_WIDTH, LINE, MOST_LISTED = 12, 110, 8
KEPT = {"keep": "keep it as", "recall": "go on with", "add": "plus"}
PLAIN = {
    "turn": "channels and places change places", "polar": "magnitude and phase", "cartesian": "real and imaginary part",
}  # fmt: skip


def card_words(card: Card, tensors: Mapping[str, Values], file: str) -> str:
    """Return a description of a model: its inputs and outputs, its accuracy, its provenance."""
    count = sum(tensor.size for tensor in tensors.values())
    interval = ["none"]
    if card.interval is not None:
        widths = ", ".join(f"{half:.3g}" for half in card.interval.half_width)
        interval = [
            f"{100 * card.interval.coverage:g} % of new answers within +- {widths}",
            f"  {card.interval.method}",
        ]
    training = {name: value for name, value in card.training.items() if name != "metrics" or value != card.metrics}
    parts: dict[str, Sequence[str]] = {
        "file": (file, f"{card.weights.file}, {size_words(card.weights.bytes)}, intact: {card.weights.sha256[:16]}..."),
        "method": (card.method,),
        "takes": _port(card.takes),
        "gives": _port(card.gives),
        "texture": _texture(card.texture, tensors),
        "interval": interval,
        "metrics": [f"{name:<24} {value:.4g}" for name, value in card.metrics.items()] or ("none were written down",),
        "measured on": [f"{group}: {data}" for group, data in card.measured_on.items()],
        "MISSED": card.missed,
        "steps": tuple(step_words(card.steps, tensors)),
        "numbers": (f"{count} in {len(tensors)} arrays",),
        "training": tuple(_flat(training)) or ("nothing was written down",),
        "notes": card.notes or ("none",),
    }
    lines = [f"{card.name}: {card.title}"]
    for name, texts in parts.items():
        for place, line in enumerate(texts):
            indent = " " * (NAME_WIDTH + 2 + len(line) - len(line.lstrip()) + 3)
            start = f"  {name if not place else '':<{NAME_WIDTH}}"
            lines += wrap(start + line, LINE, subsequent_indent=indent, break_long_words=False)
    return "\n".join(lines)


def direction(card: Card) -> str:
    """Return a short description of a model's input and output."""
    return f"{KINDS[card.takes.kind].removeprefix('a ')} -> {KINDS[card.gives.kind].removeprefix('a ')}"


def size_words(size: int) -> str:
    """Return a number of bytes for people to read."""
    return f"{size / 1e6:.1f} MB" if size >= 1e5 else f"{size / 1e3:.1f} kB"


def step_words(steps: Sequence[Step], tensors: Mapping[str, Values], before: str = "") -> Iterator[str]:
    """Yield a line for each step, with nested steps under their number."""
    for place, step in enumerate(steps, start=1):
        number = f"{before}{place}"
        yield f"{number}. {_step(step, tensors)}"
        if isinstance(step, Residual):
            yield from step_words(step.steps, tensors, f"{number}.")
        if isinstance(step, Mean):
            for letter, member in enumerate(step.members, start=1):
                yield from step_words(member, tensors, f"{number}.{letter}.")


def _step(step: Step, tensors: Mapping[str, Values]) -> str:
    if isinstance(step, Conv):
        filters, channels, width = tensors[step.weight].shape
        return f"convolution: {filters} filters of width {width} over {channels} channels, {step.pad} zeros either side"
    if isinstance(step, Dense):
        return "dense: {1} to {0}".format(*tensors[step.weight].shape)
    if isinstance(step, Kernel):
        points, inputs = tensors[step.points].shape
        return f"Gaussian kernel of length {step.length:.4g} on {points} points of {inputs} numbers"
    if isinstance(step, Forest):
        return f"forest of {tensors[step.roots].size} trees, {tensors[step.feature].size} nodes"
    if isinstance(step, Nearest):
        return f"the nearest of {len(tensors[step.points])} examples"
    return signal_step(step, tensors) or _plain_step(step, tensors)


def _plain_step(step: Any, tensors: Mapping[str, Values]) -> str:
    words: Mapping[str, Callable[[], str]] = {
        "affine": lambda: f"times {_factor(step.gain, tensors)}, plus {_factor(step.offset, tensors)}",
        "door_features": lambda: f"{len(step.names)} features of the profile: {', '.join(step.names)}",
        "activation": lambda: step.function,
        "residual": lambda: "residual: relu(x + these steps)",
        "max_pool": lambda: f"greatest of every {step.size} neighbours",
        "upsample": lambda: f"every element {step.times} times",
        "reshape": lambda: f"as shape {' x '.join(map(str, step.shape))}",
        "mean": lambda: f"mean of {len(step.members)} members",
        "clip": lambda: f"kept within {step.low:g} and {step.high:g}",
        "playable": lambda: f"kept within {step.force_N:g} N and {step.slope_N_deg:g} N a degree",
    }
    return words[step.do]()


def _factor(given: float | str, tensors: Mapping[str, Values]) -> str:
    return f"{tensors[given].size} numbers" if isinstance(given, str) else f"{given:.6g}"


def _port(port: Port) -> list[str]:
    lines = [f"{KINDS[port.kind]}: {port.size} numbers, {port.unit}"]
    antonyms = port.antonyms or ("",) * len(port.names)
    lines += [
        f"  {name}{f' (0) to {other} (100)' if other else ''}" for name, other in zip(port.names, antonyms, strict=True)
    ]
    if port.within is not None:
        lines.append("  it answers to numbers from {:g} to {:g}; others are refused".format(*port.within))
    if port.scale is not None:
        lines.append("  0 and 100 are {:.4g} and {:.4g} on the scale that people answered on".format(*port.scale))
    return lines


def _texture(texture: Texture | None, tensors: Mapping[str, Values]) -> list[str]:
    if texture is None:
        return []
    hop = "" if texture.hop is None else f", {texture.hop} samples between spectra"
    lines = [
        f"{texture.label} ({texture.id}): {texture.rate_hz:g} Hz, {texture.window} samples looked back at{hop}",
        "  from recordings at {:.3g} to {:.3g} mm/s".format(*texture.speed_mm_s)
        + " and {:.3g} to {:.3g} N".format(*texture.force_N),
        f"  {texture.rms_m_s2:.3g} m/s^2 RMS; nothing beyond {texture.peak_m_s2:.3g} m/s^2 is played",
    ]
    if texture.start is not None:
        lines.append(f"  begins with {tensors[texture.start].size} samples of its own at 45 mm/s and 0.8 N")
    return lines


def _flat(facts: Mapping[str, Any], before: str = "") -> Iterator[str]:
    """Yield nested facts, one per line."""
    for name, value in facts.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{name}.")
        else:
            text = str(value)
            if isinstance(value, list):  # of many, the first: the card itself holds them all
                more = len(value) - MOST_LISTED
                text = ", ".join(map(str, value[:MOST_LISTED]))
                text += f", and {more} more (--json shows all)" if more > 0 else ""
            yield f"{before}{name}: {text}"


def signal_step(step: Step, tensors: Mapping[str, Values]) -> str:
    """Return a line on a step of a signal model; "" for other steps."""
    line = ""
    match step:
        case Join():
            line = f"join {', '.join(step.kept)} below it"
        case Part():
            line = f"{'places' if step.along == 'length' else 'channels'} {step.start + 1} to {step.stop}"
        case Keep() | Recall() | Add():
            line = f"{KEPT[step.do]} {step.kept}"
        case Turn() | Polar() | Cartesian():
            line = PLAIN[step.do]
        case Norm():
            line = f"layer normalisation of {tensors[step.weight].size} numbers"
        case Attention():
            line = f"attention: {step.heads} heads over {len(tensors[step.out])} channels"
            line += "" if step.memory is None else f" to {step.memory}"
            line += ", none after itself" if step.causal else ""
            line += "" if step.sparse is None else f", {step.sparse} places ask"
        case Lstm():
            gates, channels = tensors[step.weight].shape
            way = "from the last place to the first" if step.reverse else "from the first place on"
            line = f"long short-term memory: {channels} to {gates // 4}, {way}"
        case Autoregression():
            points, order = tensors[step.frequencies].shape
            line = f"autoregression of order {order} between {points} points over speed and force"
            line += f", {len(tensors[step.triangles])} triangles"
    return line


ERRORS = ("mae", "loop_fresh", "loop_judge", "waveform_mae")
"""The metrics that represent a model in the list; the first one that it has is used."""


ASKED = {"ratings": "profiles", "acceleration": "windows, for the mean of the next acceleration,", "spectrum": "hands"}
"""What models with these outputs are compared on."""


def aligned(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return columns side by side, headings first, with the last column unpadded."""
    widths = [max(len(row[place]) for row in (heads, *rows)) for place in range(len(heads))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in (heads, *rows)]
    return "\n".join(line.rstrip() for line in lines)


def list_row(model: Listed) -> dict[str, Any]:
    """Return a row of the list of models; for a broken model its error."""
    row = {"name": model.path.stem, "where": model.owner, "file": str(model.path)}
    card = model.card
    if card is None:
        empty = dict.fromkeys(("method", "direction", "error", "made", "size"), "-")
        return {**row, **empty, "title": model.other or f"BROKEN: {model.wrong}"}
    metric = next((name for name in ERRORS if name in card.metrics), None)
    error = "-" if metric is None else f"{card.metrics[metric]:.2f}" + ("" if metric == "mae" else f" ({metric})")
    # The day that the training wrote down, else the file's; a shipped file's day is that of the installation.
    made = card.training.get("made")
    day = made[:10] if isinstance(made, str) else "-"
    if not isinstance(made, str) and model.owner == "lab":
        day = datetime.fromtimestamp(model.path.stat().st_mtime, UTC).date().isoformat()
    return {
        **row, "method": card.method, "direction": direction(card), "error": error, "made": day,
        "size": size_words(card.weights.bytes), "title": card.title,
    }  # fmt: skip


def metrics_words(names: Sequence[str], models: Sequence[Model], milliseconds: Sequence[float]) -> str:
    """Return every metric of the cards, a column for each model, and the time of one answer on this machine."""
    cards = [model.card for model in models]
    rows = [["method", *(card.method for card in cards)]]
    rows += [
        [metric, *(f"{card.metrics[metric]:.4g}" if metric in card.metrics else "-" for card in cards)]
        for metric in dict.fromkeys(metric for card in cards for metric in card.metrics)
    ]
    rows += [["one answer here, ms", *(f"{ms:.3g}" for ms in milliseconds)]]
    rows += [["size", *(size_words(card.weights.bytes) for card in cards)]]
    return aligned(("", *names), rows)


def apart_words(pairs: Sequence[Apart], port: Port, count: int) -> str:
    """Return a description of how far each pair of models differs."""
    what = f"{count} {ASKED.get(port.kind, 'wishes')}"
    heads = ("", "", "mean", "greatest", "at")
    rows = [[pair.first, pair.second, f"{pair.mean:.3g}", f"{pair.greatest:.3g}", pair.at] for pair in pairs]
    lines = [f"\nanswers to the same {what} are apart by ({port.unit}):", aligned(heads, rows)]
    if port.names:
        named = [[f"{pair.first} - {pair.second}", *(f"{far:.2f}" for far in pair.by_name.values())] for pair in pairs]
        lines += ["\nmean by attribute:", aligned(("", *port.names), named)]
    return "\n".join(lines)
