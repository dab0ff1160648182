"""Modules, objects and files of the product that are named in strings, where no type checker sees them."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
INSTALLED = ("protocols", "signals", "devices", "studies", "analysis", "modeling")
"""Folders at the top that are subpackages of `palpate`."""
PACKAGES = (*INSTALLED, "benchmarks", "tools")
FILES = ("palpate/__main__.py", "palpate/command_line.py", "setup.py")
_ROOTS = "|".join(("palpate", "benchmarks", "tools", "tests"))
_FOLDERS = "|".join((*PACKAGES, "palpate", "tests"))
OBJECT = re.compile(rf"(?:{_ROOTS})(?:\.\w+)*:\w+")
MODULE = re.compile(rf"(?:{_ROOTS})(?:\.\w+)+")
PATH = re.compile(rf"(?:{_FOLDERS})/[\w./-]*")
STARTED = re.compile(rf"-m (({_ROOTS})[\w.]*)")
IN_QUOTES = re.compile(rf"`((?:(?:{_ROOTS})\.|(?:{_FOLDERS})/)[\w./-]+)`")
WORTH_PARSING = re.compile(rf"""["'](?:{_FOLDERS})[.:/{{]|f["']\{{_?[A-Z_]+\}}[.:/]|-m (?:{_ROOTS})""")
KERNEL = "palpate.signals.models.native._kernel"
NO_NAMES = {
    KERNEL: "the kernel in C, which is there only where a compiler was",
    "tests/NAME.csv": "a file that a regenerated study holds",
    "studies/sponges/study.yaml": "a file of the lab that the README makes",
    "analysis/sponges/report.html": "a file of the lab that the README makes",
}
"""What looks like a name of ours, and what it is."""
PUT_TOGETHER = {
    **{f"palpate.{{{part}}}": [f"palpate.{name}" for name in INSTALLED] for part in ("name", "folder", "room")},
}
"""Names that are put together while the program runs, by f-string, and all that result from it."""


@dataclass(frozen=True)
class Named:
    """A name and the place (`file:line`) that has it."""

    name: str
    place: str

    def __str__(self) -> str:
        return f"{self.place}: {self.name}"


def names_in_product() -> Iterator[Named]:
    """Yield every name of a module, an object or a file in a string of the product, and in a command in its text."""
    paths = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    for path in [*paths, *(ROOT / name for name in FILES)]:
        yield from names_in_source(path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix())


def names_in_source(text: str, file: str) -> Iterator[Named]:
    """Yield the names in a source text."""
    if not WORTH_PARSING.search(text):
        return
    yield from (Named(started[1], file) for started in STARTED.finditer(text))
    tree = ast.parse(text)
    constants = dict(_constants(tree))
    parts = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in ast.walk(tree):
        place = f"{file}:{getattr(node, 'lineno', 0)}"
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in parts:
            if is_name(node.value):
                yield Named(node.value, place)
        elif isinstance(node, ast.JoinedStr):
            yield from (Named(name, place) for name in _put_together(node, constants))
        elif isinstance(node, ast.Attribute) and (module := _imported_by_name(node.value)):
            yield Named(f"{module}:{node.attr}", place)


def is_name(text: str) -> bool:
    """Return whether the text is the name of a module, an object or a file of ours."""
    return text not in NO_NAMES and any(kind.fullmatch(text) for kind in (OBJECT, MODULE, PATH))


def _constants(tree: ast.Module) -> Iterator[tuple[str, str]]:
    for statement in tree.body:
        match statement:
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.Constant(value=str(text))):
                yield name, text


def _put_together(node: ast.JoinedStr, constants: dict[str, str]) -> list[str]:
    """Return the names that the f-string stands for: of a path the folder, of a module itself where it is not known."""
    text = "".join(
        part.value if isinstance(part, ast.Constant) else
        constants.get(ast.unparse(part.value), f"{{{ast.unparse(part.value)}}}")
        for part in node.values
    )  # fmt: skip
    if text in PUT_TOGETHER:
        return PUT_TOGETHER[text]
    before, _, _ = text.partition("{")
    if PATH.fullmatch(before):
        return [before.rpartition("/")[0] + "/"]
    return [text] if is_name(re.sub(r"\{[^{}]*\}", "some", text)) else []


def _imported_by_name(node: ast.expr) -> str:
    """Return the module in `import_module("module")`, else an empty string."""
    if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
        argument = node.args[0]
        if isinstance(argument, ast.Constant) and is_name(str(argument.value)):
            return str(argument.value)
    return ""


def names_in_settings() -> Iterator[Named]:
    """Yield the names in pyproject.toml."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    for text in _strings(settings):
        name = text.removesuffix(".*").removesuffix("*")
        if is_name(name) or name in {"palpate", "benchmarks", "tools"}:
            yield Named(name, "pyproject.toml")


def _strings(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for item in value.values():
            yield from _strings(item)
    elif isinstance(value, list):
        for item in value:
            yield from _strings(item)


def names_in_documents() -> Iterator[Named]:
    """Yield the names in the documents, the Makefile and CI; decisions and the change log tell of what was."""
    documents = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
    for path in [*documents, ROOT / "Makefile", ROOT / ".ci" / "run"]:
        file = path.relative_to(ROOT).as_posix()
        if not file.startswith("docs/decisions/"):
            text = path.read_text(encoding="utf-8")
            for kind in (STARTED, IN_QUOTES):
                yield from (Named(match[1], file) for match in kind.finditer(text) if match[1] not in NO_NAMES)


def exists(name: str) -> bool:
    """Return whether there is such a module, object (`module:name` or `module.name`) or path from the root."""
    if PATH.fullmatch(name):
        return (ROOT / name).exists()
    module, _, inside = name.partition(":")
    if inside:
        return inside in defined_in(module)
    while file_of(module) is None:
        module, _, inside = module.rpartition(".")
        if not module:
            return False
    return not inside or inside in defined_in(module)


@cache
def file_of(module: str) -> Path | None:
    """Return the source of a module; None where there is no such module."""
    try:
        spec = find_spec(module)
    except ModuleNotFoundError:
        return None
    return Path(spec.origin) if spec and spec.origin else None


@cache
def defined_in(module: str) -> frozenset[str]:
    """Return what a module defines or imports at its top level, without importing it."""
    path = file_of(module)
    return frozenset() if path is None else frozenset(_bound(ast.parse(path.read_text(encoding="utf-8")).body))


def _bound(statements: list[ast.stmt]) -> Iterator[str]:
    for statement in statements:
        if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield statement.name
        elif isinstance(statement, ast.Import | ast.ImportFrom):
            yield from (alias.asname or alias.name for alias in statement.names)
        elif isinstance(statement, ast.Assign | ast.AnnAssign):
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            yield from (node.id for target in targets for node in ast.walk(target) if isinstance(node, ast.Name))
        elif isinstance(statement, ast.If | ast.Try):
            yield from _bound([*statement.body, *statement.orelse, *getattr(statement, "finalbody", [])])
