"""The command `bench`: areas by name, each an iterator of cases in a module that is imported when it is measured."""

from __future__ import annotations

from pathlib import Path

import click

from palpate.protocols.registry import load_object

AREAS = {
    "statistics": "benchmarks.statistics.cases:cases",
    "thresholds": "benchmarks.thresholds:cases",
    "choices": "benchmarks.choices:cases",
    "sessions": "benchmarks.sessions:sessions",
    "startup": "benchmarks.sessions:startup",
    "scale": "benchmarks.scale:cases",
    "window": "benchmarks.window.cases:cases",
    "plant": "benchmarks.plant.cases:cases",
    "serial": "benchmarks.serial:cases",
    "sensors": "benchmarks.sensors:cases",
    "tracker": "benchmarks.tracker:cases",
    "tablet": "benchmarks.tablet:cases",
    "surfaces": "benchmarks.surfaces:cases",
    "streams": "benchmarks.streams.cases:cases",
    "alignment": "benchmarks.alignment.cases:cases",
    "doors": "benchmarks.doors.cases:cases",
    "render": "benchmarks.render.cases:cases",
    "synthesis": "benchmarks.synthesis.cases:cases",
    "textures": "benchmarks.attributes.cases:cases",
    "free-running": "benchmarks.synthesis.cases:free_running",
    "actuator": "benchmarks.actuator:cases",
    "sound": "benchmarks.sound:cases",
    "camera": "benchmarks.camera:cases",
    "profiles": "benchmarks.profiles:cases",
    "power": "benchmarks.power:cases",
    "intervals": "benchmarks.intervals:cases",
    "library": "benchmarks.library:cases",
}
FIGURES = {"plant": "benchmarks.plant.cases:figures", "alignment": "benchmarks.alignment.cases:figures"}
"""Pictures that an area draws besides its work-precision plots."""


@click.command()
@click.argument("area", nargs=-1, type=click.Choice(list(AREAS)))
@click.option("--quick", is_flag=True, help="Smaller inputs and fewer repeats.")
@click.option("--json", "as_json", is_flag=True, help="Print the rows as JSON.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default=Path("bench"), show_default=True,
              help="Folder for the work-precision plots.")  # fmt: skip
def bench(area: tuple[str, ...], quick: bool, as_json: bool, out: Path) -> None:
    """Measure errors and times side by side, in one run on the same inputs; without AREA, everything.

    A row: area, case, method, error, error_kind, seconds (median), peak_MB, n, input.

    \b
    Example:
      palpate bench statistics --quick
    """
    from rich.console import Console

    from palpate.analysis.measuring.rows import as_json as rows_as_json
    from palpate.analysis.measuring.rows import run_bench
    from palpate.analysis.measuring.work_precision import print_table
    from palpate.analysis.measuring.work_precision_plot import save_plots

    chosen = {name: load_object(AREAS[name])(quick) for name in area or AREAS}
    with Console(stderr=True).status("measuring") as status:
        rows = run_bench(chosen, status.update)
    if as_json:
        click.echo(rows_as_json(rows), nl=False)
        return
    print_table(rows)
    further = [path for name in chosen if name in FIGURES for path in load_object(FIGURES[name])(out, quick)]
    for path in (*save_plots(rows, out), *further):
        click.echo(f"saved {path}")
