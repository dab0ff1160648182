"""The inputs of a model (profiles from files, wishes as NAME=VALUE), and its answer as text.

Every attribute is shown between its two words, with its interval.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.protocols.did_you_mean import nearest
from palpate.signals.arrays import Array
from palpate.signals.models.card import Port
from palpate.signals.models.errors import ModelInputError
from palpate.signals.models.runtime import Model

LOW, HIGH = 0.0, 100.0
FAR = 10.0
"""An answer this far beyond 0..100 comes from a profile that is unlike all of the training data."""
BAR = 25
"""Width of the drawn scale in characters."""
NEUTRAL = 50.0
"""The value of an attribute without a wish (thesis 5.7.1)."""
TOP = 100.0


@dataclass(frozen=True)
class Rated:
    """An attribute: the prediction on 0..100 (`raw` before it was clipped), its interval, and the study's scale.

    The interval is around the clipped prediction, for ratings that are clipped in the same way: clipping brings no two
    numbers further apart, so it covers at least as many as one around `raw`, and never shrinks to a point at an end.
    """

    attribute: str
    antonym: str
    predicted: float
    low: float | None
    high: float | None
    on_scale: float | None
    raw: float


def rated(model: Model, force_N: Array) -> tuple[Rated, ...]:
    """Return the answer to a profile (621,). Raises ModelInputError as `Model.run` does."""
    port, interval = model.card.gives, model.card.interval
    raw = model.run(force_N)
    halves = interval.half_width if interval is not None else (None,) * port.size
    names = port.names or tuple(f"rating {number}" for number in range(1, port.size + 1))
    antonyms = port.antonyms or ("",) * port.size
    ratings = []
    for name, antonym, value, half in zip(names, antonyms, raw.tolist(), halves, strict=True):
        predicted = _within(value)
        low, high = (None, None) if half is None else (_within(predicted - half), _within(predicted + half))
        on_scale = None if port.scale is None else port.scale[0] + predicted / HIGH * (port.scale[1] - port.scale[0])
        ratings.append(Rated(name, antonym, predicted, low, high, on_scale, value))
    return tuple(ratings)


def as_data(file: str, answer: tuple[Rated, ...]) -> dict[str, Any]:
    """Return the answer as JSON data."""
    return {"file": file, "ratings": [asdict(rated) for rated in answer]}


def in_words(file: str, answer: tuple[Rated, ...]) -> str:
    """Return the answer as text, a line for each attribute, with a drawn scale."""
    left = max(len(rated.attribute) for rated in answer)
    right = max(len(rated.antonym) for rated in answer)
    lines = [file]
    for rated in answer:
        range_words = "" if rated.low is None else f"  {rated.low:5.1f} to {rated.high:5.1f}"
        scale = "" if rated.on_scale is None else f"  {rated.on_scale:+6.2f}"
        # |----==O==----|: the interval and where the prediction lies.
        ends = (rated.low, rated.high) if rated.low is not None and rated.high is not None else (rated.predicted,) * 2
        low, high = (_place(end) for end in ends)
        marks = ["=" if low <= place <= high else "-" for place in range(BAR)]
        marks[_place(rated.predicted)] = "O"
        bar = f"{rated.attribute:>{left}} |{''.join(marks)}| {rated.antonym:<{right}}"
        lines.append(f"  {bar} {rated.predicted:6.1f}{range_words}{scale}")
    if far := [rated.attribute for rated in answer if not LOW - FAR <= rated.raw <= HIGH + FAR]:
        lines.append(
            f"  far beyond 0 to 100 before it was cut there: {', '.join(far)}; not a profile as those learned from"
        )
    return "\n".join(lines)


def heading(model: Model) -> str:
    """Return a heading for the columns, and the card's notes for the reader."""
    card = model.card
    interval = card.interval
    sure = (
        "no interval was calibrated"
        if interval is None
        else f"{100 * interval.coverage:g} % interval: {interval.method}"
    )
    scale = [] if card.gives.scale is None else ["the last column is on the scale that people answered on"]
    facts = ["mean ratings, from 0 for the word on the left to 100 for the one on the right", sure, *scale, *card.notes]
    return "\n".join([f"{card.name}: {card.title}", *(f"  {line}" for line in facts)])


def _within(value: float) -> float:
    return min(max(value, LOW), HIGH)


def _place(value: float) -> int:
    return round(value / HIGH * (BAR - 1))


def profile_of(path: Path, recording: bool, zero: bool) -> Array:
    """Return the 621 forces of a profile file; with `recording`, of a recording, which is normalised first.

    Raises DoorDataError that names file and line.
    """
    from palpate.devices.door.recording import read_columns
    from palpate.signals.doors.grid import DoorDataError
    from palpate.signals.doors.profile_file import HEADER, read_profile
    from palpate.signals.doors.profiles import normalise

    if not recording:
        try:
            return np.array(read_profile(path))
        except DoorDataError as error:
            raise DoorDataError(f"{error} Or let a raw recording be normalised with --recording.") from None
    columns = read_columns(path, HEADER)
    try:
        return normalise(columns["angle_deg"], columns["force_N"], zero=zero).force_N
    except DoorDataError as error:
        raise DoorDataError(f"{path}: {error}") from None


def wish_of(given: Sequence[str], port: Port) -> Array:
    """Return the wished ratings in the model's order, 0..100; 50 for an attribute that is not named.

    Raises ModelInputError: no NAME=VALUE, an unknown name, a repeated one, or a value that is not 0 to 100.
    """
    wished: dict[str, float] = {}
    pairs = zip(port.antonyms, port.names, strict=True) if port.antonyms else ()
    others = {antonym: name for antonym, name in pairs if antonym not in port.names}
    for text in given:
        name, sign, value = text.partition("=")
        name = name.strip()
        if not sign:
            example = f"{port.names[0]}=20" if port.names else "Damped=20"
            raise ModelInputError(f"{text!r}: NAME=VALUE is expected, as {example}.")
        if name in others:
            raise ModelInputError(
                f"{text!r}: {name} is the other end of {others[name]}: 0 is {others[name]}, 100 is {name}."
            )
        if name not in port.names:
            raise ModelInputError(f"{text!r}: no attribute {name!r}; {nearest(name, port.names)}")
        if name in wished:
            raise ModelInputError(f"{name} is wished twice.")
        try:
            number = float(value)
        except ValueError:
            number = np.nan
        if not 0 <= number <= TOP:
            raise ModelInputError(
                f"{text!r}: a number from 0 (the attribute's own word) to 100 (its antonym) is expected."
            )
        wished[name] = number
    return np.array([wished.get(name, NEUTRAL) for name in port.names])
