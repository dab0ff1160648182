import tomllib
from fnmatch import fnmatch
from pathlib import Path

import pytest

from palpate.studies.lab import TEMPLATE, ParticipantError
from palpate.studies.participants.lab_template import make_lab

ROOT = Path(__file__).resolve().parents[3]
FILES = ["README.md", "consent.ko.md", "consent.md", "data_protection.md", "instructions.md", "participants.json",
         "participants.tsv"]  # fmt: skip


def test_a_new_lab_holds_the_templates_files_and_room_for_sessions_and_studies(tmp_path):
    done = make_lab(tmp_path / "deep" / "lab")
    assert sorted(path.name for path in done.lab.iterdir()) == sorted([*FILES, "sessions", "studies"])
    assert all((done.lab / name).read_bytes() == (TEMPLATE / name).read_bytes() for name in FILES)
    assert done.made == tuple(sorted([*FILES, "sessions/", "studies/"]))
    assert set(done.blanks) == {"consent.md", "consent.ko.md", "data_protection.md", "instructions.md"}


def test_a_lab_is_not_made_twice(tmp_path):
    make_lab(tmp_path)
    (tmp_path / "consent.md").write_text("ours")
    with pytest.raises(ParticipantError, match=r"is a lab already \(it holds participants.json\); nothing was changed"):
        make_lab(tmp_path)
    assert (tmp_path / "consent.md").read_text() == "ours"


def test_a_folder_with_studies_and_sessions_becomes_a_lab_and_nothing_in_it_changes(tmp_path):
    study = tmp_path / "studies" / "sponges" / "study.yaml"
    study.parent.mkdir(parents=True)
    study.write_text("study: sponges\n")
    (tmp_path / "consent.md").write_text("ours")
    (tmp_path / ".git").mkdir()
    done = make_lab(tmp_path)
    assert study.read_text() == "study: sponges\n" and (tmp_path / "consent.md").read_text() == "ours"
    assert "consent.md" not in done.made and "studies/" not in done.made and "participants.json" in done.made
    assert "consent.md" not in done.blanks


@pytest.mark.parametrize("names", [["thesis.docx"], ["a", "b", "c", "d", "e"]])
def test_a_folder_with_anything_else_is_refused_and_left_as_it_is(tmp_path, names):
    for name in names:
        (tmp_path / name).touch()
    message = f"holds {', '.join(names[:3])}" + (" and 2 more" if len(names) > 3 else "")
    with pytest.raises(ParticipantError, match=message):
        make_lab(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == names


def test_a_file_is_no_place_for_a_lab(tmp_path):
    (tmp_path / "lab").touch()
    with pytest.raises(ParticipantError, match="lab is a file"):
        make_lab(tmp_path / "lab")


def test_half_a_lab_is_completed_by_the_next_try(tmp_path):
    (tmp_path / "sessions").mkdir()
    (tmp_path / "consent.md").write_bytes((TEMPLATE / "consent.md").read_bytes())
    make_lab(tmp_path)
    assert (tmp_path / "participants.json").exists() and (tmp_path / "README.md").exists()


def test_an_installed_palpate_has_every_file_of_the_template():
    """What setuptools packs is what these patterns of pyproject.toml name; the template lies beside the rooms."""
    setuptools = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
    assert f'"{TEMPLATE.name}"' in (ROOT / "setup.py").read_text(encoding="utf-8")
    patterns = [pattern.removeprefix("**/") for pattern in setuptools["package-data"]["*"]]
    files = [path.name for path in TEMPLATE.iterdir() if path.is_file()]
    assert sorted(files) == sorted(FILES)
    assert [name for name in files if not any(fnmatch(name, pattern) for pattern in patterns)] == []


def test_the_templates_table_has_a_column_for_each_that_the_sidecar_describes():
    from palpate.studies.participants.sidecar import columns

    assert (TEMPLATE / "participants.tsv").read_text() == "\t".join(columns(TEMPLATE / "participants.json")) + "\n"
