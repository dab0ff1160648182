"""Font files of this machine that cover the characters of a study, and text split into runs of one font each."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from palpate.devices.window.fonts_cmap import Coverage, NotAFont, coverage
from palpate.devices.window.fonts_files import BOLD, REGULAR, font_files, in_order
from palpate.devices.window.fonts_scripts import is_complex, packages_for
from palpate.devices.window.geometry import WindowError
from palpate.protocols.wording import some

if TYPE_CHECKING:
    from PIL import Image
    from PIL.ImageFont import FreeTypeFont

K = TypeVar("K")
V = TypeVar("V")
MOST_NAMED = 12
CJK_INDEX = {"ja": 0, "ko": 1, "zh": 2}
"""Which font of Noto Sans CJK's collection writes a language's Chinese characters as its readers know them."""


@dataclass(frozen=True)
class Face:
    """One font of a file."""

    path: Path
    index: int = 0


@dataclass(frozen=True)
class Run:
    """A stretch of text that one font draws."""

    text: str
    face: Face


@dataclass(frozen=True)
class Mask:
    """A run as it is drawn; left and top from where its baseline begins."""

    image: Image.Image
    left: int
    top: int


class Recent(dict[K, V]):
    """A memory of so many things: the one kept longest goes first."""

    def __init__(self, most: int) -> None:
        super().__init__()
        self.most = most

    def __setitem__(self, key: K, value: V) -> None:
        if len(self) >= self.most:
            del self[next(iter(self))]
        super().__setitem__(key, value)


@dataclass
class Fonts:
    """The fonts of a session, best first; what was opened or measured is kept here and nowhere else."""

    regular: tuple[Face, ...]
    bold: tuple[Face, ...] = ()
    shapes_complex: bool = True
    _covered: dict[Face, Coverage | None] = field(default_factory=dict, repr=False)
    _opened: dict[tuple[Face, int], Any] = field(default_factory=dict, repr=False)
    _faces: dict[tuple[str, bool], Face | None] = field(default_factory=dict, repr=False)
    _widths: Recent[tuple[str, int, bool], float] = field(default_factory=lambda: Recent(4000), repr=False)
    _masks: Recent[tuple[Face, int, str], Mask] = field(default_factory=lambda: Recent(400), repr=False)
    laid: Recent[tuple[object, ...], Any] = field(default_factory=lambda: Recent(400), repr=False)
    """Texts in lines, which `paint_text.lay` keeps: a form tries its texts at many sizes, and is shown many times."""

    def demand(self, texts: Iterable[str]) -> None:
        """Raise WindowError unless every character can be drawn, naming those that cannot and what to install."""
        characters = sorted({c for text in texts for c in unicodedata.normalize("NFC", text) if not _invisible(c)})
        if not self.shapes_complex and (found := [c for c in characters if is_complex(c)]):
            raise WindowError(
                f"no complex text shaping: Pillow was built without Raqm, and {_named(found)} would be drawn wrongly; "
                "install Pillow from its own wheels (pip install --force-reinstall pillow) or libraqm0"
            )
        if missing := [c for c in characters if self.face(c) is None]:
            raise WindowError(f"no font on this machine draws {_named(missing)}; install {packages_for(missing)}")

    def face(self, character: str, bold: bool = False) -> Face | None:
        """The first font that has the character; a bold one where there is one."""
        key = character, bold
        if key not in self._faces:
            faces = (*self.bold, *self.regular) if bold else self.regular
            self._faces[key] = next((face for face in faces if self._draws(face, character)), None)
        return self._faces[key]

    def runs(self, text: str, bold: bool = False) -> tuple[Run, ...]:
        """The text (NFC) split by font; a mark or a space stays with the letter before it. Raises WindowError."""
        runs: list[Run] = []
        for character in unicodedata.normalize("NFC", text):
            before = runs[-1].face if runs else None
            face = self._face_after(before, character, bold)
            if face == before:
                runs[-1] = Run(runs[-1].text + character, runs[-1].face)
            elif face is not None:
                runs.append(Run(character, face))
            else:
                self.demand([character])
        return tuple(runs)

    def width(self, text: str, size: int, bold: bool = False) -> float:
        """How far the text advances, in pixels."""
        key = text, size, bold
        if key not in self._widths:
            runs = self.runs(text, bold)
            self._widths[key] = sum(float(self.font(run.face, size).getlength(run.text)) for run in runs)
        return self._widths[key]

    def mask(self, face: Face, size: int, text: str) -> Mask:
        """The text drawn once, to be painted in any colour: shaping it is what takes time."""
        key = face, size, text
        if key not in self._masks:
            self._masks[key] = _drawn(self.font(face, size), text)
        return self._masks[key]

    def font(self, face: Face, size: int) -> FreeTypeFont:
        """The font at an em size in pixels."""
        from PIL import ImageFont

        if (face, size) not in self._opened:
            self._opened[face, size] = ImageFont.truetype(str(face.path), size, face.index)
        font: FreeTypeFont = self._opened[face, size]
        return font

    def _face_after(self, before: Face | None, character: str, bold: bool) -> Face | None:
        """A run goes on through what belongs to no script of its own, if its font has it."""
        neutral = unicodedata.category(character)[0] in "ZMC" or unicodedata.combining(character)
        if before is not None and neutral and (_invisible(character) or self._draws(before, character)):
            return before
        return (self.regular[0] if _invisible(character) else None) or self.face(character, bold)

    def _draws(self, face: Face, character: str) -> bool:
        if face not in self._covered:
            self._covered[face] = _coverage(face)
        known = self._covered[face]
        return known is not None and known.holds(character)


def _drawn(font: FreeTypeFont, text: str) -> Mask:
    from PIL import Image, ImageDraw

    left, top, right, bottom = (round(edge) for edge in font.getbbox(text, anchor="ls"))
    left, top = left - 1, top - 1
    image = Image.new("L", (max(1, right + 1 - left), max(1, bottom + 1 - top)), 0)
    ImageDraw.Draw(image).text((-left, -top), text, fill=255, font=font, anchor="ls")
    return Mask(image, left, top)


def find_fonts(language: str = "en", folders: Sequence[Path] | None = None) -> Fonts:
    """The fonts of this machine (or of some folders) that Palpate writes with. Raises WindowError if there are none."""
    from PIL import features

    files = font_files(folders)
    regular, bold = (tuple(_face(path, language) for path in in_order(files, wanted)) for wanted in (REGULAR, BOLD))
    if not regular:
        raise WindowError("no font was found on this machine; install fonts-noto-core (Debian) or Noto Sans")
    return Fonts(regular, bold, shapes_complex=bool(features.check("raqm")))


def _face(path: Path, language: str) -> Face:
    return Face(path, CJK_INDEX.get(language[:2], 1) if path.name.startswith("NotoSansCJK") else 0)


def _coverage(face: Face) -> Coverage | None:
    """What a font covers; None for a file that turns out to be broken: the next one is taken."""
    try:
        return coverage(face.path, face.index)
    except (NotAFont, OSError):
        return None


def _invisible(character: str) -> bool:
    """Controls, joiners and line breaks, which no font needs to draw."""
    return unicodedata.category(character) in {"Cc", "Cf", "Zl", "Zp"}


def _named(characters: Sequence[str]) -> str:
    return some((f"{c!r} ({unicodedata.name(c, f'U+{ord(c):04X}')})" for c in characters), MOST_NAMED)
