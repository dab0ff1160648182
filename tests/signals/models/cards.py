"""Small models written to files as a trainer would, without the trainer."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
from safetensors.numpy import save

from palpate.signals.models.card import Card, Dense, DoorFeatures, Interval, Port, Weights

ATTRIBUTES = ("Easy-to-pull", "Damped")
ANTONYMS = ("Hard-to-pull", "Recoiling")
FORCE = Port(kind="force_profile", size=621, unit="N")
RATINGS = Port(kind="ratings", size=2, unit="0..100", names=ATTRIBUTES, antonyms=ANTONYMS, scale=(-8.0, 8.0))


def port(size: int) -> Port:
    return Port(kind="ratings", size=size, unit="0..100")


def saved(folder: Path, steps, tensors, takes: Port, gives: Port, name: str = "small", **others) -> Path:
    """The card's path."""
    content = save({key: np.ascontiguousarray(value) for key, value in tensors.items()})
    weights = Weights(file=f"{name}.safetensors", sha256=hashlib.sha256(content).hexdigest(), bytes=len(content))
    card = Card(
        name=name, title="A small model", method="by hand", weights=weights, takes=takes, gives=gives,
        steps=tuple(steps), **others,
    )  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    (folder / weights.file).write_bytes(content)
    (folder / f"{name}.json").write_text(card.model_dump_json())
    return folder / f"{name}.json"


def feeling(folder: Path, name: str = "feeling", offset: float = 50.0, **others) -> Path:
    """A model of a feeling: two ratings, by the greatest and the mean force."""
    steps = (DoorFeatures(names=("max_force_N", "mean_force_N")), Dense(weight="w", bias="b"))
    tensors = {"w": np.array([[1.0, 0.0], [0.0, 2.0]]), "b": np.array([0.0, offset])}
    interval = Interval(method="split conformal", coverage=0.9, half_width=(6.0, 8.0))
    others = {"interval": interval, "metrics": {"mae": 2.5}, **others}
    return saved(folder, steps, tensors, FORCE, RATINGS, name, **others)


def shape(folder: Path, name: str = "shape", steep: float = 0.1) -> Path:
    """A model of a profile: its height by the first rating, its slope by the second."""
    weight = np.stack([np.full(621, 0.2), np.arange(621) * steep / 100], axis=1)
    tensors = {"w": weight, "b": np.full(621, 1.0)}
    metrics = {"loop_fresh": 4.25, "waveform_mae": 9.5}
    return saved(folder, (Dense(weight="w", bias="b"),), tensors, RATINGS, FORCE, name, metrics=metrics)


def edited(card: Path, **changes) -> Path:
    """The card with these top-level entries changed."""
    card_data = json.loads(card.read_text())
    card_data.update(changes)
    card.write_text(json.dumps(card_data))
    return card
