"""The run card of a training: its data, versions, settings, metrics and duration."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Any

from palpate.protocols.canonical import digest
from palpate.protocols.extras import installed_version

PACKAGES = ("palpate", "numpy", "scipy", "torch", "scikit-learn")
BESIDE = ("librosa", "scikit-image", "pywavelets", "pillow")
"""Packages that compute features of recordings and pictures; named only where they are installed."""


def run_card(
    data_digests: Mapping[str, str], settings: object, metrics: Mapping[str, float], seconds: float
) -> dict[str, Any]:
    """Return the run card as plain values for a model's card.

    `data_digests` are SHA-256 by the name of the data; `settings` a dataclass or a mapping. Raises NotCanonical for a
    metric that is not finite.
    """
    card = {
        "data": dict(data_digests),
        "versions": versions(),
        "machine": f"{platform.system()} {platform.machine()}",
        "configuration": plain_values(settings),
        "metrics": {name: float(value) for name, value in metrics.items()},
        "seconds": float(seconds),
    }
    return {**card, "digest": digest(card)}


def versions() -> dict[str, str | None]:
    """Return the versions of Python and of the packages that a result depends on, without importing them.

    A package of `PACKAGES` that is not installed has None; one of `BESIDE` is left out.
    """
    beside = {name: version for name in BESIDE if (version := installed_version(name)) is not None}
    return {"python": platform.python_version(), **{name: installed_version(name) for name in PACKAGES}, **beside}


def plain_values(value: object) -> Any:
    """Return a value as JSON holds it: mappings for dataclasses, lists for tuples, text for paths."""
    if is_dataclass(value) and not isinstance(value, type):
        return plain_values(asdict(value))
    if isinstance(value, Mapping):
        return {str(key): plain_values(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [plain_values(inner) for inner in value]
    return str(value) if isinstance(value, Path) else value
