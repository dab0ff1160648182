"""Verbs about data: import, analyse, report, samples."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.protocols.progress import Progress
from palpate.protocols.shell_command import shell_command
from palpate.studies.options import JSON, LAB, echo_json, progress_bar

if TYPE_CHECKING:
    from palpate.analysis.first_look.analysis import Analysis
    from palpate.analysis.first_look.compare_reference import Compared
    from palpate.analysis.ratings.sources import DataRequest, Missing

DATABASE = click.option(
    "--database", "url", help="SQLAlchemy URL of a collected database, instead of the lab's session files."
)
DIGEST = click.option(
    "--digest", help="The version of a study that was changed between participants (its first digits)."
)
SIMULATED = click.option(
    "--simulated/--real", default=None, help="Take only simulated or only real sessions, where both are."
)
MISSING = click.option(
    "--missing", type=click.Choice(["refuse", "listwise"]), default="refuse", show_default=True,
    help="A participant with a missing cell: refuse the tests that need it, or leave the participant out.",
)  # fmt: skip


def source_options(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with the options that select a data set, which it receives as one `DataRequest`."""

    @click.argument("name")
    @LAB
    @DATABASE
    @DIGEST
    @click.option("--include-incomplete", is_flag=True, help="Also take interrupted sessions.")
    @SIMULATED
    @wraps(command)
    def with_source(
        *, name: str, lab: Path, url: str | None, digest: str | None, include_incomplete: bool, simulated: bool | None,
        **others: Any,
    ) -> None:  # fmt: skip
        from palpate.analysis.ratings.sources import DataRequest

        command(DataRequest(name, lab, url, digest, include_incomplete, simulated), **others)

    return with_source


@click.command()
@source_options
@MISSING
@click.option(
    "--reference", default="none", show_default=True,
    help="Compare with another program's numbers: r (R's, shipped for sk2011) or FILE.json#KEY.",
)  # fmt: skip
@click.option("--figures/--no-figures", default=True, help="Whether to draw the figures, too.")
@click.option(
    "--codes", multiple=True, type=click.Path(dir_okay=False, path_type=Path), metavar="FILE.csv",
    help="A coder's table of the interview's answers: count the codes instead. Repeatable: how far coders agree.",
)  # fmt: skip
@JSON
def analyse(
    request: DataRequest, missing: Missing, reference: str, figures: bool, codes: tuple[Path, ...], as_json: bool
) -> None:
    """Compute the tables, statistics and figures of NAME, a study with sessions or an imported data set.

    A first look, by one fixed set of tests; an analysis declared in a plan is computed by `palpate regenerate`.
    Writes statistics.json, CSV tables and figures (SVG, PNG) to LAB/analysis/NAME. Equal data give equal files.
    Exit code 1 if --reference is given and a number differs by more than 1e-9 of its value.

    With --codes: counts the codes that coders put to answers in free text (`palpate export --free-text` gives these),
    and Cohen's kappa of each two coders, into LAB/analysis/NAME/codes.

    \b
    Examples:
      palpate analyse door_ratings --lab LAB
      palpate analyse my_study --codes ann.csv --codes bob.csv --lab LAB
    """
    if codes:
        context = click.get_current_context()
        options = {"missing": "--missing", "reference": "--reference", "figures": "--figures/--no-figures"}
        for name, option in options.items():
            if context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE:
                raise click.UsageError(f"{option} has no effect on codes: leave it or --codes out")
        _analyse_codes(request, codes, as_json)
        return
    from palpate.analysis.first_look.page import save_figures
    from palpate.analysis.first_look.results import write_results
    from palpate.protocols.files import staged_files

    with progress_bar(as_json) as progress:
        analysis = _analysed(request, missing, progress)
        folder = _folder(request)
        with staged_files(folder) as draft:
            drafts = write_results(analysis, draft)
            if figures:
                progress(0, 1, "drawing the figures")
                drafts += save_figures(analysis, draft)
        files = [folder / path.relative_to(draft) for path in drafts]
    comparisons: list[Compared] = []
    if reference != "none":
        from palpate.analysis.first_look.compare_reference import compare_with_reference, fitting_test, read_reference

        numbers = read_reference(reference, analysis.ratings.name)
        comparisons = compare_with_reference(fitting_test(analysis.statistics.tests, numbers).rows, numbers)
    if as_json:
        echo_json(
            _summary(analysis, files)
            | {"reference": [{**vars(comparison), "agrees": comparison.agrees} for comparison in comparisons]}
        )
    else:
        _show(analysis, files, comparisons)
    if not all(comparison.agrees for comparison in comparisons):
        raise click.exceptions.Exit(1)


def _analyse_codes(request: DataRequest, paths: tuple[Path, ...], as_json: bool) -> None:
    from palpate.analysis.coding import agreement, answers_in, code_counts, notes_on, read_coders
    from palpate.analysis.exporting.source import open_source
    from palpate.analysis.reports.csv_files import csv_text, json_row
    from palpate.protocols.files import write_texts
    from palpate.protocols.wording import count

    with open_source(request) as source:
        answers = answers_in(source)
    coders = read_coders(paths, answers)
    counts, agreed, notes = code_counts(coders, answers), agreement(coders, answers), list(notes_on(coders, answers))
    tables = {"codes.csv": counts} | ({"agreement.csv": agreed} if len(coders) > 1 else {})
    files = write_texts(_folder(request) / "codes", {name: csv_text(rows) for name, rows in tables.items()})
    if as_json:
        named = [{"coder": coder.name, "sha256": coder.sha256} for coder in coders]
        rows = {"codes": [json_row(row) for row in counts], "agreement": [json_row(row) for row in agreed]}
        echo_json(
            {"name": request.name, "coders": named, **rows, "notes": notes, "files": [str(path) for path in files]}
        )
        return
    for row in counts:
        of = f"{row['answers']} of {row['coded']} answers, {count(row['people'], 'participant')}"
        click.echo(f"{row['item']}  {row['code']}: {of} ({row['coder']})")
    for row in agreed:
        kappa = "undefined" if math.isnan(row["kappa"]) else f"{row['kappa']:.2f}"
        interval = "" if math.isnan(row["se"]) else f" (95 % CI {row['ci95_low']:.2f} to {row['ci95_high']:.2f})"
        pair = f"{row['coder_a']}, {row['coder_b']}"
        click.echo(f"{row['item']}  {row['code']}: kappa {kappa}{interval}, {row['answers']} answers ({pair})")
    for line in notes:
        click.echo(line)
    click.echo(f"Written to {_folder(request) / 'codes'}: {', '.join(path.name for path in files)}")


@click.command()
@source_options
@MISSING
@click.option(
    "--to", type=click.Path(dir_okay=False, path_type=Path), help="The file.  [default: LAB/analysis/NAME/report.html]"
)
@JSON
def report(request: DataRequest, missing: Missing, to: Path | None, as_json: bool) -> None:
    """Write the report of NAME as one HTML file that needs nothing else: mail it, archive it, print it.

    Of the same numbers as `palpate analyse`; the report of an analysis plan is written by `palpate regenerate`.

    Example: palpate report door_ratings --lab LAB
    """
    from palpate.analysis.first_look.page import write_report

    with progress_bar(as_json) as progress:
        analysis = _analysed(request, missing, progress)
        progress(0, 1, "drawing the figures")
        path = write_report(analysis, to or _folder(request) / "report.html")
    if as_json:
        echo_json(_summary(analysis, [path]))
    else:
        _show(analysis, [path], [])


@click.command("import")
@click.argument("map", type=click.Path(path_type=Path))
@click.argument("data", required=False, type=click.Path(path_type=Path))
@LAB
@click.option("--replace", is_flag=True, help="Replace a data set of that name.")
@JSON
def import_(map: Path, data: Path | None, lab: Path, replace: bool, as_json: bool) -> None:
    """Read a foreign table of ratings into LAB by the column map MAP, all of it or nothing.

    MAP is a YAML file, or the name of a shipped map: sk2011, psychopy_hussey2018. DATA is the table or its folder,
    if it is not in the map's folder. What is left out is listed.

    Example: palpate import sk2011 --lab LAB; palpate samples; palpate import samples/chairs.yaml --lab LAB
    """
    from palpate.analysis.importing.map_file import find_map
    from palpate.analysis.importing.tables import import_table
    from palpate.analysis.ratings.design import check_ratings
    from palpate.analysis.ratings.design_report import data_notes, exclusion_lines
    from palpate.analysis.ratings.rating_files import save_ratings
    from palpate.analysis.ratings.sources import IMPORTED
    from palpate.protocols.wording import count

    ratings = import_table(find_map(map), data)
    folder = lab / IMPORTED / ratings.name
    save_ratings(ratings, folder, replace=replace)
    notes = data_notes(check_ratings(ratings).notes, ratings.exclusions, ratings.sessions)
    if as_json:
        echo_json({
            "name": ratings.name, "folder": str(folder), "participants": len(ratings.participants),
            "ratings": len(ratings.table), "attributes": list(ratings.attributes), "within": list(ratings.within),
            "between": list(ratings.between), "left_out": [vars(line) for line in ratings.exclusions],
            "notes": list(notes),
        })  # fmt: skip
        return
    given = f"{count(len(ratings.participants), 'participant')}, {count(len(ratings.table), 'rating')}"
    click.echo(f"{ratings.name}: {given}, factors {ratings.factors_text()}, in {folder}")
    for line in exclusion_lines(ratings.exclusions):
        click.echo(f"  {line}")
    for line in notes:
        click.echo(line)
    click.echo(f"Next: {shell_command('analyse', ratings.name, '--lab', lab)}")


def _analysed(request: DataRequest, missing: Missing, progress: Progress) -> Analysis:
    from palpate.analysis.first_look.analysis import analyse_ratings
    from palpate.analysis.ratings.sources import read_source

    ratings, title = read_source(replace(request, missing=missing), progress)
    return analyse_ratings(ratings, title, progress)


def _folder(request: DataRequest) -> Path:
    return request.lab / "analysis" / request.name


def _show(analysis: Analysis, files: list[Path], compared: list[Compared]) -> None:
    from rich.console import Console

    console = Console(highlight=False)
    from rich.markup import escape

    from palpate.analysis.first_look.page_data import inclusions
    from palpate.analysis.ratings.design_report import data_notes
    from palpate.protocols.wording import count

    ratings, design = analysis.ratings, analysis.design
    people = f"{count(len(ratings.participants), 'participant')}, {count(len(ratings.table), 'rating')}"
    console.print(f"[bold]{escape(analysis.title)}[/bold]: {people}", soft_wrap=True)
    if ratings.simulated:
        console.print("[yellow]Simulated participants: no person gave these answers.[/yellow]")
    if ratings.exclusions:
        console.print(f"The exclusion ledger in the report has {count(len(ratings.exclusions), 'line')}.")
    for line in inclusions(ratings):
        console.print(f"[yellow]{escape(line)}[/yellow]", soft_wrap=True)
    for line in (
        *(problem.text() for problem in design.problems),
        *data_notes(design.notes, ratings.exclusions, ratings.sessions),
    ):
        console.print(f"[yellow]{escape(line)}[/yellow]", soft_wrap=True)
    from rich.markup import escape
    from rich.table import Table

    from palpate.analysis.first_look.page_tests import headlines, refusals

    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for attribute, sentence in headlines(analysis):
        table.add_row(escape(attribute), escape(sentence))
    console.print(table)
    for line in refusals(analysis):
        console.print(f"[yellow]not tested: {escape(line)}[/yellow]", soft_wrap=True)
    if compared:
        from palpate.analysis.first_look.compare_reference import comparison_table

        console.print(comparison_table(compared, "Beside the reference values"))
    for folder in dict.fromkeys(path.parent for path in files):
        names = ", ".join(path.name for path in files if path.parent == folder)
        click.echo(f"Written to {folder}: {names}")


def _summary(analysis: Analysis, files: list[Path]) -> dict[str, Any]:
    from palpate.analysis.first_look.page_tests import headlines, refusals
    from palpate.analysis.ratings.design_report import data_notes

    return {
        "name": analysis.ratings.name,
        "participants": len(analysis.ratings.participants),
        "ratings": len(analysis.ratings.table),
        "simulated": analysis.ratings.simulated,
        "complete": analysis.design.ok,
        "notes": list(data_notes(analysis.design.notes, analysis.ratings.exclusions, analysis.ratings.sessions)),
        "left_out": len(analysis.ratings.exclusions),
        "interrupted_included": len(analysis.ratings.interrupted),
        "headlines": dict(headlines(analysis)),
        "not_tested": list(refusals(analysis)),
        "files": [str(path) for path in files],
    }


TABLES = Path(__file__).resolve().with_name("samples")
DOOR = Path("door_ratings") / "profiles" / "K8_g0.csv"


def sample_files() -> dict[str, bytes]:
    """Return the sample files by name: a table of ratings with its column map, and a door's profile."""
    from palpate.studies.catalogue import SHIPPED

    files = {path.name: path.read_bytes() for path in sorted(TABLES.iterdir()) if path.is_file()}
    return {**files, "door.csv": (SHIPPED / DOOR).read_bytes()}


@click.command()
@click.argument("folder", type=click.Path(file_okay=False, path_type=Path), default=Path("samples"))
def samples(folder: Path) -> None:
    """Write sample files into FOLDER (default: samples): a table of ratings with its column map, a door's profile.

    Their README.md lists commands to try. A file of yours by the same name is never replaced.

    Example: palpate samples samples; palpate import samples/chairs.yaml --lab LAB
    """
    from palpate.protocols.files import staged_files, write_bytes

    files = sample_files()
    for name, content in files.items():
        path = folder / name
        if path.exists() and path.read_bytes() != content:
            raise click.UsageError(f"{path} exists and is not a sample file; give another folder")
    with staged_files(folder) as draft:
        for name, content in files.items():
            write_bytes(draft / name, content)
    click.echo(f"{len(files)} sample files in {folder}: {', '.join(sorted(files))}")
    click.echo(f"Try: {shell_command('import', folder / 'chairs.yaml')}")
    click.echo(f"     {shell_command('predict', 'door-perception', folder / 'door.csv')}")
