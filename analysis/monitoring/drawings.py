"""The small pictures of the monitor's page, as numbers for its SVG, without any text of participants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from palpate.analysis.monitoring.balance_grid import DesignRow, GroupBalance

SPARK = (120.0, 26.0)
CELL = 9
ROW_CELL = 14
ROWS_ACROSS = 45
LEVELS = 5
MOST_ITEMS_IN_A_TABLE = 12


@dataclass(frozen=True)
class Heat:
    """A grid of items x positions: one path of squares per shade; the greatest count is darkest."""

    width: int
    height: int
    paths: tuple[tuple[int, str], ...]
    greatest: int


@dataclass(frozen=True)
class RowCell:
    """A row of the design as a square in the strip; `row` is None without a participant."""

    place: int
    x: int
    y: int
    row: DesignRow | None


def spark_points(values: Sequence[float]) -> str:
    """Return the points of a line over all values, with zero at the bottom."""
    width, height = SPARK
    values = values if len(values) != 1 else (*values, *values)  # one trial is a level, not nothing
    greatest = max(values, default=0.0) or 1.0
    step = (width - 4) / max(len(values) - 1, 1)
    return " ".join(
        f"{2 + step * n:.1f},{height - 2 - (height - 4) * value / greatest:.1f}" for n, value in enumerate(values)
    )


def bars_path(counts: Sequence[int]) -> str:
    """Return the bars of a histogram as one path."""
    width, height = SPARK
    greatest = max(counts, default=0) or 1
    step = width / max(len(counts), 1)
    heights = [(n, (height - 2) * count / greatest) for n, count in enumerate(counts) if count]
    return "".join(f"M{step * n:.1f} {height:g}v{-tall:.1f}h{step - 1:.1f}v{tall:.1f}z" for n, tall in heights)


def heat(balance: GroupBalance) -> Heat | None:
    """Return how often every item was at every position; None if nothing counts yet."""
    rows = [balance.certificate.positions[item] for item in balance.certificate.items]
    greatest = max((count for row in rows for count in row), default=0)
    if not greatest:
        return None
    paths: dict[int, list[str]] = {}
    for y, row in enumerate(rows):
        for x, count in enumerate(row):
            if count:
                paths.setdefault(shade(count, greatest), []).append(f"M{x * CELL} {y * CELL}h8v8h-8z")
    shades = tuple((level, "".join(squares)) for level, squares in sorted(paths.items()))
    return Heat(len(rows[0]) * CELL, len(rows) * CELL, shades, greatest)


def shade(count: int, greatest: int) -> int:
    """Return the shade of a count: 0 for none, else 1 to LEVELS."""
    return -(-LEVELS * count // greatest) if count else 0


def row_cells(balance: GroupBalance) -> tuple[RowCell, ...]:
    """Return every row of the design as a square, with several squares per line."""
    taken = {row.place: row for row in balance.rows}
    return tuple(
        RowCell(n, n % ROWS_ACROSS * ROW_CELL, n // ROWS_ACROSS * ROW_CELL, taken.get(n)) for n in range(balance.round)
    )
