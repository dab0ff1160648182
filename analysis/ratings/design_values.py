"""The part of the design check that looks at the values: finite, on the scale, on a step, and not all the same."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import isfinite
from numbers import Real

import pandas as pd

from palpate.analysis.ratings.dataset import Scale
from palpate.analysis.ratings.design_report import Place, Problem, gathered

FEWEST_TO_BE_CONSTANT = 3

Row = tuple[str, tuple[str, ...], object]


def value_problems(
    table: pd.DataFrame, participant: str, cells: Sequence[str], value: str, *, scale: Scale | None, limit: int
) -> list[Problem]:
    """Every value that is no finite number, off the scale or off its steps, and every constant rater."""
    rows: list[Row] = [
        (str(person), tuple(map(str, cell)), number)
        for person, number, *cell in zip(*(table[c].tolist() for c in (participant, value, *cells)), strict=True)
    ]

    def places(wrong: Callable[[object], bool]) -> list[Place]:
        bad = (row for row in rows if wrong(row[2]))
        return [Place(who, dict(zip(cells, cell, strict=True)), f"{number}") for who, cell, number in bad]

    return [
        *gathered("non_finite", places(lambda number: not _finite(number)), limit),
        *gathered("out_of_scale", places(lambda number: _finite(number) and not _inside(number, scale)), limit),
        *gathered("off_step", places(lambda number: _finite(number) and _between_steps(number, scale)), limit),
        *_constant(rows, cells, limit),
    ]


def _finite(number: object) -> bool:
    return isinstance(number, Real) and isfinite(float(number))


def _inside(number: object, scale: Scale | None) -> bool:
    return scale is None or scale.holds(float(number))  # type: ignore[arg-type]


def _between_steps(number: object, scale: Scale | None) -> bool:
    return scale is not None and _inside(number, scale) and not scale.on_step(float(number))  # type: ignore[arg-type]


def _constant(rows: Sequence[Row], cells: Sequence[str], limit: int) -> list[Problem]:
    """Constant raters, and for those who are not, the attributes on which they are: reported, never excluded."""
    everywhere: dict[str, list[object]] = {}
    by_attribute: dict[tuple[str, str], list[object]] = {}
    column = cells.index("attribute") if "attribute" in cells else None
    for person, cell, number in rows:
        everywhere.setdefault(person, []).append(number)
        if column is not None:
            by_attribute.setdefault((person, cell[column]), []).append(number)
    people = {person for person, values in everywhere.items() if _same(values)}
    return [
        *gathered("constant_rater", [Place(p, found=_all(everywhere[p])) for p in everywhere if p in people], limit),
        *gathered(
            "constant_attribute",
            [
                Place(person, {"attribute": attribute}, _all(values))
                for (person, attribute), values in by_attribute.items()
                if person not in people and _same(values)
            ],
            limit,
        ),
    ]


def _same(values: Sequence[object]) -> bool:
    return len(values) >= FEWEST_TO_BE_CONSTANT and _finite(values[0]) and len(set(values)) == 1


def _all(values: Sequence[object]) -> str:
    return f"all {len(values)} ratings are {values[0]:g}"
