"""pyglet as it is installed, without a display."""

from __future__ import annotations

import pytest


@pytest.fixture(scope="session")
def pyglet_input():
    """The package pyglet.input; importing it opens an invisible window unless it is told not to."""
    import pyglet

    pyglet.options["shadow_window"] = False
    import pyglet.input

    return pyglet.input
