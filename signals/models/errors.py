"""Errors of a model's files, and of its inputs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class ModelFileError(ValueError):
    """A model that cannot be used; the message says which file, what was found, what is expected and what to do."""


class ModelInputError(ValueError):
    """An input that a model cannot answer, or an answer that is not finite."""


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn an OSError within the block into a ModelFileError that names the file."""
    try:
        yield
    except OSError as error:
        raise ModelFileError(f"{path}: cannot be read ({error.strerror}).") from None


@contextmanager
def in_file(path: Path) -> Iterator[None]:
    """Put the name of the file before the message of a ModelInputError within the block."""
    try:
        yield
    except ModelInputError as error:
        raise ModelInputError(f"{path}: {error}") from None
