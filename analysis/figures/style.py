"""The style of every figure, and its files, which are byte-identical for equal numbers."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.protocols.files import open_bytes, staged_files, write_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure


INK, SOFT, FAINT, PAPER = "#1f2328", "#59636e", "#d8dee4", "#ffffff"
OKABE_ITO = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7A5195")
"""Okabe and Ito (2008): distinguishable with every common colour vision.

Its yellow, too pale for lines, is replaced by a violet at the end.
"""
FURTHER_FONTS = ("Noto Sans CJK KR", "Noto Sans CJK JP", "Noto Sans Devanagari", "Malgun Gothic", "Apple SD Gothic Neo")
"""Fonts for letters that DejaVu lacks; without any of them a letter is drawn as a box, with unchanged numbers."""
NO_DATE = {"Date": None, "Creator": None, "Format": None, "Type": None}

_SETTINGS: dict[str, Any] = {
    "font.size": 9.0,
    "text.color": INK,
    "text.parse_math": False,
    "axes.edgecolor": SOFT,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.axisbelow": True,
    "grid.color": FAINT,
    "grid.linewidth": 0.6,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.major.size": 0.0,
    "ytick.major.size": 0.0,
    "figure.facecolor": PAPER,
    "savefig.facecolor": PAPER,
    "svg.fonttype": "path",
}
SHADES = ("#f3f7fb", "#c9deee", "#8dbbdc", "#4a90c2", "#1b62a0", "#0a3a6b")
"""One hue in even steps of darkness, as readable in grey as in colour."""
SHAPES = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "p", "h", "*")
HATCHES = ("", "////", "....", "xxxx", "\\\\\\\\", "----", "++++", "oo")


@contextmanager
def drawing(salt: str) -> Iterator[None]:
    """Apply the style within the context: no mathematics in names, SVG ids from `salt` alone.

    The user's own matplotlib settings are restored. Text is drawn as outlines, so that a figure looks the same where
    the font is missing.
    """
    import matplotlib as mpl
    from matplotlib import font_manager

    with mpl.rc_context():
        mpl.rcdefaults()
        # DejaVu comes with matplotlib; of the further fonts, those that this machine has.
        here = set(font_manager.get_font_names())
        fonts = ["DejaVu Sans", *(name for name in FURTHER_FONTS if name in here)]
        mpl.rcParams.update({**_SETTINGS, "font.family": fonts, "svg.hashsalt": salt})
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Glyph .* missing from font", UserWarning)
            yield


@lru_cache(maxsize=1)
def svg_text(figure: Figure) -> str:
    """Return the figure as SVG, equal bytes for equal content (call it within `drawing`)."""
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata=NO_DATE)
    return re.sub(r"[ \t]+\n", "\n", buffer.getvalue())


def save(figure: Figure, folder: Path, name: str) -> list[Path]:
    """Write NAME.svg and NAME.png (call it within `drawing`) and return their paths.

    The figure is laid out once, for the SVG, so that the PNG has the same layout.
    """
    svg, png = folder / f"{name}.svg", folder / f"{name}.png"
    with staged_files(folder) as drafts:
        write_text(drafts / svg.name, svg_text(figure))
        figure.set_layout_engine(None)
        with open_bytes(drafts / png.name) as file:
            figure.savefig(file, format="png", dpi=160, metadata={"Software": None})
    return [svg, png]


def inline_svg(svg: str, prefix: str) -> str:
    """Return the SVG as part of an HTML page: without prologue, metadata and fixed size, with ids of its own."""
    body = svg[svg.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r"<!--.*?-->", "", body, flags=re.DOTALL)
    body = re.sub(r'\bid="([^"]+)"', rf'id="{prefix}-\1"', body)
    body = re.sub(r'href="#([^"]+)"', rf'href="#{prefix}-\1"', body)
    body = re.sub(r"url\(#([^)]+)\)", rf"url(#{prefix}-\1)", body)
    size = r'<svg ([^>]*?)width="[^"]*" ?|height="[^"]*pt" ?'
    return re.sub(size, lambda match: "" if match[1] is None else f"<svg {match[1]}", body, count=2).strip()


def quiet_axes(axes: Axes) -> None:
    """Leave only a horizontal grid."""
    axes.grid(visible=True, axis="y")
    for side in ("left", "bottom"):
        axes.spines[side].set_visible(False)


def tint(colour: str, strength: float = 0.42) -> str:
    """Return a colour mixed with white, for areas below other drawings."""
    from matplotlib.colors import to_hex, to_rgb

    return to_hex([1 - strength * (1 - part) for part in to_rgb(colour)])


def shade_scale() -> LinearSegmentedColormap:
    """Return `SHADES` as a continuous scale."""
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("ladder", SHADES)


def readable_ink(colour: object) -> str:
    """Return the ink with more contrast on a colour (WCAG 2.2 relative luminance)."""
    from matplotlib.colors import to_rgb

    parts = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(colour)]
    luminance = 0.2126 * parts[0] + 0.7152 * parts[1] + 0.0722 * parts[2]
    return INK if (luminance + 0.05) / 0.065 > 1.05 / (luminance + 0.05) else "#ffffff"


def colours_and_shapes(count: int) -> list[tuple[str, str]]:
    """Return a colour and a shape for each of `count` levels, all different up to 84 levels."""
    return [(OKABE_ITO[i % len(OKABE_ITO)], SHAPES[(i + i // 84) % len(SHAPES)]) for i in range(count)]
