"""A texture's picture at true size, by its width in millimetres."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.devices.window.geometry import WindowError
from palpate.signals.models.card import Card

if TYPE_CHECKING:
    from PIL import Image

PICTURES = Path(__file__).resolve().parent / "pictures"
PLATE_MM = 100.0
"""Side of a sample (thesis 3.3.1), the default width of a picture."""
MM_INCH = 25.4
KINDS = (".png", ".jpg", ".jpeg")
LARGEST_PX = 8192


@dataclass(frozen=True)
class Photo:
    """A picture file, and how many millimetres one of its pixels is."""

    path: Path
    mm_per_px: float
    size_px: tuple[int, int]

    @property
    def size_mm(self) -> tuple[float, float]:
        """Return width and height of the pictured area, in mm."""
        return self.size_px[0] * self.mm_per_px, self.size_px[1] * self.mm_per_px


def photo_file(card: Card, folder: Path) -> Path | None:
    """Return the picture that a card in `folder` names, else that of a simulated surface of that name, or None."""
    if card.texture is None:
        return None
    if card.texture.picture is not None:
        return folder / card.texture.picture
    return next((file for kind in KINDS if (file := PICTURES / f"{card.texture.id}{kind}").is_file()), None)


def read_photo(path: Path) -> Photo:
    """Return the photo, scaled by the density in the file, else as wide as a sample. Raises WindowError."""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as opened:
            size, density = opened.size, opened.info.get("dpi")
    except (OSError, UnidentifiedImageError, Image.DecompressionBombError) as error:
        raise WindowError(f"{path}: cannot be read as a picture: {error}") from None
    if max(size) > LARGEST_PX:
        raise WindowError(f"{path}: {size[0]}x{size[1]} px; {LARGEST_PX} at most on a side")
    stated = float(density[0]) if density and float(density[0]) > 1 else 0.0
    return Photo(path, MM_INCH / stated if stated else PLATE_MM / size[0], size)


def at_true_size(photo: Photo, px_per_mm: float, room_px: tuple[int, int]) -> Image.Image:
    """Return the middle part of the picture at true size on the screen, as far as it fits the room."""
    from PIL import Image

    with Image.open(photo.path) as opened:
        whole = opened.convert("RGB")
    per_px = photo.mm_per_px * px_per_mm
    size = [max(1, min(room, round(px * per_px))) for room, px in zip(room_px, photo.size_px, strict=True)]
    half = [side / per_px / 2 for side in size]
    middle = photo.size_px[0] / 2, photo.size_px[1] / 2
    part = middle[0] - half[0], middle[1] - half[1], middle[0] + half[0], middle[1] + half[1]
    inside = (max(0.0, part[0]), max(0.0, part[1]), min(photo.size_px[0], part[2]), min(photo.size_px[1], part[3]))
    made: Image.Image = whole.resize((size[0], size[1]), Image.Resampling.LANCZOS, box=inside)
    return made
