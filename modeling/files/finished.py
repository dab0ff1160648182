"""A finished job on disk: its arrays as npz, what is told of it as JSON, never a pickle; both whole or not there."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from palpate.protocols.canonical import json_text
from palpate.protocols.files import open_bytes, write_text

Result = TypeVar("Result")
Arrays = Mapping[str, NDArray[Any]]


def put_down(place: Path, arrays: Arrays, told: Mapping[str, Any]) -> None:
    """Write PLACE.npz and then PLACE.json: where there is a JSON, the arrays are whole."""
    with open_bytes(place.with_suffix(".npz")) as file:
        np.savez_compressed(file, **dict(arrays))  # type: ignore[arg-type]
    write_text(place.with_suffix(".json"), json_text(told, sort_keys=True))


def taken_up(place: Path, made: Callable[[Mapping[str, Any], dict[str, NDArray[Any]]], Result]) -> Result | None:
    """What `made` makes of what is told and of the arrays; None where there are none, or where a file is damaged.

    `made` raises a KeyError or a ValueError for what it cannot use.
    """
    try:
        told = json.loads(place.with_suffix(".json").read_text(encoding="utf-8"))
        with place.with_suffix(".npz").open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        return made(told, arrays)
    except Exception:  # a damaged byte comes out of zip, zlib, NumPy's and Python's own parsers as anything
        return None
