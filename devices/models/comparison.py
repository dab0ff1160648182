"""Models side by side: their cards, and how far apart their answers to the same inputs are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from palpate.devices.models.answers import NEUTRAL, TOP
from palpate.signals.arrays import Array
from palpate.signals.models.card import Port, Texture
from palpate.signals.models.errors import ModelInputError
from palpate.signals.models.fastest import fastest
from palpate.signals.models.runtime import Model

STUDY = Path(__file__).resolve().parents[2] / "studies" / "door_ratings" / "profiles"
"""The profiles on which models of perception are compared by default."""
ASIDE = (10.0, 90.0)
"""The wishes on which models of a profile are compared: one attribute at these, the others at 50 (thesis 5.7.1)."""
WINDOW = "texture_window"
DRIVE = "texture_drive"
SIDE = 5
"""Number of speeds, and of forces, evenly from the least to the greatest of the first model's recording."""
WARM_UP = 200
"""Number of samples before the window that is used."""


@dataclass(frozen=True)
class Apart:
    """Two models' answers: mean and greatest absolute difference, in the unit of the answers, and where it occurs."""

    first: str
    second: str
    mean: float
    greatest: float
    at: str
    by_name: dict[str, float]


@dataclass(frozen=True)
class Inputs:
    """The inputs of all models, (n, in), and a name for each row. A model gets its own last samples of a window."""

    rows: Array
    names: tuple[str, ...]


def require_alike(models: Sequence[Model]) -> None:
    """Raise ModelInputError if the models' inputs or outputs differ, saying which.

    Models of one texture may have windows of different lengths.
    """
    first = models[0].card
    if first.takes.kind in (WINDOW, DRIVE):
        require_one_texture(models)
    for model in models[1:]:
        for side, mine, other in (("takes", first.takes, model.card.takes), ("gives", first.gives, model.card.gives)):
            sizes = (mine.size, other.size) if first.takes.kind != WINDOW else (0, 0)
            if (mine.kind, sizes[0], mine.names) != (other.kind, sizes[1], other.names):
                raise ModelInputError(
                    f"{first.name} {side} {_port(mine)}, {model.card.name} {_port(other)}: models that answer the same "
                    "question are compared."
                )


def wishes(model: Model) -> Inputs:
    """Return inputs with all attributes at 50, and with each one in turn at other values."""
    names = model.card.takes.names or tuple(map(str, range(1, model.card.takes.size + 1)))
    rows, titles = [np.full(len(names), NEUTRAL)], ["all at 50"]
    for place, name in enumerate(names):
        for value in ASIDE:
            row = np.full(len(names), NEUTRAL)
            row[place] = value
            rows.append(row)
            titles.append(f"{name}={value:g}")
    return Inputs(np.array(rows), tuple(titles))


def apart(models: Sequence[Model], labels: Sequence[str], inputs: Inputs) -> list[Apart]:
    """Return the difference of every pair of models, with ratings on the first model's 0..100."""
    answers = [_answers(model, models[0], inputs.rows) for model in models]
    pairs = []
    for first, second in combinations(range(len(models)), 2):
        difference = np.abs(answers[first] - answers[second])
        at = inputs.names[int(np.argmax(difference.max(axis=1)))]
        by_name = dict(zip(models[first].card.gives.names, difference.mean(axis=0).tolist(), strict=False))
        mean, greatest = float(difference.mean()), float(difference.max())
        pairs.append(Apart(labels[first], labels[second], mean, greatest, at, by_name))
    return pairs


def milliseconds(model: Model, inputs: Inputs, clock: Callable[[], float]) -> float:
    """Return the median time of one answer in ms, over all inputs one by one, after a warm-up run.

    For a texture's model, time the runtime that plays it.
    """
    rows = rows_for(model, inputs.rows)
    run = model.run if model.card.texture is None else fastest(model).run
    run(rows[0])
    times = []
    for row in rows:
        start = clock()
        run(row)
        times.append(clock() - start)
    return 1e3 * float(np.median(times))


def _answers(model: Model, first: Model, rows: Array) -> Array:
    takes, gives = model.card.takes, model.card.gives
    if takes.kind == WINDOW:
        return model.run(rows_for(model, rows))[:, :1]
    answers = model.run(_recounted(rows, first.card.takes.scale, takes.scale))
    shown = np.clip(answers, 0, TOP) if gives.kind == "ratings" else answers
    return _recounted(shown, gives.scale, first.card.gives.scale)


def _recounted(ratings: Array, one: tuple[float, float] | None, other: tuple[float, float] | None) -> Array:
    """Return ratings 0..100 of one card as ratings 0..100 of another card, whose answer scale may differ."""
    if one is None or other is None:
        return ratings
    return (one[0] - other[0] + ratings / TOP * (one[1] - one[0])) / (other[1] - other[0]) * TOP


def _port(port: Port) -> str:
    named = f" ({', '.join(port.names[:2])}, ...)" if port.names else ""
    return f"{port.size} numbers of {port.kind}{named}"


def require_one_texture(models: Sequence[Model]) -> None:
    """Raise ModelInputError if a model makes another texture, or its card is contradictory."""
    first, texture = models[0].card, texture_of(models[0]).id
    for card in (model.card for model in models):
        if card.texture is None or card.texture.id != texture:
            raise ModelInputError(
                f"{first.name} makes {texture}, {card.name} does not: models that answer the same question are"
                " compared."
            )
        if card.takes.kind == WINDOW and card.takes.size != 3 * card.texture.window:
            raise ModelInputError(
                f"{card.name}: it takes {card.takes.size} numbers, and its window is {card.texture.window} samples of "
                "acceleration, speed and force. Export it again."
            )


def texture_of(model: Model) -> Texture:
    """Return the card's texture. Raises ModelInputError if it has none."""
    if model.card.texture is None:
        raise ModelInputError(f"{model.card.name}: its card names no texture. Export the model again.")
    return model.card.texture


def rows_for(model: Model, rows: Array) -> Array:
    """Return windows (n, 3 * longest) cut to this model's number of last samples; other inputs unchanged."""
    if model.card.takes.kind != WINDOW or rows.shape[1] == model.card.takes.size:
        return rows
    shaped = rows.reshape(len(rows), 3, -1)[:, :, -(model.card.takes.size // 3) :]
    return np.ascontiguousarray(shaped).reshape(len(rows), -1)


def texture_windows(models: Sequence[Model]) -> tuple[Array, tuple[str, ...]]:
    """Return seeded windows of the first model, (25, 3 * longest window), C order, and each one's speed and force."""
    first = models[0]
    texture = texture_of(first)
    speed, force, names = _hands(texture)
    longest = max(model.card.takes.size // 3 for model in models)
    window = first.card.takes.size // 3
    chance = np.random.Generator(np.random.PCG64(0))
    past = np.zeros((len(speed), WARM_UP + longest + window))
    hand = np.stack([np.repeat(column[:, None], window, axis=1) for column in (speed, force)], axis=1)
    for at in range(window, past.shape[1]):
        rows = np.concatenate([past[:, None, at - window : at], hand], axis=1).reshape(len(past), -1)
        answers = first.run(rows)
        sd = np.exp(answers[:, 1]) if answers.shape[1] == 2 else texture.rms_m_s2 / 10
        samples = answers[:, 0] + sd * chance.normal(size=len(past))
        past[:, at] = np.clip(samples, -texture.peak_m_s2, texture.peak_m_s2)
    held = [np.repeat(column[:, None], longest, axis=1) for column in (speed, force)]
    return np.concatenate([past[:, -longest:], *held], axis=1), names


def texture_drives(model: Model) -> tuple[Array, tuple[str, ...]]:
    """Return (25, size): speed, force, and seeded normal random numbers, with labels."""
    speed, force, names = _hands(texture_of(model))
    chance = np.random.Generator(np.random.PCG64(0))
    drawn = chance.normal(size=(len(speed), model.card.takes.size - 2))
    return np.concatenate([speed[:, None], force[:, None], drawn], axis=1), names


def _hands(texture: Texture) -> tuple[Array, Array, tuple[str, ...]]:
    speeds, forces = np.linspace(*texture.speed_mm_s, SIDE), np.linspace(*texture.force_N, SIDE)
    speed, force = (column.ravel() for column in np.meshgrid(speeds, forces))
    return speed, force, tuple(f"{one:.3g} mm/s, {other:.3g} N" for one, other in zip(speed, force, strict=True))
