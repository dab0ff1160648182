"""Pictures of every kind of screen, painted without a window: for the documentation and for previews."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.devices.window.build import page_for, screen_for
from palpate.devices.window.fonts import find_fonts
from palpate.devices.window.geometry import Metrics
from palpate.devices.window.inputs import Typed
from palpate.devices.window.screen import Page, Screen
from palpate.devices.window.screens.specimens import TRIALS, Specimen, Wording, specimens, wording
from palpate.devices.window.texts import load_texts
from palpate.protocols.events import Ask
from palpate.protocols.files import open_bytes, staged_files
from palpate.protocols.forms import Sliders

if TYPE_CHECKING:
    from PIL import Image

WIDTH_MM = 345.0
"""Default width of the screen that pictures are painted for: a small one of 15.6 inches."""
COLOURS = 64


def pictures(
    folder: Path, size: tuple[int, int] = (1280, 720), language: str = "en", px_per_mm: float | None = None
) -> list[Path]:
    """Paint a specimen of every kind of screen into folder/screen-NAME.png, and return the files. Raises
    WindowError.
    """
    words = wording(language)
    page = specimen_page(Metrics(*size, px_per_mm or size[0] / WIDTH_MM), language, words)
    with staged_files(folder) as draft:
        drafts = [_saved(draft / f"screen-{name}.png", specimen, page) for name, specimen in specimens(words).items()]
    return [folder / path.name for path in drafts]


def specimen_page(metrics: Metrics, language: str = "en", words: Wording | None = None) -> Page:
    """Return the page for specimens."""
    pages = {"instructions": (words or wording(language)).instructions}
    return Page(metrics, load_texts(language), find_fonts(language), pages=pages, total=TRIALS, force_of=_specimen_door)


def _specimen_door(setting: Mapping[str, float]) -> Sequence[float]:
    """Return the shipped models' door for a setting, by the order of its values, because words vary by language."""
    from palpate.devices.door.making import maker_for

    forces: list[float] = maker_for(None).design(list(setting.values())).force_N.tolist()
    return forces


def shown(specimen: Specimen, page: Page) -> Screen:
    """Return the specimen's screen half way through its answers."""
    request = specimen.request
    if isinstance(request, str):
        return page_for(request, page)
    screen = screen_for(request, page, 0)
    if specimen.answers:
        screen.fill({"answers": specimen.answers})
    if isinstance(request, Ask) and isinstance(request.form, Sliders) and request.form.sides:
        screen.handle(Typed("1", 1.0))
    return screen


def picture(screen: Screen, page: Page) -> Image.Image:
    """Paint the whole screen, and return the picture."""
    from PIL import Image

    image = Image.new("RGB", (page.metrics.width_px, page.metrics.height_px))
    screen.repaint()
    screen.paint(image)
    return image


def _saved(path: Path, specimen: Specimen, page: Page) -> Path:
    """Save the picture with as few colours as it needs: text stays sharp, the file small."""
    from PIL import Image

    image = picture(shown(specimen, page), page)
    with open_bytes(path) as file:
        image.quantize(COLOURS, dither=Image.Dither.NONE).save(file, "PNG", optimize=True)
    return path
