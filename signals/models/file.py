"""Read a trained model: the card, the numbers beside it, and the checks that both fit together."""

from __future__ import annotations

from pathlib import Path

from pydantic import ValidationError

from palpate.protocols.canonical import canonical, parse
from palpate.signals.models.card import FORMAT, Card, complaint
from palpate.signals.models.errors import ModelFileError, reading
from palpate.signals.models.runtime import Model
from palpate.signals.models.tensors import read_tensors

__all__ = ["CARD_SUFFIX", "Model", "ModelFileError", "read_card", "read_model"]

CARD_SUFFIX = ".json"
HATT_SUFFIX = ".xml"
LARGEST_CARD = 8 * 1024**2
"""Greatest size of a card in bytes; the numbers are in the other file."""
CODE = {".pt", ".pth", ".pkl", ".pickle", ".joblib", ".onnx", ".h5", ".hdf5", ".keras", ".pb", ".npy", ".npz", ".ckpt"}
"""Endings of model files of other programs, some of which run code when they are opened."""
FAMILY = FORMAT.rpartition("/")[0]


def read_model(card: Path | str) -> Model:
    """Read a model from its card, NAME.json, and the weights that the card names beside it.

    Everything is checked once, here: a model that was read answers every finite input of the right size. A texture of
    the Penn Haptic Texture Toolkit, `Models_NAME.xml`, is read as a model too (signals/models/hatt.py).

    Raises:
        ModelFileError: a file that is missing, foreign, newer, truncated or changed, or whose steps do not fit.
    """
    path = Path(card)
    if path.suffix.lower() == HATT_SUFFIX:
        from palpate.signals.models.hatt import read_hatt

        return read_hatt(path)
    described = read_card(path)
    tensors = read_tensors(path, described)
    try:
        return Model(described, tensors)
    except ModelFileError as error:
        raise ModelFileError(f"{path}: {error}") from None


def read_card(path: Path | str) -> Card:
    """Read a card without its weights. Raises ModelFileError as `read_model` does."""
    path = Path(path)
    with reading(path):
        if path.suffix.lower() in CODE:
            raise ModelFileError(
                f"{path}: {path.suffix} files are not opened: they may run code or need another program. "
                f"A model here is a card, NAME{CARD_SUFFIX}, with NAME.safetensors beside it: "
                "`palpate train` writes both."
            )
        if path.suffix == ".safetensors":
            raise ModelFileError(f"{path}: these are a model's numbers; give its card, {path.stem}{CARD_SUFFIX}.")
        if not path.is_file():
            raise ModelFileError(
                f"{path}: there is no such file. A model is given by its name or as its card, NAME{CARD_SUFFIX}; "
                "`palpate models list` shows those there are."
            )
        if (size := path.stat().st_size) > LARGEST_CARD:
            raise ModelFileError(f"{path}: {size} bytes; a model's card has at most {LARGEST_CARD}.")
        content = path.read_bytes()
    try:
        document = parse(content)
        canonical(document)  # a number such as 1e999 is infinite only once it is read
    except (ValueError, RecursionError) as error:
        raise ModelFileError(f"{path}: not a model's card: {error}. A card is a JSON text file.") from None
    stated = document.get("format") if isinstance(document, dict) else None
    if stated != FORMAT and isinstance(stated, str) and stated.startswith(f"{FAMILY}/"):
        raise ModelFileError(f"{path}: format {stated!r}; this version reads {FORMAT!r}. Update palpate to use it.")
    if stated != FORMAT:
        was = "no format is named" if stated is None else f"format {str(stated)[:40]!r}"
        raise ModelFileError(f"{path}: not a model's card: {was}, {FORMAT!r} is expected.")
    try:
        return Card.model_validate_json(content, strict=True)
    except ValidationError as error:
        raise ModelFileError(f"{path}: {complaint(error)}. Export the model again, or repair the card.") from None
