"""The kernel in C, beside what pyproject.toml says: without a compiler the package is installed all the same."""

import os

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

FOLDER = "devices/models/native"
HEADERS = ("kernel.h", "set.h", "vector.h", "gemm.h", "attention.h", "plain.h", "recurrence.h", "spectral.h",
           "rates.h")  # fmt: skip
FLAGS = ["-std=gnu11", "-O3", "-fno-math-errno", "-ffp-contract=fast", "-fvisibility=hidden"]


class BuildKernel(build_ext):
    """The kernel is a plain library that is opened by ctypes: it has no call for Python to begin it with."""

    def get_export_symbols(self, ext: Extension) -> list[str]:
        """None of Python's."""
        return ext.export_symbols


kernel = Extension(
    "devices.models.native._kernel",
    sources=[f"{FOLDER}/kernel.c", f"{FOLDER}/autoregression.c"],
    depends=[f"{FOLDER}/{name}" for name in HEADERS],
    extra_compile_args=FLAGS,
    libraries=[] if os.name == "nt" else ["m"],
    optional=True,
)

setup(ext_modules=[kernel], cmdclass={"build_ext": BuildKernel})
