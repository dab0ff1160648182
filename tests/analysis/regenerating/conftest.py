import pytest

from tests.analysis.regenerating.small_lab import page_of, small_study


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    """The small data set, regenerated once for all that is shown of it."""
    return small_study(tmp_path_factory.mktemp("small_lab"))


@pytest.fixture(scope="session")
def page(small):
    return page_of(small)
