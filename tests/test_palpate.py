"""The front door: fast, thin, and polite."""

import subprocess
import sys

import pytest

from palpate import command_line

HEAVY = ("numpy", "pandas", "scipy", "sqlalchemy", "torch", "psychopy", "matplotlib", "pingouin", "statsmodels")


def imported_by(*arguments):
    """The heavy packages in sys.modules after a whole command line."""
    code = (
        "import sys\nfrom palpate import command_line\n"
        f"try: command_line.main({list(arguments)!r})\nexcept SystemExit: pass\n"
        f"print(*[name for name in {HEAVY!r} if name in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stderr.strip().splitlines()[-1].split() if done.stderr.strip() else []


@pytest.mark.parametrize(
    "arguments", [["--help"], ["--version"], ["studies"], ["check", "door_ratings"], ["plan", "door_ratings"]]
)
def test_what_needs_nothing_heavy_imports_nothing_heavy(arguments):
    assert imported_by(*arguments) == []


@pytest.mark.parametrize("verb", sorted(command_line.VERBS))
def test_the_help_of_every_verb_is_light_and_helpful(verb, run_palpate):
    assert imported_by(verb, "--help") == []
    text = run_palpate(verb, "--help")
    assert "Usage: palpate" in text and len(text) > 150


def test_a_simulated_rating_session_imports_no_arrays_and_no_tables(tmp_path):
    imported = imported_by("run", "door_ratings", "--participant", "P001", "--simulate", "--lab", str(tmp_path))
    assert imported == ["sqlalchemy"]


@pytest.mark.parametrize("arguments", [["bench"], ["bench", "statistics", "--quick"], ["bench", "--help"]])
def test_an_installed_package_says_where_the_benchmarks_are(arguments, monkeypatch, tmp_path, run_palpate):
    monkeypatch.setattr(command_line, "__file__", str(tmp_path / "palpate" / "command_line.py"))
    assert "the benchmarks come with the repository" in run_palpate(*arguments, status=2)


def test_help_lists_every_verb(run_palpate):
    text = run_palpate("--help")
    assert all(f"\n  {verb} " in text for verb in command_line.VERBS)


@pytest.mark.parametrize(
    ("arguments", "status"), [(["--version"], 0), ([], 2), (["nonsense"], 2), (["--nonsense"], 2), (["check"], 2)]
)
def test_exit_codes(arguments, status, run_palpate):
    run_palpate(*arguments, status=status)


def test_a_fault_of_ours_is_not_dressed_up_as_a_mistake_of_the_users(monkeypatch):
    def broken(*_arguments, **_options):
        raise ValueError("math domain error")

    monkeypatch.setattr("palpate.studies.catalogue.names", broken)
    with pytest.raises(ValueError, match="math domain error"):
        command_line._status(["studies"])


def test_ctrl_c_ends_with_one_word(monkeypatch, run_palpate):
    def stopped(*_arguments, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr("palpate.studies.catalogue.names", stopped)
    assert run_palpate("studies", status=130).strip() == "stopped"


def test_a_demo_clears_only_a_demos_lab(tmp_path, run_palpate):
    (tmp_path / "year_of_data.sqlite").touch()
    assert "exists and is not a demo lab" in run_palpate("demo", "--lab", tmp_path, status=2)
    assert (tmp_path / "year_of_data.sqlite").exists()


def test_a_demo_refuses_a_file_that_no_demo_wrote(tmp_path, run_palpate, monkeypatch):
    lab = tmp_path / "lab"
    monkeypatch.setattr("palpate.command_line.DEMO", ("import sk2011",))
    run_palpate("demo", "--lab", lab)
    run_palpate("demo", "--lab", lab)
    (lab / "sessions").mkdir(exist_ok=True)
    (lab / "sessions" / "notes.txt").write_text("mine")
    message = run_palpate("demo", "--lab", lab, status=2)
    assert "holds sessions/notes.txt, which the demo did not list as its own; if nothing" in message
    assert (lab / "sessions" / "notes.txt").read_text() == "mine"


def test_a_demo_of_an_older_version_is_named_as_one(tmp_path, run_palpate):
    for name in (".palpate-demo", "lab.sqlite"):
        (tmp_path / name).touch()
    assert "was written by a demo of an older version" in run_palpate("demo", "--lab", tmp_path, status=2)
    assert (tmp_path / "lab.sqlite").exists()
