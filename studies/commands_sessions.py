"""Verbs that run sessions: run, resume."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.protocols.shell_command import shell_command
from palpate.protocols.wording import count
from palpate.studies.live.options import REHEARSALS, LiveOptions, resume_options, start_options
from palpate.studies.options import JSON, LAB, echo_json, look_in, progress, with_options

if TYPE_CHECKING:
    from palpate.protocols.events import Event
    from palpate.protocols.plan import Plan
    from palpate.studies.catalogue import StudyFiles
    from palpate.studies.sessions.record import Record
    from palpate.studies.sessions.rig import RigPlan
    from palpate.studies.sessions.session import SessionResult


_SEVERAL = re.compile(r"^([A-Za-z]+)([0-9]+)\.\.\1([0-9]+)$")


_PARTICIPANT = "A pseudonym, as P001; with --simulate also several, as P001..P040."
_OPTIONS = (
    click.argument("study"),
    click.option("--participant", required=True, help=_PARTICIPANT),
    click.option("--simulate", is_flag=True, help="A simulated participant at simulated devices, in virtual time."),
    click.option("--seed", type=int, default=0, show_default=True, help="Seed of randomised orders, simulated people."),
    click.option("--group", help="The participant's group, if not by registry or number."),
    click.option("--row", type=click.IntRange(min=0), help="Row of the square, if not by registry or number."),
    click.option("--session", "number", type=click.IntRange(min=1), default=1, show_default=True, help="Which one."),
    start_options, LAB, JSON,
)  # fmt: skip


def session_options(verb: Callable[..., Any]) -> Callable[..., Any]:
    """Give a verb that begins sessions its argument and options."""
    return with_options(verb, _OPTIONS)


@click.command()
@session_options
def run(study: str, as_json: bool, **options: Any) -> None:
    """Run a session of STUDY; every event is on disk before the next thing happens.

    A real participant is known to the lab (palpate participants add) and gets a row of the square once.
    Simulated ones go round the study's groups in turn and take the next row with every round, by their numbers.
    Ctrl-C ends a session safely; go on with palpate resume.

    \b
    Examples:
      palpate run texture_ratings --participant P001 --lab LAB
      palpate run texture_ratings --participant P001 --lab LAB --rehearse
      palpate run door_ratings --participant P001..P040 --simulate --seed 1 --lab LAB
    """
    from palpate.studies.catalogue import find, read_study

    report(run_sessions(read_study(find(study, options["lab"])), **options), as_json, study, options["live"].rig)


def run_sessions(
    study_files: StudyFiles, participant: str, simulate: bool, seed: int, group: str | None, row: int | None,
    number: int, lab: Path, live: LiveOptions,
) -> list[SessionResult]:  # fmt: skip
    """Start a session, or several simulated ones, and run them as far as they go."""
    from palpate.studies.live.hardware import hardware_for
    from palpate.studies.participants.lab_forms import unasked_questions

    if simulate and (live.rehearse or live.twins or live.rig is not None):
        raise click.UsageError("--simulate needs no window and no rig: leave --rehearse, --twins and --rig out, or it")
    people = _people(participant, simulate)
    for note in unasked_questions(study_files.study, lab):
        click.echo(f"note: {note}", err=True)
    if live.rehearse:
        from palpate.studies.live.rehearsal import rehearsal_plan, rehearse

        [plan] = _plans(study_files, lab, people, seed, (group, row), live, real=False)
        return [rehearse(lab, plan, rehearsal_plan(study_files, lab, live))]
    if simulate:
        plans = _plans(study_files, lab, people, seed, (group, row), live, real=False, number=number)
        return _simulated(study_files, lab, plans, number, row is not None, live)
    hardware_for(study_files, lab, live)
    return [_live(study_files, lab, people, seed, (group, row), number, live)]


def _plans(
    study_files: StudyFiles, lab: Path, people: list[str], seed: int, place: tuple[str | None, int | None],
    live: LiveOptions, real: bool, number: int = 1,
) -> list[Plan]:  # fmt: skip
    from palpate.studies.launching.launch import plans_of

    return plans_of(study_files.study, lab, people, seed, real, live.language or "en", *place, number)


def _simulated(
    study_files: StudyFiles, lab: Path, plans: list[Plan], number: int, shared: bool, live: LiveOptions
) -> list[SessionResult]:
    from palpate.studies.participants.row_assignment import demand_free
    from palpate.studies.sessions.session import start
    from palpate.studies.simulation.rig import simulated

    rig = simulated(study_files.study, study_files.folder, lab)
    people = [plan.who.participant for plan in plans]
    accepted = _before(study_files, lab, people, number, live, real=False)
    demand_free(lab, plans, number, shared)
    results: list[SessionResult] = []
    with closing(progress(plans, "running", live.as_json)) as steps:
        for plan in steps:
            results.append(start(lab, plan, rig, number, accepted[plan.who.participant]))
            if not results[-1].complete:
                break
    return results


def _live(
    study_files: StudyFiles, lab: Path, people: list[str], seed: int, place: tuple[str | None, int | None], number: int,
    live: LiveOptions,
) -> SessionResult:  # fmt: skip
    from palpate.studies.launching.launch import demand_new
    from palpate.studies.live.opening import live_plan
    from palpate.studies.sessions.session import start

    [who] = people
    demand_new(lab, study_files.study.study, who, number)
    accepted = _before(study_files, lab, people, number, live, real=True)[who]
    rig = live_plan(study_files, lab, live)
    # This allocates a row: nothing may be amiss by now.
    [plan] = _plans(study_files, lab, people, seed, place, live, real=True, number=number)
    result = start(lab, plan, rig, number, accepted)
    _update_row(study_files, lab, who, result)
    return result


def _update_row(study_files: StudyFiles, lab: Path, participant: str, result: SessionResult) -> None:
    """Mark the participant's row as finished, or offer it again where the participant does not take part."""
    from palpate.studies.participants.admission import decline, finish

    if result.complete:
        finish(lab, study_files.study, participant)
    elif result.status == "declined":
        decline(lab, study_files.study, participant)
    elif result.status == "ineligible":
        decline(lab, study_files.study, participant, "not eligible")


def _before(
    study_files: StudyFiles, lab: Path, people: list[str], number: int, live: LiveOptions, real: bool
) -> dict[str, dict[str, Any] | None]:
    """Check that all earlier sessions have ended, and that study and models are those of the sample.

    Returns for each participant what goes on record about an accepted change or time.
    """
    from palpate.studies.launching.changes import demand_same_models, demand_unchanged, earlier_header, sample_ledgers
    from palpate.studies.launching.launch import demand_in_time, demand_next
    from palpate.studies.sessions.extensions import demand_same_extensions, extensions_of_study
    from palpate.studies.sessions.record import read_header

    study, today = study_files.study.study, datetime.now().astimezone().date() if real else None
    for who in people:
        demand_next(lab, study, who, number)
    sample = sample_ledgers(lab, study, real)
    of_sample = read_header(sample[0]) if sample else None
    models = demand_same_models(study_files.study, lab, sample, live.accept_change)
    named = extensions_of_study(study_files.study)
    accepted: dict[str, dict[str, Any] | None] = {}
    for who in people:
        header = earlier_header(lab, study, who, number) or of_sample
        changed = None if header is None else demand_unchanged(header, study_files.study, live.accept_change)
        code = None if header is None else demand_same_extensions(header, named, live.accept_change)
        timing = demand_in_time(lab, study_files.study, who, number, live.accept_timing, today)
        accepted[who] = {**(changed or {}), **(code or {}), **(models or {}), **(timing or {})} or None
    return accepted


@click.command()
@click.argument("ledger", type=click.Path(path_type=Path))
@click.option("--study", help="The study's name or path, if it is not among the lab's or the shipped ones.")
@click.option("--without-wal", is_flag=True, help="Go on although the file's -wal companion was lost.")
@resume_options
@click.option(
    "--lab", type=click.Path(file_okay=False, path_type=Path), show_default="the folder above LEDGER's",
    help="The lab's folder.",
)  # fmt: skip
@JSON
def resume(
    ledger: Path, study: str | None, without_wal: bool, lab: Path | None, as_json: bool, live: LiveOptions
) -> None:
    """Resume an interrupted session: what is recorded is replayed, then the session continues at the exact act.

    LEDGER is a session's file; with --lab also its name in LAB/sessions. It continues with the study as it was
    recorded. If the study's file or a model that it plays has changed since, --accept-change is needed, and is
    recorded.

    \b
    Example:
      palpate resume LAB/sessions/door_ratings_P001_s1.sqlite
    """
    from palpate.studies.sessions.record import LedgerError, read
    from palpate.studies.sessions.session import resume as resume_session
    from palpate.studies.sessions.session_files import in_person

    if lab is not None and not ledger.exists():
        ledger = lab / "sessions" / ledger
    if ledger.is_dir():
        raise LedgerError(f"{ledger}: a folder; name one ledger, as {ledger / 'STUDY_P001_s1.sqlite'}")
    lab = look_in(lab or ledger.resolve().parent.parent)
    record = read(ledger)
    if record.lacks_wal and not without_wal:
        raise LedgerError(
            f"{ledger}: its -wal file, which may hold the session's last events, is not there; copy both files, "
            "or add --without-wal to continue from what is left"
        )
    study_files, rig, accepted = _resumed(record, lab, study, live)
    result = resume_session(ledger, rig, accepted)
    if in_person(record.header):
        _update_row(study_files, lab, record.header["participant"], result)
    report([result], as_json, study, live.rig)


def _resumed(
    record: Record, lab: Path, study: str | None, live: LiveOptions
) -> tuple[StudyFiles, RigPlan, dict[str, Any] | None]:
    """Return the recorded study with its folder, its rig plan, and what goes on record of changes since then."""
    from palpate.studies.catalogue import StudyFiles, find
    from palpate.studies.launching.changes import demand_same_models, sample_ledgers
    from palpate.studies.launching.launch import changed_since, demand_soon
    from palpate.studies.live.opening import resumed_live_plan
    from palpate.studies.participants.admission import admit, readmit
    from palpate.studies.sessions.extensions import KEY, demand_same_extensions
    from palpate.studies.sessions.replay import recompiled
    from palpate.studies.sessions.session_files import in_person
    from palpate.studies.simulation.rig import simulated

    plan = recompiled(record)
    header, declared = record.header, plan.study
    file = find(study or declared.study, lab)
    accepted = changed_since(header, file, live.accept_change)
    study_files, real = StudyFiles(declared, file.parent), header["rig"]["kind"] != "simulated"
    admit(lab, declared, plan.who.participant, live=False)
    ledgers = [record.path, *sample_ledgers(lab, declared.study, in_person(header))]
    accepted |= demand_same_models(declared, lab, ledgers, live.accept_change) or {}
    accepted |= demand_same_extensions(header, header.get(KEY, {}), live.accept_change) or {}
    if not real:
        return study_files, simulated(declared, file.parent, lab, header["rig"].get("pictures")), accepted or None
    accepted |= demand_soon(record, live.accept_change, datetime.now(UTC)) or {}
    rig, of_screen = resumed_live_plan(study_files, lab, live, header)
    readmit(lab, declared, plan.who.participant)
    return study_files, rig, {**accepted, **(of_screen or {})} or None


def _people(participant: str, simulate: bool) -> list[str]:
    several = _SEVERAL.fullmatch(participant)
    if several is None:
        return [participant]
    from palpate.studies.participants.row_assignment import AllocationError

    letters, first, last = several.groups()
    if not simulate:
        raise AllocationError(f"participant {participant!r}: only simulated sessions run several at once")
    if not 0 < int(last) - int(first) + 1 <= 10_000:
        raise AllocationError(f"participant {participant!r}: from first to last is expected, as P001..P040")
    return [f"{letters}{number:0{len(first)}d}" for number in range(int(first), int(last) + 1)]


def report(results: list[SessionResult], as_json: bool, study: str | None, rig: Path | None = None) -> None:
    """Print how each run of a session ended, with its receipt; `rig` is the file that was named.

    Of several sessions the receipts that differ are printed, in red, and how many are good.

    The exit code is 1 unless every session is complete and all its events were read back from the disk; 130 after
    Ctrl-C.
    """
    bad = [result for result in results if result.receipt is not None and not result.receipt.good]
    if as_json:
        echo_json(
            [
                {
                    "ledger": str(result.path),
                    "complete": result.complete,
                    "events": result.events,
                    "ended": result.reason,
                }
                | ({} if result.receipt is None else {"receipt": result.receipt.to_dict()})
                for result in results
            ]
        )
    else:
        for result in bad:
            click.secho(f"{result.receipt}: {result.path}", fg="red")
        good = [result.receipt for result in results if result.receipt is not None and result.receipt.good]
        if len(good) == 1:
            click.echo(str(good[0]))
        elif good:
            events = f"{sum(receipt.planned for receipt in good)} events planned, written and read back from the disk"
            click.echo(f"receipts of {len(good)} sessions: {events}")
        for line in _outcome_lines(results, study, rig):
            click.echo(line)
    if bad or not all(result.complete for result in results):
        interrupted = not bad and any("SIGINT" in result.reason for result in results)
        raise click.exceptions.Exit(130 if interrupted else 1)


def _outcome_lines(results: list[SessionResult], study: str | None, rig: Path | None) -> Iterator[str]:
    done = [result for result in results if result.complete]
    if len(done) > 1:
        events = count(sum(result.events for result in done), "event")
        yield f"{len(done)} sessions complete, {events}, in {done[0].path.parent}"
    elif done:
        yield f"complete: {count(done[0].events, 'event')} in {done[0].path}"
    for result in results:
        if result.status in {"aborted", "declined", "ineligible"}:
            yield f"{result.status}: the session is over; recorded: {count(result.events, 'event')} in {result.path}"
        elif result.path.parent.parent.name == REHEARSALS and not result.complete:
            yield f"{result.reason}; a rehearsal cannot be resumed: rehearse again"
        elif not result.complete:
            by_path = ["--study", study] if study and ("/" in study or Path(study).suffix) else []
            by_rig = [] if rig is None else ["--rig", str(rig)]
            command = shell_command("resume", result.path, *by_path, *by_rig)
            yield f"{result.reason}; recorded: {count(result.events, 'event')}. Resume with: {command}"


@click.command()
@session_options
def record(study: str, as_json: bool, **options: Any) -> None:
    """Record the stimuli of a capture STUDY with the station's sensors, and print what was recorded of every stream.

    The devices are those of LAB/stations/HOST/rig.yaml (palpate rig simulate writes one of twins). What the sensors
    give is on disk while it is recorded; what is lost is counted; a recording that a fault breaks off is made again.

    \b
    Examples:
      palpate record texture_capture --participant P001 --group pilot --lab LAB
      palpate record texture_capture --participant P001 --simulate --lab LAB
    """
    from palpate.protocols.tasks import TASKS
    from palpate.studies.catalogue import find, read_study

    study_files = read_study(find(study, options["lab"]))
    if TASKS[study_files.study.task].asks:
        raise click.UsageError(
            f"{study_files.study.study} is not a capture study: it asks, and no sensor records. "
            f"{shell_command('run', study)}"
        )
    results = run_sessions(study_files, **options)
    if not as_json:
        from palpate.studies.sessions.record import read

        for result in results:
            for line in recorded(read(result.path)):
                click.echo(line)
    report(results, as_json, study, options["live"].rig)


def recorded(record: Record) -> Iterator[str]:
    """Yield one line for each recording of a session that counts."""
    for attempt in record.state.counting:
        for event in record.events_of(attempt):
            if event.kind == "reply" and event.value.get("recorded"):
                yield from (f"trial {event.trial}, {line}" for line in _reply_lines(event))


def _reply_lines(event: Event) -> Iterator[str]:
    """Yield for each stream what was received and what was lost; a simulated session has the samples in its reply."""
    for name, stream in event.value.get("streams", {}).items():
        lost = f"{stream['lost']} LOST in {count(stream['gaps'], 'gap')}" if stream["lost"] else "none lost"
        drift = "" if stream.get("drift_ppm") is None else f", clock {stream['drift_ppm']:+.0f} ppm"
        rate = "rate not measured" if stream["rate_hz"] is None else f"{stream['rate_hz']:.2f} Hz"
        yield f"{name}: {count(stream['samples'], 'sample')}, {rate}, {lost}{drift}"
    for samples in event.samples:
        yield f"{samples.stream}: {count(samples.count, 'sample')}, {samples.rate_hz:.2f} Hz, simulated"
    if pictures := event.value.get("pictures"):
        flagged = sum(bool(picture.get("flags")) for picture in pictures)
        yield f"camera: {count(len(pictures), 'picture')}" + (f", {flagged} of them flagged" if flagged else "")
