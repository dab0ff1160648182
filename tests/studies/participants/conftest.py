from __future__ import annotations

import pytest

from tests.studies.participants.labs import new_lab, postgres_schema


@pytest.fixture
def home(tmp_path):
    """A lab that `init` made, in a folder of its own."""
    return new_lab(tmp_path / "lab")


@pytest.fixture(params=["sqlite", pytest.param("postgres", marks=pytest.mark.needs("psycopg", "postgres"))])
def registry(request, tmp_path):
    """A lab's registry, at either kind of database."""
    if request.param == "sqlite":
        yield new_lab(tmp_path / "lab")
        return
    with postgres_schema() as url:
        yield new_lab(tmp_path / "lab", url)
