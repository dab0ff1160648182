"""What models of a texture are compared on: windows that the first of them makes, at speeds and forces of its range."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from palpate.signals.models.card import Texture
from palpate.signals.models.errors import ModelInputError
from palpate.signals.models.runtime import Model

Array = NDArray[np.float64]

WINDOW = "texture_window"
DRIVE = "texture_drive"
SIDE = 5
"""Speeds, and forces, evenly from the least to the greatest of the first model's recording."""
WARM_UP = 200
"""Samples that are made before the window that is looked at."""


def require_one_texture(models: Sequence[Model]) -> None:
    """All make the same texture. Raises ModelInputError that says which does not, or whose card is contradictory."""
    first, made = models[0].card, texture_of(models[0]).id
    for card in (model.card for model in models):
        if card.texture is None or card.texture.id != made:
            raise ModelInputError(
                f"{first.name} makes {made}, {card.name} does not: models that answer the same question are compared."
            )
        if card.takes.kind == WINDOW and card.takes.size != 3 * card.texture.window:
            raise ModelInputError(
                f"{card.name}: it takes {card.takes.size} numbers, and its window is {card.texture.window} samples of "
                "acceleration, speed and force. Export it again."
            )


def texture_of(model: Model) -> Texture:
    """What the card says of its texture. Raises ModelInputError where it says nothing."""
    if model.card.texture is None:
        raise ModelInputError(f"{model.card.name}: its card names no texture. Export the model again.")
    return model.card.texture


def rows_for(model: Model, rows: Array) -> Array:
    """Windows (n, 3 * longest) as this model takes them: its own number of last samples. Others as they are."""
    if model.card.takes.kind != WINDOW or rows.shape[1] == model.card.takes.size:
        return rows
    shaped = rows.reshape(len(rows), 3, -1)[:, :, -(model.card.takes.size // 3) :]
    return np.ascontiguousarray(shaped).reshape(len(rows), -1)


def texture_windows(models: Sequence[Model]) -> tuple[Array, tuple[str, ...]]:
    """(25, 3 * longest window), C order, and the speed and force of each: what the first model makes, seeded."""
    first = models[0]
    texture = texture_of(first)
    speed, force, names = _hands(texture)
    longest = max(model.card.takes.size // 3 for model in models)
    window = first.card.takes.size // 3
    chance = np.random.Generator(np.random.PCG64(0))
    past = np.zeros((len(speed), WARM_UP + longest + window))
    hand = np.stack([np.repeat(each[:, None], window, axis=1) for each in (speed, force)], axis=1)
    for at in range(window, past.shape[1]):
        rows = np.concatenate([past[:, None, at - window : at], hand], axis=1).reshape(len(past), -1)
        answers = first.run(rows)
        sd = np.exp(answers[:, 1]) if answers.shape[1] == 2 else texture.rms_m_s2 / 10
        made = answers[:, 0] + sd * chance.normal(size=len(past))
        past[:, at] = np.clip(made, -texture.peak_m_s2, texture.peak_m_s2)
    held = [np.repeat(each[:, None], longest, axis=1) for each in (speed, force)]
    return np.concatenate([past[:, -longest:], *held], axis=1), names


def texture_drives(model: Model) -> tuple[Array, tuple[str, ...]]:
    """(25, size): speed, force, and numbers drawn from the normal distribution, seeded."""
    speed, force, names = _hands(texture_of(model))
    chance = np.random.Generator(np.random.PCG64(0))
    drawn = chance.normal(size=(len(speed), model.card.takes.size - 2))
    return np.concatenate([speed[:, None], force[:, None], drawn], axis=1), names


def _hands(texture: Texture) -> tuple[Array, Array, tuple[str, ...]]:
    speeds, forces = np.linspace(*texture.speed_mm_s, SIDE), np.linspace(*texture.force_N, SIDE)
    speed, force = (each.ravel() for each in np.meshgrid(speeds, forces))
    return speed, force, tuple(f"{one:.3g} mm/s, {other:.3g} N" for one, other in zip(speed, force, strict=True))
