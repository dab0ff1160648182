"""Scores of a model file: its size, its speed, and its difference from the fitted model."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.modeling.doors.data import DoorData, Scaling
from palpate.modeling.doors.methods import Fitted
from palpate.modeling.doors.preparing import FURTHEST_N, WISH
from palpate.modeling.doors.registry import Direction
from palpate.protocols.progress import Clock
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS
from palpate.signals.models.card import Port

if TYPE_CHECKING:
    from palpate.signals.models.runtime import Model

ENOUGH_S, LEAST, MOST = 0.3, 5, 400
"""Seconds to time single answers for, and the least and greatest number of answers."""


@dataclass(frozen=True)
class Timed:
    """The times of single answers, in milliseconds."""

    median_ms: float
    p99_ms: float


def ports(data: DoorData, scaling: Scaling, direction: Direction) -> tuple[Port, Port]:
    """Return the input and output ports of a direction; its file refuses the same inputs as its `predict`."""
    force = Port(kind="force_profile", size=POINTS, unit="N")
    ratings = Port(
        kind="ratings", size=len(data.attributes), unit="0..100", names=data.attributes, antonyms=data.antonyms,
        scale=scaling.rating,
    )  # fmt: skip
    if direction == "forward":
        return force.model_copy(update={"within": (-FURTHEST_N, FURTHEST_N)}), ratings
    return ratings.model_copy(update={"within": WISH}), force


def timed(runs: Model, given: Array, clock: Clock) -> Timed:
    """Return the times of single answers, over the rows in turn, after a first one that does not count."""
    runs.run(given[0])
    times: list[float] = []
    while len(times) < LEAST or (sum(times) < ENOUGH_S and len(times) < MOST):
        row = given[len(times) % len(given)]
        start = clock()
        runs.run(row)
        times.append(clock() - start)
    return Timed(1e3 * float(np.median(times)), 1e3 * float(np.percentile(times, 99)))


def model_scores(
    model: Fitted, direction: Direction, method: str, title: str, given: Array, data: DoorData, scaling: Scaling,
    clock: Clock, folder: Path | None,
) -> dict[str, float]:  # fmt: skip
    """Write the model, read it with the rig's runtime, and compare: bytes, milliseconds, the largest difference.

    The difference is in percent of the range, over `given`. The files stay in `folder`, if it is given.
    """
    from palpate.modeling.files.model_files import write_model
    from palpate.signals.models.file import read_model

    takes, gives = ports(data, scaling, direction)
    name = f"{direction}-{method}"
    with tempfile.TemporaryDirectory() as scratch:
        place = folder or Path(scratch)
        place.mkdir(parents=True, exist_ok=True)
        card = write_model(place, name, model.exported(), title=title, method=method, takes=takes, gives=gives)
        runs = read_model(card)
        speed = timed(runs, given, clock)
        off = float(np.max(np.abs(np.asarray(runs.run(given), dtype=np.float64) - model.predict(given))))
        low, high = scaling.force_N
        return {
            "file_bytes": float(sum(path.stat().st_size for path in place.glob(f"{name}.*"))),
            "file_ms": speed.median_ms,
            "file_p99_ms": speed.p99_ms,
            "file_difference": off if direction == "forward" else off * 100.0 / (high - low),
        }
