"""What the specimens of the screens say: texts as the studies have them (thesis 3.3.3, 4.7, 5.3.3, 5.3.4, 5.7.2)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.protocols.yaml_text import load

FOLDER = Path(__file__).resolve().parents[1] / "texts" / "specimens"


@dataclass(frozen=True)
class Wording:
    """The study's side of the specimens in one language; `person` are questions with their answers or their unit."""

    seven: tuple[tuple[str, str, str], ...]
    four: tuple[tuple[str, str, str], ...]
    labels: tuple[str, ...]
    alike: tuple[str, str]
    sides: tuple[str, ...]
    words: tuple[str, ...]
    own: tuple[str, ...]
    items: tuple[str, ...]
    ends: tuple[str, str]
    person: tuple[tuple[str, tuple[str, ...] | str], ...]
    free: str
    anchor: str
    fit: tuple[str, ...]
    consent: str
    instructions: str


def wording(language: str = "en") -> Wording:
    """The specimens' texts in a language; in English where nobody has written them in it."""
    file = FOLDER / f"{language}.yaml"
    return read_wording(file if file.is_file() else FOLDER / "en.yaml")


def read_wording(file: Path) -> Wording:
    """The texts of a file: the fields of Wording."""
    return Wording(**{key: _frozen(value) for key, value in load(file.read_bytes(), str(file)).data.items()})


def _frozen(value: Any) -> Any:
    return tuple(_frozen(each) for each in value) if isinstance(value, list) else value
