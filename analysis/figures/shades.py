"""Colours from light to dark, and what can be read on them; shapes and hatches for print without colour."""

from __future__ import annotations

from matplotlib.colors import LinearSegmentedColormap, to_hex, to_rgb

from palpate.analysis.figures.style import INK, OKABE_ITO

LADDER = ("#f3f7fb", "#c9deee", "#8dbbdc", "#4a90c2", "#1b62a0", "#0a3a6b")
"""One hue, evenly darker: as readable in grey as in colour."""
SHAPES = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "p", "h", "*")
HATCHES = ("", "////", "....", "xxxx", "\\\\\\\\", "----", "++++", "oo")


def tint(colour: str, strength: float = 0.42) -> str:
    """A colour mixed with paper, for areas that others are drawn upon."""
    return to_hex([1 - strength * (1 - part) for part in to_rgb(colour)])


def ladder() -> LinearSegmentedColormap:
    """The ladder as a continuous scale."""
    return LinearSegmentedColormap.from_list("ladder", LADDER)


def ink_on(colour: object) -> str:
    """The ink that reads better on a colour (WCAG 2.2 relative luminance)."""
    parts = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(colour)]
    luminance = 0.2126 * parts[0] + 0.7152 * parts[1] + 0.0722 * parts[2]
    return INK if (luminance + 0.05) / 0.065 > 1.05 / (luminance + 0.05) else "#ffffff"


def looks(count: int) -> list[tuple[str, str]]:
    """A colour and a shape for each of so many levels; no two the same up to 84 levels."""
    return [(OKABE_ITO[i % len(OKABE_ITO)], SHAPES[(i + i // 84) % len(SHAPES)]) for i in range(count)]
