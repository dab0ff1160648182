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
    from palpate.analysis.regenerating.regeneration import Regenerated


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
    found: Regenerated, wanted: Wanted, folder: Path, figures: bool, as_json: bool, progress: Progress
) -> bool:
    from palpate.analysis.regenerating.outputs import times_of, write_all

    paths = write_all(found, folder, times_of(found, wanted.lab), figures, progress)
    if as_json:
        echo_json({**_summary(found), "folder": str(folder), "files": [str(path) for path in paths]})
        return False
    click.echo(f"{found.title}: {_people(found)}")
    for line in _told(found):
        click.echo(line)
    click.echo(f"Written to {folder}: {count(len(paths), 'file')}; look at {folder / 'report.html'}" if figures
               else f"Written to {folder}: {count(len(paths), 'file')}")  # fmt: skip
    return False


def _checked(found: Regenerated, folder: Path, as_json: bool) -> bool:
    from palpate.analysis.regenerating.comparison import differences, told
    from palpate.analysis.regenerating.files import file_texts

    different = differences(file_texts(found, {}), folder)
    if as_json:
        echo_json({**_summary(found), "folder": str(folder), "differences": [vars(each) for each in different]})
        return bool(different)
    for line in told(different):
        click.echo(line)
    said = "differs from" if different else "equals"
    click.echo(f"{found.title}: what is regenerated {said} what lies in {folder}")
    return bool(different)


def _exact(found: Regenerated, as_json: bool) -> bool:
    from palpate.analysis.regenerating.exact_check import RELATIVE, exact_checks

    checks = exact_checks(found.answered)
    wrong = [each for each in checks if each.difference is not None and each.difference > RELATIVE]
    for each in checks:
        click.echo(each.text(), err=as_json)
    return bool(wrong)


def _summary(found: Regenerated) -> dict[str, Any]:
    return {
        "study": found.material.name,
        "simulated": found.material.simulated,
        "participants": len(found.material.participants),
        "exclusions": len(found.exclusions),
        "notes": list(found.notes),
        "versions": [vars(version) for version in found.material.versions],
        "answered": sum(each.answer is not None for each in found.answered),
        "refused": [f"{each.asked.name} {each.outcome}".strip() for each in found.answered if each.answer is None],
        "not_drawn": [each.asked.name for each in found.pictured if each.data is None],
        **_second_opinion(found),
    }


def _second_opinion(found: Regenerated) -> dict[str, Any]:
    from palpate.analysis.crosschecking.checks import disagreements, sentence

    if found.checks is None:
        return {}
    wrong = [each.text() for each in disagreements(found.checks)]
    return {"crosscheck": {"summary": sentence(found.checks), "disagreements": wrong}}


def _people(found: Regenerated) -> str:
    people = count(len(found.material.participants), "participant")
    made_up = ", all simulated" if found.material.simulated else ""
    return f"{people}{made_up}; {count(len(found.exclusions), 'line')} in the exclusion ledger"


def _told(found: Regenerated) -> Iterator[str]:
    """What was answered, what another package says of it, and everything that was not answered, with its reason."""
    from palpate.analysis.crosschecking.checks import disagreements, sentence

    for check in disagreements(found.checks):
        yield f"DISAGREEMENT: {check.text()}"
    if found.checks is not None:
        yield f"Second opinion: {sentence(found.checks)}"
    if found.material.versions:
        yield "MIXED VERSIONS: the sessions were not all recorded with the same version of the study and its models"
    for version in found.material.versions:
        yield f"  {version.name} {version.sha256[:12]}: {version.note}"
    yield from found.notes
    answered = [each for each in found.answered if each.answer is not None]
    yield f"{count(len(answered), 'question')} answered, {len(found.answered) - len(answered)} not"
    refused = [(each.refused, each.asked.name) for each in found.answered if each.answer is None]
    yield from (f"  not answered: {line}" for line in _by_reason(refused))
    not_drawn = [(each.refused, each.asked.name) for each in found.pictured if each.data is None]
    yield from (f"  not drawn: {line}" for line in _by_reason(not_drawn))


def _by_reason(refused: Iterable[tuple[str, str]]) -> Iterator[str]:
    """Describe refused questions, (reason, name) each, in one line for a reason, with how many of each name."""
    names: dict[str, Counter[str]] = {}
    for why, name in refused:
        names.setdefault(why, Counter())[name] += 1
    for why, counts in names.items():
        yield f"{', '.join(name if n == 1 else f'{name} ({n})' for name, n in counts.items())}: {why}"
