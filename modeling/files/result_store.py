"""Results on disk, by a key of all that decides them: arrays as .npz and metadata as .json, never pickled."""

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
    """What was saved under a key."""

    arrays: Mapping[str, NDArray[Any]]
    metadata: Mapping[str, Any]


def content_key(**decides: object) -> str:
    """Return 32 hexadecimal digits that change with any of the values, which decide a result.

    A result depends on its inputs, its settings, the code (`protocols.code_digest`) and the versions of packages.
    Raises NotCanonical for a value that JSON cannot hold.
    """
    return digest(decides)[:32]


@dataclass(frozen=True)
class ResultStore:
    """A folder of results; without a folder nothing is saved and nothing is there to be loaded."""

    folder: Path | None

    def save(self, key: str, arrays: Arrays, metadata: Mapping[str, Any]) -> None:
        """Write KEY.npz and then KEY.json: where there is a JSON, the arrays are whole.

        Raises ValueError for metadata that JSON cannot hold (NaN) and for arrays of Python objects, and OSError.
        """
        if self.folder is None:
            return
        entry = {"key": key, "sha256": _digest(key, arrays, metadata), "metadata": metadata}
        with open_bytes(self.folder / f"{key}.npz") as file:
            np.savez(file, **dict(arrays))  # type: ignore[arg-type]
        write_text(self.folder / f"{key}.json", json_text(entry, sort_keys=True))

    def load(self, key: str) -> StoredResult | None:
        """Return what was saved under the key; None where nothing was, or where a file is damaged or another one's."""
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
    """Return the SHA-256 over an array's type, shape and values. Raises ValueError for one of Python objects."""
    if array.dtype.hasobject:
        raise ValueError("an array of Python objects cannot be stored; numbers or text are expected")
    return hashlib.sha256(f"{array.dtype.str} {array.shape}\0".encode() + array.tobytes()).hexdigest()


def _digest(key: str, arrays: Arrays, metadata: Mapping[str, Any]) -> str:
    """Return the SHA-256 over all that an entry holds."""
    digests = {name: array_digest(np.asarray(array)) for name, array in arrays.items()}
    return digest({"key": key, "arrays": digests, "metadata": metadata})
