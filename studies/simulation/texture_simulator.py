"""The simulator of textures, for modeling, which may not import a device: the front door hands it over."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.studies.simulation import texture_capturing

if TYPE_CHECKING:
    from palpate.studies.simulation.texture_set import SetSession


@dataclass(frozen=True)
class SimulatedTextures:
    """The simulator of textures: explorations of surfaces, and sets of them in a lab. It pickles."""

    captured = staticmethod(texture_capturing.captured)
    scene = staticmethod(texture_capturing.scene)
    again = staticmethod(texture_capturing.scene_again)

    def make_set(
        self, lab: Path, report: Callable[[str], None], *, textures: tuple[str, ...] = (), seconds: float | None = None,
        pictures: int | None = None, raters: int | None = None, seed: int = 0, workers: int = 1, quick: bool = False,
    ) -> list[SetSession]:  # fmt: skip
        """Make the set in a lab, or resume it: see `palpate.studies.simulation.texture_set.make_set`.

        None means 60 s, 10 pictures, 20 raters; with `quick`, the values of a small set.
        """
        from palpate.studies.simulation.texture_set import make_set, set_options

        return make_set(lab, set_options(textures, seconds, pictures, raters, seed, workers, quick), report)
