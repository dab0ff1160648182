"""Small models of the six textures, fitted to the hands of texture_similarity: an autoregression as one dense layer.

Its order makes a model better or worse; the noise that drives it follows speed and force.
"""

import hashlib
from pathlib import Path

import numpy as np
from safetensors.numpy import save

from palpate.signals.models.card import Card, Dense, Port, Texture, Weights
from palpate.studies.simulation.played_textures import read_felt
from tools.similarity_table import FOLDER, TEXTURES

M = 20
BY_SPEED, BY_FORCE = 0.005, 0.2
"""By how much the log of the SD rises with each mm/s and each N."""
ORDERS = {"ar": 6, "dstn": 2, "hapinf": 4, "foten_generative": 20}


def write_all(lab: Path, textures=TEXTURES, methods=tuple(ORDERS)):
    """Models of these textures in LAB/models."""
    return [write(lab / "models", texture, method) for texture in textures for method in methods]


def write(folder: Path, texture: str, method: str, louder: float = 1.0, picture: str | None = None) -> Path:
    """The card's path. `louder`: by how much its noise is than what it was fitted to. `picture`: the card names it."""
    signal, speed, force = read_felt(FOLDER / "felt" / f"{texture}.csv")
    weight, bias = fitted(signal, speed, force, ORDERS[method])
    bias[1] += np.log(louder)
    start = 0.5 * signal.std() * np.sin(np.arange(M))
    content = save({"w": weight, "b": bias, "start": start})
    name = f"texture-{texture}-{method}"
    card = Card(
        name=name, title=f"{texture} by {method}, small", method=method,
        weights=Weights(file=f"{name}.safetensors", sha256=hashlib.sha256(content).hexdigest(), bytes=len(content)),
        takes=Port(kind="texture_window", size=3 * M, unit="m/s^2, mm/s, N"),
        gives=Port(kind="acceleration", size=2, unit="m/s^2"),
        steps=(Dense(weight="w", bias="b"),),
        texture=Texture(
            id=texture, label=texture.replace("_", " ").capitalize(), window=M, speed_mm_s=(20.0, 250.0),
            force_N=(0.3, 3.0), rms_m_s2=float(signal.std()), peak_m_s2=float(3 * np.abs(signal).max()), start="start",
            picture=picture,
        ),
    )  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    (folder / card.weights.file).write_bytes(content)
    path = folder / f"{name}.json"
    path.write_text(card.model_dump_json())
    return path


def fitted(signal, speed, force, order):
    """Weight (2, 3 M) and bias (2,): the mean from the last `order` samples; log SD by speed and force."""
    past = np.lib.stride_tricks.sliding_window_view(signal, order)[:-1]
    target = signal[order:]
    mean = np.linalg.lstsq(past, target, rcond=None)[0]
    left = float(np.std(target - past @ mean))
    weight, bias = np.zeros((2, 3 * M)), np.zeros(2)
    weight[0, M - order : M] = mean
    weight[1, 2 * M - 1], weight[1, 3 * M - 1] = BY_SPEED, BY_FORCE
    bias[1] = np.log(left) - BY_SPEED * speed.mean() - BY_FORCE * force.mean()
    return weight, bias
