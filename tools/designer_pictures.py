"""Generate pictures of the designer's window for the documentation without a window: `python -m` this module FOLDER."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.devices.author.screen import DesignerScreen
from palpate.devices.author.view import DesignerStatus, DesignerView, author_texts
from palpate.devices.author.work import History, Setting, Work, neutral
from palpate.devices.door.making import Maker, maker_for
from palpate.devices.window.fonts import find_fonts
from palpate.devices.window.geometry import Metrics
from palpate.devices.window.screen import Page
from palpate.protocols.files import open_bytes

if TYPE_CHECKING:
    from PIL import Image

SIZE, PX_PER_MM, COLOURS = (1280, 720), 3.6, 128
WISHES = {"Easy-to-pull": 30, "Damped": 30, "Pleasant": 35, "New": 40, "Comfort": 30, "Luxurious": 35}
"""The wishes for a calm door; unnamed attributes stay in the middle."""
OTHER = {"Easy-to-pull": 70, "Damped": 65, "Consistent": 75}
"""The wishes for a rough door, for comparison."""
NAME = "calm saloon"


def pictures(folder: Path, maker: Maker) -> list[Path]:
    """Paint author.png, author-compare.png and author-ko.png: the door played, two doors compared, in Korean."""
    calm, rough = _setting(maker, WISHES), _setting(maker, OTHER)
    one = Work(calm, name=NAME, saved=calm)
    two = replace(one, b=rough, on="B")
    return [
        _save(folder / "author.png", maker, one, "en", "playing"),
        _save(folder / "author-compare.png", maker, two, "en", "rest"),
        _save(folder / "author-ko.png", maker, two.switched("A"), "ko", "rest"),
    ]


def picture(
    maker: Maker, work: Work, status: DesignerStatus, language: str = "en", size: tuple[int, int] = SIZE
) -> Image.Image:
    """Paint the window for this work."""
    from PIL import Image

    page = Page(Metrics(*size, PX_PER_MM * size[0] / SIZE[0]), author_texts(language), find_fonts(language))
    screen, image = DesignerScreen(page, DesignerView(page, maker), History(work)), Image.new("RGB", size)
    screen.show_status(status)
    screen.paint(image)
    return image


def _setting(maker: Maker, wishes: dict[str, int]) -> Setting:
    setting = neutral(len(maker.attributes))
    for name, value in wishes.items():
        setting = setting.wished(list(maker.attributes).index(name), value)
    return setting


def _save(path: Path, maker: Maker, work: Work, language: str, state: str) -> Path:
    from PIL import Image

    texts = author_texts(language)
    status = DesignerStatus(door=texts(f"state_{state}", name=texts("twin")))
    if state == "playing":
        force = DesignerView(Page(Metrics(*SIZE, PX_PER_MM), texts, find_fonts()), maker).made(work.setting).force_N
        status = replace(status, play="stop", hand=(27.3, float(force[273])))
    image = picture(maker, work, status, language).quantize(COLOURS, dither=Image.Dither.NONE)
    with open_bytes(path) as file:
        image.save(file, "PNG", optimize=True)
    return path


if __name__ == "__main__":
    for _path in pictures(Path(sys.argv[1]), maker_for(None)):
        print(_path)  # noqa: T201
