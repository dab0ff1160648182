"""Did a generated stimulus feel as wished: the ratings of the manipulated attribute beside its target (thesis 5.16)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import pandas as pd

from palpate.analysis.figures.drawn import AskedFigure, FigureData, FigureKind, Shown
from palpate.analysis.figures.matching_drawing import draw
from palpate.analysis.figures.shown_columns import numbers, require, uniform
from palpate.analysis.figures.spots import summary
from palpate.analysis.plans.answers import Selected
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.person_cells import PersonCells, person_cells, texts_of
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import count

__all__ = ["MATCHING", "MatchingSettings", "data", "draw"]
USUAL = ("stimulus.attribute", "manipulated", "target_attribute")


class MatchingSettings(AskedFigure):
    """The ratings of each stimulus on the one attribute that it was made for.

    `attribute_column` is the stimulus column that names this attribute (None: the first of `stimulus.attribute`,
    `manipulated`, `target_attribute` that is there), `target` the one with the wished value, on the ratings' scale.
    """

    figure: Literal["matching"]
    attribute_column: str | None = None
    target: str = "target"


def data(shown: Shown, settings: MatchingSettings) -> FigureData:
    """Rows of two sorts (`shows`): each attribute's "target" with n, mean, SD, quartiles and mean absolute error of the
    ratings, and each participant's "value" (the mean of their repeats) there.

    Raises DataRefused where a column is missing, a target is no number or no rating is of a manipulated attribute.
    """
    selected = shown.selected
    made = _manipulated(settings, selected)
    cells = person_cells(made, ["attribute", "target"], levels={**selected.levels, "target": _by_size(made)})
    rows = [row for j in range(len(cells.cells)) for row in _rows(cells, j)]
    if not rows:
        raise DataRefused(f"figure {settings.name!r}: every rating of a manipulated attribute is missing")
    attributes = list(dict.fromkeys(str(row["attribute"]) for row in rows))
    targets = sorted({float(row["target"]) for row in rows})
    antonyms = {each: selected.antonyms.get(each, "") for each in attributes}
    words = {"attributes": attributes, "targets": targets, "antonyms": antonyms, "scale": selected.scale}
    title = settings.title or "Ratings of the manipulated attribute"
    ordered = sorted(rows, key=lambda row: row["shows"] == "value")
    return FigureData(uniform(ordered), title, _caption(cells, targets), words)


def _manipulated(settings: MatchingSettings, selected: Selected) -> pd.DataFrame:
    """The ratings whose attribute is the one that their stimulus was made for, with the target as a number."""
    frame = selected.table
    named = settings.attribute_column or next((name for name in USUAL if name in frame.columns), USUAL[0])
    require(settings, frame, ["participant", "attribute", "value", named, settings.target])
    attribute, made = texts_of(frame, "attribute"), texts_of(frame, named)
    if not set(made) & set(attribute):
        raise DataRefused(
            f"figure {settings.name!r}: column {named!r} names {made[0]!r}, which is not rated;"
            f" {nearest(made[0], sorted(set(attribute)))}"
        )
    kept = np.array([a == b for a, b in zip(attribute, made, strict=True)])
    rows = frame.loc[kept].reset_index(drop=True)
    targets = numbers(rows, settings.target)
    if np.isnan(targets).any():
        raise DataRefused(f"figure {settings.name!r}: column {settings.target!r} has no number in some rows")
    chosen = rows[["participant", "value"]].assign(attribute=[a for a, k in zip(attribute, kept, strict=True) if k])
    return chosen.assign(target=[repr(value) for value in targets])


def _by_size(made: pd.DataFrame) -> tuple[str, ...]:
    return tuple(sorted(set(made["target"].tolist()), key=float))


def _rows(cells: PersonCells, j: int) -> list[dict[str, Any]]:
    """What one attribute's one target was answered with."""
    attribute, target = cells.cells[j][0], float(cells.cells[j][1])
    there = [(person, float(cells.values[i, j])) for i, person in enumerate(cells.participants)]
    known = [(person, value) for person, value in there if not np.isnan(value)]
    if not known:
        return []
    place = {"attribute": attribute, "target": target}
    told = {**summary([value for _, value in known]), "mae": _mae([value for _, value in known], target)}
    values = [{"shows": "value", **place, "participant": person, "value": value} for person, value in known]
    return [{"shows": "target", **place, **told}, *values]


def _mae(values: Sequence[float], target: float) -> float:
    return float(np.mean(np.sort(np.abs(np.array(values) - target))))


def _caption(cells: PersonCells, targets: Sequence[float]) -> str:
    written = ", ".join(f"{target:g}" for target in targets)
    most = int(cells.counts.max(initial=0))
    repeats = f" (the mean of up to {most} repeats)" if most > 1 else ""
    return (
        f"For each attribute the ratings of the stimuli that were made to feel {written} on it, the other attributes'"
        f" ratings not shown. Dots: {count(len(cells.participants), 'participant')}{repeats}; half violins: Gaussian"
        " kernel densities (Silverman's bandwidth), mirrored at the ends of the scale; large marks: means with ± 1 SD;"
        " dashed lines: the targets; below: the mean absolute error (MAE)."
    )


MATCHING = FigureKind(MatchingSettings, data, draw)
