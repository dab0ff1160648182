"""`palpate train attributes` and `palpate evaluate attributes`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.modeling.commands_data import (
    RECORDING_OPTIONS,
    demand_folder_alone,
    exit_on_interrupt,
    progress_lines,
    requested_recordings,
)
from palpate.modeling.options import EPOCHS, SEED, TO_MODELS, WORKERS, cluster_option, to_evaluated
from palpate.protocols.extras import FEATURES, MODELS
from palpate.protocols.progress import Report
from palpate.studies.options import (
    JSON,
    LAB,
    echo_json,
    names_in,
    needs_packages,
    only_simulated,
    sessions_option,
    with_options,
)

if TYPE_CHECKING:
    from palpate.modeling.attributes.evaluation.evaluate import AttributeEvaluation, AttributeOptions
    from palpate.modeling.attributes.material import Material
    from palpate.modeling.attributes.reading_recordings import Recordings

COLUMNS = (
    ("resnet", "ResNet-50", "text"), ("mae", "MAE", "2"), ("rmse", "RMSE", "2"), ("within_jnd", "JND", "share"),
    ("best_less", "more", "2"), ("half_width", "± 90 %", "1"), ("features_s", "features", "s"),
    ("train_s", "train", "s"), ("answer_s", "answer", "s"),
)  # fmt: skip
"""The columns of the printed table of methods: name in the rows, heading, number format."""
OPTIONS = (
    LAB,
    click.option(
        "--folder", type=click.Path(exists=True, file_okay=False, path_type=Path),
        help="A folder of images instead of the lab's sessions: FOLDER/ID/*.jpg or FOLDER/ID_01.jpg.",
    ),
    click.option(
        "--ratings", type=click.Path(exists=True, dir_okay=False, path_type=Path),
        help="The table of ratings that goes with --folder.  [default: FOLDER/ratings.csv]",
    ),
    click.option(
        "--scale", type=(float, float), metavar="LOW HIGH",
        help="The ends of that table's ratings, such as 1 7 or -100 100.  [default: 0 100; asked for if all are small]",
    ),
    *RECORDING_OPTIONS,
    sessions_option("real recordings and pictures, where there are any"),
    click.option(
        "--weights", type=click.Path(exists=True, dir_okay=False, path_type=Path),
        help="Weights of ResNet-50 as a file.  [default: random ones, from a seed]",
    ),
    SEED,
    click.option(
        "--quick", is_flag=True,
        help="To try it out, not to use it: 15 of the lab's textures, of which five are left out; few epochs.",
    ),
    EPOCHS,
    click.option(
        "--early-stopping", is_flag=True,
        help="The thesis' network too watches a tenth of the textures and stops early; thesis: --epochs 200.",
    ),
    WORKERS,
    cluster_option("does the trainings; features are made here"),
)  # fmt: skip
"""The options of both verbs."""


@dataclass(frozen=True)
class AttributeRequest:
    """The textures that the command line selects, and the options of learning from them."""

    lab: Path
    folder: Path | None
    ratings: Path | None
    scale: tuple[float, float] | None
    sessions: str | None
    weights: Path | None
    seed: int
    quick: bool
    epochs: int | None
    early_stopping: bool
    workers: int | None
    cluster: str | None
    recordings: Recordings | None


OWN = tuple(name for name in AttributeRequest.__dataclass_fields__ if name != "recordings")


def attribute_options(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with the options of both verbs, which it receives as one `AttributeRequest`."""

    @wraps(command)
    def with_request(**values: Any) -> None:
        demand_folder_alone(values)
        recordings = requested_recordings(values)
        command(AttributeRequest(**{name: values.pop(name) for name in OWN}, recordings=recordings), **values)

    return with_options(with_request, OPTIONS)


def material_for(request: AttributeRequest, report: Report) -> Material:
    """Return the requested textures. Raises MaterialError, or the errors of reading a lab.

    Raises JobError for an unusable cluster before the features are computed, which can take half an hour.
    """
    if request.cluster is not None:
        from palpate.modeling.training.jobs import demand_cluster

        report("looking for the cluster")
        demand_cluster(request.cluster)
    report("making features")
    options: dict[str, Any] = {"weights": request.weights, "quick": request.quick, "workers": request.workers}
    if request.folder is not None:
        from palpate.modeling.attributes.reading_folder import read_folder

        if request.scale is not None:
            options["scale"] = request.scale
        options["recordings"] = request.recordings
        return read_folder(request.folder, request.lab, table=request.ratings, report=report, **options)
    from palpate.modeling.attributes.reading import MOST_WHEN_QUICK, read_material

    options |= {"most": MOST_WHEN_QUICK if request.quick else None, "seed": request.seed}
    only = only_simulated(request.sessions)
    return read_material(request.lab, simulated=only, report=report, **options)


def options_for(
    request: AttributeRequest, methods: tuple[str, ...] | None, ablations: bool, folds: int | None = None
) -> AttributeOptions:
    """Return the options of the evaluation or the training. Raises MaterialError for an unknown method."""
    from palpate.modeling.attributes.evaluation.evaluate import AttributeOptions, require_methods
    from palpate.modeling.attributes.evaluation.outputs import NAME
    from palpate.modeling.attributes.registry import METHODS
    from palpate.modeling.evaluate.outputs import jobs_folder

    require_methods(methods or (), METHODS)
    return AttributeOptions(
        work=jobs_folder(request.lab, NAME), methods=methods, ablations=ablations, seed=request.seed,
        quick=request.quick, epochs=request.epochs, workers=request.workers, cluster=request.cluster, folds=folds,
        early_stopping=request.early_stopping,
    )  # fmt: skip


@click.command("attributes")
@needs_packages(*MODELS, *FEATURES)
@attribute_options
@click.option("--method", help="Which one.  [default: the best of the lab's own whole evaluation, else visuo_tactile]")
@TO_MODELS
@click.option("--replace", is_flag=True, help="Let a model of --quick take the place of one that had more time.")
@JSON
def train_attributes(
    request: AttributeRequest, method: str | None, to: Path | None, replace: bool, as_json: bool
) -> None:
    """Train the model that says how a texture feels, on all rated textures (with --quick on 15 of them).

    Textures that lack the recording or the pictures that others have are left out. What stops early is fitted to nine
    tenths of them and watches the others; the card says which. Writes texture-attributes, a card (JSON) and its
    numbers (safetensors), to LAB/models. The card holds the errors of leaving each texture out once, intervals that
    hold 90 % of new ratings, and the run: data, versions, settings, seconds. What an evaluation of the same textures
    finished is taken from there; stopped, the same command goes on.

    Example: palpate train attributes --lab LAB --method ridge
    """
    from palpate.analysis.reports.terminal import print_banners
    from palpate.modeling.attributes.evaluation.outputs import default_of
    from palpate.modeling.attributes.registry import METHODS, OWN_FEATURES
    from palpate.modeling.attributes.training import demand_no_loss
    from palpate.modeling.attributes.training import train_attributes as trained
    from palpate.modeling.evaluate.outputs import Choice

    options = options_for(request, None if method is None else (method,), ablations=False)
    folder = to or request.lab / "models"
    if request.quick and not replace:
        demand_no_loss(folder)
    with exit_on_interrupt("what is left"):
        with progress_lines() as report:
            material = material_for(request, report)
        chosen = default_of(request.lab, material) if method is None else Choice(method, "as it was asked for.")
        click.echo(f"training {chosen.method}: {chosen.why}", err=as_json)
        with progress_lines() as report:
            written = trained(material, chosen.method, options, folder, METHODS, OWN_FEATURES, report)
    if as_json:
        echo_json({**written.plain(), "why": chosen.why})
        return
    print_banners(written.banners)
    text = f"MAE {written.metrics['mae']:.2f}, RMSE {written.metrics['rmse']:.2f} of textures left out (0 to 100)"
    text += f"; ResNet-50: {written.resnet} weights" if written.resnet is not None else ""
    click.echo(f"{written.card}: {written.method}; {text}")


@click.command("attributes")
@needs_packages(*MODELS, *FEATURES)
@attribute_options
@click.option(
    "--methods", "names", metavar="NAMES", multiple=True, help="Only these: ridge,visuo_tactile.  [default: all]"
)
@click.option(
    "--folds",
    type=click.IntRange(1),
    help="Leave only this many textures out, in turn from each class: faster, and less certain.  [default: each one]",
)
@click.option(
    "--ablations/--no-ablations", default=True, help="Whether Tables 3.4 and 3.5 are made too: features apart."
)
@click.option("--figures/--no-figures", default=True, help="Whether to draw the figures.")
@to_evaluated("attributes")
@JSON
def evaluate_attributes(
    request: AttributeRequest,
    names: tuple[str, ...],
    folds: int | None,
    ablations: bool,
    figures: bool,
    to: Path | None,
    as_json: bool,
) -> None:
    """Evaluate every method that predicts how textures feel, by leaving each texture out once.

    Tables 3.2 to 3.5 and Figures 3.8 and 3.9 of the thesis, on this lab's textures and the same folds for all. Writes
    evaluation.json, tables, figures and report.html to LAB/evaluated/attributes. Finished trainings are kept there:
    stopped, the same command goes on, and a further method is trained alone.

    Example: palpate evaluate attributes --lab LAB --methods ridge,visuo_tactile
    """
    from palpate.modeling.attributes.evaluation.evaluate import evaluate_methods
    from palpate.modeling.attributes.evaluation.outputs import NAME, write_all
    from palpate.modeling.attributes.evaluation.outputs import as_json as results
    from palpate.modeling.attributes.feature_times import feature_seconds
    from palpate.modeling.attributes.registry import METHODS, OWN_FEATURES
    from palpate.modeling.evaluate.outputs import evaluation_folder

    chosen = names_in(names)
    if names and not chosen:
        raise click.UsageError(f"--methods names none; there are {', '.join(METHODS)}")
    if request.quick and folds is not None:
        raise click.UsageError("--quick leaves five textures out, and --folds says how many: leave one of them out")
    options = options_for(request, chosen or None, ablations, folds)
    with exit_on_interrupt("what is left"), progress_lines() as report:
        material = material_for(request, report)
        report("timing features")
        times = feature_seconds({kind for texture in material.textures for kind in (*texture.touch, *texture.sight)})
        evaluation = evaluate_methods(material, options, METHODS, OWN_FEATURES, report, times)
        paths = write_all(evaluation, to or evaluation_folder(request.lab, NAME), report, figures)
    if as_json:
        echo_json({**results(evaluation), "files": list(map(str, paths))})
        return
    _show(evaluation, paths[-1])


def _show(evaluation: AttributeEvaluation, page: Path) -> None:
    """Print the table of methods, the default method, the targets and the report's path."""
    from rich.console import Console

    from palpate.analysis.reports.terminal import methods_table, print_banners
    from palpate.modeling.attributes.evaluation.report import banners, choice_of, reached
    from palpate.modeling.attributes.evaluation.tables import method_rows

    print_banners(banners(evaluation))
    rows = method_rows(evaluation)
    Console(highlight=False).print(methods_table(rows, COLUMNS))
    for row in rows:
        if row["refused"]:
            click.echo(f"not evaluated: {row['method']}: {row['refused']}")
    chosen = choice_of(evaluation)
    click.echo(f"default: {chosen.method}. {chosen.why}")
    for label, line in reached(evaluation):
        click.echo(f"{label}: {line}")
    click.echo(f"Look at {page}")
