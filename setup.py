"""What pyproject.toml cannot say: where the packages lie, and the kernel in C.

The folders at the top are installed as subpackages of `palpate`. Without a compiler
the package is installed without the kernel.
"""

import os

from setuptools import Extension, find_namespace_packages, setup
from setuptools.command.build_ext import build_ext

FOLDERS = ("protocols", "signals", "devices", "studies", "analysis", "modeling", "participants_template")
"""Folders at the top; the package `palpate` has a link to each, for tools that do not read this file."""
FOLDER = "signals/models/native"
HEADERS = ("kernel.h", "set.h", "vector.h", "gemm.h", "attention.h", "plain.h", "recurrence.h", "spectral.h",
           "rates.h")  # fmt: skip
FLAGS = ["-std=gnu11", "-O3", "-fno-math-errno", "-ffp-contract=fast", "-fvisibility=hidden"]


class BuildKernel(build_ext):
    """The kernel is a plain library that is opened by ctypes: it has no call for Python to begin it with."""

    def get_export_symbols(self, ext: Extension) -> list[str]:
        """None of Python's."""
        return ext.export_symbols


kernel = Extension(
    "palpate.signals.models.native._kernel",
    sources=[f"{FOLDER}/kernel.c", f"{FOLDER}/autoregression.c"],
    depends=[f"{FOLDER}/{name}" for name in HEADERS],
    extra_compile_args=FLAGS,
    libraries=[] if os.name == "nt" else ["m"],
    optional=True,
)

setup(
    packages=[
        "palpate",
        *(f"palpate.{name}" for name in find_namespace_packages(include=[f"{folder}*" for folder in FOLDERS])),
    ],
    package_dir={"palpate": "palpate", **{f"palpate.{folder}": folder for folder in FOLDERS}},
    ext_modules=[kernel],
    cmdclass={"build_ext": BuildKernel},
)
