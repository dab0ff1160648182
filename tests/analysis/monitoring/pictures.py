"""The pictures of docs/how-to/watch-a-lab.md, made anew: python -m tests.analysis.monitoring.pictures docs/pictures."""

from __future__ import annotations

import base64
import io
import sys
import tempfile
from pathlib import Path
from typing import Any

from tests.analysis.monitoring.browser import chromium, emulate, monitoring, until
from tests.analysis.monitoring.showcase import fill, running

COLOURS = 128
CLIP = """
const found = document.querySelector(arguments[0]).getBoundingClientRect();
return [found.top + scrollY, found.bottom + scrollY];
"""


def shot(browser: Any, to: Path, width: int, top: float, bottom: float) -> None:
    """Save a strip of the page, with few colours and so in few bytes."""
    from PIL import Image

    clip = {"x": 0, "y": top, "width": width, "height": bottom - top, "scale": 1}
    options = {"format": "png", "captureBeyondViewport": True, "clip": clip}
    taken = base64.b64decode(browser.execute_cdp_cmd("Page.captureScreenshot", options)["data"])
    Image.open(io.BytesIO(taken)).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(to, optimize=True)


def section(browser: Any, selector: str) -> tuple[float, float]:
    """Where a part of the page begins and ends."""
    top, bottom = browser.execute_script(CLIP, selector)
    return top, bottom + 16


def take(browser: Any, address: str, to: Path) -> None:
    """Every picture."""
    emulate(browser, 1280, 900)
    browser.get(address)
    until(browser, lambda b: b.execute_script("return document.querySelectorAll('tr.flagged').length"))
    shot(browser, to / "monitor-sessions.png", 1280, 0, section(browser, "#sessions")[1])
    shot(browser, to / "monitor-balance.png", 1280, *section(browser, "#balance"))
    shot(browser, to / "monitor-raters.png", 1280, *section(browser, "#raters"))
    emulate(browser, 390, 844, "dark")
    browser.get(address)
    shot(browser, to / "monitor-phone.png", 390, 0, 1100)


def main() -> None:
    to = Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        lab = Path(folder) / "doors-lab"
        lab.mkdir()
        fill(lab)
        with (
            running(lab, "P018", 31),
            running(lab, "P019", 8),
            monitoring(lab) as address,
            chromium(Path(folder) / "profile") as browser,
        ):
            until(browser, lambda _: len(list((lab / "sessions").glob("*P01[89]*.sqlite"))) == 2)
            take(browser, address, to)


if __name__ == "__main__":
    main()
