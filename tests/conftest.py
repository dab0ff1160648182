"""What holds for all tests: which of them can run here, which are measured for coverage, and which come first."""

import ast
import gc
import json
import os
import re
import sys
import warnings
from collections import Counter
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

import pytest
from hypothesis import settings

import palpate.protocols
import palpate.studies
from tests.needs import NEEDS, missing, needs_of_file, tests_of_file

TRACED = (
    "tests/protocols/",
    "tests/studies/",
    "tests/devices/streams/",
    "tests/benchmarks/streams/",
    "tests/benchmarks/test_sessions.py",
)
"""The tests of the two rooms whose coverage `make test-all` demands, wherever they lie; no others count."""
ELSEWHERE = ("tests/studies/window/", "tests/studies/sessions/test_kill.py")
"""What these test runs in processes of its own."""
LONGEST = (
    "tests/faults/test_commands.py",
    "tests/studies/sessions/test_kill.py",
    "tests/studies/window/",
    "tests/snapshots/test_evaluations.py",
    "tests/snapshots/test_reports.py",
)
"""Each takes a minute or more, so it starts first."""
LONG = "long"
WORD = re.compile(r"\w+")
AGAIN = ("tests/devices/models/", "tests/devices/render/", "tests/benchmarks/render/", "tests/test_recorded")
"""What CI runs bare and again with everything installed: the kernel takes part in it."""
AGAIN_IN_FULL = "again"
"""The property of a test that the full run repeats, also where it passed before."""


def pytest_addoption(parser):
    parser.addoption("--all", action="store_true", help="run the long tests, too; with CI set, what is missing fails")
    parser.addoption("--save-passed", metavar="FILE", help="write down which tests passed")
    parser.addoption("--skip-passed", metavar="FILE", help="leave out what passed, but for what extras may change")


def pytest_configure(config):
    config.addinivalue_line("markers", "needs(*names): what the test needs beside the extra `test`, by tests/needs.py")
    config.addinivalue_line("markers", "long: takes long, and runs only with --all (`make test-all`)")
    config.addinivalue_line("markers", "untraced: it repeats often what other tests have measured for coverage already")
    if not config.getoption("all"):
        settings.register_profile("bare", settings.default, max_examples=25, deadline=None)
        settings.load_profile("bare")


@pytest.fixture(scope="session")
def full_run(request):
    """Whether everything is to run (`--all`), or what a bare machine does in five minutes."""
    return request.config.getoption("all")


@pytest.fixture
def run_palpate():
    """Return a function that runs `palpate ...`, checks its exit code and returns its output; above 1, its error."""
    from tests.commands_for_tests import run_command

    def run(*arguments, status=0):
        code, out, err = run_command(*arguments)
        assert code == status, err
        assert "Traceback" not in err
        return err if status > 1 else out

    return run


class FileLeftOut(pytest.File):
    """A file that cannot be imported for want of something: its tests, one by function, are left out."""

    def collect(self):
        for name in tests_of_file(self.path):
            yield TestLeftOut.from_parent(self, name=name)


class TestLeftOut(pytest.Item):
    """A test of a file that was not imported."""

    def runtest(self):
        raise AssertionError("a test that is left out was run")

    def reportinfo(self):
        return self.path, None, self.name


def pytest_pycollect_makemodule(module_path, parent):
    """Do not import a file whose `pytestmark` names something that is missing."""
    if missing(names := needs_of_file(module_path)):
        file = FileLeftOut.from_parent(parent, path=module_path)
        file.add_marker(pytest.mark.needs(*names))
        return file
    return None


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Leave the test out where something is missing; the report carries its name to where the run is summed up."""
    names = missing([name for marker in item.iter_markers("needs") for name in marker.args])
    demanded = item.config.getoption("all")
    if names and demanded and os.environ.get("CI"):
        pytest.fail(f"not on this machine: {', '.join(names)}", pytrace=False)
    if item.get_closest_marker(LONG) and not demanded:
        names.append(LONG)
    if names:
        item.user_properties.append(("missing", names))
        pytest.skip(f"missing: {', '.join(names)}")
    if item.config.getoption("save_passed") and runs_again(item):
        item.user_properties.append((AGAIN_IN_FULL, True))


def pytest_terminal_summary(terminalreporter):
    """Say for each missing thing how many tests were left out, and how they are run."""
    skipped = terminalreporter.stats.get("skipped", [])
    left_out = Counter(name for report in skipped for name in dict(report.user_properties).get("missing", ()))
    for name, count in sorted(left_out.items()):
        why, command = ("takes long", "make test-all") if name == LONG else (f"no {name}", NEEDS[name].command)
        terminalreporter.write_line(f"{why}: {count} test{'s' * (count > 1)} left out; to run: {command}")
    if file := terminalreporter.config.getoption("save_passed"):
        Path(file).write_text(json.dumps(passed_tests(terminalreporter.stats)), encoding="utf-8")


def passed_tests(stats):
    """Return which tests passed for good (AGAIN_IN_FULL), and the files in which all did."""
    ended = {report.nodeid for reports in stats.values() for report in reports if isinstance(report, pytest.TestReport)}
    passed = {
        report.nodeid for report in stats.get("passed", []) if not dict(report.user_properties).get(AGAIN_IN_FULL)
    }
    files = {file_of(name) for name in passed} - {file_of(name) for name in ended if name not in passed}
    return {"passed": sorted(passed), "files": sorted(files)}


def file_of(name):
    """Return the file of a test, from the repository's root."""
    return name.partition("::")[0]


@cache
def passed_before(file):
    """Return what another run saved: the names of tests that passed for good, and the files in which all did."""
    saved = json.loads(Path(file).read_text(encoding="utf-8"))
    return set(saved["passed"]), set(saved["files"])


def pytest_ignore_collect(collection_path, config):
    """Do not import a file all of whose tests passed in another run."""
    if file := config.getoption("skip_passed"):
        return collection_path.relative_to(config.rootpath).as_posix() in passed_before(file)[1] or None
    return None


def pytest_collection_modifyitems(config, items):
    """Let the longest tests begin first, the others keep their order; leave out what passed in another run."""
    items.sort(key=lambda item: not item.nodeid.startswith(LONGEST))
    if file := config.getoption("skip_passed"):
        passed, _ = passed_before(file)
        config.hook.pytest_deselected(items=[item for item in items if item.nodeid in passed])
        items[:] = [item for item in items if item.nodeid not in passed]


def runs_again(item):
    """Whether the test is a longer one in the full run, or what is installed may change what it finds."""
    longer = "full_run" in item.fixturenames or item.get_closest_marker("hypothesis") is not None
    return longer or item.nodeid.startswith(AGAIN) or item.originalname in look_at_imports(item.path)


@cache
def look_at_imports(path):
    """Return the names of the file's tests that look at what is imported, themselves or by something in their file."""
    parts = {
        name: ast.unparse(node) for node in ast.parse(path.read_text(encoding="utf-8")).body for name in names_of(node)
    }
    looking = {name for name, text in parts.items() if "sys.modules" in text}
    while more := {name for name, text in parts.items() if name not in looking and looking & set(WORD.findall(text))}:
        looking |= more
    return looking


def names_of(node):
    """Return the names that a statement at the top of a file defines."""
    targets = getattr(node, "targets", [node])
    return [name for target in targets if (name := getattr(target, "name", getattr(target, "id", None)))]


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection(session):
    """Trace the import of what coverage is measured of, and nothing else of the collection: it takes twice as long.

    What is collected stays to the end, so nothing looks for what could be freed among it, then or later.
    """
    if measured():
        import_rooms()
    stopped = list(running())
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()
        start_again(stopped)


def import_rooms():
    """Import every module of the two rooms that can be imported on this machine: their definitions count as run."""
    for room in (palpate.protocols, palpate.studies):
        for module in walk_packages(room.__path__, f"{room.__name__}."):
            with suppress(ImportError), warnings.catch_warnings(action="ignore"):
                import_module(module.name)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item):
    """Trace only what counts: traced, Python code takes two to three times as long, also where it is not measured."""
    stopped = [] if counts(item) else list(running())
    try:
        return (yield)
    finally:
        start_again(stopped)


def counts(item):
    """Whether the test's coverage counts."""
    marked = item.get_closest_marker("untraced") is not None
    return item.nodeid.startswith(TRACED) and not item.nodeid.startswith(ELSEWHERE) and not marked


def measured():
    """Return the tracer that coverage is measured by, or None."""
    return sys.modules["coverage"].Coverage.current() if "coverage" in sys.modules else None


def running():
    """Every tracer, stopped: in a worker of xdist there are two, and the first goes on where the second one stops."""
    while (tracer := measured()) is not None:
        tracer.stop()
        yield tracer


def start_again(stopped):
    """Start the tracers again that were stopped."""
    for tracer in reversed(stopped):
        tracer.start()
