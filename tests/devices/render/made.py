"""Small models of textures: an autoregression written as one dense layer on the window."""

from pathlib import Path

import numpy as np

from palpate.signals.models.card import Card, Dense, Port, Texture, Weights
from palpate.signals.models.runtime import Model

M = 8
RMS = 1.0


def texture(**changes):
    texture_entry = {
        "id": "cloth", "label": "Cloth", "window": M, "speed_mm_s": (20.0, 200.0), "force_N": (0.3, 3.0),
        "rms_m_s2": RMS, "peak_m_s2": 6.0, "start": "start",
    }  # fmt: skip
    return Texture(**{**texture_entry, **changes})


def resonance(radius=0.9, hertz=150.0):
    """Weights (M,) on the last accelerations, oldest first: one pair of poles."""
    weights = np.zeros(M)
    weights[-1] = 2 * radius * np.cos(2 * np.pi * hertz / 1000)
    weights[-2] = -(radius**2)
    return weights


def innovation(weights):
    """The SD that makes the level 1, from the impulse response."""
    samples = np.zeros(4000)
    samples[0] = 1.0
    for n in range(1, 4000):
        past = samples[max(0, n - M) : n]
        samples[n] = past @ weights[M - len(past) :]
    return 1 / np.sqrt(np.sum(samples**2))


def model(weights=None, sd=None, outputs=2, start=None, by_speed=0.0, bias=0.0, name="texture-cloth-ar", **changes):
    """Mean by the weights, log SD constant plus `by_speed` per mm/s."""
    weights = resonance() if weights is None else weights
    sd = innovation(weights) if sd is None else sd
    weight, offset = np.zeros((outputs, 3 * M)), np.zeros(outputs)
    weight[0, :M], offset[0] = weights, bias
    if outputs == 2:
        weight[1, 2 * M - 1], offset[1] = by_speed, np.log(sd)
    start = 0.5 * np.sin(np.arange(M)) if start is None else start
    tensors = {"w": weight, "b": offset, "start": np.asarray(start)}
    return Model(card_of((Dense(weight="w", bias="b"),), outputs, name, texture(**changes)), tensors)


def card_of(steps, outputs, name, described, takes=None, gives=None):
    return Card(
        name=name, title="A small texture", method="ar",
        weights=Weights(file=f"{name}.safetensors", sha256="0" * 64, bytes=0),
        takes=takes or Port(kind="texture_window", size=3 * M, unit="m/s^2, mm/s, N"),
        gives=gives or Port(kind="acceleration", size=outputs, unit="m/s^2"),
        steps=steps, texture=described,
    )  # fmt: skip


def spectra(frames=2, size=32, hop=8, level=1.0, noise=1, name="texture-cloth-gan"):
    """A block model that always gives the magnitudes of white noise of this level."""
    bins = size // 2 + 1
    hann = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(size) / size)
    log = np.log(level * np.sqrt(np.sum(hann**2)))
    tensors = {"w": np.zeros((bins * frames, 2 + noise)), "b": np.full(bins * frames, log)}
    takes = Port(kind="texture_drive", size=2 + noise, unit="mm/s, N, 1")
    gives = Port(kind="spectrum", size=bins * frames, unit="log m/s^2")
    described = texture(window=size, hop=hop, start=None)
    return Model(card_of((Dense(weight="w", bias="b"),), 0, name, described, takes, gives), tensors)


def write(folder: Path, texture_model: Model) -> Path:
    """The model as its two files; the card's path."""
    import hashlib

    from safetensors.numpy import save

    content = save({key: np.ascontiguousarray(value) for key, value in texture_model.tensors.items()})
    card = texture_model.card
    weights = card.weights.model_copy(update={"sha256": hashlib.sha256(content).hexdigest(), "bytes": len(content)})
    folder.mkdir(parents=True, exist_ok=True)
    (folder / weights.file).write_bytes(content)
    path = folder / f"{card.name}.json"
    path.write_text(card.model_copy(update={"weights": weights}).model_dump_json())
    return path
