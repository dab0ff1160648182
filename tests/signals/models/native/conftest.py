"""The compiled kernel, for the tests that need it."""

from __future__ import annotations

import pytest

from palpate.signals.models.native.library import Library, library


@pytest.fixture(scope="module")
def kernel() -> Library:
    return library()
