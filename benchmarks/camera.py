"""Figures of the check of pictures: exposure, sharpness and flags of pictures whose true values are known."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from palpate.devices.camera.look import SQUARE, Limits, Look, look
from palpate.protocols.bench import Case

AREA = "camera"
Pixels = NDArray[np.uint8]
LIMITS = Limits(1568, 0.05, 0.05)
"""The defaults of a rig file."""
WHITE_SHARE = 0.0125
GRATING_PX = SQUARE / 215
"""A period in pixels, not a whole number of them; a whole number of periods fills the evaluated square."""
KINDS = ("png", "jpeg")


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of pictures of 1568 x 1568 pixels and of 24 megapixels; only the small ones if `quick`."""
    sizes = [(SQUARE, SQUARE)] if quick else [(SQUARE, SQUARE), (6000, 4000)]
    for width, height in sizes:
        for kind in KINDS:
            input_name, n = f"{width}x{height}, {kind}", width * height
            yield Case(AREA, "camera: exposure", "palpate", input_name, n, "share of white pixels",
                       partial(look, encode(with_white(width, height), kind), LIMITS), white_error, 3)  # fmt: skip
            yield Case(AREA, "camera: sharpness", "palpate", input_name, n, "relative; closed form of a grating",
                       partial(look, encode(grating(width, height), kind), LIMITS), sharpness_error, 3)  # fmt: skip
    pictures_of_known_flags = list(known_pictures())
    for kind in KINDS:
        pictures = [encode(pixels, kind) for pixels in pictures_of_known_flags]
        yield Case(AREA, "camera: flags", "palpate", f"{len(pictures)} pictures, {kind}", len(pictures), "share wrong",
                   partial(evaluate_all, pictures), flags_error, 3)  # fmt: skip


def encode(pixels: Pixels, kind: str) -> bytes:
    """Return the pixels as a picture file, JPEG at quality 95 as cameras write it."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(pixels).save(file, kind, **({"quality": 95} if kind == "jpeg" else {}))
    return file.getvalue()


def with_white(width: int, height: int) -> Pixels:
    """Return even gray with one white patch, whose share of the evaluated middle square is `WHITE_SHARE`."""
    pixels = np.full((height, width), 120, np.uint8)
    rows, columns = round(SQUARE * WHITE_SHARE * 8), SQUARE // 8
    top, left = (height - SQUARE) // 2, (width - SQUARE) // 2
    pixels[top : top + rows, left : left + columns] = 255
    return pixels


def white_error(result: Look) -> float | None:
    """Return the error of the measured share of white."""
    true = round(SQUARE * WHITE_SHARE * 8) * (SQUARE // 8) / SQUARE**2
    return None if result.white is None else abs(result.white - true)


def grating(width: int, height: int) -> Pixels:
    """Return a sine across the picture with `GRATING_PX` pixels to a period."""
    line = 127.5 + 100 * np.sin(2 * math.pi * np.arange(width) / GRATING_PX)
    return np.tile(np.round(line).astype(np.uint8), (height, 1))


def sharpness_error(result: Look) -> float | None:
    """Return the relative error of the sharpness: a sine's Laplacian is 2 (cos w - 1) times itself."""
    true = (2 * (math.cos(2 * math.pi / GRATING_PX) - 1)) ** 2
    return None if result.sharpness is None else abs(result.sharpness / true - 1)


def known_pictures() -> Iterator[Pixels]:
    """Yield a rough surface in focus, increasingly out of focus, and over-exposed; `TRUTH` has the right flags."""
    surface = np.fft.rfft2(np.random.Generator(np.random.PCG64(11)).normal(0.0, 1.0, (SQUARE, SQUARE)))
    blurred = {blur_px: _blur(surface, blur_px) for blur_px in {blur_px for blur_px, _ in TRUTH}}
    for blur_px, white in TRUTH:
        seen = blurred[blur_px]
        pixels = 120 + 30 * seen / float(seen.std())
        if white:
            pixels[: round(SQUARE * white)] = 255
        yield np.clip(np.round(pixels), 0, 249 if not white else 255).astype(np.uint8)


TRUTH = ((0.8, 0.0), (1.2, 0.0), (4.0, 0.0), (8.0, 0.0), (0.8, 0.1), (8.0, 0.1))
"""SD of the blur in pixels, and the share that is white. Up to 1.2 pixels is in focus, from 4 on out of focus: the
Laplacian of Gaussian noise blurred by s has the share 2 / s^4 of its variance, 1 and 0.008 there, and 0.05 is the
limit."""


def _blur(spectrum: NDArray[np.complex128], blur_px: float) -> NDArray[np.float64]:
    frequencies = np.fft.fftfreq(SQUARE), np.fft.rfftfreq(SQUARE)
    down, across = (np.exp(-2 * (math.pi * blur_px * frequency) ** 2) for frequency in frequencies)
    return np.asarray(np.fft.irfft2(spectrum * np.outer(down, across), (SQUARE, SQUARE)))


def evaluate_all(pictures: Sequence[bytes]) -> list[Look]:
    """Return the evaluation of each picture."""
    return [look(data, LIMITS) for data in pictures]


def flags_error(results: Sequence[Look]) -> float:
    """Return the share of pictures whose flags are not exactly the right ones."""
    true = [
        {name for name, so in (("blurred", blur_px >= 4), ("over_exposed", white > LIMITS.most_white)) if so}
        for blur_px, white in TRUTH
    ]
    return float(np.mean([set(result.flags) != flags for result, flags in zip(results, true, strict=True)]))
