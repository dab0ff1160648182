"""Text in figures: how wide it is, where it may be broken, how numbers are written."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Iterable, Sequence
from itertools import combinations

from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

from palpate.analysis.statistics.apa import apa_p

Ends = tuple[float, float]
UNKNOWN = "–"


def width_pt(text: str, size: float, weight: str = "normal") -> float:
    """How wide a line of text is, in points, at that size."""
    font = FontProperties(family="DejaVu Sans", size=size, weight=weight)
    return float(text_to_path.get_text_width_height_descent(text, font, ismath=False)[0])


def widest_pt(texts: Iterable[str], size: float, weight: str = "normal") -> float:
    """The width of the widest line of all these texts."""
    return max((width_pt(line, size, weight) for text in texts for line in text.split("\n")), default=0.0)


def broken(text: str, lines: int) -> list[tuple[str, ...]]:
    """Every way to write a text on at most so many lines, broken at spaces only."""
    words = text.split()
    if len(words) > 8:
        return [tuple(folded(text, math.ceil(len(text) / k)).split("\n")) for k in range(1, lines + 1)]
    cuts = range(1, len(words))
    ways = [cut for k in range(min(lines, len(words) or 1)) for cut in combinations(cuts, k)]
    return [tuple(" ".join(words[a:b]) for a, b in _spans(cut, len(words))) for cut in ways]


def _spans(cuts: Sequence[int], end: int) -> Iterable[tuple[int, int]]:
    return zip((0, *cuts), (*cuts, end), strict=True)


def letters_of(text: str) -> float:
    """How many Latin letters a text is as long as: one of Korean, Chinese or Japanese takes the room of 1.6."""
    return sum(1.6 if unicodedata.east_asian_width(letter) in "WF" else 1.0 for letter in text)


def folded(text: str, letters: int) -> str:
    """A text on lines of about so many letters, broken at spaces and after hyphens."""
    lines = [""]
    for word in text.replace("-", "-\u200b").replace("\u200b", "\u200b ").split(" "):
        piece = word.replace("\u200b", "")
        glue = "" if not lines[-1] or lines[-1].endswith("-") else " "
        if lines[-1] and letters_of(lines[-1] + glue + piece) > letters:
            lines.append(piece)
        else:
            lines[-1] += glue + piece
    return "\n".join(lines)


def shortened(text: str, letters: int) -> str:
    """The beginning of a long text, with an ellipsis; its whole is told where one points at it."""
    if letters_of(text) <= letters:
        return text
    return text[: int((letters - 1) * len(text) / letters_of(text))].rstrip() + "…"


def elided(text: str, letters: int) -> str:
    """A long text without its middle: names that begin alike stay apart by their ends."""
    long = letters_of(text)
    if long <= letters:
        return text
    letters = int(letters * len(text) / long)
    end = min(letters // 2, 8)
    return f"{text[: letters - 1 - end].rstrip()}…{text[-end:].lstrip()}"


def letters_in(inches: float, size: float = 9.0) -> int:
    """How many bold letters of that size have room in a width."""
    return max(4, int(72 * inches / (0.7 * size)))


def number(value: float | None, decimals: int = 2) -> str:
    """A number with a true minus; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return UNKNOWN
    written = f"{value:.{decimals}f}"
    return (written if float(written) else written.lstrip("-")).replace("-", "−")


def signed(value: float, scale: Ends) -> str:
    """A number with its sign where the scale has both, and a true minus; far from 0 with the digits that differ."""
    sign = "+" if scale[0] < 0 < scale[1] and value else ""
    span, far = scale[1] - scale[0], max(map(abs, scale))
    digits = max(6, math.ceil(math.log10(far / span)) + 3) if span and far else 6
    return f"{value:{sign}.{digits}g}".replace("-", "−")


def percent(share: float | None, decimals: int = 0) -> str:
    """A share of 1 in per cent."""
    return UNKNOWN if share is None else f"{number(100 * share, decimals)} %"


def decimals_for(values: Iterable[float]) -> int:
    """How many decimals show the largest of the values with about three figures."""
    largest = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    if largest == 0 or largest >= 100:
        return 0
    return min(max(2 - math.floor(math.log10(largest)), 0), 9)


def p_written(p: float | None) -> str:
    """p as APA writes it: without the leading zero, never 0."""
    return "p undefined" if p is None else apa_p(p)
