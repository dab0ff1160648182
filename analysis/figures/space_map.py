"""A map of stimuli: near ones feel alike, ellipses show how sure a place is, arrows where an adjective grows."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from typing import Any, Literal

from palpate.analysis.figures.drawn import AskedFigure, FigureData, FigureKind, Shown
from palpate.analysis.figures.shown_columns import answer_of, in_order, real, require, uniform
from palpate.analysis.figures.space_map_drawing import draw
from palpate.analysis.plans.answers import Answer, Row, Selected
from palpate.analysis.plans.idle import Idle
from palpate.analysis.ratings.dataset import DataRefused, natural_key
from palpate.analysis.ratings.person_cells import texts_of
from palpate.protocols.undefined import nan_to_none
from palpate.protocols.wording import phrase

__all__ = ["MAP", "MapSettings", "data", "draw"]
PLACES = ("dim", "dimension", "pc", "component")
DIRECTIONS = ("direction",)
NEAR = 1e-6


class MapSettings(AskedFigure):
    """The configuration of one test of `mds` (or `pca`) in two of its `dimensions`; `tests` may name `vectors` too.

    `over` and `items` are the tests' own: the columns that name a point and a vector.
    `class_column` gives each class of stimuli a colour and a shape: a column of the answer or of the stimuli.
    `label_column` writes another column than the stimulus at the points. `ellipses` and `vectors` say whether they are
    drawn where the tests have them.
    """

    figure: Literal["map"]
    over: str = "stimulus"
    items: str = "attribute"
    dimensions: tuple[int, int] = (1, 2)
    class_column: str | None = None
    label_column: str | None = None
    ellipses: bool = True
    vectors: bool = True

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that change nothing beside the others."""
        answer = "in a map, which shows the answer of its test as it is"
        yield from (Idle(name, answer) for name in ("outcomes", "normalise"))
        if self.class_column is None and self.label_column is None:
            yield from (Idle(name, answer) for name in ("where", "table", "source"))
        if self.dimensions != (1, 2):
            yield Idle("ellipses", "in other dimensions than 1 and 2, where none are drawn")
        if not self.vectors:
            yield Idle("items", "with `vectors: false`")


def data(shown: Shown, settings: MapSettings) -> FigureData:
    """Rows of three sorts (`shows`): each "point" with its class and place, each "ellipse", each "vector".

    A vector points to where the attribute's value grows, to the second word of its scale. Raises DataRefused where no
    named test has places, or a class is not one for each stimulus.
    """
    answer = _only(settings, shown, PLACES, settings.over)
    if answer is None:
        raise DataRefused(
            f"figure {settings.name!r}: `tests` must name a test whose rows have `{settings.over}` and the dimensions"
            f" {settings.dimensions[0]} and {settings.dimensions[1]} (mds, pca);"
            f" named: {', '.join(settings.tests) or 'none'}"
        )
    vectors = _only(settings, shown, DIRECTIONS, settings.items) if settings.vectors else None
    if settings.vectors and len(settings.tests) > 1 + (vectors is not None):
        raise DataRefused(
            f"figure {settings.name!r}: a map shows one test with places and one of vectors, whose rows have"
            f" `{settings.items}` and directions; named: {', '.join(settings.tests)}"
        )
    points = _points(settings, shown.selected, answer)
    if vectors is not None:
        _same_map(settings, points, vectors)
    rows = [*points, *_ellipses(settings, answer), *(_vectors(settings, shown.selected, vectors) if vectors else [])]
    classes = _class_order(settings, shown.selected, points)
    words: dict[str, Any] = {
        "classes": classes,
        "class_name": settings.class_column or "",
        "dimensions": list(settings.dimensions),
    }
    words["alpha"] = shown.selected.alpha
    found = uniform(rows)
    return FigureData(found, settings.title or "Map of the stimuli", _caption(shown, answer, found), words)


def _only(settings: MapSettings, shown: Shown, kinds: Sequence[str], label: str) -> Answer | None:
    """The one answer with a label and two coordinates; None where no test has them."""
    found = []
    for name in settings.tests:
        answer = answer_of(settings, shown, name)
        if (
            answer.rows
            and label in answer.rows[0]
            and all(_column(answer.rows[0], kinds, k) for k in settings.dimensions)
        ):
            found.append(name)
    if len(found) > 1:
        raise DataRefused(f"figure {settings.name!r}: {phrase(found)} would be drawn in one place; name one of them")
    return answer_of(settings, shown, found[0]) if found else None


def _column(row: Row, kinds: Sequence[str], dimension: int) -> str | None:
    """The column of a dimension, however it is written: dim1, Dim_1, dimension 1."""
    wanted = {f"{kind}{dimension}" for kind in kinds}
    return next((name for name in row if re.sub(r"[^a-z0-9]", "", name.lower()) in wanted), None)


def _coordinates(settings: MapSettings, row: Row, kinds: Sequence[str]) -> tuple[float, float]:
    names = [_column(row, kinds, dimension) for dimension in settings.dimensions]
    x, y = (real(row[str(name)], f"figure {settings.name!r}") for name in names)
    return x, y


def _points(settings: MapSettings, selected: Selected, answer: Answer) -> list[dict[str, Any]]:
    classes = _per_stimulus(settings, selected, answer, settings.class_column)
    labels = _per_stimulus(settings, selected, answer, settings.label_column)
    order = {
        name: i
        for i, name in enumerate(in_order(selected, settings.over, (str(r[settings.over]) for r in answer.rows)))
    }
    rows = []
    for row in sorted(answer.rows, key=lambda row: order[str(row[settings.over])]):
        name, (x, y) = str(row[settings.over]), _coordinates(settings, row, PLACES)
        if math.isnan(x) or math.isnan(y):
            raise DataRefused(f"figure {settings.name!r}: stimulus {name!r} has no place in the map")
        rows.append(
            {
                "shows": "point",
                "stimulus": name,
                "label": labels.get(name, name),
                "class": classes.get(name),
                "x": x,
                "y": y,
            }
        )
    return rows


def _same_map(settings: MapSettings, points: list[dict[str, Any]], vectors: Answer) -> None:
    """Refuse vectors that were fitted to another configuration: they would point nowhere in this one."""
    fitted = {
        str(row[settings.over]): _coordinates(settings, row, PLACES) for row in vectors.more.get("configuration", ())
    }
    reach = max(math.hypot(point["x"], point["y"]) for point in points)
    apart = [
        str(point["stimulus"])
        for point in points
        if fitted and math.dist(fitted.get(point["stimulus"], (math.inf, 0.0)), (point["x"], point["y"])) > NEAR * reach
    ]
    if apart:
        raise DataRefused(
            f"figure {settings.name!r}: its vectors were fitted to another map than it shows ({phrase(apart[:3])} lie"
            " elsewhere); give the test of vectors the `on` and the other settings of the map's test"
        )


def _per_stimulus(settings: MapSettings, selected: Selected, answer: Answer, column: str | None) -> dict[str, str]:
    """What a column says of each stimulus: from the answer's own rows, else from the study's."""
    if column is None:
        return {}
    if column in answer.rows[0]:
        return {str(row[settings.over]): str(row[column]) for row in answer.rows}
    frame = selected.table if column in selected.table.columns else selected.trials
    require(settings, frame, [settings.over, column])
    pairs = set(zip(texts_of(frame, settings.over), texts_of(frame, column), strict=True))
    found = dict(pairs)
    if len(found) < len(pairs):
        twice = sorted({name for name, level in pairs if found[name] != level}, key=natural_key)
        raise DataRefused(f"figure {settings.name!r}: column {column!r} has several levels for {phrase(twice[:5])}")
    return found


def _class_order(settings: MapSettings, selected: Selected, points: list[dict[str, Any]]) -> list[str]:
    found = {str(point["class"]) for point in points if point["class"] is not None}
    return list(in_order(selected, settings.class_column or "", found))


def _ellipses(settings: MapSettings, answer: Answer) -> list[dict[str, Any]]:
    """Only a map in the dimensions that the ellipses were made in can show them."""
    if not settings.ellipses or settings.dimensions != (1, 2):
        return []
    found = []
    for row in answer.more.get("ellipses", ()):
        where = f"figure {settings.name!r}, ellipse of {row[settings.over]!r}"
        x, y = (real(row[name], where) for name in ("centre_1", "centre_2"))
        major, minor, angle = (real(row[name], where) for name in ("semi_major", "semi_minor", "angle_deg"))
        if not any(math.isnan(part) for part in (x, y, major, minor, angle)):
            sizes = {"semi_major": major, "semi_minor": minor, "angle_deg": angle}
            found.append({"shows": "ellipse", "stimulus": str(row[settings.over]), "x": x, "y": y, **sizes})
    return sorted(found, key=lambda row: natural_key(str(row["stimulus"])))


def _vectors(settings: MapSettings, selected: Selected, answer: Answer) -> list[dict[str, Any]]:
    order = {
        name: i
        for i, name in enumerate(in_order(selected, settings.items, (str(r[settings.items]) for r in answer.rows)))
    }
    found = []
    for row in sorted(answer.rows, key=lambda row: order[str(row[settings.items])]):
        name, (x, y) = str(row[settings.items]), _coordinates(settings, row, DIRECTIONS)
        where = f"figure {settings.name!r}, vector {name!r}"
        r2, p = real(row["r2"], where), real(row.get("p"), where)
        antonym = str(row.get("antonym") or selected.antonyms.get(name, ""))
        numbers = {"x": nan_to_none(x), "y": nan_to_none(y), "r2": nan_to_none(r2), "p": nan_to_none(p)}
        found.append({"shows": "vector", "attribute": name, "antonym": antonym, **numbers})
    return found


def _caption(shown: Shown, answer: Answer, rows: Sequence[Row]) -> str:
    kinds = {str(row["shows"]) for row in rows}
    parts = [answer.method.rstrip(".") + ".", *([answer.headline.rstrip(".") + "."] if answer.headline else [])]
    parts.append("Both axes have one scale; their directions and signs mean nothing by themselves.")
    if "ellipse" in kinds:
        told = [note for note in answer.notes if note.lower().startswith("ellipses: ")]
        where = told[0][len("ellipses: ") :].rstrip(".") if told else "as the test resampled it"
        parts.append(f"Ellipses: where a stimulus may lie ({where}).")
    if "vector" in kinds:
        parts.append(
            "Arrows: where an attribute's value grows, towards the second word of its scale; as long as its multiple"
            f" correlation R with the map, the ring being R = 1; dashed: p not below {shown.selected.alpha:g}."
        )
        undefined = [
            str(row["attribute"])
            for row in rows
            if row["shows"] == "vector" and (row["x"] is None or row["r2"] is None)
        ]
        parts += [f"Without a direction: {phrase(undefined)}."] if undefined else []
    return " ".join(parts)


MAP = FigureKind(MapSettings, data, draw)
