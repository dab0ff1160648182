"""Counterbalancing designs as rows of item numbers 0..n-1; random orders are drawn by `plan.ordered`."""

from __future__ import annotations

from typing import Literal

Design = Literal["williams", "latin", "random", "as_listed"]
Order = tuple[int, ...]


def latin_row(n: int, row: int) -> Order:
    """Return a row of the cyclic Latin square of size n: every item once per row and once per position."""
    return tuple((item + row) % n for item in range(n))


def williams_row(n: int, row: int) -> Order:
    """Return a row of a Williams design: every item precedes every other equally often (Williams 1949).

    There are n rows where n is even (each carry-over once), 2n where it is odd (twice; the second n mirror the first).
    """
    if n % 2 == 1 and row % (2 * n) >= n:
        return williams_row(n, row % n)[::-1]
    zigzag = (0 if step == 0 else (step + 1) // 2 if step % 2 else n - step // 2 for step in range(n))
    return tuple((item + row) % n for item in zigzag)


def rows_of(design: Design, n: int) -> int:
    """Return how many different rows the design has for n items; a participant's row is taken modulo this."""
    if design == "latin":
        return n
    if design == "williams":
        return 2 * n if n % 2 and n > 1 else n
    return 1


def square(design: Literal["williams", "latin"], n: int) -> tuple[Order, ...]:
    """Return all rows of the design for n items."""
    row_of = williams_row if design == "williams" else latin_row
    return tuple(row_of(n, row) for row in range(rows_of(design, n)))
