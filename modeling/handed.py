"""What the front door hands to the verbs of this room: the rig's sides of what is modelled, made when asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from palpate.modeling.textures.set_side import TextureSetSide
    from palpate.modeling.textures.side import TextureSide


class Handed(Protocol):
    """Modeling never imports a device: click's context object is one of these."""

    def textures(self) -> TextureSide:
        """The rig's side of textures."""

    def texture_set(self) -> TextureSetSide:
        """What makes sets of simulated textures."""
