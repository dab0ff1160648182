"""Models side by side: what their cards say of them, and how far apart their answers to the same inputs are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.devices.models.comparing_textures import DRIVE, WINDOW, require_one_texture, rows_for
from palpate.devices.models.given import NEUTRAL, TOP
from palpate.signals.models.card import Port
from palpate.signals.models.errors import ModelInputError
from palpate.signals.models.fastest import fastest
from palpate.signals.models.runtime import Model

Array = NDArray[np.float64]

STUDY = Path(__file__).resolve().parents[2] / "studies" / "door_ratings" / "profiles"
"""The profiles that models of a feeling are compared on, if no others are given."""
ASIDE = (10.0, 90.0)
"""The wishes that models of a profile are compared on: one attribute at these, the others at 50 (thesis 5.7.1)."""


@dataclass(frozen=True)
class Apart:
    """Two models' answers: mean and greatest absolute difference, in the unit of what they give, and where it is."""

    first: str
    second: str
    mean: float
    greatest: float
    at: str
    by_name: dict[str, float]


@dataclass(frozen=True)
class Inputs:
    """What is asked of all models: (n, in), and a name for each. Of windows, a model is asked its own last samples."""

    rows: Array
    names: tuple[str, ...]


def require_alike(models: Sequence[Model]) -> None:
    """All take and give the same, but that models of one texture may look back more or less far.

    Raises ModelInputError that says which does not.
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
    """All attributes at 50, and each one aside."""
    names = model.card.takes.names or tuple(map(str, range(1, model.card.takes.size + 1)))
    rows, told = [np.full(len(names), NEUTRAL)], ["all at 50"]
    for place, name in enumerate(names):
        for value in ASIDE:
            row = np.full(len(names), NEUTRAL)
            row[place] = value
            rows.append(row)
            told.append(f"{name}={value:g}")
    return Inputs(np.array(rows), tuple(told))


def apart(models: Sequence[Model], labels: Sequence[str], inputs: Inputs) -> list[Apart]:
    """Every pair of models, all ratings counted as the first model counts its 0..100, shown within them."""
    answers = [_answers(model, models[0], inputs.rows) for model in models]
    return [_apart(labels, models, answers, pair, inputs) for pair in combinations(range(len(models)), 2)]


def milliseconds(model: Model, inputs: Inputs, clock: Callable[[], float]) -> float:
    """The median time of one answer, over all inputs one by one, after one that does not count.

    Of a texture's model, by what plays it.
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


def _apart(
    labels: Sequence[str], models: Sequence[Model], answers: Sequence[Array], pair: tuple[int, int], inputs: Inputs
) -> Apart:
    first, second = pair
    difference = np.abs(answers[first] - answers[second])
    row = int(np.argmax(difference.max(axis=1)))
    by_name = dict(zip(models[first].card.gives.names, difference.mean(axis=0).tolist(), strict=False))
    return Apart(
        labels[first], labels[second], float(difference.mean()), float(difference.max()), inputs.names[row], by_name
    )


def _answers(model: Model, first: Model, rows: Array) -> Array:
    takes, gives = model.card.takes, model.card.gives
    if takes.kind == WINDOW:
        return model.run(rows_for(model, rows))[:, :1]
    answers = model.run(_recounted(rows, first.card.takes.scale, takes.scale))
    shown = np.clip(answers, 0, TOP) if gives.kind == "ratings" else answers
    return _recounted(shown, gives.scale, first.card.gives.scale)


def _recounted(ratings: Array, one: tuple[float, float] | None, other: tuple[float, float] | None) -> Array:
    """The same ratings on the scale that people answered on, as another card counts 0..100."""
    if one is None or other is None:
        return ratings
    return (one[0] - other[0] + ratings / TOP * (one[1] - one[0])) / (other[1] - other[0]) * TOP


def _port(port: Port) -> str:
    named = f" ({', '.join(port.names[:2])}, ...)" if port.names else ""
    return f"{port.size} numbers of {port.kind}{named}"
