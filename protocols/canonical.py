"""Canonical JSON, one text for each value, and digests of it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from typing import Any

Json = Any  # None | bool | int | float | str | list[Json] | tuple[Json, ...] | Mapping[str, Json]


class NotCanonical(ValueError):
    """A value without a canonical text: a key that is not text, a number that is not finite, a foreign type."""


def canonical(value: Json) -> bytes:
    """Return the value's unique UTF-8 JSON text: keys sorted by code point, no spaces, shortest floats, no NaN.

    The text is equal on every machine and Python version. Raises NotCanonical that names the place ($.a[2]).
    """
    try:
        return encoded(value if _is_plain(value) else _plain(value, "$"))
    except UnicodeEncodeError as error:
        raise NotCanonical(f"a text holds half a character (lone surrogate): {error.object!r:.60}") from None


def encoded(value: Json) -> bytes:
    """Return the canonical text of a value whose types are known to be JSON's own, as after parsing."""
    return _text_of(value).encode("utf-8")


def json_text(value: Json, indent: int | None = None, *, sort_keys: bool = False) -> str:
    """Return the value as JSON for people and files, ending with a newline.

    Raises NotCanonical where a number is not finite.
    """
    try:
        return json.dumps(value, indent=indent, sort_keys=sort_keys, ensure_ascii=False, allow_nan=False) + "\n"
    except ValueError:
        _plain(value, "$")
        raise


def digest(value: Json) -> str:
    """Return the SHA-256 of the canonical text, in hexadecimal."""
    return hashlib.sha256(canonical(value)).hexdigest()


def parse(text: bytes) -> Json:
    """Return the value of a canonical text. Raises NotCanonical for NaN, Infinity and repeated keys."""
    return _DECODER.decode(text.decode("utf-8"))


def difference(recorded: Json, now: Json, place: str = "$") -> str | None:
    """Return the first place where two values differ, and how; None if their texts are the same."""
    if isinstance(recorded, Mapping) and isinstance(now, Mapping):
        return _mapping_difference(recorded, now, place)
    if isinstance(recorded, list | tuple) and isinstance(now, list | tuple):
        return _list_difference(recorded, now, place)
    if canonical(recorded) == canonical(now):
        return None
    return f"{place}: recorded {_short(recorded)}, now {_short(now)}"


def _mapping_difference(recorded: Mapping[str, Json], now: Mapping[str, Json], place: str) -> str | None:
    for key in sorted({*recorded, *now}):
        inner = f"{place}.{key}"
        if key not in now:
            return f"{inner}: recorded {_short(recorded[key])}, now missing"
        if key not in recorded:
            return f"{inner}: not recorded, now {_short(now[key])}"
        if text := difference(recorded[key], now[key], inner):
            return text
    return None


def _list_difference(recorded: Json, now: Json, place: str) -> str | None:
    for index, (old, new) in enumerate(zip(recorded, now, strict=False)):
        if text := difference(old, new, f"{place}[{index}]"):
            return text
    if len(recorded) != len(now):
        return f"{place}: recorded {len(recorded)} items, now {len(now)}"
    return None


def _is_plain(value: Json) -> bool:
    """Return whether the value consists of finite numbers, texts, lists, tuples and dicts, so that it needs no copy."""
    waiting = [value]
    for item in waiting:  # grows while it is read: no recursion
        kind = type(item)
        if kind is dict:
            if not _TEXT.issuperset(map(type, item)):
                return False
            if not _SCALARS.issuperset(map(type, item.values())):
                waiting.extend(item.values())
        elif kind is list or kind is tuple:
            if not _SCALARS.issuperset(map(type, item)):
                waiting.extend(item)
        elif kind is float:
            if item - item != 0:
                return False
        elif kind not in _SCALARS:
            return False
    return True


def _plain(value: Json, place: str) -> Json:
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise NotCanonical(f"{place}: the key {key!r} is not text")
        return {key: _plain(inner, f"{place}.{key}") for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner, f"{place}[{index}]") for index, inner in enumerate(value)]
    if value is None or type(value) in (bool, int, str):
        return value
    if type(value) is float:
        if value - value != 0:
            raise NotCanonical(f"{place}: {value} is not a finite number")
        return value
    raise NotCanonical(f"{place}: {type(value).__name__} {value!r:.60} has no JSON form")


def _refuse_constant(name: str) -> Json:
    raise NotCanonical(f"{name} is not a finite number")


def _without_repeats(pairs: list[tuple[str, Json]]) -> dict[str, Json]:
    unique = dict(pairs)
    if len(unique) != len(pairs):
        raise NotCanonical("a key appears twice in one object")
    return unique


def _short(value: Json) -> str:
    text = canonical(value).decode()
    return text if len(text) <= 80 else f"{text[:77]}..."


def _writer() -> Callable[[Json], str]:
    """Return a function that writes the text of a value.

    `JSONEncoder.encode` creates CPython's encoder for every value, which takes longer than a short value does: here it
    is created once.
    """
    encoder = json.JSONEncoder(sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    build = getattr(json.encoder, "c_make_encoder", None)
    if build is None:  # an interpreter other than CPython
        return encoder.encode
    text_parts = build(None, encoder.default, json.encoder.encode_basestring, None, ":", ",", True, False, False)
    return lambda value: "".join(text_parts(value, 0))


_text_of = _writer()
_DECODER = json.JSONDecoder(parse_constant=_refuse_constant, object_pairs_hook=_without_repeats)
_TEXT = frozenset({str})
_SCALARS = frozenset({str, int, bool, type(None)})
