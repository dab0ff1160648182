"""The run card: what a training was made from and with, what it came to, and how long it took."""

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
"""What makes features of recordings and pictures, where it is installed: other models know nothing of it."""


def run_card(
    data_digests: Mapping[str, str], settings: object, metrics: Mapping[str, float], seconds: float
) -> dict[str, Any]:
    """Return a run as plain values that JSON holds: it stands in a model's card.

    `data_digests` are SHA-256 by what they are of; `settings` a dataclass or a mapping. Raises NotCanonical where a
    metric is not finite: a card never holds NaN.
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
    """Return the versions of Python and of the packages that decide a result, none of which is imported.

    None for one of `PACKAGES` that is not installed; one of `BESIDE` is not named then.
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
