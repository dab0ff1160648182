"""Without extras every command runs, or says in one sentence before any work which extra it needs and how to get it."""

import re
import shutil
import sys

import pytest

from palpate import command_line
from palpate.protocols.extras import EXTRAS
from tests.faults import commands as faults
from tests.faults.commands import LEFT_OUT, WRITES, WRITES_NOTHING, arguments, commands, make_lab

DRIVEN = {
    **dict.fromkeys(WRITES),
    "record": "record texture_capture --participant P003 --group pilot --rig twins.yaml --lab lab",
    "resume": "resume lab/sessions/doors_small_P001_s1.sqlite",
    "rig calibrate": "rig calibrate vibration --yes --rig twins.yaml",
    "rig check": "rig check --rig twins.yaml", "rig kinds": "rig kinds", "author": "author --twins --lab lab",
    "window calibrate": "window calibrate --lab lab", "window check": "window check --lab lab",
    "power": "power --help", "demo": "demo --lab lab", "bench": "bench textures --quick",
    "train doors": "train doors --lab lab", "train textures": "train textures --simulated --lab lab",
    "train attributes": "train attributes --lab lab", "evaluate doors": "evaluate doors --lab lab",
    "evaluate textures": "evaluate textures --simulated --lab lab",
    "evaluate attributes": "evaluate attributes --lab lab",
    "textures simulate": "textures simulate --lab lab --help", "textures index": "textures index --lab lab",
    "textures find": "textures find rough --lab lab", "textures nearest": "textures nearest cloth --lab lab",
    "textures show": "textures show --lab lab", "textures map": "textures map --lab lab",
    "textures draw": "textures draw T50 --lab lab --out drawn",
    "participants list": "participants list --lab lab",
    "participants balance": "participants balance doors_small --lab lab",
    "participants overlap": "participants overlap doors_small door_ratings --lab lab", "studies": "studies",
    "extensions list": "extensions list --lab lab", "extensions check": "extensions check --help",
    "check": "check door_ratings", "plan": "plan door_ratings --participant P001", "replay": "replay --lab lab",
    "streams list": "streams list lab/sessions/doors_small_P001_s1.sqlite", "models list": "models list --lab lab",
    "models card": "models card door-perception --lab lab",
    "models compare": "models compare door-perception door-force --lab lab",
    "monitor": "monitor --lab lab", "render": "render cloth --lab lab --twins",
}  # fmt: skip
"""How each command is driven: as where its files are tested, or so."""
NEEDS = {
    **dict.fromkeys(("train doors", "train textures", "train attributes", "bench"), "models"),
    **dict.fromkeys(("evaluate doors", "evaluate textures", "evaluate attributes"), "models"),
    **dict.fromkeys(("window calibrate", "window check", "author", "render"), "lab"),
    "monitor": "monitor", "rig check": "rig", "record": "lab",
}  # fmt: skip
"""What cannot be done without an extra: it says so, and exits with 2, or 1 where it checks."""


BLOCKED = set(EXTRAS) - {"pyarrow"}
"""pandas itself uses pyarrow where it finds it, and has found it before a test begins."""


class Missing:
    """Finds none of these packages, wherever they are installed."""

    def find_spec(self, name, _path=None, _target=None):
        if name.partition(".")[0] in BLOCKED:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bare")
    make_lab(folder)
    return folder


@pytest.fixture
def bare(monkeypatch):
    """As where no extra is installed."""
    monkeypatch.delenv("DISPLAY", raising=False)
    for name in [name for name in sys.modules if name.partition(".")[0] in BLOCKED]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(sys, "meta_path", [Missing(), *sys.meta_path])


def test_every_command_is_driven_without_extras():
    assert sorted(DRIVEN) == sorted({*faults.DRIVEN, *LEFT_OUT, *WRITES_NOTHING}) == sorted(commands())


@pytest.mark.parametrize("name", DRIVEN)
def test_without_extras_a_command_runs_or_says_which_one_it_needs(lab, bare, tmp_path, monkeypatch, capsys, name):
    work = tmp_path / "work"
    shutil.copytree(lab, work)
    monkeypatch.chdir(work)
    before = {path for path in work.rglob("*") if path.is_file()}
    code = command_line._status((DRIVEN[name] or " ".join(arguments(name))).split())
    out, error = capsys.readouterr()
    named = re.findall(r"needs [\w, ]+ (?:is|are) not installed: pip install 'palpate\[([\w,]+)\]'", out + error)
    assert named[:1] == ([NEEDS[name]] if name in NEEDS else []), out + error
    if name in NEEDS:
        assert "calibrated" not in error
        assert code in {1, 2} and {path for path in work.rglob("*") if path.is_file()} == before
    else:
        assert "No module named" not in out + error
