"""Models for shipping: weights in half precision, half the bytes. `python -m tools.half_precision FROM TO`.

No difference can be felt: its answers change by less than a thousandth of their SD (measured in
docs/reference/texture-rivals.md). Line spectral frequencies would move by a milliradian, so numbers in double precision
are kept.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from safetensors.numpy import load_file

from palpate.modeling.files.model_files import Exported, write_model
from palpate.signals.models.card import Card

NOTE = "judged in single precision, shipped in half"
WRITTEN_ANEW = {"format", "name", "steps", "weights", "notes"}
"""The fields of a card that are not copied as they are."""


def halve(card: Path, folder: Path) -> Path:
    """Write the model into a folder, with its single-precision numbers in half precision; return its card's path.

    Raises ModelWritingError for a number that half precision cannot hold.
    """
    known = Card.model_validate_json(card.read_bytes(), strict=True)
    tensors = {
        name: tensor.astype(np.float16) if tensor.dtype == np.float32 else tensor
        for name, tensor in load_file(card.with_name(known.weights.file)).items()
    }
    changed = any(tensor.dtype == np.float16 for tensor in tensors.values())
    notes = (*known.notes, *((NOTE,) if changed else ()))
    described = {name: getattr(known, name) for name in Card.model_fields.keys() - WRITTEN_ANEW}
    return write_model(folder, known.name, Exported(known.steps, tensors), **described, notes=notes)


def main(source: Path, folder: Path) -> None:
    """Convert every model of a folder."""
    for card in sorted(source.glob("*.json")):
        halve(card, folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
