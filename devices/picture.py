"""Pictures of what devices measured: the same bytes for the same numbers, and a table of the numbers beside them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.protocols.files import open_bytes, staged_files, write_text
from palpate.protocols.tables import table_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = ("png", "svg", "pdf")
INK, SOFT, FAINT = "#1f2328", "#59636e", "#d8dee4"
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Okabe and Ito (2008): distinguishable for colour-blind readers."""
NO_DATE = {"svg": {"Date": None}, "png": {"Software": None}, "pdf": {"CreationDate": None}}


class PictureError(ValueError):
    """A picture that cannot be written as requested; the message says what is expected."""


@contextmanager
def drawing(salt: str) -> Iterator[None]:
    """Draw and write inside this block: small type, no frame at the top and the right, SVG ids from `salt` alone."""
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update({
            "font.size": 9.0, "text.color": INK, "text.parse_math": False, "axes.labelcolor": SOFT,
            "axes.edgecolor": SOFT, "axes.linewidth": 0.7, "axes.spines.top": False, "axes.spines.right": False,
            "axes.titlesize": 9.5, "axes.titlelocation": "left", "xtick.color": SOFT, "ytick.color": SOFT,
            "legend.frameon": False, "svg.hashsalt": salt,
        })  # fmt: skip
        yield


def write_picture(figure: Figure, out: Path, rows: Sequence[Mapping[str, Any]] = ()) -> list[Path]:
    """Write the figure, and its rows as .csv beside it; return the paths (call it within `drawing`).

    `out` without a suffix gives .svg and .png. Raises PictureError for a suffix other than .png, .svg or .pdf.
    """
    form = out.suffix[1:].lower()
    if form and form not in FORMATS:
        raise PictureError(f"{out}: a picture is written as {', '.join(f'.{name}' for name in FORMATS)}")
    names = {out.name: form} if form else {f"{out.name}.{name}": name for name in ("svg", "png")}
    with staged_files(out.parent) as draft:
        for name, kind in names.items():
            with open_bytes(draft / name) as file:
                figure.savefig(file, format=kind, dpi=150, metadata=NO_DATE[kind])
            figure.set_layout_engine(None)  # laid out once: everything stands at the same place in each
        table = [f"{out.stem if form else out.name}.csv"] if rows else []
        for name in table:
            # None is an empty cell, a float has at most nine digits.
            cells = ([row.get(column) for column in rows[0]] for row in rows)
            texts = ([f"{cell:.9g}" if isinstance(cell, float) else cell for cell in row] for row in cells)
            write_text(draft / name, table_text(rows[0], texts))
    return [out.parent / name for name in (*names, *table)]
