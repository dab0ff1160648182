"""Digests of the code that determines a result, so that a result of other code is never taken for a current one."""

from __future__ import annotations

import ast
import hashlib
import re
from collections.abc import Iterable, Iterator
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = tuple(f"palpate.{room}" for room in ("protocols", "signals", "devices", "studies", "analysis", "modeling"))
BESIDE = (".c", ".cal", ".csv", ".dat", ".h", ".json", ".yaml")
"""Suffixes of files in a module's folder that the module may read."""
_NAMED = re.compile(rf"((?:{'|'.join(map(re.escape, PACKAGES))})(?:\.\w+)+)(\.\*)?(?::\w+)?")


@cache
def code_digest(*modules: str, files: tuple[str, ...] = (), registries: bool = False) -> str:
    """Return the SHA-256 of modules, all their imports within this program, and tables and C sources beside them.

    Imports inside functions count, imports for type checkers alone do not. With `registries`, modules that are named in
    strings ("module", "module:name" or "package.*") are followed too. `files` are further files, by their paths from
    the program's root. Computed once per process. Raises LookupError for a module or file that is missing.
    """
    paths = {path for name in imported_by(*modules, registries=registries) for path in _with_tables(_source(name))}
    return files_digest([*sorted(paths), *(ROOT / file for file in files)])


def files_digest(paths: Iterable[Path]) -> str:
    """Return the SHA-256 of files in the given order: their contents, and their paths from the program's root.

    Raises LookupError for a file that does not exist: a digest that leaves it out would never change again.
    """
    digest = hashlib.sha256()
    for path in paths:
        if not path.is_file():
            raise LookupError(f"{path}: no such file; a digest of the program's code needs it. Was it renamed?")
        name = path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else path.name
        digest.update(name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def sources_in(folder: Path) -> list[Path]:
    """Return all Python files in a folder and below. Raises LookupError where there are none."""
    if sources := sorted(folder.rglob("*.py")):
        return sources
    raise LookupError(f"{folder}: no such folder of sources; a digest of the program's code needs it. Was it renamed?")


def module_of(call: Any) -> str:
    """Return the name of the module in which a function or callable object is defined."""
    while isinstance(call, partial):
        call = call.func
    return str(getattr(call, "__module__", "") or type(call).__module__)


def imported_by(*modules: str, registries: bool = False) -> frozenset[str]:
    """Return the modules and everything that they import of this program, directly or not; see `code_digest`.

    For a module outside this program, such as a lab's own, its imports from its own package count too. Raises
    LookupError for a module that does not exist.
    """
    own = frozenset((*PACKAGES, *(_top(module) for module in modules)))
    todo, seen = list(modules), set[str]()
    while todo:
        name = todo.pop()
        if name in seen:
            continue
        seen.add(name)
        todo += [other for other in _imports(name, own, registries) if other not in seen]
        todo += [name.rpartition(".")[0]] if name != _top(name) else []
    return frozenset(seen)


@cache
def _imports(importer: str, own: frozenset[str], registries: bool) -> tuple[str, ...]:
    path = _source(importer)
    package = [*importer.split("."), *([""] if path.stem == "__init__" else [])]
    imported: list[str] = []
    for node in _executed(ast.parse(path.read_text(encoding="utf-8")), registries):
        match node:
            case ast.Import(names=names):
                imported += [name.name for name in names if _top(name.name) in own]
            case ast.ImportFrom(names=names, level=level):
                above = package[: len(package) - level] if level else []
                module = ".".join([*above, *filter(None, [node.module])])
                if _top(module) not in own:
                    continue
                inside = [f"{module}.{name.name}" for name in names]
                imported += [module, *(name for name in inside if _path(name) is not None)]
            case ast.Constant(value=str(text)) if registries and (named := _NAMED.fullmatch(text)):
                if (file := _path(named[1])) is not None:
                    inside = [f"{named[1]}.{part.stem}" for part in file.parent.glob("*.py")] if named[2] else []
                    imported += [named[1], *(name for name in sorted(inside) if not name.endswith(".__init__"))]
    return tuple(dict.fromkeys(imported))


def _executed(tree: ast.AST, expressions: bool) -> Iterator[ast.AST]:
    """Yield a tree's nodes except those under `if TYPE_CHECKING:`; without `expressions`, no expressions."""
    todo = [tree]
    while todo:
        for child in ast.iter_child_nodes(todo.pop()):
            if isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING":
                continue
            if expressions or not isinstance(child, ast.expr):
                yield child
                todo.append(child)


def _top(module: str) -> str:
    """Return the package that the module belongs to: `palpate.protocols`, or the first name of another program's."""
    first, *rest = module.split(".")
    return f"{first}.{rest[0]}" if first == "palpate" and rest else first


def _source(module: str) -> Path:
    """Return the module's file. Raises LookupError where there is none."""
    if (path := _path(module)) is None:
        raise LookupError(f"no module {module!r}; a digest of the program's code wants it. Was it renamed?")
    return path


@cache
def _path(module: str) -> Path | None:
    """Return the file of a module, found without importing a package; None where there is none."""
    top, *rest = module.split(".")
    if top == "palpate":
        path = ROOT.joinpath(*rest)
    elif (spec := find_spec(top)) is None:
        return None
    elif not spec.submodule_search_locations:
        return Path(spec.origin) if not rest and spec.origin else None
    else:
        path = Path(next(iter(spec.submodule_search_locations))).joinpath(*rest)
    for file in (path.with_name(f"{path.name}.py") if rest else path / "__init__.py", path / "__init__.py"):
        if file.is_file():
            return file
    return None


@cache
def _with_tables(source: Path) -> tuple[Path, ...]:
    return (source, *(path for path in sorted(source.parent.iterdir()) if path.suffix in BESIDE and path.is_file()))
