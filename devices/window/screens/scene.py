"""Painting what changed: a scene is compared with the one painted last, and only what differs is painted again."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from palpate.devices.window.geometry import Box
from palpate.devices.window.paint import GROUND
from palpate.devices.window.screens.elements import Element

if TYPE_CHECKING:
    from PIL import Image

    from palpate.devices.window.screen import Page

Scene = tuple[Element, ...]


@dataclass
class Painted:
    """What a screen looked like when it was painted last; None before."""

    scene: Scene | None = None

    def bring_up(self, image: Image.Image, scene: Scene, page: Page) -> tuple[Box, ...]:
        """Paint the differences; the boxes that were painted."""
        before, self.scene = self.scene, scene
        boxes = [page.metrics.screen] if before is None else gathered(changed(before, scene))
        for box in boxes:
            _paint(image, box.common(page.metrics.screen), scene, page)
        return tuple(boxes)


def changed(before: Scene, after: Scene) -> list[Box]:
    """Where the two scenes differ."""
    same = set(before) & set(after)
    return [element.box for element in (*before, *after) if element not in same]


def gathered(boxes: Iterable[Box]) -> list[Box]:
    """The boxes with those that overlap joined."""
    apart: list[Box] = []
    for box in boxes:
        joined = box
        while near := [each for each in apart if each.overlaps(joined)]:
            apart = [each for each in apart if each not in near]
            for each in near:
                joined = joined.joined(each)
        apart.append(joined)
    return apart


def _paint(image: Image.Image, box: Box, scene: Scene, page: Page) -> None:
    """Paint a part of the screen anew: everything that reaches into it, in order, cut at its edges."""
    from PIL import Image

    part = Image.new("RGB", (box.width, box.height), GROUND)
    for element in scene:
        if element.box.overlaps(box):
            replace(element, box=element.box.moved(-box.left, -box.top)).paint(part, page)
    image.paste(part, (box.left, box.top))
