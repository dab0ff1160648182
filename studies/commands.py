"""Verbs about studies: list, check, plan."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.protocols.wording import count
from palpate.studies.options import JSON, LAB, echo_json

if TYPE_CHECKING:
    from palpate.protocols.plan import Plan
    from palpate.protocols.study import Study
    from palpate.studies.catalogue import StudyFiles


@click.command()
@LAB
@JSON
def studies(lab: Path, as_json: bool) -> None:
    """List the studies that can be run here: the shipped ones and the lab's own.

    A lab's own studies lie in LAB/studies/NAME/study.yaml.
    """
    from palpate.studies.catalogue import names, read_study

    rows = [_listed(name, path, read_study) for name, path in names(lab).items()]
    if as_json:
        echo_json(rows)
        return
    for row in rows:
        click.echo(f"{row['study']:<20} {row['title']}")
        click.echo(f"{'':<20} {count(row['stimuli'], 'stimulus', 'stimuli')}, {row['asked']}; {row['file']}")


def _listed(name: str, path: Path, read: Any) -> dict[str, Any]:
    """Return a study's line in the list; a study that cannot be read is listed with its error."""
    from palpate.protocols.tasks import TASKS

    try:
        study = read(path).study
    except ValueError as error:
        return {
            "study": name,
            "title": f"BROKEN: {error}",
            "stimuli": 0,
            "attributes": 0,
            "asked": "-",
            "file": str(path),
        }
    return {
        "study": name,
        "title": study.title or "",
        "stimuli": len(study.stimuli),
        "attributes": len(study.attributes),
        "asked": TASKS[study.task].summary(study),
        "file": str(path),
    }


@click.command()
@click.argument("study", nargs=-1, required=True)
@LAB
@JSON
def check(study: tuple[str, ...], lab: Path, as_json: bool) -> None:
    """Check study files: keys and values, stimulus tables, files, names used, translations. Writes nothing.

    STUDY is a study's name, its folder or its study.yaml. Exit code 1 if one cannot be used.

    \b
    Example:
      palpate check door_ratings
    """
    from palpate.studies.catalogue import find

    rows = [_checked(find(name, lab), lab) for name in study]
    if as_json:
        echo_json(rows)
    else:
        for row in rows:
            click.echo(row["summary"] if row["ok"] else f"NOT OK\n{row['problems']}")
    if not all(row["ok"] for row in rows):
        raise click.exceptions.Exit(1)


def _checked(path: Path, lab: Path) -> dict[str, Any]:
    from palpate.protocols.complaints import Problem, listed
    from palpate.protocols.reading import StudyError
    from palpate.protocols.tasks import TASKS
    from palpate.protocols.tracks import path_of
    from palpate.protocols.yaml_text import YamlError
    from palpate.signals.doors.grid import DoorDataError
    from palpate.studies.catalogue import read_with_document
    from palpate.studies.lab import ParticipantError
    from palpate.studies.participants.lab_forms import unasked_questions
    from palpate.studies.sessions.rig import RigError, StimulusRefused

    try:
        study_files, document = read_with_document(path)
        study = study_files.study
        _demand_playable(study_files)
        notes = [*unasked_questions(study, lab), *TASKS[study.task].notes(study)]
    except StimulusRefused as error:
        place = path_of(study, error.stimulus, error.column)
        return {"file": str(path), "ok": False, "problems": listed([Problem(place, str(error))], document, str(path))}
    except (StudyError, YamlError, RigError, DoorDataError, ParticipantError) as error:
        return {"file": str(path), "ok": False, "problems": str(error)}
    if faults := _wordings(study_files, lab):
        return {"file": str(path), "ok": False, "problems": "\n".join(faults)}
    summary = "\n".join([_summary(study_files), *(f"    note: {note}" for note in notes)])
    return {"file": str(path), "ok": True, "summary": summary, **({"notes": notes} if notes else {})}


def _wordings(study_files: StudyFiles, lab: Path) -> list[str]:
    """Return what is wrong with the words on the screens: the window's, the lab's own, and the study's translations."""
    from palpate.devices.window.texts import SHIPPED, problems
    from palpate.devices.window.texts_study import check_study_texts

    files = [*sorted(SHIPPED.glob("*.yaml")), *sorted((lab / "texts").glob("*.yaml"))]
    return [
        *(fault for file in files for fault in problems(file)),
        *check_study_texts(study_files.study, study_files.folder),
    ]


def _demand_playable(study_files: StudyFiles) -> None:
    """Raise RigError, or the error of a device, unless every stimulus of every group can be presented."""
    from palpate.protocols.plan import compile_plan
    from palpate.protocols.trial import ParticipantRow
    from palpate.studies.simulation.rig import simulated

    rig = simulated(study_files.study, study_files.folder)
    groups: list[str | None] = [*sorted(study_files.study.groups)]
    for group in groups or [None]:
        rig.check(compile_plan(study_files.study, ParticipantRow("P001", group)))


def _summary(study_files: StudyFiles) -> str:
    from palpate.protocols.canonical import digest
    from palpate.protocols.plan import count_trials
    from palpate.protocols.tasks import TASKS

    study = study_files.study
    stimuli = {group: study.stimuli_of(group) for group in study.groups} or {"all": study.stimuli}
    lines = [
        f"ok: {study.study}: {study.title or ''}".rstrip(": "),
        f"    {count(len(study.stimuli), 'stimulus', 'stimuli')}; "
        + ", ".join(
            f"group {name}: {count(count_trials(study, own), 'trial')}" for name, own in sorted(stimuli.items())
        ),
        f"    {TASKS[study.task].summary(study)}; "
        f"order: {study.order.design} within {study.order.within}; needs {', '.join(study.needs) or 'nothing'}",
        f"    digest {digest(study.conditions())}",
    ]
    if study.anchors is not None:
        several, before = len(study.anchors.stimuli), study.anchors.before
        lines.insert(2, f"    {several} reference{'s' if several != 1 else ''} before each {before}")
    return "\n".join(lines)


@click.command()
@click.argument("study")
@click.option("--participant", default="P001", show_default=True, help="The participant's pseudonym.")
@click.option("--group", help="The participant's group, if not by the pseudonym's number.")
@click.option("--row", type=click.IntRange(min=0), help="Row of the square, if not by the pseudonym's number.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of randomised orders.")
@click.option("--session", "number", type=click.IntRange(min=1), default=1, show_default=True, help="Which session.")
@click.option("--balance", "people", type=click.IntRange(min=1), help="Certify the balance of this many participants.")
@LAB
@JSON
def plan(
    study: str, participant: str, group: str | None, row: int | None, seed: int, number: int, people: int | None,
    lab: Path, as_json: bool,
) -> None:  # fmt: skip
    """Show the trials of a participant, in order; or, with --balance N, how balanced N orders are.

    What the study declares of its sample, sessions and minutes comes first.

    \b
    Example:
      palpate plan door_ratings --participant P007
      palpate plan door_ratings --balance 40
    """
    from palpate.protocols.plan import compile_plan
    from palpate.protocols.sample import describe_sample
    from palpate.studies.catalogue import find, read_study
    from palpate.studies.participants.lab_forms import lab_forms
    from palpate.studies.participants.row_assignment import allocate

    declared = read_study(find(study, lab)).study
    if people is not None:
        _show_balance(declared, people, seed, as_json)
        return
    who = allocate(declared, participant, group, row)
    compiled = compile_plan(declared, who, seed, lab_forms(declared, lab, live=False), number)
    if as_json:
        echo_json(_plan_data(compiled))
        return
    who = compiled.who
    session = f", session {number}" if number > 1 else ""
    where = f"row {who.row}" if who.group is None else f"group {who.group}, row {who.row}"
    click.echo(f"{declared.study}, participant {who.participant}, {where}, seed {seed}{session}")
    if sample := describe_sample(declared):
        click.echo(f"planned: {sample}")
    sessions = declared.participants.sessions if declared.participants else None
    if sessions is not None and number > sessions:
        declares = f"the study declares {count(sessions, 'session')}"
        click.echo(f"note: {declares}: run refuses session {number} without --accept-timing")
    click.echo(f"plan digest {compiled.digest}")
    for place, trial in enumerate(compiled.trials):
        rest = "  (rest first)" if trial.rest_before else ""
        for anchor in compiled.anchors.get(place, ()):
            click.echo(f"   -  {anchor.block:<10} {anchor.stimulus.id}  (reference)")
        stimuli = ", ".join(side.stimulus.id for side in trial.each())
        click.echo(f"{trial.number:>4}  {trial.block:<10} {stimuli}{rest}")


def _plan_data(compiled: Plan) -> dict[str, Any]:
    from palpate.protocols.sample import sample_of

    who = compiled.who
    anchors = [
        {"before_trial": compiled.trials[place].number, "block": anchor.block, "stimulus": anchor.stimulus.id}
        for place, several in compiled.anchors.items()
        for anchor in several
    ]
    return {
        "study": compiled.study.study,
        "participant": who.participant,
        "group": who.group,
        "row": who.row,
        "seed": compiled.seed,
        "session": compiled.session,
        "digest": compiled.digest,
        "planned": sample_of(compiled.study),
        "trials": [
            {"trial": t.number, "block": t.block, "stimulus": t.stimulus.id}
            | ({"stimuli": [stimulus.id for stimulus in t.stimuli]} if t.stimuli else {})
            for t in compiled.trials
        ],
        **({"anchors": anchors} if anchors else {}),
    }


def _show_balance(study: Study, people: int, seed: int, as_json: bool) -> None:
    """Print certificates by group, over all sessions and for each, of the first `people` participants P001, P002 ..."""
    from palpate.protocols.balance import balance_data, balance_lines, certificates
    from palpate.studies.participants.row_assignment import allocate

    groups: dict[str, list[Any]] = {}
    for number in range(1, people + 1):
        who = allocate(study, f"P{number:03d}")
        groups.setdefault(who.group or "all", []).append((who, seed))
    by_group = {group: certificates(study, rows) for group, rows in sorted(groups.items())}
    if as_json:
        echo_json({group: balance_data(several) for group, several in by_group.items()})
        return
    for group, several in by_group.items():
        for line in balance_lines(group, several):
            click.echo(line)
