"""`palpate train doors` and `palpate evaluate doors`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.modeling.commands_data import DataOptions, data_options, exit_on_interrupt, progress_lines, read
from palpate.modeling.options import SEED, TO_MODELS, WORKERS, cluster_option, to_evaluated
from palpate.protocols.extras import MODELS
from palpate.studies.options import JSON, echo_json, names_in, needs_packages

if TYPE_CHECKING:
    from palpate.modeling.doors.evaluation.evaluate import DoorEvaluation
    from palpate.modeling.doors.registry import Direction

QUICK = click.option(
    "--quick", is_flag=True, help="Three folds, a few epochs on the stimuli alone: to try it out, not to use it."
)
SPLITS = ("grouped", "leave_one_door_out", "leaky")
TITLES = ("From force to feeling", "From feeling to force")
TIMES = (("train_s", "training", "s"), ("file_ms", "answer, ms", "ms"))
SHOWN = (
    (("mae", "MAE", "2"), ("rmse", "RMSE", "2"), ("r2", "R²", "3"), *TIMES),
    (("loop_fresh", "loop, people", "2"), ("loop_judge", "model", "2"), ("waveform_mae", "waveform %", "2"),
     ("corners_unplayable", "bad corners", "int"), *TIMES),
)  # fmt: skip
"""The columns of the two printed tables: name in the rows, heading, number format."""


@click.command("doors")
@needs_packages(*MODELS)
@data_options
@click.option(
    "--forward",
    metavar="METHOD",
    help="From force to feeling.  [default: the best of the lab's evaluation, else gaussian_process]",
)
@click.option("--inverse", metavar="METHOD", help="From feeling to force.  [default: likewise, else generator]")
@SEED
@QUICK
@WORKERS
@cluster_option()
@TO_MODELS
@JSON
def train_doors(
    source: DataOptions, forward: str | None, inverse: str | None, seed: int, quick: bool, workers: int | None,
    cluster: str | None, to: Path | None, as_json: bool,
) -> None:  # fmt: skip
    """Train both door models on all stimuli and write them as files that a rig reads.

    Writes door-perception and door-force, each a card (JSON) and its numbers (safetensors), to LAB/models. The cards
    hold the metrics of a cross-validation on grouped folds, intervals that hold 90 % of new ratings, and the run: data,
    versions, settings, seconds. Of a network also its learning curve. Stopped (Ctrl-C, a power cut), the same command
    goes on.

    Example: palpate train doors --lab LAB
    """
    from palpate.modeling.doors.evaluation.outputs import NAME, default_of
    from palpate.modeling.doors.registry import demand_file
    from palpate.modeling.doors.results import DoorOptions, folds_for
    from palpate.modeling.doors.training import Training, train_pair
    from palpate.modeling.evaluate.outputs import jobs_folder

    named: dict[Direction, str | None] = {"forward": forward, "inverse": inverse}
    for way, name in named.items():
        if name is not None:
            demand_file(way, name)
    with exit_on_interrupt("what is left"), progress_lines() as report:
        data, _ = read(source)
        methods = {way: name or default_of(source.lab, data, way) for way, name in named.items()}
        work = jobs_folder(source.lab, NAME)
        options = DoorOptions(
            seed=seed, quick=quick, folds=folds_for(quick), workers=workers, cluster=cluster, work=work
        )
        written = train_pair(data, Training(methods, to or source.lab / "models", options), report)
    if as_json:
        echo_json({way: model.plain() for way, model in written.items()})
        return
    for way, model in written.items():
        click.echo(f"{model.card}: {model.method}; {_scores_text(way, model.metrics)}")


def _scores_text(way: Direction, metrics: Any) -> str:
    """Return the main scores of a model as text."""
    if way == "forward":
        return f"MAE {metrics['mae']:.2f}, RMSE {metrics['rmse']:.2f} of unseen stimuli (0 to 100)"
    loop = metrics.get("loop_fresh", metrics.get("loop_judge"))
    text = "" if loop is None else f"loop error {loop:.2f} (0 to 100), "
    return f"{text}waveform MAE {metrics['waveform_mae']:.2f} %"


@click.command("doors")
@needs_packages(*MODELS)
@data_options
@click.option(
    "--methods", "names", metavar="NAMES", multiple=True,
    help="Only these: ridge,generator; forward:network for one direction.  [default: all]",
)  # fmt: skip
@click.option("--split", type=click.Choice(SPLITS), default="grouped", show_default=True, help="Which folds count.")
@SEED
@QUICK
@WORKERS
@cluster_option()
@click.option(
    "--figures/--no-figures", default=None, help="Whether to draw the figures.  [default: drawn, but not with --quick]"
)
@to_evaluated("doors")
@JSON
def evaluate_doors(
    source: DataOptions, names: tuple[str, ...], split: Any, seed: int, quick: bool, workers: int | None,
    cluster: str | None, figures: bool | None, to: Path | None, as_json: bool,
) -> None:  # fmt: skip
    """Evaluate every method of both directions on the same folds, and write tables, figures and a report.

    Folds are grouped by source: no stimulus is tested by a model that saw it or what was made from it. Writes
    evaluation.json, tables, figures and report.html to LAB/evaluated/doors. Finished trainings are kept there: stopped,
    the same command goes on, and a further method is trained alone.

    Example: palpate evaluate doors --lab LAB --methods ridge,generator
    """
    from palpate.modeling.doors.evaluation.evaluate import evaluate_doors as evaluated
    from palpate.modeling.doors.evaluation.outputs import NAME, folder_for, write_all
    from palpate.modeling.doors.results import DoorOptions, folds_for
    from palpate.modeling.evaluate.outputs import jobs_folder

    options = DoorOptions(
        methods=_methods(names),
        split=split,
        seed=seed,
        quick=quick,
        folds=folds_for(quick),
        workers=workers,
        cluster=cluster,
        work=jobs_folder(source.lab, NAME),
        beside=not quick,
    )
    with exit_on_interrupt("what is left"), progress_lines() as report:
        data, individual = read(source)
        evaluation = evaluated(data, individual, options, report)
        paths = write_all(
            evaluation, to or folder_for(source.lab, split), report, not quick if figures is None else figures
        )
    if as_json:
        from palpate.modeling.doors.evaluation.result_tables import as_json as results

        echo_json({**results(evaluation), "files": list(map(str, paths))})
        return
    _show(evaluation, paths[-1])


def _methods(names: tuple[str, ...]) -> dict[Direction, tuple[str, ...]] | None:
    """Return the methods by direction; None for all. Raises ModelDataError for an unknown name."""
    from palpate.modeling.doors.registry import FORWARD, INVERSE, methods_of
    from palpate.modeling.evaluate.rows import ModelDataError
    from palpate.protocols.did_you_mean import nearest

    entries = names_in(names)
    if not entries:
        return None
    chosen: dict[Direction, list[str]] = {"forward": [], "inverse": []}
    for entry in entries:
        way, _, name = entry.rpartition(":")
        if way not in ("", *chosen):
            raise ModelDataError(f"--methods {entry}: {way!r} is not a direction; {nearest(way, chosen)}")
        fitting: list[Direction] = [known for known in chosen if way in ("", known) and name in methods_of(known)]
        if not fitting:
            methods = {"forward": tuple(FORWARD), "inverse": tuple(INVERSE), "": (*FORWARD, *INVERSE)}[way]
            raise ModelDataError(f"--methods: no method {name!r}; {nearest(name, dict.fromkeys(methods))}")
        for direction in fitting:
            chosen[direction] += [name] if name not in chosen[direction] else []
    return {
        direction: tuple(name for name in methods_of(direction) if name in names) for direction, names in chosen.items()
    }


def _show(evaluation: DoorEvaluation, page: Path) -> None:
    """Print the tables, the default methods, the targets and the report's path."""
    from rich.console import Console
    from rich.table import Table

    from palpate.analysis.reports.tables import written
    from palpate.analysis.reports.terminal import print_banners
    from palpate.modeling.doors.evaluation.report import banners, reached

    print_banners(banners(evaluation))
    console = Console(highlight=False)
    for title, rows, columns in zip(TITLES, (evaluation.forward, evaluation.inverse), SHOWN, strict=True):
        if rows:
            table = Table(title=title, title_justify="left", box=None, pad_edge=False)
            table.add_column("method", no_wrap=True, min_width=max(len(row["method"]) for row in rows))
            for _, heading, _ in columns:
                table.add_column(heading, justify="right")
            for row in rows:
                table.add_row(row["method"], *(written(row[name], form) for name, _, form in columns))
            console.print(table)
    for choice in evaluation.choices.values():
        click.echo(f"default: {choice.method}. {choice.why} {' '.join(choice.of_ours)}".rstrip())
    for label, line in reached(evaluation):
        click.echo(f"{label}: {line}")
    click.echo(f"Look at {page}")
