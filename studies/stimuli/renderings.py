"""What a model plays under a simulated hand, how similar it feels to the real surface, and the files of both."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.protocols.canonical import canonical
from palpate.protocols.files import file_sha256, write_bytes
from palpate.studies.sessions.rig import RigError

SEED = 0
MET = ("sounding", "held", "restarts", "quiet", "muted")
"""The counts, in steps, that a record has of a model's playing; see palpate.signals.textures.voice.Tally."""


@dataclass(frozen=True)
class Alike:
    """The differences between a rendering and the real surface; 0 means equal.

    `level_dB` between the total levels above the threshold of touch, `spectrum_dB` the RMS of the remaining differences
    over third octaves, `friction` the logarithm of the ratio of the friction coefficients.
    """

    level_dB: float
    spectrum_dB: float
    friction: float

    def columns(self) -> dict[str, float]:
        """Return the values by the columns of the study's table."""
        return dict(vars(self))


@dataclass(frozen=True)
class Rendered:
    """The result of a model under the simulated hand; `alike` is None if no real surface is known to compare with."""

    metadata: Mapping[str, Any]
    alike: Alike | None = None

    def record(self) -> dict[str, Any]:
        """Return the rendering as a reply records it."""
        return dict(self.metadata) | ({} if self.alike is None else {"compared": self.alike.columns()})


def demand_whole(card: Path) -> None:
    """Raise RigError unless the model's numbers are those that its card names.

    A saved rendering spares reading the numbers again, so they are checked apart.
    """
    try:
        named = json.loads(card.read_bytes())["weights"]
        file, expected = card.parent / Path(named["file"]).name, named["sha256"]
        sha256 = file_sha256(file)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RigError(f"{card}: not a whole model: {error}") from None
    if sha256 != expected:
        raise RigError(f"{file}: not the numbers that {card.name} names (SHA-256 {sha256[:12]}, not {expected[:12]})")


def model_metadata(card: Path, read: Any) -> dict[str, Any]:
    """Return a model's files by name and digest, as every reply names them."""
    return {
        "model": card.stem, "method": read.method, "sha256": file_sha256(card),
        "weights": read.weights.file, "weights_sha256": read.weights.sha256,
    }  # fmt: skip


def load_rendering(file: Path) -> Mapping[str, Any]:
    """Read a file of renderings. Raises RigError."""
    try:
        content = json.loads(file.read_bytes())
    except (OSError, ValueError) as error:
        raise _damaged(file, error) from None
    if not isinstance(content, dict):
        raise _damaged(file, "an object is expected")
    return content


def rendering_of(metadata: Mapping[str, Any], card: Path, file: Path) -> Rendered:
    """Return the rendering of this card from `metadata`: the inverse of `Rendered.record`. Raises RigError."""
    try:
        rest = {name: value for name, value in metadata.items() if name != "compared"}
        compared = None if "compared" not in metadata else Alike(**metadata["compared"])
        if (metadata["model"], metadata["sha256"]) != (card.stem, file_sha256(card)):
            raise ValueError("it is of another card")
        if compared is not None and not all(map(math.isfinite, compared.columns().values())):
            raise ValueError("finite numbers are expected")
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise _damaged(file, error) from None
    return Rendered(rest, compared)


def _damaged(file: Path, error: object) -> RigError:
    return RigError(f"{file}: not a stored rendering ({error}). Remove it: the models are then rendered again")


def save_rendering(file: Path, made: Rendered) -> None:
    """Write a rendering atomically: if two sessions write at once, one of the two files remains whole."""
    write_bytes(file, canonical(made.record()))
