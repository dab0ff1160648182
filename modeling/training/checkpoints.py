"""Trainings kept on disk: tensors in a safetensors file, the rest in a JSON file that names the tensors' SHA-256.

The JSON file is written last and renamed into its place, so that a checkpoint is there as a whole or not at all;
the one before it stays until the next. Nothing in either can execute code.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor

from palpate.modeling.training.refusals import CheckpointError
from palpate.protocols.canonical import canonical, digest, parse
from palpate.protocols.files import UNFINISHED, write_bytes
from palpate.protocols.progress import Report

FORMAT = "palpate checkpoint 1"
KEEP = 2


@dataclass(frozen=True)
class Kept:
    """A checkpoint: the epoch that it ends, its tensors, and its plain values."""

    epoch: int
    tensors: Mapping[str, Tensor]
    plain: Mapping[str, Any]


def write_checkpoint(folder: Path, kept: Kept) -> None:
    """Write it beside the last one, and remove what is older than that one, or damaged and passed over."""
    name = f"epoch-{kept.epoch:06d}"
    tensors = save(dict(kept.tensors))
    write_bytes(folder / f"{name}.safetensors", tensors)
    plain = {**kept.plain, "format": FORMAT, "epoch": kept.epoch, "tensors": hashlib.sha256(tensors).hexdigest()}
    write_bytes(folder / f"{name}.json", canonical({**plain, "digest": digest(plain)}))
    _remove_others(folder, name)


def read_latest(folder: Path, report: Report) -> Kept | None:
    """The newest whole checkpoint, or None; a damaged one is reported, and the one before it is taken."""
    for path in _newest_first(folder):
        try:
            return read_checkpoint(path)
        except CheckpointError as error:
            report(f"{error} The one before it is used, or the training begins anew.")
    return None


def read_checkpoint(path: Path) -> Kept:
    """The checkpoint of this JSON file. Raises CheckpointError where it or its tensors are not as they were written."""
    try:
        plain = parse(path.read_bytes())
        if plain["format"] != FORMAT or plain.pop("digest") != digest(plain):
            raise ValueError("its text was changed, or it is of another format")
        data = path.with_suffix(".safetensors").read_bytes()
        if hashlib.sha256(data).hexdigest() != plain["tensors"]:
            raise ValueError("its tensors are not those that were written")
        return Kept(plain["epoch"], load(data), plain)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, SafetensorError) as error:
        raise CheckpointError(f"checkpoint {path} is damaged: {error}.") from error


def _newest_first(folder: Path) -> Iterator[Path]:
    return iter(sorted(folder.glob("epoch-*.json"), reverse=True))


def _remove_others(folder: Path, newest: str) -> None:
    """Keep the newest and the one before it.

    One with a later name is damaged, or the training would have gone on from there. The JSON file goes
    first: without it its tensors are nobody's.
    """
    keep = {path.stem for path in [path for path in _newest_first(folder) if path.stem <= newest][:KEEP]}
    for path in sorted(folder.glob("epoch-*.*")):
        if path.stem not in keep:
            path.unlink(missing_ok=True)
    for path in folder.glob(f"{UNFINISHED}*"):
        path.unlink(missing_ok=True)
