"""Names of parts that do not come with Palpate, what a ledger says of their extension, and who looks for them.

A name with a dot, as `acme.grip`, is the part `grip` of the extension `acme`. No built-in name has a dot, so that none
can be replaced. Nothing is looked for here: `palpate.studies.extensions` does that, in a lab and among the installed
packages, and is handed in by `use`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol, TypeVar

PARTS = ("tasks", "forms", "needs", "procedures", "devices", "participants", "tests", "figures")
"""The kinds of parts that an extension can bring; an entry point's group is `palpate.` and one of them."""
_NAME = re.compile(r"[a-z][a-z0-9_]*\.[a-z][a-z0-9_]*")


class ExtensionError(ValueError):
    """An extension is missing, broken or has no such part; the message says what to do."""


class MissingExtension(ExtensionError):
    """An extension is not here at all."""


@dataclass(frozen=True)
class Extension:
    """What an extension is known by: its name, its version and the SHA-256 of its files.

    `package` is the distribution that it was installed with; None if it lies in the lab's folder.
    """

    name: str
    version: str
    sha256: str
    package: str | None = None

    def definition(self) -> dict[str, str]:
        """Return what a ledger stores of the extension beside its name."""
        package = {} if self.package is None else {"package": self.package}
        return {"version": self.version, "sha256": self.sha256, **package}

    def __str__(self) -> str:
        return described(self.name, self.definition())


def described(name: str, definition: Mapping[str, str]) -> str:
    """Return an extension in words, from what a ledger stores of it."""
    return f"{name} {definition['version']} (SHA-256 {definition['sha256'][:12]})"


class Finder(Protocol):
    """What looks for extensions. Nothing is imported before it is asked for by name."""

    def load(self, extension: str) -> Extension:
        """Return the extension, imported. Raises ExtensionError."""

    def part(self, kind: str, name: str) -> Any:
        """Return a part of an extension by its whole name. Raises ExtensionError."""

    def parts(self, kind: str) -> Mapping[str, Any]:
        """Return all parts of a kind that the extensions which are loaded by now have."""


AnyFinder = TypeVar("AnyFinder", bound=Finder)


class _Nowhere:
    """A finder that finds nothing."""

    def load(self, extension: str) -> Extension:
        raise ExtensionError(f"the extension {extension!r} is named, and no lab is open in which to look for it")

    def part(self, _kind: str, name: str) -> Any:
        return self.load(extension_of(name))

    def parts(self, _kind: str) -> Mapping[str, Any]:
        return {}


@dataclass
class Lazily:
    """A finder in a lab's folder that is imported and made once an extension is named: most studies name none.

    `place` ("module:NAME") is the class of the finder, made with the folder. Another process makes its own.
    """

    place: str
    lab: Path
    made: Finder | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        return Lazily, (self.place, self.lab)

    def load(self, extension: str) -> Extension:
        """Return the extension, imported. Raises ExtensionError."""
        return self._finder().load(extension)

    def part(self, kind: str, name: str) -> Any:
        """Return a part of an extension by its whole name. Raises ExtensionError."""
        return self._finder().part(kind, name)

    def parts(self, kind: str) -> Mapping[str, Any]:
        """Return all parts of a kind that the extensions which are loaded by now have."""
        return {} if self.made is None else self.made.parts(kind)

    def _finder(self) -> Finder:
        if self.made is None:
            module, _, name = self.place.partition(":")
            self.made = getattr(import_module(module), name)(self.lab)
        return self.made


@dataclass
class _Place:
    """The finder of this process, like `sys.path`: every part of the program sees the same extensions."""

    finder: Finder = field(default_factory=_Nowhere)


_PLACE = _Place()


def use(finder: Finder) -> Finder:
    """Let this finder look for extensions from now on; return the one before it."""
    before, _PLACE.finder = _PLACE.finder, finder
    return before


@contextmanager
def used(finder: AnyFinder) -> Iterator[AnyFinder]:
    """Let this finder look for extensions within the block."""
    before = use(finder)
    try:
        yield finder
    finally:
        use(before)


def finder() -> Finder:
    """Return what looks for extensions."""
    return _PLACE.finder


def is_own(name: object) -> bool:
    """Return whether this is the name of a part of an extension."""
    return isinstance(name, str) and _NAME.fullmatch(name) is not None


def extension_of(name: str) -> str:
    """Return the name of the extension that a part belongs to."""
    return name.partition(".")[0]


def extensions_in(names: Iterable[object]) -> tuple[str, ...]:
    """Return the extensions of those names that are parts of any, each once, in alphabetical order."""
    return tuple(sorted({extension_of(name) for name in names if isinstance(name, str) and is_own(name)}))
