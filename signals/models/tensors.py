"""The tensors of a model, read from the safetensors file that its card names."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from palpate.signals.models.card import Card, Weights, card_tensors
from palpate.signals.models.errors import ModelFileError, reading

Tensors: TypeAlias = Mapping[str, NDArray[Any]]

LARGEST_WEIGHTS = 2 * 1024**3
"""Greatest size of a weights file in bytes."""
TYPES = {"F16": "<f2", "F32": "<f4", "F64": "<f8", "I32": "<i4", "I64": "<i8"}
"""Types of tensors: real numbers in single or double precision, or in half to save space; whole numbers for the nodes
of trees.
"""
HALF = "F16"


def read_tensors(card_path: Path, card: Card) -> dict[str, NDArray[Any]]:
    """Return the arrays that the card's steps use. Raises ModelFileError unless all are there, finite, and no
    others.
    """
    path = weights_file(card_path, card.weights)
    require_size(path, card_path, card.weights)
    # The file must be byte for byte what the card was written for.
    with reading(path):
        content = path.read_bytes()
    digest = hashlib.sha256(content).hexdigest()
    if digest != card.weights.sha256:
        raise ModelFileError(
            f"{path}: SHA-256 {digest[:12]}... found, {card.weights.sha256[:12]}... expected by {card_path.name}: the "
            "numbers were changed or belong to another model. Copy both files again."
        )
    tensors = _parsed(path, content)
    present = set(tensors)
    needed = set(card_tensors(card))
    if missing := sorted(needed - present):
        raise ModelFileError(f"{path}: the steps need {', '.join(map(repr, missing[:4]))}, which is not in the file.")
    if unused := sorted(present - needed):
        raise ModelFileError(f"{path}: no step uses {', '.join(map(repr, unused[:4]))}: not this model's numbers.")
    for name, tensor in tensors.items():
        if not np.isfinite(tensor).all():
            raise ModelFileError(f"{path}: {name!r} holds a value that is not finite. Train the model again.")
        tensor.flags.writeable = False
    return tensors


def weights_file(card_path: Path, weights: Weights) -> Path:
    """Return the path of the weights beside the card. Raises ModelFileError for anything but a bare file name."""
    name = weights.file
    if name in ("", ".", "..") or any(mark in name for mark in "/\\:\0") or not name.endswith(".safetensors"):
        raise ModelFileError(
            f"{card_path}: weights.file is {name!r}; the name of a .safetensors file in the card's folder is expected."
        )
    return card_path.parent / name


def require_size(path: Path, card_path: Path, weights: Weights) -> None:
    """Raise ModelFileError for a file that is missing or not as long as the card says."""
    with reading(path):
        if not path.is_file():
            raise ModelFileError(f"{path}: missing; it belongs to {card_path.name}. Copy both files, or train again.")
        size = path.stat().st_size
    if size > LARGEST_WEIGHTS:
        raise ModelFileError(f"{path}: {size} bytes; a model's numbers have at most {LARGEST_WEIGHTS}.")
    if size != weights.bytes:
        raise ModelFileError(
            f"{path}: {size} bytes found, {weights.bytes} expected by {card_path.name}: truncated or another model's. "
            "Copy both files again."
        )


def _parsed(path: Path, content: bytes) -> dict[str, NDArray[Any]]:
    from safetensors import SafetensorError, deserialize

    try:
        listed: list[tuple[str, dict[str, Any]]] = deserialize(content)  # type: ignore[no-untyped-call]
    except SafetensorError as error:
        raise ModelFileError(f"{path}: not a safetensors file ({error}). Export the model again.") from None
    tensors: dict[str, NDArray[Any]] = {}
    for name, entry in listed:
        if entry["dtype"] not in TYPES:
            raise ModelFileError(
                f"{path}: {name!r} is {entry['dtype']}; {', '.join(TYPES)} are read. Export it as F32."
            )
        try:
            tensor = np.frombuffer(entry["data"], dtype=TYPES[entry["dtype"]]).reshape(entry["shape"])
        except ValueError as error:
            raise ModelFileError(f"{path}: {name!r} cannot be held: {error}. Export the model again.") from None
        tensors[name] = tensor.astype(np.float32) if entry["dtype"] == HALF else tensor
    return tensors
