"""Extensions of a lab: files in LAB/extensions, and installed packages with entry points for their parts.

A file `LAB/extensions/acme.py`, or a folder `LAB/extensions/acme/` with an `__init__.py`, is the extension `acme`. Its
parts are in mappings by the kind in capitals, as `TASKS = {"grip": TASK}` for `acme.grip`. It is imported as
`lab_extensions.acme`, and only if lab.yaml says `extensions: true`, as it is code. A package has an entry point for
each part, whose name is the whole name: `[project.entry-points."palpate.tasks"]`, `"acme.grip" = "acme_touch:GRIP"`.
"""

from __future__ import annotations

import ast
import sys
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module, invalidate_caches, metadata
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

from palpate.protocols.canonical import digest
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.extensions import PARTS, Extension, ExtensionError, MissingExtension, extension_of, is_own
from palpate.protocols.files import file_sha256
from palpate.studies.lab import SETTINGS, settings

FOLDER = "extensions"
"""The folder of a lab with its own extensions."""
PACKAGE = "lab_extensions"
"""The name under which the modules of that folder are imported."""
GROUP = "palpate" + "."
"""What the groups of entry points begin with: one group for each kind of part."""
NO_VERSION = "0"


@dataclass(frozen=True)
class Found:
    """An extension before it is imported: its name, its file or folder, and how each of its parts is loaded.

    `entries` are the entry points of an installed package by kind and by the part's whole name; a lab's file has none.
    """

    name: str
    path: Path | None
    entries: Mapping[str, Mapping[str, metadata.EntryPoint]] = field(default_factory=dict)

    @property
    def distribution(self) -> metadata.Distribution | None:
        """Return the installed distribution; None for a lab's file."""
        return next((entry.dist for kind in self.entries.values() for entry in kind.values()), None)

    @property
    def where(self) -> str:
        """Return where it lies, for messages."""
        dist = self.distribution
        return str(self.path) if dist is None else f"the package {dist.name} {dist.version}"

    @property
    def sources(self) -> list[Path]:
        """Return its files and folders. Raises ExtensionError for a module without a file."""
        if self.path is not None:
            return [self.path]
        modules = {entry.module.partition(".")[0] for kind in self.entries.values() for entry in kind.values()}
        return [_source(module) for module in sorted(modules)]

    @property
    def sha256(self) -> str:
        """Return the SHA-256 of its files."""
        return _sha256(self.sources)


@dataclass(frozen=True)
class Loaded:
    """An extension that was imported, with its parts by kind and by whole name."""

    extension: Extension
    parts: Mapping[str, Mapping[str, Any]]


@dataclass
class LabExtensions:
    """A finder of the extensions in a lab's folder and among the installed packages."""

    lab: Path
    loaded: dict[str, Loaded] = field(default_factory=dict)

    @property
    def allowed(self) -> bool:
        """Return whether the lab lets code in its folder be imported."""
        return settings(self.lab).extensions

    @cached_property
    def all_found(self) -> tuple[Found, ...]:
        """Return all extensions, without importing them; two may have one name."""
        return (*_installed(), *_in_folder(self.lab / FOLDER))

    def find(self, name: str) -> Found:
        """Return an extension by its name, without importing it.

        Raises MissingExtension if there is none, ExtensionError if there are two of this name.
        """
        named = [found for found in self.all_found if found.name == name]
        if not named:
            known = [found.name for found in self.all_found]
            near = f" ({nearest(name, known)})" if known else ""
            raise MissingExtension(
                f"the extension {name!r} is not here{near}: install the package that brings it, or put {name}.py into "
                f"{self.lab / FOLDER}"
            )
        if len(named) > 1:
            one, other, *_ = named
            raise ExtensionError(f"the extension {name!r} is there twice: {one.where} and {other.where}; rename one")
        return named[0]

    def load(self, extension: str) -> Extension:
        """Return the extension, imported. Raises ExtensionError."""
        return self._loaded(extension).extension

    def part(self, kind: str, name: str) -> Any:
        """Return a part by its whole name. Raises ExtensionError."""
        loaded = self._loaded(extension_of(name))
        parts = loaded.parts.get(kind, {})
        if name not in parts:
            raise ExtensionError(f"{loaded.extension} has no {name!r} among its {kind}; {nearest(name, parts)}")
        return parts[name]

    def parts(self, kind: str) -> Mapping[str, Any]:
        """Return all parts of a kind of the extensions that were loaded."""
        return {name: part for loaded in self.loaded.values() for name, part in loaded.parts.get(kind, {}).items()}

    def _loaded(self, name: str) -> Loaded:
        if name not in self.loaded:
            self.loaded[name] = self._import(name)
        return self.loaded[name]

    def _import(self, name: str) -> Loaded:
        found = self.find(name)
        dist = found.distribution
        if dist is not None:
            with _named_errors(found):
                parts = {k: {n: entry.load() for n, entry in of.items()} for k, of in found.entries.items()}
            extension = Extension(name, dist.version, found.sha256, dist.name)
        else:
            if not self.allowed:
                raise ExtensionError(
                    f"the extension {name!r} is code in {found.where}, which this lab does not allow; if you trust it, "
                    f"write `extensions: true` into {self.lab / SETTINGS}"
                )
            sha256 = found.sha256
            with _named_errors(found):
                module = _module_of_lab(self.lab, name)
                parts = {k: {f"{name}.{n}": part for n, part in _mapping(module, k).items()} for k in PARTS}
            extension = Extension(name, str(getattr(module, "VERSION", NO_VERSION)), sha256)
        return Loaded(extension, parts)


def _installed() -> Iterator[Found]:
    """Yield the extensions of installed packages: those of one name come from one distribution."""
    entries: dict[tuple[str, str], dict[str, dict[str, metadata.EntryPoint]]] = {}
    for kind in PARTS:
        for entry in metadata.entry_points(group=GROUP + kind):
            if entry.dist is not None and is_own(entry.name):
                key = (extension_of(entry.name), entry.dist.name)
                entries.setdefault(key, {}).setdefault(kind, {})[entry.name] = entry
    for (name, _), of_kinds in sorted(entries.items()):
        yield Found(name, None, of_kinds)


def _in_folder(folder: Path) -> Iterator[Found]:
    """Yield the extensions in a lab's folder."""
    for path in sorted(folder.iterdir()) if folder.is_dir() else ():
        name = path.stem if path.suffix == ".py" else path.name
        if is_own(f"{name}.x") and (path.suffix == ".py" or (path / "__init__.py").is_file()):
            yield Found(name, path)


def parts_declared(found: Found) -> Mapping[str, tuple[str, ...]]:
    """Return the names of an extension's parts by kind, without importing it.

    Those of a lab's file are known if its mappings are written out: `TASKS = {"grip": ...}`.
    """
    if found.path is None:
        return {kind: tuple(of) for kind, of in found.entries.items()}
    file = found.path if found.path.is_file() else found.path / "__init__.py"
    declared: dict[str, tuple[str, ...]] = {}
    for node in ast.parse(file.read_bytes(), str(file)).body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        value = getattr(node, "value", None)
        for target in targets:
            if isinstance(target, ast.Name) and target.id.lower() in PARTS and isinstance(value, ast.Dict):
                keys = (str(key.value) for key in value.keys if isinstance(key, ast.Constant))
                declared[target.id.lower()] = tuple(f"{found.name}.{key}" for key in keys)
    return declared


def _module_of_lab(lab: Path, name: str) -> ModuleType:
    """Import a module of LAB/extensions as `lab_extensions.NAME`; those of another lab are forgotten."""
    folder = str((lab / FOLDER).resolve())
    package = sys.modules.get(PACKAGE)
    if package is None or list(package.__path__) != [folder]:
        forget_lab_modules()
        package = ModuleType(PACKAGE)
        package.__path__ = [folder]
        sys.modules[PACKAGE] = package
    invalidate_caches()
    before, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        return import_module(f"{PACKAGE}.{name}")
    finally:
        sys.dont_write_bytecode = before


def forget_lab_modules() -> None:
    """Forget all modules of a lab's extensions, so that they are imported anew."""
    for module in [name for name in sys.modules if name.partition(".")[0] == PACKAGE]:
        del sys.modules[module]


def _mapping(module: ModuleType, kind: str) -> Mapping[str, Any]:
    given = getattr(module, kind.upper(), {})
    if not isinstance(given, Mapping) or not all(is_own(f"x.{name}") for name in given):
        raise TypeError(f"{kind.upper()} is {given!r:.80}; a mapping of parts by names of a-z, 0-9 and _ is expected")
    return given


@contextmanager
def _named_errors(found: Found) -> Iterator[None]:
    """Say of any error in an extension's code which extension it was, where, and what."""
    try:
        yield
    except ExtensionError:
        raise
    except Exception as error:
        folder = str(found.path.resolve() if found.path is not None else "")
        frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename.startswith(folder)]
        line = f"{frames[-1].filename} line {frames[-1].lineno}: " if frames and folder else ""
        if isinstance(error, SyntaxError):
            line = f"{error.filename!s} line {error.lineno}: "
        raise ExtensionError(
            f"the extension {found.name!r} ({found.where}) cannot be imported: {line}{type(error).__name__}: {error}"
        ) from error


def _source(module: str) -> Path:
    """Return the file of a module, or the folder of a package."""
    spec = find_spec(module)
    if spec is None or spec.origin is None:
        raise ExtensionError(f"{module}: a module with a file is expected")
    return Path(spec.origin).parent if spec.submodule_search_locations else Path(spec.origin)


def _sha256(places: list[Path]) -> str:
    """Return the SHA-256 of all files at these places, by their names; compiled files do not count."""
    files: dict[str, str] = {}
    for place in places:
        inside = [place] if place.is_file() else [path for path in place.rglob("*") if path.is_file()]
        for path in inside:
            if "__pycache__" not in path.parts and path.suffix != ".pyc":
                files[path.relative_to(place.parent).as_posix()] = file_sha256(path)
    return digest(files)
