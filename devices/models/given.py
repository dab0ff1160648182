"""What a model is asked about: profiles from files, and wishes as NAME=VALUE."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from palpate.protocols.did_you_mean import nearest
from palpate.signals.arrays import Array
from palpate.signals.models.card import Port
from palpate.signals.models.errors import ModelInputError

NEUTRAL = 50.0
"""An attribute that nothing is wished for (thesis 5.7.1)."""
TOP = 100.0


def profile_of(path: Path, recording: bool, zero: bool) -> Array:
    """The 621 forces of a profile file; with `recording`, of a recording that is normalised first.

    Raises DoorDataError naming file and line.
    """
    from palpate.devices.door.recording import read_columns
    from palpate.signals.doors.grid import DoorDataError
    from palpate.signals.doors.profile_file import HEADER, read_profile
    from palpate.signals.doors.profiles import normalise

    if not recording:
        try:
            return np.array(read_profile(path))
        except DoorDataError as error:
            raise DoorDataError(f"{error} Or let a raw recording be normalised with --recording.") from None
    columns = read_columns(path, HEADER)
    try:
        return normalise(columns["angle_deg"], columns["force_N"], zero=zero).force_N
    except DoorDataError as error:
        raise DoorDataError(f"{path}: {error}") from None


def wish_of(given: Sequence[str], port: Port) -> Array:
    """The wished ratings in the model's order, 0..100; 50 for an attribute that is not named.

    Raises ModelInputError: no NAME=VALUE, an unknown name, one that stands twice, or a value that is not 0 to 100.
    """
    wished: dict[str, float] = {}
    for text in given:
        name, sign, value = text.partition("=")
        name = name.strip()
        if not sign:
            raise ModelInputError(f"{text!r}: NAME=VALUE is expected, as {_example(port)}.")
        if name not in port.names:
            raise ModelInputError(f"{text!r}: {_unknown(name, port)}")
        if name in wished:
            raise ModelInputError(f"{name} is wished twice.")
        wished[name] = _value(text, value)
    return np.array([wished.get(name, NEUTRAL) for name in port.names])


def _value(text: str, value: str) -> float:
    try:
        number = float(value)
    except ValueError:
        number = np.nan
    if not 0 <= number <= TOP:
        raise ModelInputError(f"{text!r}: a number from 0 (the attribute's own word) to 100 (its antonym) is expected.")
    return number


def _unknown(name: str, port: Port) -> str:
    pairs = dict(zip(port.antonyms, port.names, strict=True)) if port.antonyms else {}
    if name in pairs:
        return f"{name} is the other end of {pairs[name]}: 0 is {pairs[name]}, 100 is {name}."
    return f"no attribute {name!r}; {nearest(name, port.names)}"


def _example(port: Port) -> str:
    return f"{port.names[0]}=20" if port.names else "Damped=20"
