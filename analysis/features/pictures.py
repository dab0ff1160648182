"""Pictures of surfaces as input of features: the middle as a gray square, and its patches (thesis 3.4.2)."""

from __future__ import annotations

import io
import struct
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from PIL.Image import Image

Gray = NDArray[np.float32]
SIDE, PATCH = 1568, 224
"""Pixels of the square that is cut out of a picture, and of a patch of it (thesis 3.4.2)."""
LEAST = PATCH
"""Least pixels of a picture's shorter side, one patch."""
WHITE_16, WHITE_8 = 65535.0, 255.0
RAW = b"FOVb"
"""The first bytes of Sigma's raw format, which is recorded but not decoded."""


class PictureError(ValueError):
    """A picture that cannot be used; the message says where, what is wrong and what to do."""


@dataclass(frozen=True)
class Looking:
    """The patches of a square: `patch` pixels wide, with corners `stride` pixels apart.

    The thesis says 49 "partially overlapping" patches of 224 pixels in 1568; 7 x 224 is 1568, so the default is its 7 x
    7 without overlap. `grid`: only this many along each side, evenly spread (1: the middle one).
    """

    side: int = SIDE
    patch: int = PATCH
    stride: int = PATCH
    grid: int | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.patch <= self.side or self.stride < 1:
            sizes = f"side {self.side}, patch {self.patch}, stride {self.stride}"
            raise PictureError(f"{sizes}: patches of 1 pixel or more that fit into the side, 1 or more apart")
        most = len(self._all())
        if self.grid is not None and not 1 <= self.grid <= most:
            raise PictureError(f"grid {self.grid}: from 1 to {most} patches along each side exist")

    @property
    def starts(self) -> tuple[int, ...]:
        """The first pixels of the patches along each side."""
        every = self._all()
        if self.grid is None:
            return every
        chosen = np.linspace(0, len(every) - 1, self.grid) if self.grid > 1 else np.array([(len(every) - 1) / 2])
        return tuple(every[round(float(place))] for place in chosen)

    def _all(self) -> tuple[int, ...]:
        return tuple(range(0, self.side - self.patch + 1, self.stride))


@dataclass(frozen=True)
class Square:
    """The middle of a picture: (side, side) of brightness from 0 to 1, and notes on oddities.

    `blank`: it has a single brightness.
    """

    values: Gray
    notes: tuple[str, ...] = ()
    blank: bool = False


def square(data: bytes, where: str, side: int = SIDE) -> Square:
    """Return the middle of the picture in a file's bytes as a gray square of `side` pixels.

    Colours are weighted by ITU-R 601 (0.299, 0.587, 0.114); 16 bits stay 16 bits; a square of another size is resampled
    (Lanczos). Raises PictureError on an invalid or truncated picture, fewer than 224 pixels on the shorter side,
    transparent parts, or an unknown white level.
    """
    from PIL import Image

    cut = _gray(_cut(data, where), where)
    notes = []
    if min(cut.shape) < side:
        notes.append(f"{where}: {cut.shape[0]} pixels made {side}: nothing finer than that was seen")
    blank = float(np.ptp(cut)) == 0.0
    if blank:
        notes.append(f"{where}: of one brightness ({float(cut[0, 0]):.2f}): it shows nothing")
    if cut.shape != (side, side):
        resized = Image.fromarray(cut).resize((side, side), Image.Resampling.LANCZOS)
        cut = np.clip(np.asarray(resized, dtype=np.float32), 0.0, 1.0)
    return Square(cut, tuple(notes), blank)


def patches(values: Gray, looking: Looking) -> Gray:
    """Return the patches of a square, (patches, patch, patch), row by row. Raises PictureError for another size."""
    size, starts = looking.patch, looking.starts
    if values.shape != (looking.side, looking.side):
        raise PictureError(f"a square of {values.shape} pixels: {looking.side} x {looking.side} are expected")
    return np.stack([values[top : top + size, left : left + size] for top in starts for left in starts])


def _cut(data: bytes, where: str) -> Image:
    """Return the middle square with every pixel read. Raises PictureError."""
    from PIL import Image, ImageOps, UnidentifiedImageError

    if data.startswith(RAW):
        raise PictureError(f"{where}: Sigma's raw format is not decoded here; develop it to TIFF, PNG or JPEG")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # large pictures, and odd tags: what they show is checked below
            with Image.open(io.BytesIO(data)) as picture:
                picture.load()
                turned = ImageOps.exif_transpose(picture)
                side = min(turned.size)
                if side < LEAST:
                    size = f"{turned.width} x {turned.height} pixels"
                    raise PictureError(
                        f"{where}: {size}: {LEAST} on the shorter side are the least, {SIDE} or more are expected"
                    )
                left, top = (turned.width - side) // 2, (turned.height - side) // 2
                return turned.crop((left, top, left + side, top + side))
    except UnidentifiedImageError:
        raise PictureError(f"{where}: no picture in a format that is known here; JPEG, PNG or TIFF do") from None
    except PictureError:
        raise
    except (OSError, SyntaxError, ValueError, EOFError, struct.error, Image.DecompressionBombError) as error:
        reason = str(error) or type(error).__name__
        raise PictureError(f"{where}: the picture cannot be read to its end ({reason}); take it again") from None


def _gray(cut: Image, where: str) -> Gray:
    """Return the brightness from 0 to 1."""
    if cut.mode.startswith("I"):
        values = np.asarray(cut)
        low, high = int(values.min()), int(values.max())
        if low < 0 or high > WHITE_16:
            raise PictureError(f"{where}: brightness from {low} to {high}: 16 bits, 0 to 65535, are expected")
        return values.astype(np.float32) * np.float32(1 / WHITE_16)
    if cut.mode == "F":
        raise PictureError(f"{where}: brightness as fractions, whose white is not known; save it with 8 or 16 bits")
    if cut.has_transparency_data:
        # An alpha channel that hides nothing is dropped.
        whole = cut.convert("RGBA")
        least, _most = whole.getchannel("A").getextrema()
        if not isinstance(least, int | float) or least < 255:
            raise PictureError(
                f"{where}: parts of its middle are transparent, which no photo of a surface is; fill them"
            )
        cut = whole.convert("RGB")
    rgb = cut if cut.mode in ("1", "L", "RGB") else cut.convert("RGB")
    return np.asarray(rgb.convert("L"), dtype=np.float32) * np.float32(1 / WHITE_8)
