"""A stored result is of the code that made it: the digest follows every import, and never leaves a file out."""

from __future__ import annotations

import importlib

import pytest

from palpate.protocols import code_digest as module
from palpate.protocols.code_digest import ROOT, code_digest, files_digest, imported_by, module_of, sources_in

PACKAGE = {
    "__init__": "",
    "entry": "import example.direct\nif TYPE_CHECKING:\n    from example.typed import T\n"
    "def f():\n    from example import within\nLATER = 'palpate.studies.workers:run'\n",
    "direct": "from example.below import x",
    "below": "x = 1",
    "within": "y = 1",
    "typed": "T = int",
    "unused": "z = 1",
}


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package that is not of this program, as a lab's own would be."""
    folder = tmp_path / "example"
    folder.mkdir()
    for name, text in PACKAGE.items():
        (folder / f"{name}.py").write_text(text)
    (folder / "table.csv").write_text("a,b\n")
    monkeypatch.syspath_prepend(tmp_path)
    return folder


def digest(*names, **more):
    """As in a new process."""
    importlib.invalidate_caches()
    for cached in (code_digest, module._imports, module._path, module._with_tables):
        cached.cache_clear()
    return code_digest(*names, **more)


@pytest.mark.parametrize("name", ["__init__.py", "entry.py", "direct.py", "below.py", "within.py", "table.csv"])
def test_an_edit_of_what_is_imported_changes_the_digest(package, name):
    before = digest("example.entry")
    assert digest("example.entry") == before
    (package / name).write_text((package / name).read_text() + "\n")
    assert digest("example.entry") != before


def test_a_renamed_module_changes_the_digest(package):
    before = digest("example.entry")
    (package / "below.py").rename(package / "lower.py")
    (package / "direct.py").write_text("from example.lower import x")
    assert digest("example.entry") != before


@pytest.mark.parametrize("name", ["typed.py", "unused.py"])
def test_an_edit_elsewhere_does_not(package, name):
    before = digest("example.entry")
    (package / name).write_text("w = 2")
    assert digest("example.entry") == before


def test_what_a_string_names_counts_only_where_registries_do(package):
    assert "palpate.studies.workers" not in imported_by("example.entry")
    assert "palpate.studies.workers" in imported_by("example.entry", registries=True)
    assert digest("example.entry") != digest("example.entry", registries=True)


def test_a_string_that_names_a_folder_of_parts_stands_for_all_its_modules(package):
    (package / "entry.py").write_text("PARTS = 'palpate.protocols.tasks.*'\n")
    digest("example.entry")
    assert {"palpate.protocols.tasks.words", "palpate.protocols.tasks"} <= imported_by("example.entry", registries=True)


def test_what_is_not_there_is_named(package, tmp_path):
    with pytest.raises(LookupError, match="no module 'palpate.modeling.textures.renamed'"):
        digest("palpate.modeling.textures.renamed")
    with pytest.raises(LookupError, match="no module 'nowhere'"):
        digest("nowhere")
    with pytest.raises(LookupError, match="studies/renamed.csv: no such file"):
        digest("example.entry", files=("studies/renamed.csv",))
    with pytest.raises(LookupError, match="renamed: no such folder of sources"):
        sources_in(tmp_path / "renamed")
    (package / "below.py").rename(package / "lower.py")
    with pytest.raises(LookupError, match="no module 'example.below'"):
        digest("example.entry")


def test_the_paths_count_as_well_as_the_contents(tmp_path):
    (tmp_path / "a").write_text("1")
    (tmp_path / "b").write_text("1")
    assert files_digest([tmp_path / "a"]) != files_digest([tmp_path / "b"])
    assert files_digest([ROOT / "setup.py"]) != files_digest([])


@pytest.mark.parametrize("line", ["from .below import x", "from . import below", "from example import below"])
def test_relative_imports_are_followed_as_well(package, line):
    (package / "direct.py").write_text(line)
    digest("example.entry")
    assert "example.below" in imported_by("example.entry")
    (package / "__init__.py").write_text("from .unused import z")
    digest("example.entry")
    assert "example.unused" in imported_by("example.entry")


def test_a_partial_is_of_the_module_of_its_function():
    from functools import partial

    assert module_of(partial(partial(sources_in), ROOT)) == module_of(sources_in) == "palpate.protocols.code_digest"
    assert module_of(ROOT) == type(ROOT).__module__


@pytest.mark.parametrize(
    ("arguments", "there", "not_there"),
    [
        (
            {"modules": ("palpate.signals.textures.voice",), "registries": True},
            {"palpate.signals.models.native.library", "palpate.signals.models.runtime"},
            {"palpate.studies.simulation.texture_capturing", "palpate.devices.surfaces.hand"},
        ),
        (
            {"modules": ("palpate.studies.simulation.texture_capturing",), "registries": True},
            {"palpate.devices.daq.force_torque", "palpate.devices.surfaces.hand", "palpate.protocols.keyed"},
            {
                "palpate.studies.simulation.texture_set",
                "palpate.studies.sessions.session",
                "palpate.devices.window.presenter",
                "palpate.devices.render.commands",
            },
        ),
        (
            {"modules": ("palpate.modeling.doors.domain",), "registries": True},
            {
                "palpate.signals.doors.features",
                "palpate.signals.doors.limits",
                "palpate.signals.models.file",
                "palpate.modeling.doors.linear",
                "palpate.modeling.training.loop",
                "palpate.analysis.statistics",
            },
            {
                "palpate.modeling.doors.evaluation.report",
                "palpate.modeling.commands_doors",
                "palpate.modeling.textures.foten",
            },
        ),
        (
            {"modules": ("palpate.modeling.attributes.network_methods", "palpate.modeling.attributes.domain")},
            {
                "palpate.modeling.attributes.visuo_tactile",
                "palpate.modeling.attributes.material",
                "palpate.modeling.training.loop",
            },
            {"palpate.modeling.attributes.tactile_svm", "palpate.modeling.attributes.registry"},
        ),
        (
            {"modules": ("palpate.modeling.attributes.seeing",)},
            {"palpate.modeling.attributes.resnet", "palpate.analysis.features.glcm"},
            set(),
        ),
        (
            {"modules": ("palpate.modeling.attributes.feeling", "palpate.modeling.attributes.reading_touch")},
            {
                "palpate.analysis.features.touch_features",
                "palpate.analysis.streams.recorded_streams",
                "palpate.studies.sessions.record",
            },
            {"palpate.modeling.attributes.registry"},
        ),
    ],
)
def test_what_decides_results_here(arguments, there, not_there):
    modules = imported_by(*arguments["modules"], registries=arguments.get("registries", False))
    assert there <= modules and not modules & not_there
