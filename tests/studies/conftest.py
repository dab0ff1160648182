from __future__ import annotations

import pytest

from tests.studies.labs import Lab


@pytest.fixture
def lab(tmp_path) -> Lab:
    return Lab(tmp_path)
