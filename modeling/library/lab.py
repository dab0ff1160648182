"""The library of a lab: from its ratings, its model of attributes and its pictures to LAB/library."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.modeling.library.entries import LibraryError
from palpate.modeling.library.files import earlier_in, place_of, write_library, write_whole
from palpate.modeling.library.indexing import IndexedLibrary, gone, library_of
from palpate.modeling.library.sources import (
    LibraryOptions,
    Pictures,
    first_pictures,
    material_of,
    missing_picture_notes,
    model_of,
    predictor_of,
    rating_sources,
)
from palpate.protocols.progress import Report

if TYPE_CHECKING:
    from PIL.Image import Image

FOLDER, SIDE, QUALITY = "pictures", 288, 85
MIDDLE = 0.5
"""The middle half is shown of a picture that is large enough for it: what one would feel, not the frame around it."""
PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")


class NoPicture(LibraryError):
    """A file that is there and shows nothing, or cannot be read."""


@dataclass(frozen=True)
class Indexed:
    """What was written. `gone` are textures of the library before that are not in it any more."""

    path: Path
    changed: bool
    indexed: IndexedLibrary
    gone: tuple[str, ...]

    @property
    def counts(self) -> dict[str, int]:
        """How many textures there are, rated, predicted, with a picture, and left out."""
        textures = self.indexed.library.textures
        return {
            "textures": len(textures), "rated": sum(texture.rated is not None for texture in textures),
            "predicted": sum(texture.predicted is not None for texture in textures),
            "pictures": sum(texture.picture is not None for texture in textures),
            "left_out": len(self.indexed.left_out),
        }  # fmt: skip


def index(options: LibraryOptions, report: Report = lambda _line: None) -> Indexed:
    """Make a lab's library anew and write it; the same sources give the same bytes.

    Raises LibraryError where there is nothing to make it from, NewerLibrary where a later version wrote the one that is
    there, and what reading ratings, features, models and pictures raises.
    """
    folder, earlier = place_of(options.lab).parent, earlier_in(options.lab)
    model = model_of(options)
    material = material_of(options, model, report)
    if not material.textures:
        raise LibraryError(
            f"{options.lab}: no texture was rated, and there is no model that predicts how one feels: run "
            f"{options.study}, or make a simulated lab (`palpate textures simulate`)."
        )
    sources = tuple(rating_sources(options)) if any(texture.rated for texture in material.textures) else ()
    indexed = library_of(material, None if model is None else predictor_of(model, options.lab), sources=sources)
    report("reading pictures")
    indexed = _with_thumbnails(indexed, first_pictures(options, [texture.id for texture in material.textures]), folder)
    path, changed = write_library(options.lab, indexed.library)
    before = {texture.picture for texture in earlier.textures if texture.picture} if earlier else set()
    drop(folder, before - {texture.picture for texture in indexed.library.textures})
    return Indexed(path, changed, indexed, gone(earlier, indexed.library))


def _with_thumbnails(indexed: IndexedLibrary, shown: Pictures, folder: Path) -> IndexedLibrary:
    """The same library, each texture with its thumbnail beside the index; a note on pictures that cannot be shown."""
    names, lacking = {}, dict(shown.lacking)
    for texture in (entry.id for entry in indexed.library.textures if entry.id in shown.files):
        path = shown.files[texture]
        try:
            names[texture] = keep(folder, texture, _read(path), str(path))
        except NoPicture as error:
            lacking[texture] = str(error)
    here = {entry.id for entry in indexed.library.textures}
    notes = missing_picture_notes({texture: why for texture, why in sorted(lacking.items()) if texture in here})
    textures = tuple(entry.model_copy(update={"picture": names.get(entry.id)}) for entry in indexed.library.textures)
    changed = {"textures": textures, "notes": (*indexed.library.notes, *notes)}
    return replace(indexed, library=indexed.library.model_copy(update=changed))


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise NoPicture(f"{path}: cannot be read ({error.strerror}); a picture is expected.") from None


def thumbnail(content: bytes, where: str) -> bytes:
    """Return the middle of a picture as a small square JPEG. Raises NoPicture for what is none."""
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        with Image.open(BytesIO(content)) as opened:
            seen = ImageOps.exif_transpose(opened)
            if seen.mode.startswith("I"):  # of 16 bits the upper ones
                seen = seen.convert("I").point(lambda value: value * (1 / 257)).convert("L")
            seen = seen.convert("RGB")
    except (UnidentifiedImageError, Image.DecompressionBombError, OSError, ValueError, SyntaxError) as error:
        raise NoPicture(f"{where}: this picture cannot be read ({error}).") from None
    written = BytesIO()
    _middle(seen).save(written, "JPEG", quality=QUALITY, optimize=True)
    return written.getvalue()


def _middle(seen: Image) -> Image:
    from PIL import Image

    short = min(seen.size)
    side = max(min(short, SIDE), round(short * MIDDLE))
    left, top = (seen.width - side) // 2, (seen.height - side) // 2
    return seen.resize((SIDE, SIDE), Image.Resampling.LANCZOS, (left, top, left + side, top + side))


def name_of(texture: str) -> str:
    """Return the file's name for a texture, whatever letters its own name has."""
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
