"""A model's answer to a profile, as a person reads it: every attribute between its two words, with its interval."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from palpate.signals.arrays import Array
from palpate.signals.models.runtime import Model

LOW, HIGH = 0.0, 100.0
FAR = 10.0
"""An answer so far beyond 0..100 comes from a profile that is unlike all that the model learned from."""
BAR = 25
"""Characters of the scale that is drawn."""


@dataclass(frozen=True)
class Rated:
    """One attribute: what is predicted on 0..100 (`raw` before it was kept within), its interval, the study's scale.

    The interval is around what was kept within, for ratings that are kept within in the same way: that brings no two
    numbers further apart, so it holds at least as many as one around `raw`, and never shrinks to a point at an end.
    """

    attribute: str
    antonym: str
    predicted: float
    low: float | None
    high: float | None
    on_scale: float | None
    raw: float


def rated(model: Model, force_N: Array) -> tuple[Rated, ...]:
    """The answer to one profile (621,). Raises ModelInputError as `Model.run` does."""
    port, interval = model.card.gives, model.card.interval
    raw = model.run(force_N)
    halves = interval.half_width if interval is not None else (None,) * port.size
    names = port.names or tuple(f"rating {number}" for number in range(1, port.size + 1))
    antonyms = port.antonyms or ("",) * port.size
    return tuple(_rated(*each, port.scale) for each in zip(names, antonyms, raw.tolist(), halves, strict=True))


def as_told(file: str, answer: tuple[Rated, ...]) -> dict[str, Any]:
    """The same for a script."""
    return {"file": file, "ratings": [asdict(each) for each in answer]}


def in_words(file: str, answer: tuple[Rated, ...]) -> str:
    """A line for each attribute, with a drawn scale."""
    left = max(len(each.attribute) for each in answer)
    right = max(len(each.antonym) for each in answer)
    lines = [file]
    for each in answer:
        range_words = "" if each.low is None else f"  {each.low:5.1f} to {each.high:5.1f}"
        scale = "" if each.on_scale is None else f"  {each.on_scale:+6.2f}"
        bar = f"{each.attribute:>{left}} {_bar(each)} {each.antonym:<{right}}"
        lines.append(f"  {bar} {each.predicted:6.1f}{range_words}{scale}")
    if far := [each.attribute for each in answer if not LOW - FAR <= each.raw <= HIGH + FAR]:
        lines.append(
            f"  far beyond 0 to 100 before it was cut there: {', '.join(far)}; not a profile as those learned from"
        )
    return "\n".join(lines)


def heading(model: Model) -> str:
    """What the columns are, and what the card says that a reader must know."""
    card = model.card
    interval = card.interval
    sure = (
        "no interval was calibrated"
        if interval is None
        else f"{100 * interval.coverage:g} % interval: {interval.method}"
    )
    scale = [] if card.gives.scale is None else ["the last column is on the scale that people answered on"]
    told = ["mean ratings, from 0 for the word on the left to 100 for the one on the right", sure, *scale, *card.notes]
    return "\n".join([f"{card.name}: {card.title}", *(f"  {line}" for line in told)])


def _rated(attribute: str, antonym: str, raw: float, half: float | None, scale: tuple[float, float] | None) -> Rated:
    predicted = _within(raw)
    low, high = (None, None) if half is None else (_within(predicted - half), _within(predicted + half))
    on_scale = None if scale is None else scale[0] + predicted / HIGH * (scale[1] - scale[0])
    return Rated(attribute, antonym, predicted, low, high, on_scale, raw)


def _within(value: float) -> float:
    return min(max(value, LOW), HIGH)


def _bar(each: Rated) -> str:
    """|----==O==----|: the interval and where the prediction lies."""
    ends = (each.low, each.high) if each.low is not None and each.high is not None else (each.predicted,) * 2
    low, high = (_place(end) for end in ends)
    marks = ["=" if low <= place <= high else "-" for place in range(BAR)]
    marks[_place(each.predicted)] = "O"
    return f"|{''.join(marks)}|"


def _place(value: float) -> int:
    return round(value / HIGH * (BAR - 1))
