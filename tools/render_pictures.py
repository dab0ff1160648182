"""Generate pictures of the renderer's window for the documentation: `python -m` this module FOLDER [LAB].

What they show is played by the models, those of LAB first, for the simulated hand of `palpate render --hand`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.devices.render.hand_simulated import simulated_hand
from palpate.devices.render.headless import at_once
from palpate.devices.render.texture_models import DEFAULT_METHOD, SHIPPED, available, card_for
from palpate.devices.render.window.choice import Choice, method_word, render_texts, texture_word
from palpate.devices.render.window.elements import SHOWN, heard
from palpate.devices.render.window.screen import RendererScreen
from palpate.devices.render.window.view import RendererStatus, RendererView
from palpate.devices.window.fonts import find_fonts
from palpate.devices.window.geometry import Metrics
from palpate.devices.window.screen import Page
from palpate.protocols.files import open_bytes
from palpate.signals.arrays import Array
from palpate.signals.textures.sounds import Sounds

if TYPE_CHECKING:
    from PIL import Image

SIZE, PX_PER_MM, COLOURS = (1280, 720), 3.6, 256
SECONDS = 6.0
SHOWS = (("render.png", "steel_mesh", "en"), ("render-ko.png", "cloth", "ko"))


def pictures(folder: Path, lab: Path) -> list[Path]:
    """Paint render.png and render-ko.png: strokes over steel mesh, and over cloth in Korean."""
    folder.mkdir(parents=True, exist_ok=True)
    return [save(folder / name, lab, Choice(texture, DEFAULT_METHOD), language) for name, texture, language in SHOWS]


def picture(
    lab: Path, choice: Choice, last: Array, status: RendererStatus, language: str = "en", metrics: Metrics | None = None
) -> Image.Image:
    """Paint the window for the last second, (3, n): acceleration, speed and force."""
    from PIL import Image

    page = Page(metrics or Metrics(*SIZE, PX_PER_MM), render_texts(language), find_fonts(language))
    screen = RendererScreen(page, RendererView(page, available(lab)), choice)
    image = Image.new("RGB", (page.metrics.width_px, page.metrics.height_px))
    screen.show(heard(last), status)
    screen.paint(image)
    return image


def save(path: Path, lab: Path, choice: Choice, language: str) -> Path:
    """Save one picture to a file; return its path."""
    from PIL import Image

    last, record = strokes(card_for(choice.texture, choice.method, lab))
    texts = render_texts(language)
    names = {"texture": texture_word(texts, choice.texture), "method": method_word(texts, choice.method)}
    image = picture(lab, choice, last, RendererStatus(record=record, notice=texts("switched", **names) + "."), language)
    with open_bytes(path) as file:
        image.quantize(COLOURS, dither=Image.Dither.FLOYDSTEINBERG).save(file, "PNG", optimize=True)
    return path


def strokes(card: Path) -> tuple[Array, dict[str, Any]]:
    """Return the liveliest second that a model plays for the simulated hand, and the record of the whole run."""
    played = at_once(Sounds(card), simulated_hand(SECONDS, 0))
    power = np.convolve(played.signals[0] ** 2, np.ones(SHOWN), "valid")
    first = int(power.argmax())
    record = {"ready": played.record["took"], "voice": played.record["voice"]}
    return played.signals[:, first : first + SHOWN], record


if __name__ == "__main__":
    _lab = Path(sys.argv[2]) if len(sys.argv) > 2 else SHIPPED
    for _path in pictures(Path(sys.argv[1]), _lab):
        print(_path)  # noqa: T201
