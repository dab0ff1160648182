"""What the import contracts in pyproject.toml do not say: everything has its place, and no module is in a cycle.

What a command imports when it runs is in tests/test_palpate.py.
"""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Collection, Iterable, Iterator
from importlib import import_module
from pathlib import Path

import grimp
import pytest

from palpate.command_line import VERBS
from palpate.devices.kinds import KINDS
from palpate.protocols import code_digest
from tests import names

ROOT = names.ROOT
NOT_INSTALLED = {"benchmarks", "tools"}
LIVE = (
    *(f"palpate.studies.live.{name}" for name in ("opening", "hardware", "station", "renderer")),
    "palpate.studies.sessions.session", "palpate.studies.commands_sessions",
    "palpate.devices.window.presenter_window", "palpate.devices.rig.opened",
    *(place.partition(":")[0] for place in KINDS.all_places.values()),
)  # fmt: skip
"""What runs a session with real devices, and the module of every kind of device."""
SIMULATED = re.compile(
    r"(.*\.)?(twin|twins|twin_\w+|\w+_twin|hand_simulated|simulator)|palpate\.studies\.(simulation\..*|stimuli\.scenes|live\.rehearsal)"
    r"|palpate\.devices\.(surfaces|door\.firmware)(\..*)?|palpate\.devices\.door\.opening_scene"
)
"""Modules of simulated people, devices and surfaces: a live session imports one when its rig has a simulated device."""
LOADED_ALL_THE_SAME = {
    ("palpate.devices.door.link.connections", "palpate.devices.door.link.simulator"),
    ("palpate.devices.door.link.connections", "palpate.devices.door.link.twin_process"),
    ("palpate.devices.door.link.device", "palpate.devices.door.link.simulator"),
    ("palpate.studies.live.renderer", "palpate.studies.stimuli.scenes"),
    ("palpate.studies.live.renderer", "palpate.studies.simulation.virtual_textures"),
    ("palpate.studies.live.station", "palpate.studies.stimuli.scenes"),
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
    packages = {path.parent.name for path in ROOT.glob("*/__init__.py")} - {"tests", "palpate"}
    assert packages == {*names.PACKAGES} and packages - NOT_INSTALLED == {*names.INSTALLED}
    assert [f"palpate.{name}" for name in names.INSTALLED] == [*code_digest.PACKAGES]
    checked = ["benchmarks", "palpate", "tools"]
    examples = {path.parent for path in ROOT.glob("examples/**/__init__.py")}
    assert {ROOT / place for place in tool["mypy"]["mypy_path"]} == {path.parent for path in examples}
    assert sorted([*checked, *(path.name for path in examples)]) == sorted(tool["mypy"]["packages"])
    assert checked == sorted(tool["importlinter"]["root_packages"])
    contract, *_ = tool["importlinter"]["contracts"]
    assert contract["exhaustive"] and contract["containers"] == ["palpate"]
    assert {path.name for path in ROOT.glob("*.py")} == {"setup.py"}


def test_a_link_shows_each_installed_folder_as_a_subpackage():
    links = {path.name: path.resolve() for path in (ROOT / "palpate").iterdir() if path.is_symlink()}
    installed = ast.literal_eval(re.search(r"FOLDERS = (\(.*?\))", (ROOT / "setup.py").read_text("utf-8"), re.S)[1])
    assert links == {name: ROOT / name for name in installed}, "git made no links: see CONTRIBUTING.md, The house"
    assert {*installed} == {*names.INSTALLED, "participants_template"}


def test_no_module_is_loaded_under_two_names():
    for place, _ in VERBS.values():
        import_module(place.partition(":")[0])
    ours = [(name, Path(module.__file__).resolve()) for name, module in sys.modules.items()
            if getattr(module, "__file__", None) and Path(module.__file__).resolve().is_relative_to(ROOT)]  # fmt: skip
    in_rooms = [(name, file) for name, file in ours if file.relative_to(ROOT).parts[0] in names.INSTALLED]
    assert len(in_rooms) > 50 and all(name.startswith("palpate.") for name, _ in in_rooms)
    assert len({file for _, file in in_rooms}) == len(in_rooms)


@pytest.mark.parametrize("name", names.INSTALLED)
def test_the_name_at_the_top_of_the_repository_is_refused(name):
    with pytest.raises(ImportError, match=f"from palpate import {name}"):
        import_module(name)


def test_every_module_of_a_package_is_seen(graph):
    files = {path for package in (*names.PACKAGES, "palpate") for path in (ROOT / package).rglob("*.py")}
    assert files == {file_of(module) for module in graph.modules}


def test_no_module_imports_itself_through_others(graph):
    left = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    while done := {module for module, imported in left.items() if not imported & left.keys()}:
        left = {module: imported for module, imported in left.items() if module not in done}
    importers = {name for imported in left.values() for name in imported}
    assert sorted(left.keys() & importers) == [], "these are in cycles, or between two cycles"


def test_the_live_path_loads_what_is_simulated_only_where_the_rig_asks(graph):
    assert set(eager_imports_of_simulated(LIVE, graph.modules)) == LOADED_ALL_THE_SAME


def test_there_are_simulated_modules(graph):
    assert len(list(filter(SIMULATED.fullmatch, graph.modules))) > 30


def file_of(module: str) -> Path:
    """Return the source of a module of ours."""
    path = ROOT.joinpath(*module.split(".")).resolve()
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
    statements, imported = list(ast.parse(source).body), set[str]()
    for statement in statements:
        if isinstance(statement, ast.Import):
            imported |= {alias.name for alias in statement.names}
        elif isinstance(statement, ast.ImportFrom):
            imported |= {str(statement.module), *(f"{statement.module}.{alias.name}" for alias in statement.names)}
        elif not isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef) and not is_for_types(statement):
            for part in ("body", "orelse", "finalbody"):
                statements += getattr(statement, part, [])
    return imported


def is_for_types(statement: ast.stmt) -> bool:
    """Return whether only a type checker reads the statement."""
    return isinstance(statement, ast.If) and ast.unparse(statement.test) == "TYPE_CHECKING"


def test_an_import_within_a_function_is_not_eager():
    source = (
        "import palpate.studies.live.world\nif TYPE_CHECKING:\n    import palpate.studies.sessions.rig\nclass A:\n"
        "    import palpate.studies.sessions.ledger\n"
    )
    assert eager_imports(f"{source}def f():\n    import palpate.studies.simulation.twins\n") == {
        "palpate.studies.live.world",
        "palpate.studies.sessions.ledger",
    }
