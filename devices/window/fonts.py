"""Font files of this machine that cover the characters of a study, and text divided into runs of one font each.

Which characters a file can draw is read from its character map (OpenType `cmap`, formats 4 and 12).
"""

from __future__ import annotations

import os
import struct
import sys
import unicodedata
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from fnmatch import fnmatch
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, TypeVar

from palpate.devices.window.geometry import WindowError
from palpate.protocols.wording import some

if TYPE_CHECKING:
    from PIL import Image
    from PIL.ImageFont import FreeTypeFont

K = TypeVar("K")
V = TypeVar("V")
MOST_NAMED = 12
CJK_INDEX = {"ja": 0, "ko": 1, "zh": 2}
"""The font in Noto Sans CJK's collection with a language's usual forms of Chinese characters."""
UNICODE = ((3, 10), (0, 6), (0, 4), (3, 1), (0, 3), (0, 2), (0, 1), (0, 0))
"""(platform, encoding) of Unicode subtables, the widest first."""
LARGEST_TABLE = 4_000_000
REGULAR = (
    "NotoSans-Regular.ttf", "NotoSans[[]*[]].ttf", "segoeui.ttf", "HelveticaNeue.ttc", "Arial.ttf", "arial.ttf",
    "DejaVuSans.ttf", "LiberationSans-Regular.ttf",
    "NotoSansKR-Regular.*", "NotoSansCJK-Regular.ttc", "NotoSansCJK-VF*.ttc", "malgun.ttf", "AppleSDGothicNeo.ttc",
    "NanumGothic.ttf", "NotoSansJP-Regular.*", "NotoSansSC-Regular.*", "YuGothR.ttc", "msyh.ttc", "PingFang.ttc",
    "NotoSansDevanagari-Regular.ttf", "Nirmala.ttf", "Nirmala.ttc", "Kohinoor.ttc", "mangal.ttf",
    "Lohit-Devanagari.ttf",
    "NotoSans*-Regular.ttf", "NotoSansSymbols*-Regular.ttf", "seguisym.ttf",
)  # fmt: skip
"""File names in order of preference: Latin with accents, then Korean and its neighbours, Devanagari, others."""
BOLD = (
    "NotoSans-Bold.ttf", "segoeuib.ttf", "Arial Bold.ttf", "arialbd.ttf", "DejaVuSans-Bold.ttf",
    "LiberationSans-Bold.ttf", "NotoSansKR-Bold.*", "NotoSansCJK-Bold.ttc", "malgunbd.ttf", "NanumGothicBold.ttf",
    "NotoSansDevanagari-Bold.ttf", "NirmalaB.ttf", "NotoSans*-Bold.ttf",
)  # fmt: skip
ENDINGS = (".ttf", ".ttc", ".otf", ".otc")
COMPLEX = (
    (0x0590, 0x08FF),
    (0x0900, 0x0DFF),
    (0x0E00, 0x0FFF),
    (0x1000, 0x109F),
    (0x1100, 0x11FF),
    (0x1780, 0x17FF),
    (0xA8E0, 0xA8FF),
    (0xFB1D, 0xFDFF),
    (0xFE70, 0xFEFC),
)
"""Hebrew to Arabic, the scripts of India, Thai to Tibetan, Myanmar, loose Hangul letters, Khmer, and extensions."""
_CJK = ("fonts-noto-cjk", "the system's Korean, Japanese or Chinese language pack")
SOURCES = (
    (0x1100, 0x11FF, *_CJK),
    (0x3000, 0x9FFF, *_CJK),
    (0xA960, 0xD7FF, *_CJK),
    (0xF900, 0xFAFF, *_CJK),
    (0xFF00, 0xFFEF, *_CJK),
    (0x20000, 0x3FFFF, "fonts-noto-cjk", "the system's Chinese language pack"),
    (0x0900, 0x0DFF, "fonts-noto-core", "the system's Hindi or Indian language pack (Nirmala UI, Kohinoor)"),
    (0x1F000, 0x1FAFF, "fonts-symbola", "or leave pictures such as these out of the text"),
)
ANY = ("fonts-noto-core or fonts-noto-extra", "Noto Sans from notofonts.github.io")


@dataclass(frozen=True)
class Face:
    """A font in a file."""

    path: Path
    index: int = 0


@dataclass(frozen=True)
class Run:
    """A stretch of text that one font draws."""

    text: str
    face: Face


@dataclass(frozen=True)
class Mask:
    """A run as it is drawn; left and top are from the start of its baseline."""

    image: Image.Image
    left: int
    top: int


class Recent(dict[K, V]):
    """A cache of limited size that drops the oldest entry first."""

    def __init__(self, most: int) -> None:
        super().__init__()
        self.most = most

    def __setitem__(self, key: K, value: V) -> None:
        if len(self) >= self.most:
            del self[next(iter(self))]
        super().__setitem__(key, value)


@dataclass
class Fonts:
    """The fonts of a session, best first; opened fonts and measurements are cached only here."""

    regular: tuple[Face, ...]
    bold: tuple[Face, ...] = ()
    shapes_complex: bool = True
    _covered: dict[Face, Coverage | None] = field(default_factory=dict, repr=False)
    _opened: dict[tuple[Face, int], Any] = field(default_factory=dict, repr=False)
    _faces: dict[tuple[str, bool], Face | None] = field(default_factory=dict, repr=False)
    _widths: Recent[tuple[str, int, bool], float] = field(default_factory=lambda: Recent(4000), repr=False)
    _masks: Recent[tuple[Face, int, str], Mask] = field(default_factory=lambda: Recent(400), repr=False)
    laid: Recent[tuple[object, ...], Any] = field(default_factory=lambda: Recent(400), repr=False)
    """Cache of laid out texts for `paint_text.lay`: a form tries its texts at many sizes, and is shown many times."""

    def demand(self, texts: Iterable[str]) -> None:
        """Raise WindowError unless every character can be drawn; it lists those that cannot, and what to install."""
        characters = sorted({c for text in texts for c in unicodedata.normalize("NFC", text) if not _invisible(c)})
        if not self.shapes_complex and (found := [c for c in characters if is_complex(c)]):
            raise WindowError(
                f"no complex text shaping: Pillow was built without Raqm, and {_named(found)} would be drawn wrongly; "
                "install Pillow from its own wheels (pip install --force-reinstall pillow) or libraqm0"
            )
        if missing := [c for c in characters if self.face(c) is None]:
            raise WindowError(f"no font on this machine draws {_named(missing)}; install {packages_for(missing)}")

    def face(self, character: str, bold: bool = False) -> Face | None:
        """Return the first font that has the character, a bold one if available; None if there is none."""
        key = character, bold
        if key not in self._faces:
            faces = (*self.bold, *self.regular) if bold else self.regular
            self._faces[key] = next((face for face in faces if self._draws(face, character)), None)
        return self._faces[key]

    def runs(self, text: str, bold: bool = False) -> tuple[Run, ...]:
        """Return the text (NFC) divided by font; a mark or a space stays with the letter before it. Raises
        WindowError.
        """
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
        """Return the advance width of the text in pixels."""
        key = text, size, bold
        if key not in self._widths:
            runs = self.runs(text, bold)
            self._widths[key] = sum(float(self.font(run.face, size).getlength(run.text)) for run in runs)
        return self._widths[key]

    def mask(self, face: Face, size: int, text: str) -> Mask:
        """Return the text drawn once, to be painted in any colour, because shaping it takes time."""
        key = face, size, text
        if key not in self._masks:
            font = self.font(face, size)
            from PIL import Image, ImageDraw

            left, top, right, bottom = (round(edge) for edge in font.getbbox(text, anchor="ls"))
            left, top = left - 1, top - 1
            image = Image.new("L", (max(1, right + 1 - left), max(1, bottom + 1 - top)), 0)
            ImageDraw.Draw(image).text((-left, -top), text, fill=255, font=font, anchor="ls")
            self._masks[key] = Mask(image, left, top)
        return self._masks[key]

    def font(self, face: Face, size: int) -> FreeTypeFont:
        """Return the font at an em size in pixels."""
        from PIL import ImageFont

        if (face, size) not in self._opened:
            self._opened[face, size] = ImageFont.truetype(str(face.path), size, face.index)
        font: FreeTypeFont = self._opened[face, size]
        return font

    def _face_after(self, before: Face | None, character: str, bold: bool) -> Face | None:
        """Return the font of the next character; a neutral character keeps the font before it, if that has it."""
        neutral = unicodedata.category(character)[0] in "ZMC" or unicodedata.combining(character)
        if before is not None and neutral and (_invisible(character) or self._draws(before, character)):
            return before
        return (self.regular[0] if _invisible(character) else None) or self.face(character, bold)

    def _draws(self, face: Face, character: str) -> bool:
        if face not in self._covered:
            # None for a file that turns out to be broken: the next one is taken.
            self._covered[face] = None
            with suppress(NotAFont, OSError):
                self._covered[face] = coverage(face.path, face.index)
        known = self._covered[face]
        return known is not None and known.holds(character)


def find_fonts(language: str = "en", folders: Sequence[Path] | None = None) -> Fonts:
    """Return the fonts of this machine, or of some folders, for Palpate's texts. Raises WindowError if there are
    none.
    """
    from PIL import features

    files, cjk = font_files(folders), CJK_INDEX.get(language[:2], 1)
    regular, bold = (
        tuple(Face(path, cjk if path.name.startswith("NotoSansCJK") else 0) for path in in_order(files, patterns))
        for patterns in (REGULAR, BOLD)
    )
    if not regular:
        raise WindowError("no font was found on this machine; install fonts-noto-core (Debian) or Noto Sans")
    return Fonts(regular, bold, shapes_complex=bool(features.check("raqm")))


def _invisible(character: str) -> bool:
    """Return whether no font needs to draw the character: controls, joiners and line breaks."""
    return unicodedata.category(character) in {"Cc", "Cf", "Zl", "Zp"}


def _named(characters: Sequence[str]) -> str:
    return some((f"{c!r} ({unicodedata.name(c, f'U+{ord(c):04X}')})" for c in characters), MOST_NAMED)


class NotAFont(ValueError):
    """A file that is not an OpenType or TrueType font with a Unicode character map."""


@dataclass(frozen=True)
class Coverage:
    """Sorted ranges of code points: first[n] to last[n], both inclusive."""

    first: tuple[int, ...]
    last: tuple[int, ...]

    def holds(self, character: str) -> bool:
        """Return whether the font has a glyph for the character."""
        place = bisect_right(self.first, ord(character)) - 1
        return place >= 0 and ord(character) <= self.last[place]


def coverage(path: Path, index: int = 0) -> Coverage:
    """Return the characters that font `index` of a file can draw. Raises NotAFont, or OSError if it cannot be read."""
    try:
        with path.open("rb") as file:
            data = _subtable(_table(file, index))
            (kind,) = struct.unpack_from(">H", data)
            ranges = sorted(_groups(data) if kind == 12 else _segments(data))
    except (struct.error, IndexError) as error:
        raise NotAFont(f"{path}: a broken character map ({error})") from None
    except NotAFont as error:
        raise NotAFont(f"{path}: {error}") from None
    return Coverage(tuple(first for first, _ in ranges), tuple(last for _, last in ranges))


def _table(file: BinaryIO, index: int) -> bytes:
    """Return the bytes of the cmap table."""
    start = 0
    if file.read(4) == b"ttcf":
        _, count = struct.unpack(">II", file.read(8))
        if not 0 <= index < count:
            raise NotAFont(f"font {index} of {count}")
        file.seek(12 + 4 * index)
        (start,) = struct.unpack(">I", file.read(4))
    file.seek(start + 4)
    (tables,) = struct.unpack(">H", file.read(2))
    file.seek(start + 12)
    for _ in range(tables):
        tag, _, offset, length = struct.unpack(">4sIII", file.read(16))
        if tag == b"cmap":
            file.seek(offset)
            return file.read(min(length, LARGEST_TABLE))
    raise NotAFont("no character map")


def _subtable(table: bytes) -> bytes:
    """Return the widest Unicode subtable in a supported format."""
    _, count = struct.unpack_from(">HH", table)
    tables = {}
    for number in range(count):
        platform, encoding, offset = struct.unpack_from(">HHI", table, 4 + 8 * number)
        (kind,) = struct.unpack_from(">H", table, offset)
        if kind in (4, 12):
            tables[platform, encoding] = table[offset:]
    for key in UNICODE:
        if key in tables:
            return tables[key]
    raise NotAFont("no Unicode character map of format 4 or 12")


def _groups(data: bytes) -> Iterator[tuple[int, int]]:
    (count,) = struct.unpack_from(">I", data, 12)
    for first, last, glyph in struct.iter_unpack(">III", data[16 : 16 + 12 * count]):
        yield first + (glyph == 0), last


def _segments(data: bytes) -> Iterator[tuple[int, int]]:
    (twice,) = struct.unpack_from(">H", data, 6)
    columns = [
        struct.unpack_from(f">{twice // 2}H", data, 14 + twice * n + 2 * (n > 0)) for n in range(4)
    ]  # ends; a pad; starts; deltas; range offsets
    for place, (last, first, delta, offset) in enumerate(zip(*columns, strict=True)):
        if offset == 0 and not first <= (-delta & 0xFFFF) <= last:
            yield first, last
        else:
            where = 16 + 3 * twice + 2 * place + offset
            yield from ((c, c) for c in range(first, last + 1) if _glyph(data, c, first, delta, offset, where))


def _glyph(data: bytes, code: int, first: int, delta: int, offset: int, where: int) -> int:
    """Return the glyph of a code point; 0 for none."""
    if offset == 0:
        return (code + delta) & 0xFFFF
    place = where + 2 * (code - first)
    if place + 2 > len(data):
        return 0
    (glyph,) = struct.unpack_from(">H", data, place)
    return (glyph + delta) & 0xFFFF if glyph else 0


def font_files(folders: Sequence[Path] | None = None) -> dict[str, Path]:
    """Return font files by name in the folders and below (default: the system's); the first of equal names counts."""
    files: dict[str, Path] = {}
    for folder in system_folders() if folders is None else folders:
        for place, inner, names in os.walk(folder):
            inner.sort()
            for name in sorted(names):
                if name.lower().endswith(ENDINGS):
                    files.setdefault(name, Path(place, name))
    return files


def in_order(files: dict[str, Path], patterns: Sequence[str]) -> list[Path]:
    """Return the files that match name patterns, in the order of the patterns, each once."""
    chosen: dict[Path, None] = {}
    for pattern in patterns:
        exact = pattern in files
        names = [pattern] if exact else sorted(name for name in files if fnmatch(name, pattern))
        chosen.update((files[name], None) for name in names)
    return list(chosen)


def system_folders(platform: str = sys.platform) -> tuple[Path, ...]:
    """Return the system's font folders, and last matplotlib's, so that Latin can always be drawn."""
    home = Path.home()
    own: tuple[Path, ...]
    if platform == "win32":
        local = Path(os.environ.get("LOCALAPPDATA", home / "AppData/Local"))
        own = (Path(os.environ.get("WINDIR", "C:/Windows"), "Fonts"), local / "Microsoft/Windows/Fonts")
    elif platform == "darwin":
        own = (home / "Library/Fonts", Path("/Library/Fonts"), Path("/System/Library/Fonts"))
    else:
        shared = os.environ.get("XDG_DATA_DIRS") or "/usr/local/share:/usr/share"
        data = Path(os.environ.get("XDG_DATA_HOME") or home / ".local/share")
        own = (data / "fonts", home / ".fonts", *(Path(part, "fonts") for part in shared.split(":") if part))
    spec = find_spec("matplotlib")
    if spec is None or spec.origin is None:
        return own
    return (*own, Path(spec.origin).parent / "mpl-data/fonts/ttf")


def is_complex(character: str) -> bool:
    """Return whether the script joins or reorders letters, so that one glyph after another would be wrong."""
    return any(first <= ord(character) <= last for first, last in COMPLEX)


def packages_for(characters: Sequence[str]) -> str:
    """Return what to install for characters that no font has: Debian's packages, and their names elsewhere."""
    sources: dict[tuple[str, str], None] = {}
    for character in characters:
        rows = ((debian, other) for first, last, debian, other in SOURCES if first <= ord(character) <= last)
        sources[next(rows, ANY)] = None
    return " and ".join(f"{debian} (Debian, Ubuntu) / {other} (Windows, macOS)" for debian, other in sources)
