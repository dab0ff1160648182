"""`palpate train textures` and `palpate evaluate textures`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.modeling.commands_data import (
    FILE_OPTIONS,
    FILES,
    HELD_OPTIONS,
    demand_one,
    exit_on_interrupt,
    held_in,
    progress_lines,
)
from palpate.modeling.options import EPOCHS, SEED, TO_MODELS, WORKERS, cluster_option, to_evaluated
from palpate.protocols.extras import MODELS
from palpate.protocols.progress import Report
from palpate.studies.options import JSON, LAB, echo_json, names_in, needs_packages, with_options

if TYPE_CHECKING:
    from palpate.modeling.textures.evaluation.evaluate import TextureEvaluation, TextureOptions
    from palpate.modeling.textures.reading_tables import Held
    from palpate.modeling.textures.recording import Recording
    from palpate.modeling.textures.simulator import GetSimulator, TextureSimulator

COLUMNS = (
    ("kept", "kept", "int"), ("felt_dB", "dB", "2"), ("level", "level", "text"), ("smoothed_gfc", "GFC", "3"),
    ("envelope", "env", "2"), ("cycle_excess", "rep", "2"), ("mae", "MAE", "3"), ("step_us", "µs", "0"),
    ("train_s", "train", "s"),
)  # fmt: skip
"""The columns of the printed table of methods: name in the rows, heading, number format."""
OPTIONS = (
    LAB,
    *FILE_OPTIONS,
    click.option("--simulated", is_flag=True, help="Six simulated surfaces, 20 s each, instead of the lab's captures."),
    click.option("--textures", metavar="NAMES", multiple=True, help="Only these: cloth,cardboard.  [default: all]"),
    *HELD_OPTIONS,
    SEED,
    click.option("--quick", is_flag=True, help="A few epochs, ten seconds: to try it out, not to use it."),
    EPOCHS,
    click.option("--batch", type=click.IntRange(1), help="Windows at a time.  [default: each method's own]"),
    WORKERS,
    cluster_option(),
    click.option(
        "--methods", metavar="NAMES", multiple=True,
        help="Only these: ar,foten_generative.  [default of evaluate: all; of train: the best of the lab's evaluation]",
    ),
)  # fmt: skip
"""The options of both verbs."""
SOURCES = (*FILES, "simulated")
OWN = ("lab", *SOURCES, "seed", "quick", "epochs", "batch", "workers", "cluster")


@dataclass(frozen=True)
class TextureRequest:
    """The recordings that the command line selects, and the options of the evaluation or training."""

    lab: Path
    tables: tuple[Path, ...]
    simulated: bool
    textures: tuple[str, ...]
    held: Held | None
    methods: tuple[str, ...]
    seed: int
    quick: bool
    epochs: int | None
    batch: int | None
    workers: int | None
    cluster: str | None
    hatt: Path | None = None
    cluster_data: Path | None = None


def texture_options(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with the options of both verbs, which it receives as one `TextureRequest`."""

    @wraps(command)
    def with_request(**values: Any) -> None:
        own = {name: values.pop(name) for name in OWN}
        demand_one(own, SOURCES)
        held = held_in(values, own["tables"])
        textures, methods = (names_in(values.pop(name)) for name in ("textures", "methods"))
        command(TextureRequest(textures=textures, methods=methods, held=held, **own), **values)

    return with_options(with_request, OPTIONS)


def recordings_for(request: TextureRequest, simulator: TextureSimulator, report: Report) -> tuple[Recording, ...]:
    """Return the requested recordings. Raises TextureDataError, or the errors of reading a lab."""
    from palpate.modeling.evaluate.outputs import jobs_folder
    from palpate.modeling.textures.evaluation.outputs import NAME
    from palpate.modeling.textures.recording import TextureDataError
    from palpate.protocols.did_you_mean import nearest

    report("reading recordings")
    if request.simulated:
        from palpate.modeling.textures.simulated import SIX, simulated

        unknown = [name for name in request.textures if name not in SIX]
        if unknown:
            raise TextureDataError(f"--textures: no texture {unknown[0]!r}; {nearest(unknown[0], SIX)}")
        return simulated(
            simulator, request.textures or SIX, cache=jobs_folder(request.lab, NAME) / "recordings", report=report
        )
    recordings = _recorded(request)
    known = {recording.texture: recording for recording in recordings}
    unknown = [name for name in request.textures if name not in known]
    if unknown:
        raise TextureDataError(f"--textures: no recording of {unknown[0]!r}; {nearest(unknown[0], known)}")
    return tuple(known[name] for name in request.textures) if request.textures else recordings


def _recorded(request: TextureRequest) -> tuple[Recording, ...]:
    """Return the recordings of the requested files, or else of the lab's sessions."""
    if request.tables:
        from palpate.modeling.textures.reading_tables import read_tables

        paths = request.tables[0] if len(request.tables) == 1 else request.tables
        return read_tables(paths, held=request.held)
    if request.hatt is not None:
        from palpate.modeling.textures.reading_hatt import read_hatt

        return read_hatt(request.hatt, request.textures)
    if request.cluster_data is not None:
        from palpate.modeling.textures.reading_cluster import read_cluster

        return read_cluster(request.cluster_data, request.textures)
    from palpate.modeling.textures.reading_ledgers import read_lab

    return read_lab(request.lab)


def options_for(request: TextureRequest, methods: tuple[str, ...] | None, grid: tuple[str, ...] = ()) -> TextureOptions:
    """Return the options of the evaluation or the training. Raises TextureDataError for an unknown method."""
    from palpate.modeling.evaluate.outputs import jobs_folder
    from palpate.modeling.textures.evaluation.evaluate import TextureOptions
    from palpate.modeling.textures.evaluation.outputs import NAME
    from palpate.modeling.textures.registry import demand_known

    demand_known(methods or ())
    settings = {
        name: value for name, value in (("epochs", request.epochs), ("batch", request.batch)) if value is not None
    }
    return TextureOptions(
        work=jobs_folder(request.lab, NAME), methods=methods, explore=request.simulated, grid=grid, seed=request.seed,
        quick=request.quick, settings=settings, workers=request.workers, cluster=request.cluster,
    )  # fmt: skip


@click.command("textures")
@needs_packages(*MODELS)
@texture_options
@TO_MODELS
@JSON
@click.pass_obj
def train_textures(get_simulator: GetSimulator, request: TextureRequest, to: Path | None, as_json: bool) -> None:
    """Train a model of each texture and write it as a file that the renderer plays.

    Writes texture-TEXTURE-METHOD, a card (JSON) and its numbers (safetensors), to LAB/models. The cards hold the
    metrics of the test part and of a free run, what a touch begins with, and the run: data, versions, settings,
    seconds. Of a network also its learning curve. Stopped (Ctrl-C, a power cut), the same command goes on.

    Example: palpate train textures --lab LAB --methods foten_generative
    """
    from palpate.modeling.textures.evaluation.outputs import default_of
    from palpate.modeling.textures.training import train_textures as trained

    options = options_for(request, request.methods or None)
    with exit_on_interrupt("what is left"), progress_lines() as report:
        simulator = get_simulator()
        recordings = recordings_for(request, simulator, report)
        methods = options.methods or (default_of(request.lab, recordings),)
        written = trained(
            recordings, simulator, replace(options, methods=methods), to or request.lab / "models", report
        )
    if as_json:
        echo_json([model.plain() for model in written])
        return
    for model in written:
        click.echo(f"{model.card}: {_scores_text(model.metrics)}")
        for line in model.cautions:
            click.secho(f"  {line}", fg="yellow")


def _scores_text(metrics: Any) -> str:
    """Return the main scores of a model as text."""
    free = "not run free"
    if "free_level" in metrics and "free_felt_dB" in metrics:
        free = f"running free: level {metrics['free_level']:.2f}, felt {metrics['free_felt_dB']:.1f} dB off"
    one_step = f"one step ahead: MAE {metrics['mae']:.3f} SDs" if "mae" in metrics else ""
    return "; ".join(part for part in (free, one_step) if part)


@click.command("textures")
@needs_packages(*MODELS)
@texture_options
@click.option(
    "--figure-4-5", "figure_4_5", is_flag=True, help="Compare five windows by five losses of FoTEN too: takes hours."
)
@click.option(
    "--table-4-2",
    "table_4_2",
    is_flag=True,
    help="The same for FoTEN and all its variants: takes days; with --textures cloth --epochs 3, an hour on one core.",
)
@click.option("--figures/--no-figures", default=True, help="Whether to draw the figures.")
@to_evaluated("textures")
@JSON
@click.pass_obj
def evaluate_textures(
    get_simulator: GetSimulator,
    request: TextureRequest,
    figure_4_5: bool,
    table_4_2: bool,
    figures: bool,
    to: Path | None,
    as_json: bool,
) -> None:
    """Evaluate every method on every texture, running free and one step ahead, and write tables, figures and a report.

    Each model runs on its own output for a minute under a hand that it did not see, through the renderer's player,
    and is compared with the truth. Writes evaluation.json, tables, figures and report.html to LAB/evaluated/textures.
    Finished trainings are kept there: stopped, the same command goes on, and a further method is trained alone.

    Example: palpate evaluate textures --simulated --methods ar,foten_generative
    """
    from palpate.modeling.evaluate.outputs import evaluation_folder
    from palpate.modeling.textures.evaluation.evaluate import domain_for, evaluate_methods
    from palpate.modeling.textures.evaluation.outputs import NAME, write_all
    from palpate.modeling.textures.evaluation.outputs import as_json as results
    from palpate.modeling.textures.evaluation.tables import VARIANTS
    from palpate.modeling.textures.registry import THESIS

    grid = VARIANTS if table_4_2 else (THESIS,) if figure_4_5 else ()
    options = options_for(request, request.methods or None, grid)
    with exit_on_interrupt("what is left"), progress_lines() as report:
        simulator = get_simulator()
        recordings = recordings_for(request, simulator, report)
        evaluation = evaluate_methods(domain_for(recordings, simulator, options), options, report)
        paths = write_all(evaluation, to or evaluation_folder(request.lab, NAME), report, figures)
    if as_json:
        echo_json({**results(evaluation), "files": list(map(str, paths))})
        return
    _show(evaluation, paths[-1])


def _show(evaluation: TextureEvaluation, page: Path) -> None:
    """Print the table of methods, the default method, the targets and the report's path."""
    from rich.console import Console

    from palpate.analysis.reports.terminal import methods_table, print_banners
    from palpate.modeling.textures.evaluation.report import banners, choice_of
    from palpate.modeling.textures.evaluation.tables import method_rows
    from palpate.modeling.textures.evaluation.targets import reached

    print_banners(banners(evaluation))
    rows = method_rows(evaluation)
    for row in rows:
        low, high = row["level_low"], row["level_high"]
        row |= {
            "level": None if low is None else f"{low:.2f}-{high:.2f}",
            "kept": row["kept"] if row["ran"] else None,
        }
    Console(highlight=False).print(methods_table(rows, COLUMNS))
    chosen = choice_of(evaluation)
    click.echo(f"default: {chosen.method}. {chosen.why} {' '.join(chosen.of_ours)}".rstrip())
    for label, line in reached(evaluation):
        click.echo(f"{label}: {line}")
    click.echo(f"Look at {page}")
