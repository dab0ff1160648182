"""A fitted model as steps and tensors, and as files: NAME.json (its card) and NAME.safetensors, both or neither."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError
from safetensors import numpy as numbers

from palpate.protocols.canonical import NotCanonical, canonical
from palpate.protocols.files import staged_files, write_bytes
from palpate.signals.models.card import Card, Interval, Port, Step, Texture, Weights, complaint, tensors_named

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
KINDS = ("float16", "float32", "float64", "int32", "int64")
NUMBERS = ".safetensors"


@dataclass(frozen=True)
class Exported:
    """A fitted model as steps from the card's input to its output, and the tensors that they name."""

    steps: tuple[Step, ...]
    tensors: Mapping[str, NDArray[Any]]


def write_model(
    folder: Path,
    name: str,
    exported: Exported,
    *,
    title: str,
    method: str,
    takes: Port,
    gives: Port,
    interval: Interval | None = None,
    texture: Texture | None = None,
    metrics: Mapping[str, float] | None = None,
    measured_on: Mapping[str, str] | None = None,
    missed: Sequence[str] = (),
    training: Mapping[str, Any] | None = None,
    notes: Sequence[str] = (),
) -> Path:
    """Write a model into a folder, read it back, and return its card's path.

    A model of the same name is replaced. If the write is interrupted, the folder still holds a complete model, the old
    one or the new.

    Raises:
        ModelWritingError: for a name that is no bare file name; tensors that are missing, unused, not finite or of
            another type than float16 (read back as float32), float32, float64, int32, int64; a card that contradicts
            itself; or files that do not read back as they were written.
    """
    if not NAME.fullmatch(name):
        raise ModelWritingError(f"{name!r} cannot name a model: letters, digits, '-', '_' and '.' are expected.")
    tensors = _checked(name, exported, texture)
    content = numbers.save(tensors)
    weights = Weights(file=f"{name}{NUMBERS}", sha256=hashlib.sha256(content).hexdigest(), bytes=len(content))
    try:
        card = Card(
            name=name, title=title, method=method, weights=weights, takes=takes, gives=gives, steps=exported.steps,
            interval=interval, texture=texture, metrics=dict(metrics or {}),
            measured_on=dict(measured_on or {}), missed=tuple(missed), training=_plain(name, training or {}),
            notes=tuple(notes),
        )  # fmt: skip
    except ValidationError as error:
        raise ModelWritingError(f"{name}: {complaint(error)}. Nothing was written.") from None
    _require_same(name, content, tensors, card)
    path = folder / f"{name}.json"
    return replace_model(path, _text(card), content, partial(_renamed, path, weights.file))


def _checked(name: str, exported: Exported, texture: Texture | None) -> dict[str, NDArray[Any]]:
    """Return the arrays in C order, little-endian. Raises ModelWritingError unless they are those of the steps."""
    tensors = {key: np.asarray(value) for key, value in exported.tensors.items()}
    needed = set(tensors_named(exported.steps))
    if texture is not None and texture.start is not None:
        needed.add(texture.start)
    if needed != set(tensors):
        odd = ", ".join(map(repr, sorted(needed ^ set(tensors))[:4]))
        raise ModelWritingError(f"{name}: the steps use {len(needed)} arrays and {len(tensors)} are given; see {odd}.")
    for key, tensor in tensors.items():
        if tensor.dtype.name not in KINDS:
            raise ModelWritingError(f"{name}: {key!r} is {tensor.dtype}; {', '.join(KINDS)} can be written.")
        if not np.isfinite(tensor).all():
            raise ModelWritingError(f"{name}: {key!r} holds values that are not finite. Nothing was written.")
    return {key: np.array(tensor, dtype=tensor.dtype.newbyteorder("<"), order="C") for key, tensor in tensors.items()}


def _plain(name: str, training: Mapping[str, Any]) -> dict[str, Any]:
    """Return the run card as JSON holds it: lists for tuples, and no NaN."""
    try:
        canonical(training)
    except NotCanonical as error:
        raise ModelWritingError(f"{name}: the run card cannot be saved: {error}. Nothing was written.") from None
    plain: dict[str, Any] = json.loads(json.dumps(training))
    return plain


def _require_same(name: str, content: bytes, tensors: Mapping[str, NDArray[Any]], card: Card) -> None:
    """Raise ModelWritingError unless the content to be written reads back as the same tensors and card."""
    read = numbers.load(content)
    same = read.keys() == tensors.keys() and all(
        read[key].dtype == tensor.dtype and np.array_equal(read[key], tensor) for key, tensor in tensors.items()
    )
    if not same or Card.model_validate_json(_text(card), strict=True) != card:
        raise ModelWritingError(f"{name}: it does not read back as it was written. Nothing was written.")


def _renamed(path: Path, numbers_file: str, copy: str) -> bytes | None:
    """Return the earlier card with its tensors in `copy`; None unless it can be read and names `numbers_file`."""
    try:
        earlier = Card.model_validate_json(path.read_bytes(), strict=True)
    except (ValueError, OSError):
        return None
    if earlier.weights.file != numbers_file:
        return None
    return _text(earlier.model_copy(update={"weights": earlier.weights.model_copy(update={"file": copy})}))


def _text(card: Card) -> bytes:
    return (card.model_dump_json(indent=1) + "\n").encode()


class ModelWritingError(ValueError):
    """A model that cannot be written: the message names the model, the fault and what is expected."""


def replace_model(card: Path, text: bytes, content: bytes, renamed: Callable[[str], bytes | None]) -> Path:
    """Write a card's text and the content of its tensors, then move both into place; return the card's path.

    If the write is interrupted, the card in place belongs to the tensors in place, because an earlier card is first
    changed to name a copy of its tensors. `renamed(file)` returns that card with its tensors in `file`; None where no
    readable card is there, or it names such a copy already.

    Raises ModelWritingError for files that do not read back as they were written, and OSError. Both leave the earlier
    model complete.
    """
    numbers = card.with_name(f"{card.stem}{NUMBERS}")
    copy = card.with_name(f"{card.stem}~replaced{NUMBERS}")  # no model can have this name
    files = {numbers.name: content, card.name: text}

    def check(draft: Path) -> None:
        for name, expected in files.items():
            _require_content(draft / name, expected, card.with_name(name))
        _free_numbers(card, numbers, copy, renamed(copy.name))

    with staged_files(card.parent, last=[card.name], check=check) as draft:
        for name, expected in files.items():
            write_bytes(draft / name, expected)
    copy.unlink(missing_ok=True)
    return card


def _free_numbers(card: Path, numbers: Path, copy: Path, renamed: bytes | None) -> None:
    """Copy the earlier tensors and let the earlier card name the copy, so that their own name is free."""
    if renamed is None or not numbers.is_file():
        return
    earlier = numbers.read_bytes()
    try:
        write_bytes(copy, earlier, lambda draft: _require_content(draft, earlier, copy))
        write_bytes(card, renamed, lambda draft: _require_content(draft, renamed, card))
    except BaseException:
        with suppress(OSError):
            if card.read_bytes() != renamed:  # otherwise the card is in place, and only syncing its folder failed
                copy.unlink(missing_ok=True)
        raise


def _require_content(draft: Path, content: bytes, path: Path) -> None:
    if draft.read_bytes() != content:
        raise ModelWritingError(f"{path}: it does not read back as it was written, and was not replaced.")
