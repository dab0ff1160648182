"""Generate the files of texture_similarity that follow from the shipped models: `python -m tools.similarity_table`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from statistics import mean, pstdev
from typing import Any

import click

from palpate.protocols.canonical import json_text
from palpate.protocols.files import file_sha256, write_text
from palpate.protocols.study import Stimulus
from palpate.protocols.tables import table_text
from palpate.studies.simulation.played_textures import friction_apart
from palpate.studies.simulation.virtual_textures import VirtualTextures

FOLDER = Path(__file__).resolve().parent.parent / "studies" / "texture_similarity"
TEXTURES = ("textured_rubber", "artificial_grass", "steel_mesh", "cloth", "cardboard", "plastic_mesh")
METHODS = {"AR": "ar", "DSTN": "dstn", "HapInf": "hapinf", "FoTEN": "foten_generative"}
SECONDS, SEED = 4.0, 7
PER_UNIT = {"level_dB": -2.5, "spectrum_dB": -5.0, "friction": -8.0}
"""Points of 100 that people subtract per dB, and per unit of friction: an assumption."""
SAME = 90.0
"""The mean answer where nothing differs: people scatter, and the scale ends at 100. Also an assumption."""
LATENT = "    Similarity: "
HEAD = ("id", "label", "texture", "method", "model", "file", *PER_UNIT)


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--renew", is_flag=True, help="Make the hands anew, too: if the simulated surfaces have changed.")
def main(renew: bool) -> None:
    """Make what texture_similarity holds of the shipped models. Run it when they have changed: tests fail until then.

    \b
    felt/TEXTURE.csv  a hand on each simulated surface, and what its tool vibrates with (only where it is missing)
    rendered.json     what each shipped model plays for that hand, and how alike that is
    stimuli.csv       the same three figures, by stimulus
    study.yaml        the weights that simulated people give them

    Everything goes to studies/texture_similarity. What people then feel, of 100, is printed. About 15 seconds; 30 more
    with --renew.
    """
    for texture in TEXTURES:
        file = FOLDER / "felt" / f"{texture}.csv"
        if renew or not file.is_file():
            write_hand(file, texture)
    records = {key: record for stimulus in planned() for key, record in rendered(stimulus)}
    write_text(FOLDER / "rendered.json", json_text(records, indent=1, sort_keys=True))
    rows = [row(stimulus) for stimulus in planned()]
    write_table(rows)
    write_weights(rows)
    for line in rating_table(rows):
        click.echo(line)


def write_hand(file: Path, texture: str) -> None:
    """Write the file of a hand that strokes over the simulated surface, which `palpate render --hand` reads, too."""
    from palpate.studies.simulation.texture_capturing import scene

    samples = zip(*scene(texture, SECONDS, SEED), strict=True)
    rows = ([f"{place / 1000:.3f}", *(f"{value:.4g}" for value in values)] for place, values in enumerate(samples))
    write_text(file, table_text(("t_s", "acceleration_m_s2", "speed_mm_s", "force_N"), rows))


def planned() -> Iterator[Stimulus]:
    """Yield every virtual texture as the study plans it."""
    for texture in TEXTURES:
        file = f"felt/{texture}.csv"
        sha256 = file_sha256(FOLDER / file)
        friction = f"{round(friction_apart(kinetic(texture)), 3):g}"
        for method, model in METHODS.items():
            columns = {
                "label": texture.replace("_", " "), "texture": texture, "method": method, "model": model, "file": file,
                "friction": friction,
            }  # fmt: skip
            yield Stimulus(id=f"{texture}_{method}", columns=columns, sha256=sha256)


def kinetic(texture: str) -> float:
    """Return the kinetic friction of a simulated surface."""
    from palpate.devices.surfaces.choice import surface_for
    from palpate.studies.simulation.texture_capturing import stimuli

    return surface_for(texture, stimuli()[texture]).kinetic_friction


def rendered(stimulus: Stimulus) -> Iterator[tuple[str, Any]]:
    """Yield the key of the stimulus' rendering by its model, and the rendering, computed now."""
    fresh = VirtualTextures(FOLDER, shipped=False)
    rendering = fresh.of(stimulus)
    yield from ((key, rendering.record()) for key in fresh.known)


def row(stimulus: Stimulus) -> Mapping[str, str]:
    """Return a row of the stimulus table."""
    differences = VirtualTextures(FOLDER).feels(stimulus)
    return {"id": stimulus.id, **stimulus.columns, **{name: f"{value:g}" for name, value in differences.items()}}


def write_table(rows: list[Mapping[str, str]]) -> None:
    """Write stimuli.csv."""
    write_text(FOLDER / "stimuli.csv", table_text(HEAD, ([row[name] for name in HEAD] for row in rows)))


def weights(rows: list[Mapping[str, str]]) -> dict[str, float]:
    """Return the latents of study.yaml: points per SD of a column over the stimuli, around the middle of the scale."""
    columns = {name: [float(row[name]) for row in rows] for name in PER_UNIT}
    level = SAME - 50.0 + sum(weight * mean(columns[name]) for name, weight in PER_UNIT.items())
    return {**{n: round(w * pstdev(columns[n]), 2) for n, w in PER_UNIT.items()}, "intercept": round(level, 2)}


def write_weights(rows: list[Mapping[str, str]]) -> None:
    """Write the latents' line of study.yaml."""
    file, inner = FOLDER / "study.yaml", ", ".join(f"{name}: {value:.2f}" for name, value in weights(rows).items())
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    if sum(line.startswith(LATENT) for line in lines) != 1:
        raise ValueError(f"{file}: one line that begins with {LATENT!r} is expected")
    changed = [f"{LATENT}{{{inner}}}\n" if line.startswith(LATENT) else line for line in lines]
    write_text(file, "".join(changed))


def rating_table(rows: list[Mapping[str, str]]) -> Iterator[str]:
    """Yield lines with the perceived rating of 100: each texture by each method, and the methods' means."""
    perceived = {(r["texture"], r["method"]): SAME + sum(w * float(r[n]) for n, w in PER_UNIT.items()) for r in rows}
    yield "| texture | " + " | ".join(METHODS) + " |"
    for texture in TEXTURES:
        yield f"| {texture} | " + " | ".join(f"{perceived[texture, method]:.0f}" for method in METHODS) + " |"
    yield "| mean | " + " | ".join(f"{mean(perceived[t, method] for t in TEXTURES):.1f}" for method in METHODS) + " |"


if __name__ == "__main__":
    main()
