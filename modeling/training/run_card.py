"""The run card (data, versions, settings, metrics, seconds), and the files that a training writes."""

from __future__ import annotations

import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, is_dataclass
from pathlib import Path
from typing import Any

from palpate.modeling.training.history import Epoch, remove_history, write_history
from palpate.protocols.canonical import digest
from palpate.protocols.extras import installed_version

PACKAGES = ("palpate", "numpy", "scipy", "torch", "scikit-learn")
BESIDE = ("librosa", "scikit-image", "pywavelets", "pillow")
"""What makes features of recordings and pictures, where it is installed: other models know nothing of it."""


def run_card(
    data_digests: Mapping[str, str], settings: object, metrics: Mapping[str, float], seconds: float
) -> dict[str, Any]:
    """A run as plain values that JSON holds: it stands in a model's card.

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
    """Of Python and of the packages that decide a result, none of which is imported.

    None for one of `PACKAGES` that is not installed; one of `BESIDE` is not named then.
    """
    beside = {name: told for name in BESIDE if (told := installed_version(name)) is not None}
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


@dataclass(frozen=True)
class Written:
    """A model that was written: its card, its method, the metrics of its card, its files (the card's first)."""

    card: Path
    method: str
    metrics: Mapping[str, float]
    files: tuple[Path, ...]

    def plain(self) -> dict[str, Any]:
        """As JSON holds it."""
        told: dict[str, Any] = plain_values(self)
        return told


def write_trained(
    folder: Path, write: Callable[[Path], Path], history: Sequence[Epoch], last: bool = False
) -> tuple[Path, ...]:
    """Write a model, and the epochs of its training as a table and as a picture; return its files, the card first.

    `write` writes card and numbers into the folder and returns the card's path. The learning curve of an older model of
    this name is removed. `last`: the last epoch is the one that was kept, not the best. Raises what `write` raises.
    """
    folder.mkdir(parents=True, exist_ok=True)
    card = write(folder)
    files = (card, card.with_suffix(".safetensors"))
    remove_history(folder, card.stem)
    if not history:
        return files
    from palpate.modeling.training.learning_curve import save_learning_curve

    table = write_history(history, folder / f"{card.stem}.history.csv")
    return (*files, table, *save_learning_curve({"": history}, folder, f"{card.stem}.history", last))
