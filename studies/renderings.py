"""What the renderer makes of a study's virtual textures under a simulated hand, rendered once and kept.

Simulated people feel these. The hand and what it meets on the real surface are a file beside the study's table; what
is played is the renderer's own loop under a clock that only the loop moves on.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from protocols.canonical import canonical, digest
from protocols.files import write_bytes
from protocols.study import Stimulus
from studies.rig import RigError

if TYPE_CHECKING:
    from devices.render.voice import Voice
    from studies.played_textures import Array

VERSION = 1
"""Of what is kept: another one where the player or the comparison changes what comes out."""
SEED = 0
KEPT, SHIPPED = "compared", "rendered.json"
MET = ("sounding", "held", "restarts", "quiet", "muted")
"""What a record tells of how a model fared, in steps; what each is: devices.render.voice.Tally."""


@dataclass(frozen=True)
class Alike:
    """How far apart the two are; 0 is the same.

    `level_dB` between the whole levels above the threshold of touch, `spectrum_dB` the RMS over third octaves of what
    else they differ by, `friction` the logarithm of the ratio of the friction coefficients.
    """

    level_dB: float
    spectrum_dB: float
    friction: float

    def columns(self) -> dict[str, float]:
        """By the columns of the study's table."""
        return dict(vars(self))


@dataclass(frozen=True)
class Rendered:
    """What came of a model under the simulated hand; `alike` None where no real surface is known to compare with."""

    told: Mapping[str, Any]
    alike: Alike | None = None

    def record(self) -> dict[str, Any]:
        """As a reply keeps it."""
        return dict(self.told) | ({} if self.alike is None else {"compared": self.alike.columns()})


@dataclass
class Renderings:
    """The virtual textures of a study in `folder`, by the models of a lab, else by the shipped ones."""

    folder: Path
    lab: Path | None = None
    known: dict[str, Rendered] = field(default_factory=dict)
    shipped: bool = True
    """Whether what is kept beside the study's table is used."""

    def card(self, stimulus: Stimulus) -> Path:
        """The model's card of a stimulus. Raises RigError where there is none."""
        from devices.render.errors import RenderError
        from devices.render.found import SHIPPED as MODELS
        from devices.render.found import card_for

        texture, model = (_column(stimulus, name) for name in ("texture", "model"))
        try:
            return card_for(texture, model, self.lab or MODELS)
        except RenderError as error:
            raise RigError(f"stimulus {stimulus.id!r}: {error}") from None

    def check(self, stimulus: Stimulus) -> None:
        """The stimulus has a whole model, and its hand is the planned one. Raises RigError."""
        card = self.card(stimulus)
        _friction(stimulus)
        demand_whole(card)
        if (key := self._key(stimulus, card)) not in self.known and self._kept(key, card) is None:
            self._voice(card)
            self._felt(stimulus)

    def of(self, stimulus: Stimulus) -> Rendered:
        """What its model plays, and how alike that is; rendered where nobody has kept it. Raises RigError."""
        card = self.card(stimulus)
        key = self._key(stimulus, card)
        if key not in self.known:
            self.known[key] = self._kept(key, card) or self._fresh(key, stimulus, card)
        return self.known[key]

    def feels(self, stimulus: Stimulus) -> Mapping[str, float]:
        """By which columns it is felt otherwise than its table says."""
        found = self.of(stimulus).alike
        return {} if found is None else found.columns()

    def _key(self, stimulus: Stimulus, card: Path) -> str:
        """What decides a rendering: the card, which names the digest of its numbers; the hand's file; the seed."""
        made = [card.stem, hashlib.sha256(card.read_bytes()).hexdigest()]
        parts = [*made, stimulus.sha256, stimulus.columns.get("friction")]
        return digest({"rendering": VERSION, "seed": SEED, "of": parts})

    def _kept(self, key: str, card: Path) -> Rendered | None:
        """What was kept of this rendering; None where nobody did. Raises RigError on a file that is damaged."""
        if (told := self._shipped().get(key)) is not None:
            return restored(told, card, self.folder / SHIPPED)
        if self.lab is not None and (file := _kept_file(self.lab, key)).is_file():
            return restored(read_kept(file), card, file)
        return None

    def _shipped(self) -> Mapping[str, Any]:
        file = self.folder / SHIPPED
        return read_kept(file) if self.shipped and file.is_file() else {}

    def _fresh(self, key: str, stimulus: Stimulus, card: Path) -> Rendered:
        from studies.played_textures import rendered

        made = rendered(self._voice(card), card, self._felt(stimulus), _friction(stimulus))
        if self.lab is not None:
            keep(_kept_file(self.lab, key), made)
        return made

    def _voice(self, card: Path) -> Voice:
        from devices.models.errors import ModelFileError
        from devices.render.errors import RenderError
        from devices.render.voice import open_voice

        try:
            return open_voice(card, seed=SEED)
        except (ModelFileError, RenderError) as error:
            raise RigError(str(error)) from None

    def _felt(self, stimulus: Stimulus) -> Array:
        """(3, n): what the hand meets on the real surface, its speed and its force. Raises RigError."""
        from studies.played_textures import read_felt

        file = self.folder / _column(stimulus, "file")
        if not file.is_file():
            raise RigError(f"stimulus {stimulus.id!r}: no hand on the real surface, {file} (the column `file`)")
        content = file.read_bytes()
        if hashlib.sha256(content).hexdigest() != stimulus.sha256:
            raise RigError(f"{file}: not the file that the session was planned with (its SHA-256 differs)")
        return read_felt(file)


def demand_whole(card: Path) -> None:
    """The model's numbers are those that its card names. What was rendered once need not be read again for that.

    Raises RigError.
    """
    try:
        named = json.loads(card.read_bytes())["weights"]
        file, expected = card.parent / Path(named["file"]).name, named["sha256"]
        found = hashlib.sha256(file.read_bytes()).hexdigest()
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RigError(f"{card}: not a whole model: {error}") from None
    if found != expected:
        raise RigError(f"{file}: not the numbers that {card.name} names (SHA-256 {found[:12]}, not {expected[:12]})")


def told_of(card: Path, read: Any) -> dict[str, Any]:
    """A model's files, by name and digest, as every reply names them."""
    return {
        "model": card.stem, "method": read.method, "sha256": hashlib.sha256(card.read_bytes()).hexdigest(),
        "weights": read.weights.file, "weights_sha256": read.weights.sha256,
    }  # fmt: skip


def read_kept(file: Path) -> Mapping[str, Any]:
    """What a file of renderings holds. Raises RigError."""
    try:
        found = json.loads(file.read_bytes())
    except (OSError, ValueError) as error:
        raise _damaged(file, error) from None
    if not isinstance(found, dict):
        raise _damaged(file, "an object is expected")
    return found


def restored(told: Mapping[str, Any], card: Path, file: Path) -> Rendered:
    """The inverse of `Rendered.record`, as `file` holds it of this card. Raises RigError."""
    try:
        rest = {name: value for name, value in told.items() if name != "compared"}
        compared = None if "compared" not in told else Alike(**told["compared"])
        if (told["model"], told["sha256"]) != (card.stem, hashlib.sha256(card.read_bytes()).hexdigest()):
            raise ValueError("it is of another card")
        if compared is not None and not all(map(math.isfinite, compared.columns().values())):
            raise ValueError("finite numbers are expected")
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise _damaged(file, error) from None
    return Rendered(rest, compared)


def _damaged(file: Path, error: object) -> RigError:
    return RigError(f"{file}: not what was kept of a rendering ({error}). Remove it: the models are then rendered anew")


def keep(file: Path, made: Rendered) -> None:
    """Write what came out; of two sessions that do so at once, either one's file is whole."""
    write_bytes(file, canonical(made.record()))


def _kept_file(lab: Path, key: str) -> Path:
    from devices.render.found import FOLDER

    return lab / FOLDER / KEPT / f"{key[:32]}.json"


def _friction(stimulus: Stimulus) -> float | None:
    """The table's; None where it says nothing. Raises RigError."""
    told = stimulus.columns.get("friction", "")
    try:
        found = float(told) if told else None
    except ValueError:
        found = math.nan
    if found is not None and not math.isfinite(found):
        raise RigError(f"stimulus {stimulus.id!r}: its friction is {told!r}; a number is expected")
    return found


def _column(stimulus: Stimulus, name: str) -> str:
    if not (told := stimulus.columns.get(name, "")):
        raise RigError(f"stimulus {stimulus.id!r}: the texture renderer needs the column {name!r} in its table")
    return told
