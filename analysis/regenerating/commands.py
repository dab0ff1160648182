"""The verb `regenerate`: a study's statistics, figures and report from its raw ledgers, by its analysis plan."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.analysis.commands import DATABASE, DIGEST, SIMULATED
from palpate.protocols.progress import Progress
from palpate.protocols.wording import count
from palpate.studies.options import JSON, LAB, echo_json, progress_bar

if TYPE_CHECKING:
    from palpate.analysis.ratings.sources import DataRequest
    from palpate.analysis.regenerating.regeneration import RegeneratedStudy


@click.command()
@click.argument("study")
@LAB
@click.option(
    "--plan", "plan_file", type=click.Path(dir_okay=False, path_type=Path),
    help="The analysis plan.  [default: analysis.yaml of the lab for the study, else of the study itself]",
)  # fmt: skip
@click.option(
    "--to", type=click.Path(file_okay=False, path_type=Path),
    help="The folder that is written.  [default: LAB/regenerated/STUDY]",
)  # fmt: skip
@click.option("--check", is_flag=True, help="Write nothing: compare with the folder's files. Exit code 1 if not equal.")
@click.option("--check-plan", is_flag=True, help="Only check the plan against the study, also before there are data.")
@click.option("--exact", is_flag=True, help="Compute every analysis of variance again in exact fractions and compare.")
@click.option("--figures/--no-figures", default=True, help="Whether to draw the figures and write the report.")
@click.option(
    "--crosscheck/--no-crosscheck", default=True,
    help="Whether to hold the answers against pingouin and statsmodels (crosscheck.json; never with --check).",
)  # fmt: skip
@DATABASE
@DIGEST
@SIMULATED
@JSON
def regenerate(
    study: str, lab: Path, plan_file: Path | None, to: Path | None, check: bool, check_plan: bool, exact: bool,
    figures: bool, crosscheck: bool, url: str | None, digest: str | None, simulated: bool | None, as_json: bool,
) -> None:  # fmt: skip
    """From STUDY's raw ledgers to every number, table and figure that its analysis plan asks for.

    Writes statistics.json, tidy tables, a table for each test, figures (SVG, PNG, CSV), tables.docx, tables.tex,
    report.html, and crosscheck.json: what pingouin and statsmodels say of the answers. Twice gives the same bytes.
    STUDY is a study's name or folder, or an imported data set.

    Example: palpate regenerate door_ratings --lab LAB; palpate regenerate door_ratings --lab LAB --check
    """
    from palpate.analysis.ratings.sources import DataRequest
    from palpate.analysis.regenerating.outputs import FOLDER
    from palpate.analysis.regenerating.plan_check import check_against_study, refuse_idle_settings
    from palpate.analysis.regenerating.regeneration import find_plan, regenerate_by

    request = DataRequest(study, lab, url, digest, simulated=simulated)
    name, plan = find_plan(request, plan_file)
    check_against_study(request, plan)
    if check_plan:
        refuse_idle_settings(plan)
        tests, drawn = len(plan.tests), len(plan.figures)
        if as_json:
            echo_json({"study": name, "plan": str(plan.path), "tests": tests, "figures": drawn})
        else:
            what = f"{count(tests, 'test')}, {count(drawn, 'figure')}"
            click.echo(f"{plan.path}: the plan of {name} is in order: {what}")
        return
    with progress_bar(as_json) as progress:
        result = regenerate_by(request, name, plan, progress, crosscheck and not check)
        folder = to or lab / FOLDER / name
        failed = (
            _compare(result, folder, as_json) if check else _write(result, request, folder, figures, as_json, progress)
        )
    if exact:
        from palpate.analysis.regenerating.comparison import EXACT_RELATIVE, exact_checks

        checks = exact_checks(result.answered)
        for line in checks:
            click.echo(line.text(), err=as_json)
        failed = failed or any((line.difference or 0.0) > EXACT_RELATIVE for line in checks)
    if failed:
        raise click.exceptions.Exit(1)


def _write(
    study: RegeneratedStudy, request: DataRequest, folder: Path, figures: bool, as_json: bool, progress: Progress
) -> bool:
    from palpate.analysis.regenerating.outputs import times_of, write_all

    paths = write_all(study, folder, times_of(study, request.lab), figures, progress)
    if as_json:
        echo_json({**_summary(study), "folder": str(folder), "files": [str(path) for path in paths]})
        return False
    people = count(len(study.material.participants), "participant")
    simulated = ", all simulated" if study.material.simulated else ""
    excluded = count(len(study.exclusions), "line")
    click.echo(f"{study.title}: {people}{simulated}; {excluded} in the exclusion ledger")
    for line in _lines(study):
        click.echo(line)
    click.echo(f"Written to {folder}: {count(len(paths), 'file')}; look at {folder / 'report.html'}" if figures
               else f"Written to {folder}: {count(len(paths), 'file')}")  # fmt: skip
    return False


def _compare(study: RegeneratedStudy, folder: Path, as_json: bool) -> bool:
    from palpate.analysis.regenerating.comparison import difference_lines, differences
    from palpate.analysis.regenerating.outputs import file_texts

    different = differences(file_texts(study, {}), folder)
    if as_json:
        echo_json(
            {**_summary(study), "folder": str(folder), "differences": [vars(difference) for difference in different]}
        )
        return bool(different)
    for line in difference_lines(different):
        click.echo(line)
    verdict = "differs from" if different else "equals"
    click.echo(f"{study.title}: what is regenerated {verdict} what lies in {folder}")
    return bool(different)


def _summary(study: RegeneratedStudy) -> dict[str, Any]:
    from palpate.analysis.crosschecking.checks import disagreements, sentence

    crosscheck = {}
    if study.checks is not None:
        disagree = [check.text() for check in disagreements(study.checks)]
        crosscheck = {"crosscheck": {"summary": sentence(study.checks), "disagreements": disagree}}
    return {
        "study": study.material.name,
        "simulated": study.material.simulated,
        "participants": len(study.material.participants),
        "exclusions": len(study.exclusions),
        "notes": list(study.notes),
        "versions": [vars(version) for version in study.material.versions],
        "answered": sum(result.answer is not None for result in study.answered),
        "refused": [
            f"{result.settings.name} {result.outcome}".strip() for result in study.answered if result.answer is None
        ],
        "not_drawn": [figure.settings.name for figure in study.figures if figure.data is None],
        **crosscheck,
    }


def _lines(study: RegeneratedStudy) -> Iterator[str]:
    """Yield lines on what was answered, its cross-checks, and what was refused with the reason."""
    from palpate.analysis.crosschecking.checks import disagreements, sentence

    for check in disagreements(study.checks):
        yield f"DISAGREEMENT: {check.text()}"
    if study.checks is not None:
        yield f"Second opinion: {sentence(study.checks)}"
    if study.material.versions:
        yield "MIXED VERSIONS: the sessions were not all recorded with the same version of the study and its models"
    for version in study.material.versions:
        yield f"  {version.name} {version.sha256[:12]}: {version.note}"
    yield from study.notes
    answered = [result for result in study.answered if result.answer is not None]
    yield f"{count(len(answered), 'question')} answered, {len(study.answered) - len(answered)} not"
    refused = [(result.refused, result.settings.name) for result in study.answered if result.answer is None]
    yield from (f"  not answered: {line}" for line in _by_reason(refused))
    not_drawn = [(figure.refused, figure.settings.name) for figure in study.figures if figure.data is None]
    yield from (f"  not drawn: {line}" for line in _by_reason(not_drawn))


def _by_reason(refused: Iterable[tuple[str, str]]) -> Iterator[str]:
    """Yield refused questions, (reason, name) each, as one line per reason with counts of each name."""
    names: dict[str, Counter[str]] = {}
    for why, name in refused:
        names.setdefault(why, Counter())[name] += 1
    for why, counts in names.items():
        yield f"{', '.join(name if n == 1 else f'{name} ({n})' for name, n in counts.items())}: {why}"
