from __future__ import annotations

from functools import lru_cache

import pytest

from tests.studies.labs import Lab


@pytest.fixture
def lab(tmp_path) -> Lab:
    return Lab(tmp_path)


@pytest.fixture(scope="session")
def shared_grounds():
    """Compute once for all tests what the tip feels of a texture: it depends on nothing but the texture."""
    from palpate.devices.surfaces import scene

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scene, "ground_of", lru_cache(maxsize=8)(scene.ground_of))
        yield
