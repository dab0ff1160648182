"""pyglet as it is installed, without a display."""

from __future__ import annotations

import pytest


@pytest.fixture(scope="session")
def pyglet_input():
    """The package pyglet.input; importing it opens an invisible window unless it is told not to."""
    pyglet = pytest.importorskip("pyglet")
    pyglet.options["shadow_window"] = False
    return pytest.importorskip("pyglet.input")
