"""The table of simulated surfaces, by physical parameters with units and ranges."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

from palpate.protocols.tables import Row, TableFormat, has_text, read_table
from palpate.protocols.wording import some

SHIPPED = Path(__file__).resolve().with_name("textures.csv")
PATTERNS = (
    "none", "ribs", "plain", "twill", "mesh", "studs", "knurl", "grit", "foam", "leather", "loops", "pile", "blades",
    "fibres", "pores",
)  # fmt: skip
"""Patterns that repeat over a surface; see devices/surfaces/relief.py."""
PAINTS = ("none", "pattern", "height", "grain", "speckle")
"""Where the second colour is; `grain` and `speckle` are independent of the relief."""
COLOUR = re.compile(r"#[0-9a-f]{6}")


class SurfaceDataError(ValueError):
    """A table of surfaces, or a scene on one, that cannot be used; the message says where and what is expected."""


@dataclass(frozen=True)
class Span:
    """Least and greatest value of a parameter, and its unit."""

    low: float
    high: float
    unit: str


SPANS: Mapping[str, Span] = {
    "rms_um": Span(0, 500, "um"),
    "correlation_mm": Span(0.1, 20, "mm"),
    "hurst": Span(0.05, 1, "1"),
    "finest_mm": Span(0.13, 5, "mm"),
    "stretch": Span(1, 30, "1"),
    "grain_deg": Span(0, 180, "deg"),
    "pattern_um": Span(0, 3000, "um"),
    "pitch_mm": Span(0.2, 20, "mm"),
    "aspect": Span(0.2, 10, "1"),
    "pattern_deg": Span(0, 180, "deg"),
    "regularity": Span(0, 1, "1"),
    "bumps_um": Span(0, 1500, "um"),
    "bumps_mm": Span(15, 50, "mm"),
    "static_friction": Span(0.02, 2, "1"),
    "kinetic_friction": Span(0.02, 2, "1"),
    "stribeck_mm_s": Span(1, 200, "mm/s"),
    "stiffness_N_mm": Span(0.05, 10_000, "N/mm"),
    "damping_ratio": Span(0.01, 5, "1"),
    "mottle": Span(0, 1, "1"),
    "gloss": Span(0, 1, "1"),
    "shine": Span(1, 200, "1"),
}
"""The range of each number; meanings and sources are in docs/explanation/simulated-surfaces.md."""


@dataclass(frozen=True)
class Surface:
    """A surface. Heights in micrometres, lengths along it in millimetres, angles in degrees from the x axis."""

    id: str
    label: str
    category: str
    rms_um: float
    correlation_mm: float
    hurst: float
    finest_mm: float
    stretch: float
    grain_deg: float
    pattern: str
    pattern_um: float
    pitch_mm: float
    aspect: float
    pattern_deg: float
    regularity: float
    bumps_um: float
    bumps_mm: float
    static_friction: float
    kinetic_friction: float
    stribeck_mm_s: float
    stiffness_N_mm: float
    damping_ratio: float
    colour: str
    colour2: str
    paint: str
    mottle: float
    gloss: float
    shine: float

    def __post_init__(self) -> None:
        """Raise SurfaceDataError for a value out of its range."""
        for name, span in SPANS.items():
            _demand_in(f"surface {self.id!r}", name, getattr(self, name), span)
        if self.static_friction < self.kinetic_friction:
            raise SurfaceDataError(
                f"surface {self.id!r}: static_friction {self.static_friction:g} is less than kinetic_friction "
                f"{self.kinetic_friction:g}; at least as much is expected"
            )
        for name, known in (("pattern", PATTERNS), ("paint", PAINTS)):
            if getattr(self, name) not in known:
                raise SurfaceDataError(
                    f"surface {self.id!r}: {name} {getattr(self, name)!r} is not known; expected one of "
                    f"{', '.join(known)}"
                )
        for name in ("colour", "colour2"):
            if not COLOUR.fullmatch(getattr(self, name)):
                raise SurfaceDataError(
                    f"surface {self.id!r}: {name} {getattr(self, name)!r} is no colour; expected #rrggbb, small letters"
                )


COLUMNS = tuple("class" if field.name == "category" else field.name for field in fields(Surface))
FORMAT = TableFormat(
    error=SurfaceDataError,
    counted=has_text,
    encoding=lambda wrong: f"{wrong.path}: not a UTF-8 text file ({wrong.reason})",
    quoting=None,
    width=lambda wrong: f"{wrong.where}: {wrong.cells} values found, {len(COLUMNS)} expected",
)


def read_surfaces(path: Path | str = SHIPPED) -> dict[str, Surface]:
    """Return the surfaces of a table, by id, in its order.

    Raises:
        SurfaceDataError: naming file, line and column, where a column is missing or unknown, a value is not a number
            or out of its range, a name is not known, or an id occurs twice.
    """
    table = read_table(Path(path), (), FORMAT)
    _demand_columns(table.path, table.header)
    surfaces: dict[str, Surface] = {}
    for row in table.rows():
        surface = _surface(row)
        if surface.id in surfaces:
            raise SurfaceDataError(f"{row.where}, column 'id': {surface.id!r} appears twice")
        surfaces[surface.id] = surface
    if not surfaces:
        raise SurfaceDataError(f"{path}: no surface found; one a line is expected")
    return surfaces


def _demand_columns(path: Path, header: Sequence[str]) -> None:
    for name in COLUMNS:
        if header.count(name) != 1:
            problem = "appears more than once" if name in header else "is missing"
            raise SurfaceDataError(f"{path}, line 1: column {name!r} {problem}; expected {','.join(COLUMNS)}")
    if tuple(header) != COLUMNS:
        others = some(name for name in header if name not in COLUMNS) or "another order"
        raise SurfaceDataError(f"{path}, line 1: found {others}; expected {','.join(COLUMNS)}")


def _surface(row: Row) -> Surface:
    values = {name: _value(row, name) for name in COLUMNS}
    values["category"] = values.pop("class")
    try:
        return Surface(**values)  # type: ignore[arg-type]
    except SurfaceDataError as error:
        raise SurfaceDataError(f"{row.where}: {error}") from None


def _value(row: Row, name: str) -> str | float:
    text = row[name].strip()
    if name not in SPANS:
        if not text:
            raise SurfaceDataError(f"{row.where}, column {name!r}: empty, a value is expected")
        return text
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    _demand_in(row.where, name, value, SPANS[name], text)
    return value


def _demand_in(where: str, name: str, value: float, span: Span, found: str | None = None) -> None:
    if not span.low <= value <= span.high:
        raise SurfaceDataError(
            f"{where}, column {name!r}: {value if found is None else found!r} found, "
            f"a number from {span.low:g} to {span.high:g} ({span.unit}) is expected"
        )
