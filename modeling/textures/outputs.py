"""A fitted texture as the file that a rig gets: the card's texture section, its ports, and what a touch begins with."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol, cast

import numpy as np

from palpate.modeling.textures.methods import Fitted, Method
from palpate.modeling.textures.recording import RATE_HZ, Parts, Recording, TextureDataError
from palpate.modeling.textures.windows import samples_of
from palpate.signals.arrays import Array
from palpate.signals.models.card import Port, Texture
from palpate.signals.textures.voice import play

START_SPEED_MM_S, START_FORCE_N = 45.0, 0.8
"""What hands begin with (thesis 4.5.1; 45 m/s there is a misprint)."""
START_S = 1.0
"""The model runs so long at that speed and force before its last window is taken."""
HEADROOM = 1.25
"""What is played may go beyond the greatest acceleration of the training part by this."""
LEAST_PEAK_M_S2 = 1e-3
LONGEST_NAME = 64
START = "start"
WINDOW_UNIT = "m/s^2, mm/s, N"


class BlockFitted(Fitted, Protocol):
    """A fitted method that gives spectra: frames of `window` samples, `hop` apart, from `drawn` random numbers."""

    @property
    def hop(self) -> int:
        """Samples between frames."""

    @property
    def drawn(self) -> int:
        """Random numbers that it takes beside speed and force."""

    @property
    def frames(self) -> int:
        """Frames that one answer holds."""


def write_texture(
    folder: Path, recording: Recording, parts: Parts, fitted: Fitted, method: Method, *,
    with_start: bool = False, seed: int = 0, name: str | None = None,
    metrics: Mapping[str, float] | None = None, training: Mapping[str, Any] | None = None, notes: Sequence[str] = (),
) -> Path:  # fmt: skip
    """Write a fitted texture as a model (NAME.json, NAME.safetensors) and return its card's path.

    NAME is texture-TEXTURE-METHOD unless given. `with_start`: the file also holds what a touch begins with: the last
    window of a second that the model itself makes at 45 mm/s and 0.8 N, by the renderer (thesis 4.5.1); without, or
    where a model gives spectra, a touch begins without. Raises ModelWritingError for what cannot be written,
    TextureDataError for a training part without samples.
    """
    from palpate.modeling.files.model_files import write_model

    takes, gives = ports(fitted, method)
    exported = fitted.exported()
    fields: dict[str, Any] = {
        "title": f"{recording.label}: {method.title}", "method": method.name, "takes": takes, "gives": gives,
        "metrics": metrics, "missed": getattr(fitted, "missed", ()), "training": training,
        "notes": (*recording.notes, *notes),
    }  # fmt: skip
    name = name or model_name(recording.texture, method.name)
    texture = texture_of(recording, parts, fitted, method)
    card = write_model(folder, name, exported, texture=texture, **fields)
    if not with_start or method.kind == "block":
        return card
    start = started(card, fitted.window, seed)
    held = replace(exported, tensors={**exported.tensors, START: start})
    return write_model(folder, name, held, texture=texture.model_copy(update={"start": START}), **fields)


def model_name(texture: str, method: str) -> str:
    """texture-TEXTURE-METHOD. A name that no file may have is changed, and a part of its hash tells it from others."""
    plain = re.sub(r"[^A-Za-z0-9_.-]+", "-", texture)[: LONGEST_NAME - len(f"texture--{method}")]
    if plain != texture:
        digest = hashlib.sha256(texture.encode()).hexdigest()[:6]
        plain = f"{plain[: LONGEST_NAME - len(f'texture---{method}{digest}')].strip('-')}-{digest}"
    return f"texture-{plain}-{method}"


def texture_of(recording: Recording, parts: Parts, fitted: Fitted, method: Method) -> Texture:
    """Return what the card says of the texture: levels, speeds and forces are those of the training part.

    Raises TextureDataError for a training part without samples.
    """
    acceleration, speed, force = samples_of(recording, parts.train)
    if not acceleration.size:
        raise TextureDataError(f"{recording.texture}: the training part is empty")
    return Texture(
        id=recording.texture,
        label=recording.label,
        rate_hz=RATE_HZ,
        window=fitted.window,
        speed_mm_s=(max(0.0, float(speed.min())), max(0.0, float(speed.max()))),
        force_N=(max(0.0, float(force.min())), max(0.0, float(force.max()))),
        rms_m_s2=float(np.sqrt(np.mean(acceleration**2))),
        peak_m_s2=max(HEADROOM * float(np.abs(acceleration).max()), LEAST_PEAK_M_S2),
        hop=cast(BlockFitted, fitted).hop if method.kind == "block" else None,
    )


def ports(fitted: Fitted, method: Method) -> tuple[Port, Port]:
    """Return what the model takes and gives."""
    if method.kind == "block":
        block = cast(BlockFitted, fitted)
        bins = block.window // 2 + 1
        return (
            Port(kind="texture_drive", size=2 + block.drawn, unit="mm/s, N, 1"),
            Port(kind="spectrum", size=bins * block.frames, unit="log m/s^2"),
        )
    return (
        Port(kind="texture_window", size=3 * fitted.window, unit=WINDOW_UNIT),
        Port(kind="acceleration", size=2 if method.sampled else 1, unit="m/s^2"),
    )


def started(card: Path, window: int, seed: int = 0) -> Array:
    """Return the last `window` samples in m/s^2 of a second that the card's model makes at 45 mm/s and 0.8 N."""
    steps = round(START_S * RATE_HZ) + window
    made = play(card, np.full(steps, START_SPEED_MM_S), np.full(steps, START_FORCE_N), seed)
    result: Array = np.asarray(made, dtype=np.float64)[-window:]
    return result
