"""The verb `extensions`: each template works as it is written, in a lab and as a package; what fails is named."""

import json
import sys
import tomllib
from importlib import invalidate_caches

import pytest

from palpate.command_line import _status
from palpate.protocols.extensions import PARTS
from palpate.studies.extensions.check import check
from palpate.studies.extensions.templates import ENTRY_POINTS, write_module, write_package
from tests.studies.extensions.labs import TASK, make_lab


@pytest.fixture
def lab(tmp_path):
    folder = tmp_path / "lab"
    assert _status(["init", str(folder)]) == 0
    (folder / "lab.yaml").write_text("extensions: true\n", encoding="utf-8")
    return folder


@pytest.fixture
def run(capsys):
    def call(*words):
        capsys.readouterr()
        status = _status(["extensions", *map(str, words)])
        return status, "".join(capsys.readouterr())

    return call


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Install a package by what pip leaves of an editable one: its folder and its metadata on sys.path."""

    def install(root, name):
        project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        info = root / f"{name}-{project['version']}.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {project['version']}\n")
        lines = [
            f"[{group}]\n{key} = {place}\n"
            for group, of in project["entry-points"].items()
            for key, place in of.items()
        ]
        (info / "entry_points.txt").write_text("".join(lines))
        monkeypatch.syspath_prepend(str(root))
        invalidate_caches()

    yield install
    for module in [module for module in sys.modules if module.startswith("acme_")]:
        del sys.modules[module]


def failed(verdicts):
    return [str(verdict) for verdict in verdicts if not verdict.ok]


def test_there_is_a_template_for_each_kind_of_part():
    assert {parts for of in ENTRY_POINTS.values() for parts in of} == set(PARTS)


@pytest.mark.needs("fonts")
@pytest.mark.parametrize("kind", ENTRY_POINTS)
def test_each_template_is_a_package_that_keeps_the_contract_as_it_is_written(kind, tmp_path, installed):
    name = f"acme_{kind}"
    files = write_package(kind, f"{name}.grip", tmp_path / "package")
    assert {"pyproject.toml", "README.md", "__init__.py", "test_contract.py"} <= {file.name for file in files}
    root = tmp_path / "package"
    texts = [f"{file.relative_to(root)} {file.read_text(encoding='utf-8')}" for file in files]
    assert not any("template_" in text for text in texts)
    installed(tmp_path / "package", name)
    verdicts = check(name, tmp_path)
    assert failed(verdicts) == [] and {verdict.part for verdict in verdicts} == {f"{name}.grip"}


@pytest.mark.needs("fonts")
@pytest.mark.parametrize("kind", ["form", "need"])
def test_a_template_in_a_lab_keeps_the_contract(kind, lab):
    write_module(kind, "acme.grip", lab)
    assert failed(check("acme.grip", lab)) == []
    assert _status(["run", "acme_grip", "--participant", "P001", "--simulate", "--lab", str(lab)]) == 0
    assert _status(["replay", "--lab", str(lab)]) == 0


def test_new_overwrites_nothing_and_names_the_nearest_kind(run, lab, tmp_path):
    assert run("new", "task", "acme.grip", "--in-lab", "--lab", lab)[0] == 0
    module = lab / "extensions" / "acme" / "__init__.py"
    module.write_text("mine", encoding="utf-8")
    status, said = run("new", "device", "acme.other", "--in-lab", "--lab", lab)
    assert status == 2 and "nothing is overwritten" in said and module.read_text(encoding="utf-8") == "mine"
    assert not (lab / "studies" / "acme_other").exists()
    status, said = run("new", "tasks", "acme.grip", "--out", tmp_path / "x")
    assert status == 2 and "no template for the kind 'tasks'; did you mean 'task'" in said
    status, said = run("new", "task", "grip", "--out", tmp_path / "x")
    assert status == 2 and "a name such as acme.grip is expected" in said and not (tmp_path / "x").exists()


def test_new_says_what_comes_next(run, lab, tmp_path):
    status, said = run("new", "test", "acme.spread", "--out", tmp_path / "out")
    assert (
        status == 0 and f"next: pip install -e {tmp_path / 'out'}, then: palpate extensions check acme.spread" in said
    )
    (lab / "lab.yaml").unlink()
    status, said = run("new", "test", "acme.spread", "--in-lab", "--lab", lab)
    assert status == 0 and "next: write `extensions: true` into" in said


def test_list_imports_nothing_and_names_conflicts_and_what_is_not_allowed(run, tmp_path):
    lab = make_lab(tmp_path / "lab", allowed=False)
    marker = "raise SystemExit('imported')\n"
    for name in ("acme", "drawn"):
        file = lab / "extensions" / f"{name}.py"
        file.write_text(file.read_text(encoding="utf-8") + marker, encoding="utf-8")
    (lab / "extensions" / "acme").mkdir()
    (lab / "extensions" / "acme" / "__init__.py").write_text(TASK, encoding="utf-8")
    (lab / "extensions" / "broken.py").write_text("def (\n", encoding="utf-8")
    status, said = run("list", "--lab", lab)
    assert status == 0 and said.count("CONFLICT") == 2 and said.count("not allowed") == 4
    assert "  procedures: drawn.any_level" in said and "  BROKEN: SyntaxError" in said
    rows = {row["where"]: row for row in json.loads(run("list", "--json", "--lab", lab)[1])}
    drawn = rows[str(lab / "extensions" / "drawn.py")]
    assert drawn["parts"] == {"procedures": ["drawn.any_level"]} and drawn["allowed"] is False
    assert len(drawn["sha256"]) == 64 and drawn["conflicts"] == []


def test_a_lab_without_extensions_is_told_how_to_begin(run, lab):
    status, said = run("list", "--lab", lab)
    assert status == 0 and "palpate extensions new task acme.grip" in said


def test_check_prints_a_line_for_each_demand(run, tmp_path):
    lab = make_lab(tmp_path / "lab")
    status, said = run("check", "drawn", "--lab", lab)
    assert status == 0 and said.splitlines()[0] == "drawn.any_level" and "6 demands, all kept" in said
    status, said = run("check", "acme.largest", "--lab", lab)
    assert status == 1 and "garbage is refused: AttributeError" in said
    rows = json.loads(run("check", "acme.largest", "--json", "--lab", lab)[1])
    assert {row["ok"] for row in rows} == {True, False} and rows[0]["part"] == "acme.largest"


def test_check_names_the_nearest_part_and_a_missing_extension(run, tmp_path):
    lab = make_lab(tmp_path / "lab")
    status, said = run("check", "acme.largst", "--lab", lab)
    assert status == 2 and "has no part 'acme.largst'; did you mean 'acme.largest'" in said
    status, said = run("check", "acmee", "--lab", lab)
    assert status == 2 and "the extension 'acmee' is not here (did you mean 'acme'" in said
    status, said = run("chek", "acme")
    assert status == 2 and "did you mean 'check'" in said


def test_a_study_that_cannot_be_read_is_named(run, tmp_path):
    lab = make_lab(tmp_path / "lab")
    study = lab / "studies" / "levels" / "study.yaml"
    study.write_text(study.read_text(encoding="utf-8").replace("seed: 3", "sead: 3"), encoding="utf-8")
    status, said = run("check", "drawn", "--lab", lab)
    assert status == 1 and "no study names it" not in said and "no study names drawn.any_level" in said
    assert "5 more are not tried" in said and "its studies can be read: " in said and "sead" in said
