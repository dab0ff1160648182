"""Every module, object and file of ours that a string names is there: a renamed one fails here, not at a user's."""

from __future__ import annotations

import pickle
from importlib import import_module

import pytest

from tests.names import (
    KERNEL,
    NO_NAMES,
    OBJECT,
    PUT_TOGETHER,
    exists,
    file_of,
    names_in_documents,
    names_in_product,
    names_in_settings,
    names_in_source,
)

PICKLED = ("palpate.studies.simulation.texture_simulator:SimulatedTextures",
           "palpate.modeling.doors.domain:DoorDomain", "palpate.modeling.textures.domain:TextureDomain",
           "palpate.modeling.attributes.domain:AttributeDomain",
           "palpate.studies.simulation.texture_set_rig:ToolAhead",
           "palpate.studies.simulation.texture_set_rig:Seen")  # fmt: skip
"""What travels to worker processes: pickle names its class by module and name. None of it lies in a file."""
STARTED = ("palpate.devices.door.firmware.process", "benchmarks.window.stage", "benchmarks.window.session",
           "benchmarks.streams.run", "tools.similarity_table")  # fmt: skip
"""Modules that are started by name, as a process of their own."""


@pytest.fixture(scope="module")
def product():
    return list(names_in_product())


def missing(named):
    return sorted({str(name) for name in named if not exists(name.name)})


def test_every_name_in_a_string_of_the_product_is_there(product):
    assert missing(product) == []
    assert len({name.name for name in product if OBJECT.fullmatch(name.name)}) > 120


def test_every_name_in_the_settings_is_there():
    named = list(names_in_settings())
    assert missing(named) == [] and {"palpate.__main__:main", "palpate.modeling"} <= {name.name for name in named}


def test_every_name_in_the_documents_is_there():
    named = list(names_in_documents())
    assert missing(named) == [] and len(named) > 80


@pytest.mark.parametrize("name", STARTED)
def test_a_module_that_is_started_by_name_can_be(name):
    assert 'if __name__ == "__main__":' in file_of(name).read_text(encoding="utf-8")


def test_the_modules_started_by_name_are_known_here(product):
    named = {name.name for name in product}
    assert [name for name in STARTED if name not in named] == []


@pytest.mark.parametrize("name", PICKLED)
def test_a_class_that_is_pickled_can_be_imported_by_its_name(name):
    module, _, attribute = name.partition(":")
    kind = getattr(import_module(module), attribute)
    assert (kind.__module__, kind.__qualname__) == (module, attribute)
    assert pickle.loads(pickle.dumps(kind)) is kind


@pytest.mark.parametrize(
    "source",
    [
        'KINDS = {"door": "palpate.devices.door.link.renamed"}',
        'VERBS = {"init": ("palpate.studies.participants.commands:renamed", "Make a folder a lab.")}',
        'VERBS = {"init": ("palpate.studies.participants.renamed:init", "Make a folder a lab.")}',
        '_AT = "palpate.analysis.plans.families"\nTESTS = {"anova": f"{_AT}.renamed:ANOVA"}',
        'for room in ROOMS:\n    import_module(f"palpate.devices.{room}.bench")',
        'import_module("palpate.devices.render.window.app").renamed()',
        'run([sys.executable, "-m", "palpate.studies.renamed"])',
        '"""Makes pictures: `python -m palpate.devices.author.renamed`."""',
        'DECIDES = ("studies/renamed.csv",)',
    ],
)
def test_what_was_renamed_is_missed(source):
    assert len(missing(names_in_source(source, "made.py"))) == 1


def test_no_exception_is_left_that_nothing_needs():
    unneeded = [name for name in NO_NAMES if exists(name) and name != KERNEL]
    assert unneeded == [] and all(exists(name) for names in PUT_TOGETHER.values() for name in names)


@pytest.mark.long
@pytest.mark.needs("torch", "librosa", "flask")
def test_every_object_that_is_named_can_be_imported(product):
    for name in sorted({known.name for known in product if OBJECT.fullmatch(known.name)}):
        module, _, attribute = name.partition(":")
        assert hasattr(import_module(module), attribute), name
