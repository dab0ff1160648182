"""The library of a lab, built from its ratings, its model of attributes and its pictures, in LAB/library."""

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
from palpate.modeling.library.indexing import IndexedLibrary, library_of, removed_textures
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
"""The share of a large picture's shorter side that a thumbnail shows, so that it shows the surface, not its frame."""
PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")


class NoPicture(LibraryError):
    """A file that is not a readable picture."""


@dataclass(frozen=True)
class IndexResult:
    """The library that was written. `removed` are textures of the earlier library that it no longer has."""

    path: Path
    changed: bool
    indexed: IndexedLibrary
    removed: tuple[str, ...]

    @property
    def counts(self) -> dict[str, int]:
        """The numbers of textures: all, rated, predicted, with a picture, and left out."""
        textures = self.indexed.library.textures
        return {
            "textures": len(textures), "rated": sum(texture.rated is not None for texture in textures),
            "predicted": sum(texture.predicted is not None for texture in textures),
            "pictures": sum(texture.picture is not None for texture in textures),
            "left_out": len(self.indexed.left_out),
        }  # fmt: skip


def index(options: LibraryOptions, report: Report = lambda _line: None) -> IndexResult:
    """Build a lab's library and write it; the same sources give the same bytes.

    Raises LibraryError where there are no sources, NewerLibrary where a later version wrote the present one, and the
    errors of reading ratings, features, models and pictures.
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
    remove_thumbnails(folder, before - {texture.picture for texture in indexed.library.textures})
    return IndexResult(path, changed, indexed, removed_textures(earlier, indexed.library))


def _with_thumbnails(indexed: IndexedLibrary, shown: Pictures, folder: Path) -> IndexedLibrary:
    """Write thumbnails beside the index; return the library with them, and a note on pictures that cannot be shown."""
    names, missing = {}, dict(shown.missing)
    for texture in (entry.id for entry in indexed.library.textures if entry.id in shown.files):
        path = shown.files[texture]
        try:
            names[texture] = save_thumbnail(folder, texture, _read(path), str(path))
        except NoPicture as error:
            missing[texture] = str(error)
    here = {entry.id for entry in indexed.library.textures}
    notes = missing_picture_notes({texture: why for texture, why in sorted(missing.items()) if texture in here})
    textures = tuple(entry.model_copy(update={"picture": names.get(entry.id)}) for entry in indexed.library.textures)
    changed = {"textures": textures, "notes": (*indexed.library.notes, *notes)}
    return replace(indexed, library=indexed.library.model_copy(update=changed))


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise NoPicture(f"{path}: cannot be read ({error.strerror}); a picture is expected.") from None


def thumbnail(content: bytes, where: str) -> bytes:
    """Return the middle of a picture as a square JPEG of `SIDE` pixels. Raises NoPicture where it cannot be read."""
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        with Image.open(BytesIO(content)) as opened:
            image = ImageOps.exif_transpose(opened)
            if image.mode.startswith("I"):  # 16 bits to 8
                image = image.convert("I").point(lambda value: value * (1 / 257)).convert("L")
            image = image.convert("RGB")
    except (UnidentifiedImageError, Image.DecompressionBombError, OSError, ValueError, SyntaxError) as error:
        raise NoPicture(f"{where}: this picture cannot be read ({error}).") from None
    buffer = BytesIO()
    _middle(image).save(buffer, "JPEG", quality=QUALITY, optimize=True)
    return buffer.getvalue()


def _middle(image: Image) -> Image:
    """Return the central square of an image, `SIDE` pixels wide."""
    from PIL import Image

    short = min(image.size)
    side = max(min(short, SIDE), round(short * MIDDLE))
    left, top = (image.width - side) // 2, (image.height - side) // 2
    return image.resize((SIDE, SIDE), Image.Resampling.LANCZOS, (left, top, left + side, top + side))


def name_of(texture: str) -> str:
    """Return the file name of a texture's thumbnail; a hash where the texture's name cannot be a file name."""
    if PLAIN.fullmatch(texture):
        return f"{FOLDER}/{texture}.jpg"
    return f"{FOLDER}/{hashlib.sha256(texture.encode()).hexdigest()[:24]}.jpg"


def save_thumbnail(library: Path, texture: str, content: bytes, where: str) -> str:
    """Write a texture's thumbnail beside the index, unless an equal one is there; return its name."""
    name, small = name_of(texture), thumbnail(content, where)
    path = library / name
    if not path.is_file() or path.read_bytes() != small:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, small)
    return name


def remove_thumbnails(library: Path, names: Collection[str]) -> None:
    """Remove thumbnails of an earlier index, but no file outside their folder."""
    for name in names:
        path = library / name
        if path.parent.resolve() == (library / FOLDER).resolve():
            path.unlink(missing_ok=True)
