"""The compiled kernel, for the tests that need it."""

from __future__ import annotations

import pytest

from devices.models.native.library import KernelMissing, Library, library


@pytest.fixture(scope="module")
def kernel() -> Library:
    try:
        return library()
    except KernelMissing as missing:
        pytest.skip(f"{missing}")
