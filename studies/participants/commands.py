"""Verbs about people: making a lab, adding, listing, withdrawing; the rows of studies stand in commands_rows.py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from palpate.protocols.shell_command import shell_command
from palpate.protocols.wording import count
from palpate.studies.options import JSON, LAB, echo_json
from palpate.studies.participants.commands_rows import allocate, balance, overlap, release


@click.command(short_help="Make a folder a lab.")
@click.argument("lab", type=click.Path(path_type=Path))
def init(lab: Path) -> None:
    """Make LAB a lab: the table of participants, consent and data-protection texts, and where sessions will lie.

    LAB must be new or empty, or hold nothing but a lab's own studies and sessions. Nothing is ever overwritten.

    \b
    Example:
      palpate init mylab
    """
    from palpate.studies.participants.lab_template import make_lab

    done = make_lab(lab)
    click.echo(f"{lab} is a lab now: {', '.join(done.made)}")
    for name, blanks in done.blanks.items():
        click.echo(f"  {name}: {blanks} [blanks] to fill in")
    click.echo(f"then: {shell_command('participants', 'add', '--lab', lab)}")


@click.group()
def participants() -> None:
    """Add, list and withdraw people, and say who holds which row of a study's counterbalancing square.

    Everybody is a pseudonym. Names, contacts and dates of consent lie in LAB/private, which only its owner can read,
    and nowhere else.
    """


@participants.command(short_help="Add a participant.")
@click.option("--pseudonym", help="As P007.  [default: the next that is free]")
@click.option("--name", help="Who it is; goes into LAB/private only, as do the following.")
@click.option("--contact", help="How to reach them.")
@click.option("--consented", metavar="DATE", help="When the consent was signed, as 2026-03-31.")
@click.option("--note", help="One line about the person.")
@LAB
@JSON
def add(
    pseudonym: str | None, name: str | None, contact: str | None, consented: str | None, note: str | None, lab: Path,
    as_json: bool,
) -> None:  # fmt: skip
    """Add a participant and print the pseudonym.

    \b
    Example:
      palpate participants add --name "Kim Hana" --contact hana@example.org --consented 2026-03-31 --lab LAB
    """
    from palpate.protocols.interrupts import holding_interrupts
    from palpate.studies.participants.identities import Identity, demand_good, demand_private, identify
    from palpate.studies.participants.lab import demand_lab
    from palpate.studies.participants.people import add as enter
    from palpate.studies.participants.registry import open_registry

    demand_lab(lab)
    identity = Identity(name, contact, consented, note)
    demand_good(identity)
    demand_private(lab)
    registry = open_registry(lab)
    with holding_interrupts():  # a pseudonym without an identity would be added again
        added = enter(registry, pseudonym)
        identify(lab, added, identity)
    if as_json:
        echo_json({"participant": added})
    else:
        click.echo(added)


@participants.command(name="identify", short_help="Write down or correct who somebody is.")
@click.argument("participant")
@click.option("--name", help="Who it is.")
@click.option("--contact", help="How to reach them.")
@click.option("--consented", metavar="DATE", help="When the consent was signed, as 2026-03-31.")
@click.option("--note", help="One line about the person.")
@LAB
def identify_(
    participant: str, name: str | None, contact: str | None, consented: str | None, note: str | None, lab: Path
) -> None:
    """Write down or correct who is behind a pseudonym, in LAB/private only; what is left out stays as it was.

    \b
    Example:
      palpate participants identify P003 --contact new@example.org --lab LAB
    """
    from palpate.studies.participants.identities import Identity, identify
    from palpate.studies.participants.people import demand_known
    from palpate.studies.participants.registry import open_registry

    identity = Identity(name, contact, consented, note)
    if not identity.told():
        raise click.UsageError("nothing to write down: give --name, --contact, --consented or --note")
    demand_known(_registry(lab, open_registry), participant)
    identify(lab, participant, identity)
    click.echo(f"{participant}: {', '.join(identity.told())} kept in {lab / 'private'}")


@participants.command(name="list", short_help="List participants, rows, sessions.")
@click.option("--study", help="Only those who hold or held a row of this study.")
@click.option("--identities", "with_names", is_flag=True, help="Show names and contacts, on the screen only.")
@LAB
@JSON
def list_(study: str | None, with_names: bool, lab: Path, as_json: bool) -> None:
    """List the lab's participants: status, rows, sessions.

    \b
    Example:
      palpate participants list --study door_ratings --lab LAB
    """
    from palpate.studies.catalogue import find
    from palpate.studies.participants.identities import identities
    from palpate.studies.participants.listing import lines, listed
    from palpate.studies.participants.registry import open_registry

    if with_names and as_json:
        raise click.UsageError("--identities is for the screen: names go into no JSON; leave one of the two out")
    people = listed(_registry(lab, open_registry), study)
    if study is not None and not people:
        find(study, lab)  # A name that is mistyped is said to be one.
    if as_json:
        echo_json(people)
        return
    for line in lines(people, identities(lab) if with_names else {}):
        click.echo(line)


@participants.command(short_help="Erase who a participant is.")
@click.argument("participant")
@click.option("--why", required=True, help="For the audit trail, which stays: no names.")
@LAB
@JSON
def withdraw(participant: str, why: str, lab: Path, as_json: bool) -> None:
    """Erase who a participant is, mark their sessions, and offer their rows again. This cannot be undone.

    Their sessions stay under the pseudonym, but are no longer collected, analysed or exported.

    \b
    Example:
      palpate participants withdraw P003 --why "on request, by mail" --lab LAB
    """
    from palpate.studies.participants.registry import open_registry
    from palpate.studies.participants.withdrawal import withdraw as take_out

    done = take_out(_registry(lab, open_registry), participant, why)
    if as_json:
        rows = [{"study": each.study, "group": each.group, "row": each.row} for each in done.released]
        echo_json(
            {"participant": participant, "erased": done.erased, "released": rows, "sessions": list(done.sessions)}
        )
        return
    click.echo(
        f"{participant} has withdrawn; " + ("their identity is erased" if done.erased else "no identity was kept here")
    )
    for each in done.released:
        click.echo(f"  {each.told()} of {each.study} is on offer again")
    for name in done.sessions:
        click.echo(f"  marked: {name}")


@participants.command(short_help="Write participants.tsv (BIDS).")
@click.option("--simulated", is_flag=True, help="Also what simulated people answered: for rehearsing only.")
@LAB
@JSON
def export(simulated: bool, lab: Path, as_json: bool) -> None:
    """Write LAB/participants.tsv (BIDS): pseudonyms, what people said about themselves, and the studies they sat in.

    Who withdrew is left out. Columns that participants.json does not ask about are kept as they stand in the table.

    \b
    Example:
      palpate participants export --lab LAB
    """
    from palpate.studies.participants.export import export as write_out
    from palpate.studies.participants.registry import open_registry

    done = write_out(_registry(lab, open_registry), simulated)
    if as_json:
        echo_json(
            {
                "file": str(done.file),
                "participants": list(done.participants),
                "withdrawn": list(done.withdrawn),
                "simulated": list(done.simulated),
                "refused": list(done.refused),
            }
        )
    else:
        _show_export(done)
    if done.refused:
        raise click.exceptions.Exit(1)


def _show_export(done: Any) -> None:
    click.echo(f"{count(len(done.participants), 'participant')} in {done.file}")
    if done.withdrawn:
        click.echo(f"left out: {len(done.withdrawn)} who withdrew")
    if done.simulated:
        click.echo(f"left out: {count(len(done.simulated), 'simulated session')} (--simulated takes them in)")
    for problem in done.refused:
        click.echo(f"REFUSED  {problem}")


def _registry(lab: Path, opened: Any) -> Any:
    from palpate.studies.participants.lab import demand_lab

    demand_lab(lab)
    return opened(lab)


for _command in (allocate, release, balance, overlap):
    participants.add_command(_command)
