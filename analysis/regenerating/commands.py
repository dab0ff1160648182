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
    from palpate.analysis.ratings.sources import Wanted
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
    from palpate.analysis.ratings.sources import Wanted
    from palpate.analysis.regenerating.outputs import FOLDER
    from palpate.analysis.regenerating.plan_check import check_against_study, refuse_idle_settings
    from palpate.analysis.regenerating.regeneration import find_plan, regenerate_by

    wanted = Wanted(study, lab, url, digest, simulated=simulated)
    name, plan = find_plan(wanted, plan_file)
    check_against_study(wanted, plan)
    if check_plan:
        refuse_idle_settings(plan)
        _plan_told(name, len(plan.tests), len(plan.figures), plan.path, as_json)
        return
    with progress_bar(as_json) as progress:
        found = regenerate_by(wanted, name, plan, progress, crosscheck and not check)
        folder = to or lab / FOLDER / name
        failed = (
            _checked(found, folder, as_json) if check else _written(found, wanted, folder, figures, as_json, progress)
        )
    if exact:
        failed = _exact(found, as_json) or failed
    if failed:
        raise click.exceptions.Exit(1)


def _plan_told(name: str, tests: int, figures: int, path: Path, as_json: bool) -> None:
    if as_json:
        echo_json({"study": name, "plan": str(path), "tests": tests, "figures": figures})
        return
    click.echo(f"{path}: the plan of {name} is in order: {count(tests, 'test')}, {count(figures, 'figure')}")


def _written(
    study: RegeneratedStudy, wanted: Wanted, folder: Path, figures: bool, as_json: bool, progress: Progress
) -> bool:
    from palpate.analysis.regenerating.outputs import times_of, write_all

    paths = write_all(study, folder, times_of(study, wanted.lab), figures, progress)
    if as_json:
        echo_json({**_summary(study), "folder": str(folder), "files": [str(path) for path in paths]})
        return False
    click.echo(f"{study.title}: {_people(study)}")
    for line in _told(study):
        click.echo(line)
    click.echo(f"Written to {folder}: {count(len(paths), 'file')}; look at {folder / 'report.html'}" if figures
               else f"Written to {folder}: {count(len(paths), 'file')}")  # fmt: skip
    return False


def _checked(study: RegeneratedStudy, folder: Path, as_json: bool) -> bool:
    from palpate.analysis.regenerating.comparison import differences, told
    from palpate.analysis.regenerating.files import file_texts

    different = differences(file_texts(study, {}), folder)
    if as_json:
        echo_json(
            {**_summary(study), "folder": str(folder), "differences": [vars(difference) for difference in different]}
        )
        return bool(different)
    for line in told(different):
        click.echo(line)
    said = "differs from" if different else "equals"
    click.echo(f"{study.title}: what is regenerated {said} what lies in {folder}")
    return bool(different)


def _exact(study: RegeneratedStudy, as_json: bool) -> bool:
    from palpate.analysis.regenerating.exact_check import RELATIVE, exact_checks

    checks = exact_checks(study.answered)
    wrong = [check for check in checks if check.difference is not None and check.difference > RELATIVE]
    for check in checks:
        click.echo(check.text(), err=as_json)
    return bool(wrong)


def _summary(study: RegeneratedStudy) -> dict[str, Any]:
    return {
        "study": study.material.name,
        "simulated": study.material.simulated,
        "participants": len(study.material.participants),
        "exclusions": len(study.exclusions),
        "notes": list(study.notes),
        "versions": [vars(version) for version in study.material.versions],
        "answered": sum(result.answer is not None for result in study.answered),
        "refused": [
            f"{result.asked.name} {result.outcome}".strip() for result in study.answered if result.answer is None
        ],
        "not_drawn": [figure.settings.name for figure in study.figures if figure.data is None],
        **_second_opinion(study),
    }


def _second_opinion(study: RegeneratedStudy) -> dict[str, Any]:
    from palpate.analysis.crosschecking.checks import disagreements, sentence

    if study.checks is None:
        return {}
    wrong = [check.text() for check in disagreements(study.checks)]
    return {"crosscheck": {"summary": sentence(study.checks), "disagreements": wrong}}


def _people(study: RegeneratedStudy) -> str:
    people = count(len(study.material.participants), "participant")
    made_up = ", all simulated" if study.material.simulated else ""
    return f"{people}{made_up}; {count(len(study.exclusions), 'line')} in the exclusion ledger"


def _told(study: RegeneratedStudy) -> Iterator[str]:
    """What was answered, what another package says of it, and everything that was not answered, with its reason."""
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
    refused = [(result.refused, result.asked.name) for result in study.answered if result.answer is None]
    yield from (f"  not answered: {line}" for line in _by_reason(refused))
    not_drawn = [(figure.refused, figure.settings.name) for figure in study.figures if figure.data is None]
    yield from (f"  not drawn: {line}" for line in _by_reason(not_drawn))


def _by_reason(refused: Iterable[tuple[str, str]]) -> Iterator[str]:
    """Describe refused questions, (reason, name) each, in one line for a reason, with how many of each name."""
    names: dict[str, Counter[str]] = {}
    for why, name in refused:
        names.setdefault(why, Counter())[name] += 1
    for why, counts in names.items():
        yield f"{', '.join(name if n == 1 else f'{name} ({n})' for name, n in counts.items())}: {why}"
