"""Results on disk, by a key of all that they depend on: arrays as .npz and metadata as .json, never pickled.

A stored result is never marked stale: `content_key` changes with the inputs, the settings and the code, and what lies
under another key is not found.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from palpate.protocols.canonical import digest, json_text
from palpate.protocols.files import open_bytes, write_text

Arrays: TypeAlias = Mapping[str, NDArray[Any]]


class StoredResult(NamedTuple):
    """The arrays and metadata that were saved under a key."""

    arrays: Mapping[str, NDArray[Any]]
    metadata: Mapping[str, Any]


def content_key(**decides: object) -> str:
    """Return a key of 32 hexadecimal digits that changes with any of the values.

    Pass all that a result depends on: inputs, settings, code (`protocols.code_digest`) and versions of packages.
    Raises NotCanonical for a value that JSON cannot hold.
    """
    return digest(decides)[:32]


@dataclass(frozen=True)
class ResultStore:
    """A folder of results; with None as the folder, `save` does nothing and `load` returns None."""

    folder: Path | None

    def save(self, key: str, arrays: Arrays, metadata: Mapping[str, Any]) -> None:
        """Write KEY.npz and then KEY.json, so that the arrays are complete wherever the JSON file exists.

        Raises ValueError for metadata that JSON cannot hold (NaN) and for arrays of Python objects, and OSError.
        """
        if self.folder is None:
            return
        entry = {"key": key, "sha256": _digest(key, arrays, metadata), "metadata": metadata}
        with open_bytes(self.folder / f"{key}.npz") as file:
            np.savez(file, **dict(arrays))  # type: ignore[arg-type]
        write_text(self.folder / f"{key}.json", json_text(entry, sort_keys=True))

    def load(self, key: str) -> StoredResult | None:
        """Return the result under the key; None where there is none, or where a file is damaged or has another key."""
        if self.folder is None:
            return None
        try:
            entry = json.loads((self.folder / f"{key}.json").read_text(encoding="utf-8"))
            with (self.folder / f"{key}.npz").open("rb") as raw, np.load(raw, allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
            is_whole = entry["key"] == key and entry["sha256"] == _digest(key, arrays, entry["metadata"])
            return StoredResult(arrays, entry["metadata"]) if is_whole else None
        except Exception:  # a damaged byte comes out of zip, zlib, NumPy's and Python's own parsers as anything
            return None


def array_digest(array: NDArray[Any]) -> str:
    """Return the SHA-256 over an array's type, shape and values. Raises ValueError for an array of Python objects."""
    if array.dtype.hasobject:
        raise ValueError("an array of Python objects cannot be stored; numbers or text are expected")
    return hashlib.sha256(f"{array.dtype.str} {array.shape}\0".encode() + array.tobytes()).hexdigest()


def _digest(key: str, arrays: Arrays, metadata: Mapping[str, Any]) -> str:
    """Return the SHA-256 over an entry's key, arrays and metadata."""
    digests = {name: array_digest(np.asarray(array)) for name, array in arrays.items()}
    return digest({"key": key, "arrays": digests, "metadata": metadata})
