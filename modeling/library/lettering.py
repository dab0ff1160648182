"""Letters on a picture: the face that matplotlib brings along, so that they are the same everywhere."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw
    from PIL.ImageFont import FreeTypeFont

FACES = {False: "DejaVuSans.ttf", True: "DejaVuSans-Bold.ttf"}
MORE = "…"


@cache
def _faces() -> Path:
    import matplotlib

    return Path(matplotlib.get_data_path()) / "fonts" / "ttf"


@dataclass
class Pen:
    """Writes on a drawing; places and sizes in pixels."""

    draw: ImageDraw
    opened: dict[tuple[int, bool], FreeTypeFont] = field(default_factory=dict)

    def font(self, size: int, bold: bool = False) -> FreeTypeFont:
        """A face in a size, opened once."""
        from PIL import ImageFont

        if (size, bold) not in self.opened:
            face = str(_faces() / FACES[bold])
            self.opened[size, bold] = ImageFont.truetype(face, size, layout_engine=ImageFont.Layout.BASIC)
        return self.opened[size, bold]

    def width(self, text: str, size: int, bold: bool = False) -> float:
        """How wide a text is."""
        return float(self.font(size, bold).getlength(text))

    def fitted(self, text: str, room: float, size: int, bold: bool = False) -> str:
        """The text, cut off where there is no room for it."""
        if self.width(text, size, bold) <= room:
            return text
        most = bisect_right(range(len(text)), room, key=lambda end: self.width(text[:end] + MORE, size, bold))
        return text[: max(0, most - 1)].rstrip() + MORE

    def write(
        self, place: tuple[float, float], text: str, size: int, colour: str, *, bold: bool = False, anchor: str = "ls"
    ) -> None:
        """A line of text; `anchor` as Pillow names it (ls: left, on the baseline)."""
        self.draw.text(place, text, fill=colour, font=self.font(size, bold), anchor=anchor)
