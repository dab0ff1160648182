"""Recordings that were captured once, kept in a folder under the SHA-256 of all that decides them."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from palpate.modeling.textures.joined import Joined
from palpate.modeling.textures.recording import Recording
from palpate.protocols.canonical import json_text
from palpate.protocols.code_digest import code_digest
from palpate.protocols.files import file_sha256, open_bytes, write_text


def content_key(*decides: object) -> str:
    """16 hexadecimal digits that change with what decides a recording: what is given, and the code that makes it."""
    told = [code_digest("palpate.modeling.textures.simulated"), *(str(each) for each in decides)]
    return hashlib.sha256(json.dumps(told).encode()).hexdigest()[:16]


def write_cached(stem: Path, recording: Recording) -> Path:
    """Keep a recording: numbers as STEM.npy, the rest with their SHA-256 as STEM.json, which is written last."""
    numbers = stem.with_name(f"{stem.name}.npy")
    with open_bytes(numbers) as file:
        np.save(file, recording.signals, allow_pickle=False)
    told = {name: value for name, value in asdict(recording).items() if name != "signals"}
    about = stem.with_name(f"{stem.name}.json")
    return write_text(about, json_text({**told, "sha256": file_sha256(numbers)}))


def read_cached(stem: Path) -> Recording | None:
    """The recording that is kept there; None where there is none, or one that is not as it was written."""
    about, numbers = stem.with_name(f"{stem.name}.json"), stem.with_name(f"{stem.name}.npy")
    try:
        told = json.loads(about.read_text(encoding="utf-8"))
        if told.pop("sha256") != file_sha256(numbers):
            return None
        signals = np.load(numbers, allow_pickle=False)
        lists = {name: tuple(value) for name, value in told.items() if isinstance(value, list)}
        kind = Joined if "borders" in told else Recording
        return kind(**{**told, **lists, "signals": signals})
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
