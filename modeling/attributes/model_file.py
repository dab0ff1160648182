"""A model of attributes as files: NAME.json, its card, and NAME.safetensors, its arrays. Neither can execute code."""

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
from palpate.protocols.strict import StrictFinite
from palpate.signals.arrays import Array
from palpate.signals.models.card import Interval, Weights, complaint

FORMAT = "palpate-attributes/1"
NAME = "texture-attributes"
AGAIN = "`palpate train attributes` makes it again."
Arrays = Mapping[str, NDArray[Any]]


class ModelFileError(ValueError):
    """A model of attributes that is missing, damaged or newer, or cannot be saved: the message names the fault."""


class Saveable(Protocol):
    """A fitted method that can be saved; `Method.restore` returns it."""

    def predict(self, texture: Texture) -> Array:
        """Return predictions (n, attributes), as every fitted method does."""

    def saved(self) -> tuple[Mapping[str, NDArray[Any]], Mapping[str, Any]]:
        """Return its arrays, and plain values that JSON holds."""


class Card(StrictFinite):
    """The card of a model.

    `attributes` are pairs of adjectives, for 0 and 100. `touch` and `sight` are the kinds of features, `weights` names
    those of ResNet-50. `told` are the plain values of the method's `saved`. `metrics` are those of leaving one texture
    out; `interval` holds 90 % of new ratings; `learned` are the textures of the fit: those that it was fitted to, and
    those that it watched to stop early, which `training` names.
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
        """Whether it was trained with --quick, on quick features."""
        configuration = self.training.get("configuration")
        return isinstance(configuration, Mapping) and bool(configuration.get("quick"))


@dataclass(frozen=True)
class AttributeModel:
    """A model that was read: its card, the card's path, and the fitted method."""

    card: Card
    path: Path
    fitted: Fitted

    @property
    def attributes(self) -> tuple[Pair, ...]:
        """The attributes that it predicts."""
        return tuple(Pair(low, high) for low, high in self.card.attributes)

    @property
    def half_width(self) -> Array | None:
        """Half the width of its 90 % intervals, (attributes,) on 0..100; None where there were too few textures."""
        return None if self.card.interval is None else np.array(self.card.interval.half_width)

    def predict(self, texture: Texture) -> Array:
        """Return predictions (n, attributes) on 0..100, not clipped; their mean counts.

        Raises MaterialError for features that it was not fitted to.
        """
        return self.fitted.predict(texture)

    def predictions(self, textures: Sequence[Texture]) -> list[Array | MaterialError]:
        """Return for each texture what `predict` returns or raises; computed at once, which is faster for networks."""
        return predictions(self.fitted, textures)


def write_model(folder: Path, fitted: Saveable, card: Mapping[str, Any], methods: Mapping[str, Method]) -> Path:
    """Write a model, read it back, and return its card's path. `card` has the fields of `Card` but format and tensors.

    The earlier model stays complete until the last rename. Raises ModelFileError for numbers that are not finite and
    for a method that cannot be restored from its file, and the errors of `replace_model`.
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
    """Return the earlier card with its tensors in `copy`; None unless it can be read and names `numbers_file`."""
    try:
        earlier = read_card(path)
    except ModelFileError:
        return None
    if earlier.tensors.file != numbers_file:
        return None
    return _text(earlier.model_copy(update={"tensors": earlier.tensors.model_copy(update={"file": copy})}))


def read_model(path: Path, methods: Mapping[str, Method] | None = None) -> AttributeModel:
    """Return the model of a card, or of a folder with texture-attributes.json.

    Raises ModelFileError for a file that is missing, newer, of another format, cut short or changed, and for an unknown
    method.
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
    """Return a card. Raises ModelFileError as `read_model` does for the card."""
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
    """Return the fitted method. Raises ModelFileError where it cannot be restored."""
    if card.method not in methods:
        raise ModelFileError(f"{path}: method {card.method!r} is not known here: {', '.join(methods)}.")
    restore = methods[card.method].restore
    if restore is None:
        raise ModelFileError(f"{path}: method {card.method!r} cannot be saved as a file. Train another one.")
    try:
        return restore(arrays, card.told)
    except Exception as error:  # NumPy and torch raise various errors for arrays that do not fit
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
    """Return the card's file, with a digest of its content."""
    plain = card.model_dump(mode="json")
    return json_text({**plain, "digest": digest(plain)}, indent=1).encode()
