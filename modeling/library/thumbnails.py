"""Small pictures of textures beside the library: LAB/library/pictures/TEXTURE.jpg."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.modeling.library.entries import LibraryError
from palpate.modeling.library.writing import write_whole

if TYPE_CHECKING:
    from PIL.Image import Image

FOLDER, SIDE, QUALITY = "pictures", 288, 85
MIDDLE = 0.5
"""The middle half is shown of a picture that is large enough for it: what one would feel, not the frame around it."""
PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")


class NoPicture(LibraryError):
    """A file that is there and shows nothing, or cannot be read."""


def thumbnail(content: bytes, where: str) -> bytes:
    """The middle of a picture as a small square JPEG. Raises NoPicture for what is none."""
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        with Image.open(BytesIO(content)) as opened:
            seen = _colours(ImageOps.exif_transpose(opened))
    except (UnidentifiedImageError, Image.DecompressionBombError, OSError, ValueError, SyntaxError) as error:
        raise NoPicture(f"{where}: this is no picture that can be read ({error}).") from None
    written = BytesIO()
    _middle(seen).save(written, "JPEG", quality=QUALITY, optimize=True)
    return written.getvalue()


def _colours(seen: Image) -> Image:
    """As red, green and blue of 8 bits; of 16 bits the upper ones."""
    if seen.mode.startswith("I"):
        seen = seen.convert("I").point(lambda value: value * (1 / 257)).convert("L")
    return seen.convert("RGB")


def _middle(seen: Image) -> Image:
    from PIL import Image

    short = min(seen.size)
    side = max(min(short, SIDE), round(short * MIDDLE))
    left, top = (seen.width - side) // 2, (seen.height - side) // 2
    return seen.resize((SIDE, SIDE), Image.Resampling.LANCZOS, (left, top, left + side, top + side))


def name_of(texture: str) -> str:
    """The file's name for a texture, whatever letters its own name has."""
    if PLAIN.fullmatch(texture):
        return f"{FOLDER}/{texture}.jpg"
    return f"{FOLDER}/{hashlib.sha256(texture.encode()).hexdigest()[:24]}.jpg"


def keep(library: Path, texture: str, content: bytes, where: str) -> str:
    """Write a texture's thumbnail beside the index; its name there. Equal ones are left alone."""
    name, small = name_of(texture), thumbnail(content, where)
    path = library / name
    if not path.is_file() or path.read_bytes() != small:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, small)
    return name


def drop(library: Path, names: Collection[str]) -> None:
    """Remove thumbnails that an earlier index named; nothing outside their folder."""
    for name in names:
        path = library / name
        if path.parent.resolve() == (library / FOLDER).resolve():
            path.unlink(missing_ok=True)
