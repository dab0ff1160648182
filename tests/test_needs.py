"""A test that needs what is missing is left out and counted; its file is not imported, and the full run of CI fails."""

from pathlib import Path

import pytest
from hypothesis import settings

from tests import needs

CONFTEST = Path(__file__).with_name("conftest.py")
FILE = """
import pytest
import no_such_package

pytestmark = pytest.mark.needs("no_such_package", "nothing")

def test_a(): ...

class TestB:
    def test_c(self): ...
"""
OTHER = """
import pytest

@pytest.mark.needs("no_such_package")
@pytest.mark.parametrize("x", [1, 2])
def test_d(x): ...

@pytest.mark.long
def test_e(): ...

def test_f(): ...
"""
pytest_plugins = ["pytester"]


@pytest.fixture
def run(pytester, monkeypatch):
    monkeypatch.setitem(needs.NEEDS, "no_such_package", needs.package("no_such_package", "models"))
    monkeypatch.setitem(needs.NEEDS, "nothing", needs.Need(lambda: True, ""))
    for name in ("CI", "PYTEST_ADDOPTS"):  # of the run that this test is part of
        monkeypatch.delenv(name, raising=False)
    pytester.makeconftest(CONFTEST.read_text(encoding="utf-8"))
    pytester.makepyfile(test_file=FILE, test_other=OTHER)
    profile = settings.get_current_profile_name()
    yield lambda *options: pytester.runpytest_inprocess("-p", "no:cacheprovider", *options)
    settings.load_profile(profile)


def test_what_is_left_out_is_counted_by_what_is_missing_with_the_command_that_runs_it(run):
    result = run()
    result.assert_outcomes(passed=1, skipped=5)
    result.stdout.fnmatch_lines([
        "takes long: 1 test left out; to run: make test-all",
        "no no_such_package: 4 tests left out; to run: make test EXTRAS=test,models",
    ])  # fmt: skip
    result.stdout.no_fnmatch_line("*nothing*")


@pytest.mark.parametrize(("ci", "outcomes"), [("", {"passed": 2, "skipped": 4}), ("true", {"passed": 2, "errors": 4})])
def test_the_full_run_runs_the_long_tests_and_fails_in_ci_for_what_is_missing(run, monkeypatch, ci, outcomes):
    monkeypatch.setenv("CI", ci)
    run("--all").assert_outcomes(**outcomes)


def test_what_passed_in_one_run_is_left_out_of_another_but_for_tests_of_what_is_imported(run, pytester):
    pytester.makepyfile(test_imports="import sys\ndef test_g(): assert 'sys' in sys.modules")
    run("--save-passed=passed").assert_outcomes(passed=2, skipped=5)
    run("--all", "--skip-passed=passed").assert_outcomes(passed=2, skipped=4, deselected=1)


def test_a_need_that_nobody_knows_is_refused(tmp_path):
    with pytest.raises(LookupError, match="'troch'.*torch"):
        needs.missing(["troch"])
