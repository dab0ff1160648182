"""The compiled kernel, if it was built, and those of its instruction sets that this processor has."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

VERSION = 2
"""Version of the program's layout (kernel.h)."""
NAME = "_kernel"
ANSWERED = 0


class KernelMissing(ValueError):
    """The error that there is no kernel to run a program with; the message says why, and what to do."""


class Program(ctypes.Structure):
    """`palpate_program` of kernel.h."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("set", "ops", "inputs", "outputs", "answer", "answer64")),
        *((name, ctypes.c_void_p) for name in ("op", "work", "work64", "weights", "doubles", "within", "out_affine")),
        ("x", ctypes.c_void_p),
        ("y", ctypes.c_void_p),
    )


@dataclass(frozen=True)
class InstructionSet:
    """A version of the kernel that computes `lanes` numbers at once; weights lie in panels of `panel` columns."""

    number: int
    name: str
    lanes: int

    @property
    def panel(self) -> int:
        """Return the number of columns of a panel: two vectors."""
        return 2 * self.lanes


@dataclass(frozen=True)
class Library:
    """The kernel's functions and its instruction sets that can be used here, the fastest first."""

    path: Path
    sets: tuple[InstructionSet, ...]
    step: Callable[[int], int]
    many: Callable[[int, int], int]
    calls: ctypes.CDLL


@cache
def library() -> Library:
    """Return the kernel. Raises KernelMissing if it was not built, has another version, or cannot be loaded."""
    here = Path(__file__).resolve().parent
    for suffix in EXTENSION_SUFFIXES:
        if (path := here / f"{NAME}{suffix}").is_file():
            return opened(path)
    raise KernelMissing("the kernel was not compiled when the package was installed; with GCC or Clang, install again.")


def opened(path: Path) -> Library:
    """Return the kernel in this file. Raises KernelMissing."""
    try:
        # The interpreter is not let go while a step runs: getting it back could take longer than the step.
        calls = ctypes.PyDLL(str(path))
        calls.palpate_version.restype = ctypes.c_int64
        version = int(calls.palpate_version())
    except (OSError, AttributeError) as error:
        raise KernelMissing(f"{path}: cannot be loaded ({error}). Install the package again.") from None
    if version != VERSION:
        raise KernelMissing(f"{path}: version {version}, {VERSION} is expected. Install the package again.")
    calls.palpate_sets.restype = ctypes.c_int64
    calls.palpate_set_name.restype, calls.palpate_set_lanes.restype = ctypes.c_char_p, ctypes.c_int64
    for name in ("palpate_set_name", "palpate_set_lanes", "palpate_set_usable"):
        getattr(calls, name).argtypes = (ctypes.c_int64,)
    numbers = [number for number in range(calls.palpate_sets()) if calls.palpate_set_usable(number)]
    sets = tuple(
        InstructionSet(number, calls.palpate_set_name(number).decode(), int(calls.palpate_set_lanes(number)))
        for number in numbers
    )
    calls.palpate_step.argtypes = (ctypes.c_void_p,)
    many = ctypes.CDLL(str(path)).palpate_many  # lets the interpreter go: many steps take long
    many.argtypes, many.restype = (ctypes.c_void_p, ctypes.c_int64), ctypes.c_int64
    return Library(path, sets, calls.palpate_step, many, calls)
