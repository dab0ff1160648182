"""Text in figures: its width, its line breaks, its abbreviation, and numbers as text."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Iterable
from itertools import combinations

from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

from palpate.analysis.statistics.apa import apa_p

Ends = tuple[float, float]
"""The low and the high end of a scale."""
UNKNOWN = "–"


def width_pt(text: str, size: float, weight: str = "normal") -> float:
    """Return the width of a line of text in points at that size in DejaVu Sans."""
    font = FontProperties(family="DejaVu Sans", size=size, weight=weight)
    return float(text_to_path.get_text_width_height_descent(text, font, ismath=False)[0])


def widest_pt(texts: Iterable[str], size: float, weight: str = "normal") -> float:
    """Return the width of the widest line of these texts in points; 0 without any."""
    return max((width_pt(line, size, weight) for text in texts for line in text.split("\n")), default=0.0)


def line_breaks(text: str, lines: int) -> list[tuple[str, ...]]:
    """Return every way to write a text on at most `lines` lines, broken at spaces only.

    A text of more than eight words is broken once for each number of lines instead.
    """
    words = text.split()
    if len(words) > 8:
        return [tuple(fold(text, math.ceil(len(text) / k)).split("\n")) for k in range(1, lines + 1)]
    places = range(1, len(words))
    cuts = [cut for k in range(min(lines, len(words) or 1)) for cut in combinations(places, k)]
    return [tuple(" ".join(words[a:b]) for a, b in zip((0, *cut), (*cut, len(words)), strict=True)) for cut in cuts]


def count_letters(text: str) -> float:
    """Return the length of a text in Latin letters; a Korean, Chinese or Japanese one counts as 1.6."""
    return sum(1.6 if unicodedata.east_asian_width(letter) in "WF" else 1.0 for letter in text)


def letters_that_fit(inches: float, size: float = 9.0) -> int:
    """Return how many bold letters of that size (in points) fit a width; at least 4."""
    return max(4, int(72 * inches / (0.7 * size)))


def fold(text: str, letters: int) -> str:
    """Break a text into lines of about `letters` letters, at spaces and after hyphens."""
    lines = [""]
    for word in text.replace("-", "-\u200b").replace("\u200b", "\u200b ").split(" "):
        piece = word.replace("\u200b", "")
        glue = "" if not lines[-1] or lines[-1].endswith("-") else " "
        if lines[-1] and count_letters(lines[-1] + glue + piece) > letters:
            lines.append(piece)
        else:
            lines[-1] += glue + piece
    return "\n".join(lines)


def shorten(text: str, letters: int) -> str:
    """Return the beginning of a long text with an ellipsis; its mark has the whole text."""
    if count_letters(text) <= letters:
        return text
    return text[: int((letters - 1) * len(text) / count_letters(text))].rstrip() + "…"


def elide(text: str, letters: int) -> str:
    """Return a long text without its middle, so that names with the same beginning differ by their ends."""
    length = count_letters(text)
    if length <= letters:
        return text
    letters = int(letters * len(text) / length)
    end = min(letters // 2, 8)
    return f"{text[: letters - 1 - end].rstrip()}…{text[-end:].lstrip()}"


def format_interval(low: float | None, high: float | None, decimals: int = 2) -> str:
    """Return an interval in words, as "1.20 to 3.40"; "none" where an end is not known."""
    if low is None or high is None:
        return "none"
    return f"{format_number(low, decimals)} to {format_number(high, decimals)}"


def format_number(value: float | None, decimals: int = 2) -> str:
    """Return a number with a true minus; a dash for None, NaN or infinity."""
    if value is None or not math.isfinite(value):
        return UNKNOWN
    text = f"{value:.{decimals}f}"
    return (text if float(text) else text.lstrip("-")).replace("-", "−")


def format_signed(value: float, scale: Ends) -> str:
    """Return a number with its sign if the scale has both signs, and a true minus; far from 0 with more digits."""
    sign = "+" if scale[0] < 0 < scale[1] and value else ""
    span, far = scale[1] - scale[0], max(map(abs, scale))
    digits = max(6, math.ceil(math.log10(far / span)) + 3) if span and far else 6
    return f"{value:{sign}.{digits}g}".replace("-", "−")


def format_percent(share: float | None, decimals: int = 0) -> str:
    """Return a share of 1 in per cent."""
    return UNKNOWN if share is None else f"{format_number(100 * share, decimals)} %"


def format_p(p: float | None) -> str:
    """Return p in APA style: without the leading zero, never 0."""
    return "p undefined" if p is None else apa_p(p)


def decimals_for(values: Iterable[float]) -> int:
    """Return how many decimals show the largest of the values with about three significant digits."""
    largest = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    if largest == 0 or largest >= 100:
        return 0
    return min(max(2 - math.floor(math.log10(largest)), 0), 9)
