"""What the renderer makes of a study's virtual textures under a simulated hand, rendered once and saved.

Simulated people feel these. The hand and its vibration on the real surface are in a file beside the study's table; the
renderer's own loop plays under a clock that only the loop advances.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.protocols.canonical import digest
from palpate.protocols.files import file_sha256
from palpate.protocols.study import Stimulus
from palpate.studies.sessions.rig import RigError
from palpate.studies.stimuli.renderings import (
    SEED,
    Rendered,
    demand_whole,
    load_rendering,
    rendering_of,
    save_rendering,
)

if TYPE_CHECKING:
    from palpate.signals.arrays import Array
    from palpate.signals.textures.voice import Voice

VERSION = 1
"""Version of saved renderings: increased where the player or the comparison changes the result."""
KEPT, SHIPPED = "compared", "rendered.json"


@dataclass
class VirtualTextures:
    """The virtual textures of a study in `folder`, by the models of a lab, else by the shipped ones."""

    folder: Path
    lab: Path | None = None
    known: dict[str, Rendered] = field(default_factory=dict)
    shipped: bool = True
    """Whether the renderings saved beside the study's table are used."""

    def card(self, stimulus: Stimulus) -> Path:
        """Return the card of a stimulus' model. Raises RigError where there is none."""
        from palpate.devices.render.texture_models import SHIPPED as MODELS
        from palpate.devices.render.texture_models import card_for
        from palpate.signals.textures.sounds import RenderError

        texture, model = (_column(stimulus, name) for name in ("texture", "model"))
        try:
            return card_for(texture, model, self.lab or MODELS)
        except RenderError as error:
            raise RigError(f"stimulus {stimulus.id!r}: {error}") from None

    def check(self, stimulus: Stimulus) -> None:
        """Raise RigError unless the stimulus has a complete model, and its hand is the planned one."""
        card = self.card(stimulus)
        _friction(stimulus)
        demand_whole(card)
        if (key := self._key(stimulus, card)) not in self.known and self._saved(key, card) is None:
            self._voice(card)
            self._felt(stimulus)

    def of(self, stimulus: Stimulus) -> Rendered:
        """Return what the stimulus' model plays and how similar that is, from the saved rendering if any.

        Raises RigError.
        """
        card = self.card(stimulus)
        key = self._key(stimulus, card)
        if key not in self.known:
            if (rendered := self._saved(key, card)) is None:
                from palpate.studies.simulation.played_textures import render

                rendered = render(self._voice(card), card, self._felt(stimulus), _friction(stimulus))
                if self.lab is not None:
                    save_rendering(_saved_file(self.lab, key), rendered)
            self.known[key] = rendered
        return self.known[key]

    def feels(self, stimulus: Stimulus) -> Mapping[str, float]:
        """Return the columns that replace the table's, as simulated people feel them."""
        alike = self.of(stimulus).alike
        return {} if alike is None else alike.columns()

    def _key(self, stimulus: Stimulus, card: Path) -> str:
        """Return the digest of card (which names the digest of its numbers), hand and seed: they decide a rendering."""
        made = [card.stem, file_sha256(card)]
        parts = [*made, stimulus.sha256, stimulus.columns.get("friction")]
        return digest({"rendering": VERSION, "seed": SEED, "of": parts})

    def _saved(self, key: str, card: Path) -> Rendered | None:
        """Return the saved rendering, None if there is none. Raises RigError on a damaged file."""
        file = self.folder / SHIPPED
        shipped = load_rendering(file) if self.shipped and file.is_file() else {}
        if (entry := shipped.get(key)) is not None:
            return rendering_of(entry, card, file)
        if self.lab is not None and (file := _saved_file(self.lab, key)).is_file():
            return rendering_of(load_rendering(file), card, file)
        return None

    def _voice(self, card: Path) -> Voice:
        from palpate.signals.models.errors import ModelFileError
        from palpate.signals.textures.sounds import RenderError
        from palpate.signals.textures.voice import open_voice

        try:
            return open_voice(card, seed=SEED)
        except (ModelFileError, RenderError) as error:
            raise RigError(str(error)) from None

    def _felt(self, stimulus: Stimulus) -> Array:
        """Return (3, n): the acceleration on the real surface, the hand's speed and its force. Raises RigError."""
        from palpate.studies.simulation.played_textures import read_felt

        file = self.folder / _column(stimulus, "file")
        if not file.is_file():
            raise RigError(f"stimulus {stimulus.id!r}: no hand on the real surface, {file} (the column `file`)")
        content = file.read_bytes()
        if hashlib.sha256(content).hexdigest() != stimulus.sha256:
            raise RigError(f"{file}: not the file that the session was planned with (its SHA-256 differs)")
        return read_felt(file)


def _saved_file(lab: Path, key: str) -> Path:
    from palpate.devices.render.texture_models import FOLDER

    return lab / FOLDER / KEPT / f"{key[:32]}.json"


def _friction(stimulus: Stimulus) -> float | None:
    """Return the table's friction, None if it has none. Raises RigError if it is no number."""
    text = stimulus.columns.get("friction", "")
    try:
        friction = float(text) if text else None
    except ValueError:
        friction = math.nan
    if friction is not None and not math.isfinite(friction):
        raise RigError(f"stimulus {stimulus.id!r}: its friction is {text!r}; a number is expected")
    return friction


def _column(stimulus: Stimulus, name: str) -> str:
    if not (text := stimulus.columns.get(name, "")):
        raise RigError(f"stimulus {stimulus.id!r}: the texture renderer needs the column {name!r} in its table")
    return text
