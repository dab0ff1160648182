"""Designs on disk: named wishes with the door made from them, and the current work, saved at every change."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, ValidationError

from palpate.devices.author.work import MOST_SMOOTHING_DEG, Setting, Work
from palpate.devices.door.making import DesignedDoor, Maker
from palpate.devices.door.stimuli import profile_text
from palpate.protocols.canonical import json_text
from palpate.protocols.files import write_text
from palpate.protocols.strict import StrictFinite
from palpate.signals.doors.grid import FORCE_DECIMALS, POINTS

FOLDER = "designs"
KEPT, BEFORE = ".autosave.json", ".autosave-before.json"
LONGEST_NAME = 60
Wish = Annotated[float, Field(ge=0, le=100)]
Smoothing = Annotated[float, Field(ge=0, le=MOST_SMOOTHING_DEG)]


class DesignError(ValueError):
    """A design that cannot be saved under its name, or a file that is not a design."""


class Design(StrictFinite):
    """A saved design: wishes by their low word, the models that made it, the 621 forces, and how they should feel."""

    format: Literal["palpate-design/1"] = "palpate-design/1"
    name: str
    wish: Mapping[str, Wish]
    smoothing_deg: Smoothing
    models: Mapping[str, Any]
    force_N: Annotated[tuple[float, ...], Field(min_length=POINTS, max_length=POINTS)]
    predicted: Mapping[str, float]


class Side(StrictFinite):
    """A setting as it is stored."""

    wish: tuple[Wish, ...]
    smoothing_deg: Smoothing


class StoredWork(StrictFinite):
    """The current work as it is stored at every change."""

    format: Literal["palpate-authoring/1"] = "palpate-authoring/1"
    attributes: tuple[str, ...]
    a: Side
    b: Side | None = None
    on: Literal["A", "B"] = "A"
    name: str = ""
    saved: Side | None = None


def designs_folder(lab: Path) -> Path:
    """Return the folder of a lab's designs."""
    return lab / FOLDER


def name_problem(name: str) -> str:
    """Return the text key of why a design cannot have this name; "" if it can."""
    if not name:
        return "name_missing"
    if len(name) > LONGEST_NAME:
        return "name_long"
    letters = name.replace(" ", "").replace("-", "").replace("_", "")
    return "" if letters.isalnum() else "name_letters"


def design_of(name: str, setting: Setting, maker: Maker, made: DesignedDoor) -> Design:
    """Return the design to save. Raises DesignError for a name that is not allowed."""
    if problem := name_problem(name):
        raise DesignError(f"a design cannot be called {name!r:.80} ({problem}): letters, digits, blanks, - and _")
    predicted = {low: round(float(value), 2) for low, value in zip(maker.attributes, made.predicted, strict=True)}
    return Design(
        name=name, wish=dict(zip(maker.attributes, setting.wish, strict=True)), smoothing_deg=setting.smoothing_deg,
        models=dict(maker.identity), force_N=tuple(round(float(force), FORCE_DECIMALS) + 0.0 for force in made.force_N),
        predicted=predicted,
    )  # fmt: skip


def save(lab: Path, design: Design) -> Path:
    """Write LAB/designs/NAME.json; a design of that name is replaced completely or not at all."""
    return _written(designs_folder(lab) / f"{design.name}.json", design)


def export(lab: Path, design: Design) -> Path:
    """Write LAB/designs/NAME.csv, a profile as the door studies read it."""
    import numpy as np

    return write_text(designs_folder(lab) / f"{design.name}.csv", profile_text(np.array(design.force_N)))


def names(lab: Path) -> list[str]:
    """Return the names of the lab's designs in alphabetical order."""
    return sorted(path.stem for path in designs_folder(lab).glob("*.json") if not path.name.startswith("."))


def read_design(path: Path) -> Design:
    """Return a saved design. Raises DesignError that names file and place if the file is not a valid design."""
    design: Design = _read(path, Design)
    return design


def setting_of(design: Design, maker: Maker) -> Setting:
    """Return the setting that makes a design. Raises DesignError if the design has other attributes."""
    if set(design.wish) != set(maker.attributes):
        theirs, ours = ", ".join(design.wish), ", ".join(maker.attributes)
        raise DesignError(f"{design.name}: this design wishes for {theirs}; these models make doors from {ours}")
    return Setting(tuple(design.wish[low] for low in maker.attributes), design.smoothing_deg)


def keep(lab: Path, work: Work, maker: Maker) -> None:
    """Save the current work, so that a killed process loses no more than its last move."""
    kept = StoredWork(
        attributes=tuple(maker.attributes), a=_side(work.a), b=None if work.b is None else _side(work.b), on=work.on,
        name=work.name, saved=None if work.saved is None else _side(work.saved),
    )  # fmt: skip
    _written(designs_folder(lab) / KEPT, kept)


def kept_work(lab: Path, maker: Maker) -> Work | None:
    """Return the work of the last time that the window was open; None if there is none.

    Raises DesignError if the file is damaged, or belongs to doors of other attributes.
    """
    path = designs_folder(lab) / KEPT
    if not path.is_file():
        return None
    kept = _read(path, StoredWork)
    ours = tuple(maker.attributes)
    if kept.attributes != ours or any(len(s.wish) != len(ours) for s in (kept.a, kept.b, kept.saved) if s):
        raise DesignError(f"Work on doors of other attributes than these models' was left. It is kept as {BEFORE}.")
    b, saved = (None if s is None else Setting(s.wish, s.smoothing_deg) for s in (kept.b, kept.saved))
    a = Setting(kept.a.wish, kept.a.smoothing_deg)
    return Work(a, b, "A" if b is None else kept.on, kept.name, saved)


def put_aside(lab: Path) -> None:
    """Rename the saved work, so that it is not resumed; it is kept until the next time."""
    path = designs_folder(lab) / KEPT
    if path.is_file():
        path.replace(path.with_name(BEFORE))


def forget(lab: Path) -> None:
    """Delete the saved work, because everything is in a design."""
    (designs_folder(lab) / KEPT).unlink(missing_ok=True)


def _side(setting: Setting) -> Side:
    return Side(wish=setting.wish, smoothing_deg=setting.smoothing_deg)


def _read(path: Path, kind: type[Any]) -> Any:
    try:
        return kind.model_validate_json(path.read_bytes())
    except OSError as error:
        raise DesignError(f"{path}: cannot be read ({error.strerror})") from error
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"])) or "the file"
        raise DesignError(f"{path}: no design of this program: {place}: {first['msg']}") from error


def _written(path: Path, data: BaseModel) -> Path:
    return write_text(path, json_text(data.model_dump(mode="json"), indent=1))
