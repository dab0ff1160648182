"""All surfaces on one page, to look at."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from palpate.devices.surfaces.fields import PIXELS
from palpate.devices.surfaces.photo import Image, light, photograph
from palpate.devices.surfaces.relief import relief
from palpate.devices.surfaces.table import Surface
from palpate.protocols.files import open_bytes

THUMB, ACROSS, CAPTION = 300, 10, 22


def contact_sheet(surfaces: Iterable[Surface], path: Path, share: float = 0.4, number: int = 3) -> None:
    """Save a picture of each surface's middle (`share` of its side) under one light, with its id and label."""
    from PIL import Image as Pictures
    from PIL import ImageDraw

    chosen = list(surfaces)
    rows = -(-len(chosen) // ACROSS)
    page = Pictures.new("RGB", (ACROSS * THUMB, rows * (THUMB + CAPTION)), "white")
    draw = ImageDraw.Draw(page)
    for n, surface in enumerate(chosen):
        left, top = n % ACROSS * THUMB, n // ACROSS * (THUMB + CAPTION)
        picture = Pictures.fromarray(_middle(photograph(surface, relief(surface), light(number), "sheet"), share))
        page.paste(picture.resize((THUMB - 4, THUMB - 4), Pictures.Resampling.LANCZOS), (left, top))
        draw.text((left + 4, top + THUMB), f"{surface.id} {surface.label}", fill="black")
    with open_bytes(path) as file:
        page.save(file, "PNG")


def _middle(image: Image, share: float) -> Image:
    cut = round(PIXELS * (1 - share) / 2)
    return np.ascontiguousarray(image[cut : PIXELS - cut, cut : PIXELS - cut])
