"""The whole-screen picture on the graphics card: one texture, kept, and drawn pixel for pixel."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from palpate.devices.window.geometry import Box, WindowError

if TYPE_CHECKING:
    from PIL import Image


class Texture:
    """One texture of the window's size, in the window's current context; `gl` is pyglet's."""

    def __init__(self, gl: Any, size: tuple[int, int]) -> None:
        self._gl, self._size = gl, size
        self._demand_room()
        self._name = gl.GLuint()
        gl.glGenTextures(1, self._name)
        gl.glBindTexture(gl.GL_TEXTURE_2D, self._name)
        for which in (gl.GL_TEXTURE_MIN_FILTER, gl.GL_TEXTURE_MAG_FILTER):
            gl.glTexParameteri(gl.GL_TEXTURE_2D, which, gl.GL_NEAREST)
        for which in (gl.GL_TEXTURE_WRAP_S, gl.GL_TEXTURE_WRAP_T):
            gl.glTexParameteri(gl.GL_TEXTURE_2D, which, gl.GL_CLAMP_TO_EDGE)
        width, height = size
        gl.glTexImage2D(gl.GL_TEXTURE_2D, 0, gl.GL_RGBA8, width, height, 0, gl.GL_RGBA, gl.GL_UNSIGNED_BYTE, None)

    def upload(self, picture: Image.Image, box: Box) -> None:
        """Take over a box of the picture; what of it lies outside of the window is left out.

        Pillow keeps a pixel of an RGB picture in four bytes, as the texture does: nothing need be converted.
        """
        inside = box.common(Box(0, 0, *self._size))
        if not inside.width or not inside.height:
            return
        gl = self._gl
        part = picture.crop((inside.left, inside.top, inside.right, inside.bottom))
        gl.glBindTexture(gl.GL_TEXTURE_2D, self._name)
        gl.glPixelStorei(gl.GL_UNPACK_ALIGNMENT, 4)
        gl.glTexSubImage2D(
            gl.GL_TEXTURE_2D, 0, inside.left, inside.top, inside.width, inside.height,
            gl.GL_RGBA, gl.GL_UNSIGNED_BYTE, part.tobytes("raw", "RGBX"),
        )  # fmt: skip

    def draw(self, boxes: Iterable[Box]) -> None:
        """Cover these boxes of the window with the texture: the picture's first row is at the top."""
        gl = self._gl
        self._plain_state()
        for box in boxes:
            gl.glScissor(box.left, self._size[1] - box.bottom, box.width, box.height)
            gl.glBegin(gl.GL_QUADS)
            for right, top in ((0, 0), (1, 0), (1, 1), (0, 1)):
                gl.glTexCoord2f(right, 1 - top)
                gl.glVertex2f(2 * right - 1, 2 * top - 1)
            gl.glEnd()
        gl.glDisable(gl.GL_TEXTURE_2D)

    def _plain_state(self) -> None:
        """No shader, no blending, no view but the window's own: PsychoPy leaves its own behind."""
        gl = self._gl
        gl.glUseProgram(0)
        for matrix in (gl.GL_PROJECTION, gl.GL_MODELVIEW):
            gl.glMatrixMode(matrix)
            gl.glLoadIdentity()
        for off in (gl.GL_BLEND, gl.GL_DEPTH_TEST, gl.GL_LIGHTING):
            gl.glDisable(off)
        gl.glViewport(0, 0, *self._size)
        gl.glEnable(gl.GL_SCISSOR_TEST)
        gl.glActiveTexture(gl.GL_TEXTURE0)
        gl.glEnable(gl.GL_TEXTURE_2D)
        gl.glBindTexture(gl.GL_TEXTURE_2D, self._name)
        gl.glTexEnvi(gl.GL_TEXTURE_ENV, gl.GL_TEXTURE_ENV_MODE, gl.GL_REPLACE)

    def _demand_room(self) -> None:
        gl = self._gl
        most = gl.GLint()
        gl.glGetIntegerv(gl.GL_MAX_TEXTURE_SIZE, most)
        if most.value < max(self._size):
            raise WindowError(f"the graphics card draws pictures up to {most.value} px; {self._size} px are needed")
