"""A cache of features in LAB/features, by their sources, settings and code.

The folder may be removed at any time; missing features are computed again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from palpate.modeling.attributes.material import FeatureRows, MaterialError
from palpate.modeling.files.result_store import ResultStore, content_key
from palpate.protocols.extras import installed_version

FOLDER = "features"
"""The name of the folder in a lab."""
Entry: TypeAlias = tuple[Mapping[str, FeatureRows], Mapping[str, Any]]
"""Rows (n, features) by kind, and their metadata as JSON holds them."""


def feature_key(decides: Mapping[str, object], code: Sequence[str], packages: Sequence[str]) -> str:
    """Return the key of rows: a digest of their source and settings, of the code, and of the packages' versions."""
    return content_key(
        decides={name: str(value) for name, value in decides.items()},
        code=list(code),
        packages={name: installed_version(name) or "" for name in packages},
    )


def load_features(folder: Path | None, key: str) -> Entry | None:
    """Return the entry of a key; None where there is none, or it is damaged."""
    return ResultStore(folder).load(key)


def save_features(folder: Path | None, key: str, rows: Mapping[str, FeatureRows], metadata: Mapping[str, Any]) -> None:
    """Save an entry atomically; do nothing without a folder. Raises MaterialError where it cannot be written."""
    try:
        ResultStore(folder).save(key, rows, metadata)
    except OSError as error:
        raise MaterialError(
            f"{folder}: features cannot be stored there ({error.strerror}); make room, or let it be written to"
        ) from None
