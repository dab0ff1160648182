"""What a test may need beside the extra `test`: how to see whether this machine has it, and how to get it.

A test says so by the marker `needs`, a whole file by `pytestmark = pytest.mark.needs("torch")`; NEEDS has the names.
"""

from __future__ import annotations

import ast
import ctypes.util
import os
import platform
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path


@dataclass(frozen=True)
class Need:
    """One thing that a machine may be without, and the command that gets it and runs the tests."""

    is_there: Callable[[], bool]
    command: str


def package(name: str, extra: str) -> Need:
    """Return the need of a Python package that one of our extras installs."""
    return Need(lambda: find_spec(name) is not None, f"make test EXTRAS=test,{extra}")


def system(is_there: Callable[[], bool], debian: str, command: str = "make test") -> Need:
    """Return the need of something that the system's own packages install."""
    return Need(is_there, f"sudo apt-get install {debian} && {command}")


def has_programs(*names: str) -> bool:
    """Whether all programs are on the PATH."""
    return all(shutil.which(name) for name in names)


def has_kernel() -> bool:
    """Whether the kernel of models was compiled when the package was installed, and can be loaded."""
    from palpate.signals.models.native.library import KernelMissing, library

    try:
        library()
    except KernelMissing:
        return False
    return True


def has_seccomp() -> bool:
    """Whether the kernel filters system calls for this process, by the numbers in tests/faults/machine.py."""
    actions = Path("/proc/sys/kernel/seccomp/actions_avail")
    return platform.machine() == "x86_64" and actions.exists() and "user_notif" in actions.read_text()


def has_tmpfs() -> bool:
    """Whether a process may mount a file system in memory: as root, or where user namespaces are permitted."""
    from tests.faults.machine import may_mount

    return sys.platform == "linux" and may_mount()


def has_fonts() -> bool:
    """Whether the window finds fonts for Korean, Hindi and Chinese."""
    from palpate.devices.window.fonts import find_fonts
    from palpate.devices.window.geometry import WindowError

    try:
        find_fonts("ko").demand(["한국어", "कड़ा", "直"])
    except WindowError:
        return False
    return True


NEEDS = {
    "torch": package("torch", "models"),
    "librosa": package("librosa", "features"),
    "pywt": package("pywt", "features"),
    "skimage": package("skimage", "features"),
    "distributed": package("distributed", "cluster"),
    "flask": package("flask", "monitor"),
    "nidaqmx": package("nidaqmx", "rig"),
    "psychopy": package("psychopy", "lab"),
    "questplus": package("questplus", "lab"),
    "psycopg": package("psycopg", "postgres"),
    "pyarrow": package("pyarrow", "export"),
    "pylsl": package("pylsl", "rig"),
    "serial": package("serial", "rig"),
    "sounddevice": package("sounddevice", "rig"),
    "bids-validator": package("bids_validator_deno", "dev"),
    "selenium": package("selenium", "dev"),
    "chromium": system(partial(has_programs, "chromium", "chromedriver"), "chromium chromium-driver"),
    "compiler": system(has_kernel, "gcc libc6-dev", "make clean test"),
    "fonts": system(has_fonts, "libfribidi0 fonts-noto-core fonts-noto-cjk"),
    "pgrep": system(partial(has_programs, "pgrep"), "procps"),
    "portaudio": system(lambda: ctypes.util.find_library("portaudio") is not None, "libportaudio2"),
    "xvfb": system(partial(has_programs, "Xvfb"), "xvfb xauth libglu1-mesa libfontconfig1"),
    "postgres": Need(
        lambda: bool(os.environ.get("PALPATE_TEST_POSTGRES")),
        "PALPATE_TEST_POSTGRES=postgresql+psycopg://USER@HOST/DATABASE make test EXTRAS=test,postgres",
    ),
    "linux": Need(lambda: sys.platform == "linux", "make test, on Linux"),
    "glibc": Need(lambda: platform.libc_ver()[0] == "glibc", "make test, on a Linux with glibc"),
    "seccomp": Need(has_seccomp, "make test, on Linux on x86_64 with seccomp"),
    "tmpfs": Need(has_tmpfs, "make test, as root on Linux, or where user namespaces are permitted"),
    "posix": Need(lambda: os.name == "posix", "make test, on Linux or macOS"),
}


@cache
def is_there(name: str) -> bool:
    """Whether this machine has what the name stands for. Raises LookupError for an unknown name."""
    if name not in NEEDS:
        raise LookupError(f"no need is named {name!r}; tests/needs.py has {', '.join(NEEDS)}")
    return NEEDS[name].is_there()


def missing(names: list[str]) -> list[str]:
    """Return those of the names that this machine is without."""
    return [name for name in dict.fromkeys(names) if not is_there(name)]


def needs_of_file(path: Path) -> list[str]:
    """Return what the file says in its `pytestmark`, without importing it."""
    text = path.read_text(encoding="utf-8")
    if "pytestmark" not in text:
        return []
    return [name for statement in ast.parse(text).body if is_pytestmark(statement) for name in needs_in(statement)]


def is_pytestmark(statement: ast.stmt) -> bool:
    """Whether the statement assigns `pytestmark`."""
    return isinstance(statement, ast.Assign) and ast.unparse(statement.targets[0]) == "pytestmark"


def needs_in(statement: ast.stmt) -> Iterator[str]:
    """Yield the arguments of every `pytest.mark.needs(...)` within the statement."""
    for node in ast.walk(statement):
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "pytest.mark.needs":
            yield from (ast.literal_eval(argument) for argument in node.args)


def tests_of_file(path: Path) -> Iterator[str]:
    """Yield the names of the file's test functions, those of a class as CLASS::NAME, without importing it."""
    for statement in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(statement, ast.FunctionDef) and statement.name.startswith("test"):
            yield statement.name
        elif isinstance(statement, ast.ClassDef) and statement.name.startswith("Test"):
            methods = (method for method in statement.body if isinstance(method, ast.FunctionDef))
            yield from (f"{statement.name}::{method.name}" for method in methods if method.name.startswith("test"))
