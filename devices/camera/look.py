"""Check a picture file for completeness, size, sharpness and exposure; store it in the lab by sample and light."""

from __future__ import annotations

import hashlib
import io
import re
import struct
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from palpate.devices.device import DeviceFault
from palpate.protocols.canonical import digest
from palpate.protocols.files import reason, write_bytes

if TYPE_CHECKING:
    pass

SQUARE = 1568
"""Side of the examined square in the middle, in pixels: what the thesis cuts out of a picture (3.4.2)."""
WHITE = 249.5 / 255
X3F = b"FOVb"


class Incomplete(ValueError):
    """A picture that cannot be read to its end; the message says why."""


@dataclass(frozen=True)
class Limits:
    """Requirements for a picture: pixels on its shorter side, sharpness, and share of white."""

    least_pixels: int
    least_sharpness: float
    most_white: float


@dataclass(frozen=True)
class Look:
    """The measurements of a picture; `flags` are reasons to take it again: too_small, blurred, over_exposed.

    Sharpness is the variance of the Laplacian over the variance of the brightness, in a square in the middle, so
    contrast does not matter. White is the share of that square above 250 of 255. Both are None if the format is not
    decoded here.
    """

    sha256: str
    width: int
    height: int
    sharpness: float | None
    white: float | None
    flags: tuple[str, ...]


def look(data: bytes, limits: Limits) -> Look:
    """Read a complete picture and return its measurements. Raises Incomplete if it ends too soon or is not a
    picture.
    """
    sha256 = hashlib.sha256(data).hexdigest()
    if data.startswith(X3F):
        width, height = _x3f_size(data)
        small = ("too_small",) if min(width, height) < limits.least_pixels else ()
        return Look(sha256, width, height, None, None, small)
    width, height, middle = _decoded(data)
    sharpness, white = 0.0, float((middle >= WHITE).mean())
    if min(middle.shape) >= 3 and float(np.ptp(middle)) != 0.0:
        sides = middle[1:-1, :-2] + middle[1:-1, 2:] + middle[:-2, 1:-1] + middle[2:, 1:-1]
        sharpness = float((sides - 4 * middle[1:-1, 1:-1]).var() / middle.var())
    flags = {
        "too_small": min(width, height) < limits.least_pixels,
        "blurred": sharpness < limits.least_sharpness,
        "over_exposed": white > limits.most_white,
    }
    raised = tuple(name for name, so in flags.items() if so)
    return Look(sha256, width, height, float(f"{sharpness:.4g}"), float(f"{white:.4g}"), raised)


def _decoded(data: bytes) -> tuple[int, int, NDArray[np.float32]]:
    """Return the size and the square's brightness, 0 to 1; every pixel is decoded, to detect truncated files."""
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data)) as picture:
                picture.load()
                side = min(SQUARE, picture.width, picture.height)
                left, top = (picture.width - side) // 2, (picture.height - side) // 2
                cut = picture.crop((left, top, left + side, top + side))
                gray, white = (cut, 65535) if cut.mode.startswith("I") else (cut.convert("L"), 255)
                middle = np.asarray(gray, dtype=np.float32) * np.float32(1 / white)
                return picture.width, picture.height, middle
    except UnidentifiedImageError:
        raise Incomplete("no picture in a format that is known here") from None
    except (OSError, SyntaxError, ValueError, struct.error, Image.DecompressionBombError) as error:
        raise Incomplete(str(error) or type(error).__name__) from None


def _x3f_size(data: bytes) -> tuple[int, int]:
    """Return the size in the header of a Sigma raw file. Raises Incomplete if its end does not name the directory."""
    if len(data) < 40:
        raise Incomplete("the file ends in its header")
    (directory,) = struct.unpack("<I", data[-4:])
    if data[directory : directory + 4] != b"SECd":
        raise Incomplete("the file ends before its directory")
    width, height = struct.unpack("<II", data[28:36])
    return int(width), int(height)


def keep(device: str, pictures: Path, stimulus: str, light: int, sha256: str, name: str, data: bytes) -> str:
    """Copy a picture, and return its path below `pictures`, as T07/light03-0123456789abcdef.jpg.

    Raises DeviceFault if it cannot be written.
    """
    suffix = Path(name).suffix.lower()
    path = pictures / folder_of(stimulus) / f"light{light:02d}-{sha256[:16]}{suffix}"
    try:
        write_bytes(path, data)
    except OSError as error:
        message = f"{device}: {name} cannot be stored in {path.parent}: {reason(error)}"
        raise DeviceFault(device, "refused", message) from None
    return path.relative_to(pictures).as_posix()


def folder_of(stimulus: str) -> str:
    """Return a stimulus' folder: its id if that is a plain name, else its plain characters and a digest."""
    if re.fullmatch(r"[A-Za-z0-9_-]{1,64}", stimulus):
        return stimulus
    return f"{re.sub(r'[^A-Za-z0-9_-]+', '_', stimulus)[:40]}-{digest(stimulus)[:8]}"
