"""Features on disk by what they were made from, how, and by which code: LAB/features.

Nothing there is needed: the folder may be removed at any time, and what is missing is computed again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from palpate.modeling.attributes.material import FeatureRows, MaterialError
from palpate.modeling.files.result_store import ResultStore, content_key
from palpate.protocols.extras import installed_version

FOLDER = "features"
"""Of a lab."""
Entry: TypeAlias = tuple[Mapping[str, FeatureRows], Mapping[str, Any]]
"""Rows by kind, and their metadata (what JSON holds)."""


def feature_key(decides: Mapping[str, object], code: Sequence[str], packages: Sequence[str]) -> str:
    """Return the key of rows, by their source and settings, digests of the code and the packages that make them."""
    return content_key(
        decides={name: str(value) for name, value in decides.items()},
        code=list(code),
        packages={name: installed_version(name) or "" for name in packages},
    )


def load_features(folder: Path | None, key: str) -> Entry | None:
    """Return the entry of that key as it was saved; None where there is none that is whole."""
    return ResultStore(folder).load(key)


def save_features(folder: Path | None, key: str, rows: Mapping[str, FeatureRows], metadata: Mapping[str, Any]) -> None:
    """Save an entry, whole or not at all; nothing without a folder. Raises MaterialError on a full disk."""
    try:
        ResultStore(folder).save(key, rows, metadata)
    except OSError as error:
        raise MaterialError(
            f"{folder}: features cannot be stored there ({error.strerror}); make room, or let it be written to"
        ) from None
