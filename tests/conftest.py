"""What holds for all tests: which of them are measured for coverage, and which come first."""

import pytest
from coverage import Coverage

TRACED = ("tests/protocols/", "tests/studies/", "tests/devices/streams/")
"""The tests of the two rooms whose coverage `make test` demands, wherever they lie; others do not count towards it."""
ELSEWHERE = ("tests/studies/window/", "tests/studies/test_kill.py")
"""What these test runs in processes of its own."""
LONGEST = ("tests/studies/test_kill.py", "tests/studies/window/")
"""Minutes of waiting for other processes: begun first, nobody waits for them in the end."""


def pytest_configure(config):
    config.addinivalue_line("markers", "untraced: it repeats often what other tests have measured for coverage already")


def pytest_collection_modifyitems(items):
    """Let the longest tests begin first; the others keep their order."""
    items.sort(key=lambda item: not item.nodeid.startswith(LONGEST))


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item):
    """Trace only what counts: traced, Python code takes two to three times as long, also where it is not measured."""
    stopped = [] if counts(item) else list(running())
    try:
        return (yield)
    finally:
        for tracer in reversed(stopped):
            tracer.start()


def counts(item):
    """Whether the test's coverage counts."""
    marked = item.get_closest_marker("untraced") is not None
    return item.nodeid.startswith(TRACED) and not item.nodeid.startswith(ELSEWHERE) and not marked


def running():
    """Every tracer, stopped: in a worker of xdist there are two, and the first goes on where the second one stops."""
    while (tracer := Coverage.current()) is not None:
        tracer.stop()
        yield tracer
