"""Errors of a model's files, and of its inputs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class ModelFileError(ValueError):
    """A model that is not used: the message says which file, what was found, what is expected and what to do."""


class ModelInputError(ValueError):
    """Numbers that a model cannot answer, or an answer that is none."""


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Yield a file that the system does not let us read is a model that is not used."""
    try:
        yield
    except OSError as error:
        raise ModelFileError(f"{path}: cannot be read ({error.strerror}).") from None


@contextmanager
def in_file(path: Path) -> Iterator[None]:
    """Yield numbers that a model cannot answer came from this file."""
    try:
        yield
    except ModelInputError as error:
        raise ModelInputError(f"{path}: {error}") from None
