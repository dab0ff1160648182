"""A model of attributes as a file: NAME.json, its card, and NAME.safetensors, its numbers. Neither can execute code."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError

from palpate.modeling.attributes.material import MaterialError, Pair, Texture
from palpate.modeling.attributes.methods import Fitted, Method, predictions
from palpate.modeling.files.model_files import NUMBERS, replace_model
from palpate.protocols.canonical import NotCanonical, canonical, digest, json_text, parse
from palpate.protocols.strict import Strict
from palpate.signals.arrays import Array
from palpate.signals.models.card import Interval, Weights, complaint

FORMAT = "palpate-attributes/1"
NAME = "texture-attributes"
AGAIN = "`palpate train attributes` makes it again."
Arrays = Mapping[str, NDArray[Any]]


class ModelFileError(ValueError):
    """A model of attributes that is not there, is damaged or newer, or cannot be saved: the message says which."""


class Saveable(Protocol):
    """A fitted method that can be saved; `Method.restore` gives it back."""

    def predict(self, texture: Texture) -> Array:
        """As every fitted method."""

    def saved(self) -> tuple[Mapping[str, NDArray[Any]], Mapping[str, Any]]:
        """Return its arrays, and plain values."""


class Card(Strict):
    """What stands in the card.

    `attributes` are pairs of adjectives, 0 and 100. `touch` and `sight` are the kinds of features that are looked at,
    `weights` says which weights ResNet-50 had for them. `told` is the method's own. `metrics` are those of leaving one
    texture out; `interval` holds 90 % of new ratings; `learned` are the textures whose ratings the fit was shown: those
    that it was fitted to, and those that it only watched to stop early, which `training` names.
    """

    format: Literal["palpate-attributes/1"] = "palpate-attributes/1"
    name: str
    title: str
    method: str
    attributes: tuple[tuple[str, str], ...] = Field(min_length=1)
    touch: tuple[str, ...] = ()
    sight: tuple[str, ...] = ()
    weights: str = ""
    simulated: bool = False
    told: Mapping[str, Any] = Field(default_factory=dict)
    tensors: Weights
    metrics: Mapping[str, float] = Field(default_factory=dict)
    interval: Interval | None = None
    learned: tuple[Annotated[str, Field(min_length=1)], ...] = ()
    training: Mapping[str, Any] = Field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def quick(self) -> bool:
        """Whether it was trained with --quick, on features that were made in a hurry."""
        configuration = self.training.get("configuration")
        return isinstance(configuration, Mapping) and bool(configuration.get("quick"))


@dataclass(frozen=True)
class AttributeModel:
    """A model that was read: its card, where it lies, and the method as it was fitted."""

    card: Card
    path: Path
    fitted: Fitted

    @property
    def attributes(self) -> tuple[Pair, ...]:
        """What it predicts."""
        return tuple(Pair(low, high) for low, high in self.card.attributes)

    @property
    def half_width(self) -> Array | None:
        """Of its 90 % intervals, (attributes,) on 0..100; None where too few textures calibrated one."""
        return None if self.card.interval is None else np.array(self.card.interval.half_width)

    def predict(self, texture: Texture) -> Array:
        """(n, attributes) on 0..100, not clipped; their mean counts. Raises MaterialError for other features."""
        return self.fitted.predict(texture)

    def predictions(self, textures: Sequence[Texture]) -> list[Array | MaterialError]:
        """Return what `predict` says of each texture, or why it says nothing; together, which networks do faster."""
        return predictions(self.fitted, textures)


def write_model(folder: Path, fitted: Saveable, card: Mapping[str, Any], methods: Mapping[str, Method]) -> Path:
    """Write a model, read it back, and return its card's path. `card` has the fields of `Card` but format and tensors.

    Until the last rename the earlier model is whole. Raises ModelFileError for numbers that are not finite, and for a
    method that does not come back from its file, and what `replace_model` raises.
    """
    from safetensors.numpy import save

    arrays, metadata = fitted.saved()
    name = str(card["name"])
    plain = {key: np.ascontiguousarray(array) for key, array in arrays.items()}
    for key, array in plain.items():
        if not np.isfinite(array).all():
            raise ModelFileError(f"{name}: {key!r} holds numbers that are not finite. Nothing was written.")
    content = save(plain)
    weights = Weights(file=f"{name}{NUMBERS}", sha256=hashlib.sha256(content).hexdigest(), bytes=len(content))
    try:
        written = Card.model_validate(
            {**card, "told": json.loads(canonical(metadata)), "tensors": weights.model_dump()}
        )
        text = _text(written)
    except (ValidationError, NotCanonical) as error:
        why = complaint(error) if isinstance(error, ValidationError) else str(error)
        raise ModelFileError(f"{name}: {why}. Nothing was written.") from None
    path = folder / f"{name}.json"
    _restored(path, written, _loaded(content), methods)
    return replace_model(path, text, content, partial(_renamed, path, weights.file))


def _renamed(path: Path, numbers_file: str, copy: str) -> bytes | None:
    """Return the earlier card, if it can be read and its numbers are in that file, with their copy's name."""
    try:
        earlier = read_card(path)
    except ModelFileError:
        return None
    if earlier.tensors.file != numbers_file:
        return None
    return _text(earlier.model_copy(update={"tensors": earlier.tensors.model_copy(update={"file": copy})}))


def read_model(path: Path, methods: Mapping[str, Method] | None = None) -> AttributeModel:
    """Read a model from its card, or the one of a lab's folder `models`.

    Raises ModelFileError for a file that is missing, newer, foreign, cut short or changed, or an unknown method.
    """
    if path.is_dir():
        path = path / f"{NAME}.json"
    card = read_card(path)
    if Path(card.tensors.file).name != card.tensors.file:
        raise ModelFileError(f"{path}: its numbers are declared at {card.tensors.file!r}; a bare file name expected.")
    file = path.with_name(card.tensors.file)
    try:
        content = file.read_bytes()
    except OSError:
        raise ModelFileError(f"{file}: the numbers of {path.name} are not there. {AGAIN}") from None
    digest = hashlib.sha256(content).hexdigest()
    if digest != card.tensors.sha256:
        raise ModelFileError(f"{file}: SHA-256 {digest[:12]}..., the card says {card.tensors.sha256[:12]}...: damaged. "
                             f"{AGAIN}")  # fmt: skip
    if not methods:
        from palpate.modeling.attributes.registry import METHODS

        methods = METHODS
    return AttributeModel(card, path, _restored(path, card, _loaded(content), methods))


def read_card(path: Path) -> Card:
    """Return the card alone. Raises ModelFileError as `read_model` does for it."""
    try:
        content = parse(path.read_bytes())
    except OSError:
        raise ModelFileError(
            f"{path}: there is no model of attributes. `palpate train attributes` makes one."
        ) from None
    except (ValueError, RecursionError) as error:
        raise ModelFileError(f"{path}: it cannot be read ({error}): cut short or damaged. {AGAIN}") from None
    named = content.get("format") if isinstance(content, dict) else None
    if not isinstance(content, dict) or not isinstance(named, str):
        raise ModelFileError(f"{path}: this is not a model of attributes ({FORMAT} is expected).")
    if named != FORMAT:
        later = named.startswith(FORMAT.rpartition("/")[0] + "/")
        hint = "a later version wrote it: update palpate to use it." if later else f"{FORMAT!r} is expected."
        raise ModelFileError(f"{path}: format {named[:40]!r}; {hint}")
    if content.pop("digest", None) != digest(content):
        raise ModelFileError(
            f"{path}: its content is not what was written (its digest differs): edited or damaged. {AGAIN}"
        )
    try:
        return Card.model_validate_json(json.dumps(content), strict=True)
    except ValidationError as error:
        raise ModelFileError(f"{path}: {complaint(error)}. {AGAIN}") from None


def _restored(path: Path, card: Card, arrays: Arrays, methods: Mapping[str, Method]) -> Fitted:
    """Return the method as it was fitted. Raises ModelFileError where that cannot be."""
    if card.method not in methods:
        raise ModelFileError(f"{path}: method {card.method!r} is not known here: {', '.join(methods)}.")
    restore = methods[card.method].restore
    if restore is None:
        raise ModelFileError(f"{path}: method {card.method!r} cannot be saved as a file. Train another one.")
    try:
        return restore(arrays, card.told)
    except Exception as error:  # numbers that do not fit come out of NumPy's and torch's own checks as anything
        raise ModelFileError(
            f"{path}: {card.method} cannot be made from it ({type(error).__name__}: {error}). {AGAIN}"
        ) from None


def _loaded(content: bytes) -> dict[str, NDArray[Any]]:
    from safetensors import SafetensorError
    from safetensors.numpy import load

    try:
        result: dict[str, NDArray[Any]] = load(content)
    except SafetensorError as error:
        raise ModelFileError(f"these are not tensors: {error}. {AGAIN}") from None
    return result


def _text(card: Card) -> bytes:
    plain = card.model_dump(mode="json")
    return json_text({**plain, "digest": digest(plain)}, indent=1).encode()
