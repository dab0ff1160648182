"""The front door: fast, thin and polite; which heavy packages a command and a rating session import."""

import subprocess
import sys

import pytest

from palpate import command_line

HEAVY = ("numpy", "pandas", "scipy", "sqlalchemy", "torch", "psychopy", "matplotlib", "pingouin", "statsmodels")


THRESHOLDS = (
    "palpate.protocols.fields", "palpate.protocols.procedures", "palpate.protocols.tasks.intervals",
    "palpate.studies.procedures", "palpate.devices.vibrator", "palpate.devices.fed_desk", "palpate.signals.vibration",
)  # fmt: skip
"""What studies with procedures and vibrations need, and no other study."""


def imported_by(*command_lines, among=HEAVY):
    """The packages that each of these command lines imports, one after another in a process of its own."""
    code = (
        "import sys\nfrom palpate import command_line\nbefore = set()\n"
        f"for words in {command_lines!r}:\n"
        "    try: command_line.main(list(words))\n    except SystemExit: pass\n"
        f"    now = {{name for name in {among!r} if name in sys.modules}}\n"
        "    print('imported', *sorted(now - before), file=sys.stderr)\n    before = now"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    lines = [line.split()[1:] for line in done.stderr.splitlines() if line.split()[:1] == ["imported"]]
    return dict(zip(command_lines, lines, strict=True))


def test_what_needs_nothing_heavy_imports_nothing_heavy():
    light = (("--help",), ("--version",), ("studies",), ("check", "door_ratings"), ("plan", "door_ratings"),
             *((verb, "--help") for verb in sorted(command_line.VERBS)))  # fmt: skip
    assert {words: heavy for words, heavy in imported_by(*light).items() if heavy} == {}


@pytest.mark.parametrize("verb", sorted(command_line.VERBS))
def test_the_help_of_every_verb_is_helpful(verb, run_palpate):
    text = run_palpate(verb, "--help")
    assert "Usage: palpate" in text and len(text) > 150


def test_a_simulated_rating_session_imports_no_arrays_and_no_tables(tmp_path):
    words = ("run", "door_ratings", "--participant", "P001", "--simulate", "--lab", str(tmp_path))
    assert imported_by(words, among=HEAVY + THRESHOLDS) == {words: ["sqlalchemy"]}


def test_a_threshold_session_imports_arrays_and_still_no_tables(tmp_path):
    words = ("run", "roughness_discrimination", "--participant", "P001", "--simulate", "--lab", str(tmp_path))
    [imported] = imported_by(words, among=HEAVY + THRESHOLDS).values()
    assert imported == [*sorted(THRESHOLDS[:4]), "sqlalchemy"]


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
