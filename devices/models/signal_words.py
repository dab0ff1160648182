"""The steps of a model that continues a signal, in words."""

from __future__ import annotations

from collections.abc import Mapping

from palpate.signals.models.card import Step
from palpate.signals.models.card_steps import (
    Add,
    Attention,
    Autoregression,
    Cartesian,
    Join,
    Keep,
    Lstm,
    Norm,
    Part,
    Polar,
    Recall,
    Turn,
)
from palpate.signals.models.form import Values


def signal_step(step: Step, tensors: Mapping[str, Values]) -> str:
    """A line on one of these steps; nothing on another."""
    if isinstance(step, Keep | Recall | Add | Join | Part | Turn | Polar | Cartesian):
        return _of_values(step)
    if isinstance(step, Norm):
        return f"layer normalisation of {tensors[step.weight].size} numbers"
    if isinstance(step, Attention):
        return _attention(step, tensors)
    if isinstance(step, Lstm):
        gates, channels = tensors[step.weight].shape
        way = "from the last place to the first" if step.reverse else "from the first place on"
        return f"long short-term memory: {channels} to {gates // 4}, {way}"
    if isinstance(step, Autoregression):
        points, order = tensors[step.frequencies].shape
        triangles = len(tensors[step.triangles])
        return f"autoregression of order {order} between {points} points over speed and force, {triangles} triangles"
    return ""


def _of_values(step: Keep | Recall | Add | Join | Part | Turn | Polar | Cartesian) -> str:
    if isinstance(step, Join):
        return f"join {', '.join(step.kept)} below it"
    if isinstance(step, Part):
        return f"{'places' if step.along == 'length' else 'channels'} {step.start + 1} to {step.stop}"
    if isinstance(step, Keep | Recall | Add):
        return f"{KEPT[step.do]} {step.kept}"
    return PLAIN[step.do]


KEPT = {"keep": "keep it as", "recall": "go on with", "add": "plus"}
PLAIN = {
    "turn": "channels and places change places", "polar": "magnitude and phase", "cartesian": "real and imaginary part",
}  # fmt: skip


def _attention(step: Attention, tensors: Mapping[str, Values]) -> str:
    told = f"attention: {step.heads} heads over {len(tensors[step.out])} channels"
    told += "" if step.memory is None else f" to {step.memory}"
    told += ", none after itself" if step.causal else ""
    return told if step.sparse is None else f"{told}, {step.sparse} places ask"
