"""The library as a map: a bubble plot as thesis figure 3.3c, with the results marked."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

from matplotlib.patches import Circle

from palpate.analysis.figures.bubbles import SPACE, draw
from palpate.analysis.figures.figure_kind import DrawnFigure, FigureData
from palpate.analysis.figures.style import INK, PAPER, SOFT, drawing, save
from palpate.modeling.library.entries import Entry, Kind, Library, LibraryError, value_of
from palpate.modeling.library.files import demand_folder

ROLES = {"x": ("hard", "soft"), "y": ("flat", "bumpy"), "size": ("smooth", "rough"), "colour": ("slippery", "sticky")}
"""Figure 3.3c: the attribute of each role, with the word at its high end second."""
FOUND, FADED = "#D55E00", 0.22


def map_data(entries: Sequence[Entry], library: Library, kind: Kind | None = None) -> FigureData:
    """Return textures as rows of a bubble plot, with values from -100 to 100.

    Raises LibraryError for fewer than two attributes, and where no texture has all of them.
    """
    roles = roles_of(library.attributes)
    rows = [row for entry in entries if (row := _row(entry, library, kind)) is not None]
    if not rows:
        raise LibraryError("no texture has all of its attributes: there is nothing to draw.")
    caption = f"Each bubble is a texture ({len(rows)}), brought to -100 to 100."
    text = f"{len(rows)} texture{'s' if len(rows) > 1 else ''}{', simulated' if library.simulated else ''}"
    return FigureData(tuple(rows), "The library.", caption, {"by": "texture", "roles": roles, "told": text})


def roles_of(pairs: Sequence[tuple[str, str]]) -> dict[str, dict[str, Any]]:
    """Return the attributes of x, y, bubble size and colour: those of the thesis, else in order.

    Raises LibraryError for fewer than two attributes.
    """
    if len(pairs) < 2:
        raise LibraryError(f"a plane needs two attributes; this library has {len(pairs)}.")
    own = {frozenset(word.lower() for word in pair): at for at, pair in enumerate(pairs)}
    places = {role: own[frozenset(words)] for role, words in ROLES.items() if frozenset(words) in own}
    free = [at for at in range(len(pairs)) if at not in places.values()]
    for role in ROLES:
        if role not in places and free:
            places[role] = free.pop(0)
    roles = {}
    for role, (_, high_word) in ROLES.items():
        if role in places:
            at = places[role]
            reverse = pairs[at][0].lower() == high_word  # the column `name` is negated where the pair is reversed
            low, high = pairs[at][::-1] if reverse else pairs[at]
            roles[role] = {"name": f"{at}{'-' if reverse else '+'}", "low": low, "high": high, "ends": list(SPACE)}
    return roles


def _row(entry: Entry, library: Library, kind: Kind | None) -> dict[str, Any] | None:
    """Return a texture's row, with each attribute as "N+" and negated as "N-"; None where one is unknown."""
    row: dict[str, Any] = {"texture": entry.id, "label": entry.id, "n": entry.rated.raters if entry.rated else 0}
    for at in range(len(library.attributes)):
        estimate = value_of(entry, at, kind)
        if estimate is None:
            return None
        value = 2 * estimate.value - 100
        row |= {f"{at}+": value, f"{at}-": -value}
    return row


def draw_map(data: FigureData, marked: Collection[str] = ()) -> DrawnFigure:
    """Draw the map: `marked` textures in full colour with a red edge, others faded. Call it within `drawing`."""
    from matplotlib.patheffects import withStroke

    drawn = draw(data)
    axes = drawn.figure.axes[0]
    title = f"{data.words['told']}{'; with a red edge: found' if marked else ''}"
    axes.set_title(title, fontsize=8.0, fontweight="normal", color=SOFT, loc="left")
    if marked:
        keys = {mark.gid: mark.key for mark in drawn.marks}
        named = {text.get_text() for text in axes.texts}
        for bubble in [patch for patch in axes.patches if isinstance(patch, Circle)]:
            name = keys.get(str(bubble.get_gid()), "")
            if name not in marked:
                bubble.set(alpha=FADED)
                continue
            bubble.set(edgecolor=FOUND, linewidth=2.4, alpha=1.0, zorder=4)
            if name not in named:
                # a marked texture is named inside its bubble where there was no room beside it
                around = [withStroke(linewidth=2.2, foreground=PAPER)]
                x, y = bubble.center
                axes.text(x, y, name, ha="center", va="center", fontsize=6.5, color=INK, zorder=6, path_effects=around)
    return drawn


def write_map(path: Path, data: FigureData, marked: Collection[str] = ()) -> list[Path]:
    """Write the map as SVG and PNG, whichever of the two the path names; equal input gives equal bytes.

    Both files are written or neither. Raises LibraryError as `demand_writable` does.
    """
    demand_writable(path)
    with drawing("library"):
        return save(draw_map(data, marked).figure, path.parent, path.stem)


def demand_writable(path: Path) -> None:
    """Raise LibraryError unless the file is .svg or .png in a writable folder."""
    if path.suffix.lower() not in (".svg", ".png"):
        raise LibraryError(f"{path}: a map is written as .svg and .png.")
    demand_folder(path)
