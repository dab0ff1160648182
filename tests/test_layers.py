"""What the import contracts in pyproject.toml do not say: everything has its place, and no module is in a cycle."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path

import grimp
import pytest

from devices.rig.kinds import KINDS
from protocols import code_digest
from tests import names

ROOT = names.ROOT
NOT_INSTALLED = {"benchmarks", "tools"}
LIVE = ("studies.live_rig", "studies.hardware", "studies.rig_station", "studies.rig_renderer", "studies.session",
        "studies.commands_record", "studies.commands_sessions", "devices.window.presenter_window",
        "devices.rig.opened", *KINDS.values())  # fmt: skip
"""What runs a session with real devices, and the module of every kind of device."""
SIMULATED = re.compile(
    r"(.*\.)?(twin|twins|twin_\w+|\w+_twin|hand_simulated|simulator)|studies\.(virtual_\w+|scenes|rehearsal)"
    r"|devices\.(surfaces|door\.firmware)(\..*)?|devices\.door\.opening_scene"
)
"""Modules of simulated people, devices and surfaces: a live session imports one when its rig has a simulated device."""
LOADED_ALL_THE_SAME = {
    ("devices.door.link.connections", "devices.door.link.simulator"),
    ("devices.door.link.connections", "devices.door.link.twin_process"),
    ("devices.door.link.device", "devices.door.link.simulator"),
    ("devices.tablet.device", "devices.tablet.twin"),
    ("devices.tracker.device", "devices.tracker.twin"),
    ("studies.profiles", "devices.door.twin"),
    ("studies.rig_renderer", "studies.scenes"),
    ("studies.rig_renderer", "studies.virtual_textures"),
    ("studies.rig_station", "studies.scenes"),
}
"""Imports of simulated modules that a live session makes whatever its rig is. There may be fewer, never more."""


@pytest.fixture(scope="module")
def settings():
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def graph(settings):
    return grimp.build_graph(*settings["tool"]["importlinter"]["root_packages"], cache_dir=None)


def test_every_package_and_module_at_the_top_has_its_place(settings):
    tool = settings["tool"]
    packages = {path.parent.name for path in ROOT.glob("*/__init__.py")} - {"tests"}
    contract, *_ = tool["importlinter"]["contracts"]
    layers = {package for layer in contract["layers"] for package in layer.split(" | ")}
    assert packages == set(tool["importlinter"]["root_packages"]) == layers == set(tool["mypy"]["packages"])
    assert packages == set(names.PACKAGES)
    found = {name.removesuffix("*") for name in tool["setuptools"]["packages"]["find"]["include"]}
    assert found == (packages - NOT_INSTALLED) | {"participants_template"}
    assert packages - NOT_INSTALLED == set(code_digest.PACKAGES)
    modules = {path.stem for path in ROOT.glob("*.py")} - {"setup"}
    assert modules == set(tool["setuptools"]["py-modules"]) == set(tool["mypy"]["modules"])


def test_every_module_of_a_package_is_seen(graph):
    files = {path for package in names.PACKAGES for path in (ROOT / package).rglob("*.py")}
    assert files == {file_of(module) for module in graph.modules}


def test_no_module_imports_itself_through_others(graph):
    left = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    while done := {module for module, imported in left.items() if not imported & left.keys()}:
        left = {module: imported for module, imported in left.items() if module not in done}
    importers = {name for imported in left.values() for name in imported}
    assert sorted(left.keys() & importers) == [], "these are in cycles, or between two cycles"


def test_the_live_path_loads_what_is_simulated_only_where_the_rig_asks(graph):
    assert set(eager_imports_of_simulated(LIVE, graph.modules)) == LOADED_ALL_THE_SAME


def test_there_are_simulated_modules_to_be_kept_away(graph):
    assert len(list(filter(SIMULATED.fullmatch, graph.modules))) > 35


def file_of(module: str) -> Path:
    """Return the source of a module of ours."""
    path = ROOT.joinpath(*module.split("."))
    file = path.with_name(f"{path.name}.py")
    return file if file.is_file() else path / "__init__.py"


def eager_imports_of_simulated(modules: Iterable[str], known: Collection[str]) -> Iterator[tuple[str, str]]:
    """Yield what is imported when these modules are, and is simulated, each with its importer."""
    todo, seen = list(modules), set[str]()
    while todo:
        module = todo.pop()
        if module in seen:
            continue
        seen.add(module)
        for name in eager_imports(file_of(module).read_text(encoding="utf-8")) & set(known):
            if SIMULATED.fullmatch(name):
                yield module, name
            else:
                todo.append(name)


def eager_imports(source: str) -> set[str]:
    """Return the names that are imported as soon as the source is: not within functions, nor for types."""
    statements, found = list(ast.parse(source).body), set[str]()
    for statement in statements:
        if isinstance(statement, ast.Import):
            found |= {alias.name for alias in statement.names}
        elif isinstance(statement, ast.ImportFrom):
            found |= {str(statement.module), *(f"{statement.module}.{alias.name}" for alias in statement.names)}
        elif not isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef) and not is_for_types(statement):
            for part in ("body", "orelse", "finalbody"):
                statements += getattr(statement, part, [])
    return found


def is_for_types(statement: ast.stmt) -> bool:
    """Return whether only a type checker reads the statement."""
    return isinstance(statement, ast.If) and ast.unparse(statement.test) == "TYPE_CHECKING"


def test_an_import_within_a_function_is_not_eager():
    source = "import studies.live\nif TYPE_CHECKING:\n    import studies.rig\nclass A:\n    import studies.ledger\n"
    assert eager_imports(f"{source}def f():\n    import studies.twins\n") == {"studies.live", "studies.ledger"}
