"""How what was drawn comes before the eye: all of it by a flip, or, where the processor draws, only what changed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from palpate.devices.window.geometry import Box

SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software rasterizer")
"""What the renderers call themselves that draw with the processor."""
EXTENSION = "GLX_MESA_copy_sub_buffer"
Copy = Callable[[Box], None]


def copier(handle: Any, renderer: str, height: int) -> Copy | None:
    """What copies a box of the drawn picture to the window of `handle` and leaves the drawn picture as it is.

    None where there is nothing but a flip: on a graphics card only a flip waits for the screen to be through, so that
    no frame is seen half old, and what was drawn before is then lost. A software renderer has no screen to wait for,
    and each pixel that it need not draw again is time won.
    """
    if not any(name in renderer.lower() for name in SOFTWARE) or not hasattr(handle, "_x_display"):
        return None
    from pyglet.gl import glFinish
    from pyglet.gl.glx_info import GLXInfo
    from pyglet.gl.glxext_arb import glXCopySubBufferMESA
    from pyglet.libs.x11.xlib import XSync

    display, drawable = handle._x_display, getattr(handle.context, "glx_window", None)
    if drawable is None or not GLXInfo(display).have_extension(EXTENSION):
        return None

    def copy(box: Box) -> None:
        glFinish()
        glXCopySubBufferMESA(display, drawable, box.left, height - box.bottom, box.width, box.height)
        XSync(display, False)

    return copy
