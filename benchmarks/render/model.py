"""The texture that the renderer is measured with: a shipped model, or a small predictor made here without one."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
from safetensors.numpy import save

from palpate.devices.render.texture_models import DEFAULT_METHOD, available
from palpate.protocols.files import write_bytes, write_text
from palpate.signals.models.card import Card, Dense, Port, Texture, Weights

WINDOW = 20
RADIUS, HERTZ = 0.95, 150.0
LEVEL, PEAK = 1.0, 6.0
NAME = "texture-predictor-ar"


def measured_card(folder: Path) -> Path:
    """Return the first shipped texture's card by the default method, or a predictor's, written into the folder."""
    for methods in available(folder).values():
        if DEFAULT_METHOD in methods:
            return methods[DEFAULT_METHOD]
    return predictor(folder)


def predictor(folder: Path) -> Path:
    """Write a model of two poles driven by noise of constant scale, as one dense layer on the window."""
    weight, sd = np.zeros((2, 3 * WINDOW), np.float32), LEVEL * _innovation()
    weight[0, WINDOW - 1], weight[0, WINDOW - 2] = _coefficients()
    start = LEVEL * np.sin(2 * np.pi * HERTZ / 1000 * np.arange(WINDOW))
    bias = np.array([0.0, np.log(sd)], np.float32)
    content = save({"weight": weight, "bias": bias, "start": start.astype(np.float32)})
    weights = Weights(file=f"{NAME}.safetensors", sha256=hashlib.sha256(content).hexdigest(), bytes=len(content))
    texture = Texture(
        id="predictor", label="Two poles", window=WINDOW, speed_mm_s=(10.0, 300.0), force_N=(0.2, 3.6),
        rms_m_s2=LEVEL, peak_m_s2=PEAK, start="start",
    )  # fmt: skip
    card = Card(
        name=NAME, title="Two poles driven by noise", method="ar", weights=weights,
        takes=Port(kind="texture_window", size=3 * WINDOW, unit="m/s^2, mm/s, N"),
        gives=Port(kind="acceleration", size=2, unit="m/s^2"), steps=(Dense(weight="weight", bias="bias"),),
        texture=texture,
    )  # fmt: skip
    write_bytes(folder / weights.file, content)
    return write_text(folder / f"{NAME}.json", card.model_dump_json())


def _coefficients() -> tuple[float, float]:
    return 2 * RADIUS * float(np.cos(2 * np.pi * HERTZ / 1000)), -(RADIUS**2)


def _innovation() -> float:
    """Return the SD of noise that gives level 1: the variance of two poles (Box and Jenkins 3.2.23)."""
    first, second = _coefficients()
    return float(np.sqrt((1 + second) * ((1 - second) ** 2 - first**2) / (1 - second)))
