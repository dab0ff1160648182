"""Generate the pictures of the renderer's window: `python -m tools.texture_pictures`."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import click

from palpate.protocols.files import write_bytes
from palpate.studies.simulation.texture_capturing import stimuli
from tools.similarity_table import TEXTURES

LIGHT, PX, QUALITY = 3, 800, 78


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
def main() -> None:
    """Write devices/render/window/pictures/TEXTURE.jpg: each simulated surface under one light, at a known size.

    About five seconds for each of the six. Run it when the simulated surfaces have changed.
    """
    from palpate.devices.render.window.photo import PICTURES

    known = stimuli()
    for texture in TEXTURES:
        write(PICTURES / f"{texture}.jpg", texture, known[texture])


def write(path: Path, texture: str, columns: dict[str, str]) -> None:
    """Write one picture, whose density states its size."""
    from PIL import Image

    from palpate.devices.surfaces.choice import surface_for
    from palpate.devices.surfaces.fields import SIZE_MM
    from palpate.devices.surfaces.photo import light, photograph
    from palpate.devices.surfaces.relief import relief

    surface = surface_for(texture, columns)
    image = Image.fromarray(photograph(surface, relief(surface), light(LIGHT)))
    density = PX / SIZE_MM * 25.4
    small = image.resize((PX, PX), Image.Resampling.LANCZOS)
    picture = BytesIO()
    small.save(picture, "JPEG", quality=QUALITY, optimize=True, dpi=(density, density))
    write_bytes(path, picture.getvalue())


if __name__ == "__main__":
    main()
