"""A fitted texture as a model file for a rig: the card's texture section, its ports, and the start of a touch."""

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
"""Speed and force at the start of a touch (thesis 4.5.1; 45 m/s there is a misprint)."""
START_S = 1.0
"""Seconds that the model runs at that speed and force before its last window is taken."""
HEADROOM = 1.25
"""The factor by which a played signal may exceed the greatest acceleration of the training part."""
LEAST_PEAK_M_S2 = 1e-3
LONGEST_NAME = 64
START = "start"
WINDOW_UNIT = "m/s^2, mm/s, N"


class BlockFitted(Fitted, Protocol):
    """A fitted method that generates spectra: frames of `window` samples, `hop` apart, from `drawn` random numbers."""

    @property
    def hop(self) -> int:
        """The number of samples between frames."""

    @property
    def drawn(self) -> int:
        """The number of random numbers of its input, beside speed and force."""

    @property
    def frames(self) -> int:
        """The number of frames in one output."""


def write_texture(
    folder: Path, recording: Recording, parts: Parts, fitted: Fitted, method: Method, *,
    with_start: bool = False, seed: int = 0, name: str | None = None,
    metrics: Mapping[str, float] | None = None, training: Mapping[str, Any] | None = None, notes: Sequence[str] = (),
) -> Path:  # fmt: skip
    """Write a fitted texture as a model (NAME.json, NAME.safetensors) and return its card's path.

    NAME is texture-TEXTURE-METHOD unless given. With `with_start`, the file also holds the start of a touch, except for
    a model of spectra: the last window of a second that the model generates at 45 mm/s and 0.8 N in the renderer
    (thesis 4.5.1). Raises ModelWritingError for a model that cannot be written, TextureDataError for a training part
    without samples.
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
    """Return texture-TEXTURE-METHOD; a name that is no valid file name is changed, with a part of its hash added."""
    plain = re.sub(r"[^A-Za-z0-9_.-]+", "-", texture)[: LONGEST_NAME - len(f"texture--{method}")]
    if plain != texture:
        digest = hashlib.sha256(texture.encode()).hexdigest()[:6]
        plain = f"{plain[: LONGEST_NAME - len(f'texture---{method}{digest}')].strip('-')}-{digest}"
    return f"texture-{plain}-{method}"


def texture_of(recording: Recording, parts: Parts, fitted: Fitted, method: Method) -> Texture:
    """Return the texture section of the card: levels, speeds and forces are those of the training part.

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
    """Return the model's input and output ports."""
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
    """Return the last `window` samples in m/s^2 of a second that the card's model generates at 45 mm/s and 0.8 N."""
    steps = round(START_S * RATE_HZ) + window
    made = play(card, np.full(steps, START_SPEED_MM_S), np.full(steps, START_FORCE_N), seed)
    result: Array = np.asarray(made, dtype=np.float64)[-window:]
    return result
