"""Verbs about people: make a lab; add, list and withdraw people; allocate and release rows of a study's square."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.protocols.shell_command import shell_command
from palpate.protocols.wording import count
from palpate.studies.options import JSON, LAB, echo_json

if TYPE_CHECKING:
    from palpate.protocols.study import Study
    from palpate.studies.participants.allocation_overview import GroupAllocation
    from palpate.studies.participants.registry import Registry


@click.command(short_help="Make a folder a lab.")
@click.argument("lab", type=click.Path(path_type=Path))
def init(lab: Path) -> None:
    """Make LAB a lab: the table of participants, consent and data-protection texts, and a folder for sessions.

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
    from palpate.studies.lab import demand_lab
    from palpate.studies.participants.identities import Identity, demand_good, demand_private, identify
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


@participants.command(name="identify", short_help="Write down or correct a participant's identity.")
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
    if not identity.to_dict():
        raise click.UsageError("nothing to write down: give --name, --contact, --consented or --note")
    demand_known(_registry(lab, open_registry), participant)
    identify(lab, participant, identity)
    click.echo(f"{participant}: {', '.join(identity.to_dict())} kept in {lab / 'private'}")


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
        find(study, lab)  # raises on a mistyped name
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
        rows = [{"study": one.study, "group": one.group, "row": one.row} for one in done.released]
        echo_json(
            {"participant": participant, "erased": done.erased, "released": rows, "sessions": list(done.sessions)}
        )
        return
    click.echo(
        f"{participant} has withdrawn; "
        + ("their identity is erased" if done.erased else "no identity was stored here")
    )
    for allocation in done.released:
        click.echo(f"  {allocation.describe()} of {allocation.study} is on offer again")
    for name in done.sessions:
        click.echo(f"  marked: {name}")


@participants.command(short_help="Write participants.tsv (BIDS).")
@click.option("--simulated", is_flag=True, help="Also what simulated people answered: for rehearsing only.")
@LAB
@JSON
def export(simulated: bool, lab: Path, as_json: bool) -> None:
    """Write LAB/participants.tsv (BIDS): pseudonyms, what people said about themselves, and their studies.

    People who withdrew are left out. Columns that participants.json does not ask about stay as they are in the table.

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
        click.echo(f"{count(len(done.participants), 'participant')} in {done.file}")
        if done.withdrawn:
            click.echo(f"left out: {len(done.withdrawn)} who withdrew")
        if done.simulated:
            click.echo(f"left out: {count(len(done.simulated), 'simulated session')} (--simulated takes them in)")
        for problem in done.refused:
            click.echo(f"REFUSED  {problem}")
    if done.refused:
        raise click.exceptions.Exit(1)


def _registry(lab: Path, opened: Any) -> Any:
    from palpate.studies.lab import demand_lab

    demand_lab(lab)
    return opened(lab)


@participants.command(short_help="Allocate a row of a study.")
@click.argument("study")
@click.argument("participant")
@click.option("--replaces", metavar="PSEUDONYM", help="Whose group and row to inherit; they dropped out or withdrew.")
@click.option("--group", help="The group.  [default: the one with the fewest participants]")
@click.option("--row", type=click.IntRange(min=0), help="The row.  [default: one given up, else the next]")
@LAB
@JSON
def allocate(
    study: str, participant: str, replaces: str | None, group: str | None, row: int | None, lab: Path, as_json: bool
) -> None:
    """Allocate a row of STUDY's counterbalancing square to a participant: once, and nobody else's.

    A session does this by itself when it starts; ahead of time it is for planning, and for replacements.

    \b
    Example:
      palpate participants allocate door_ratings P041 --replaces P003 --lab LAB
    """
    from palpate.studies.participants.allocations import describe_place
    from palpate.studies.participants.rows import allocate_row

    declared, registry = _opened(study, lab)
    who = allocate_row(registry, declared, participant, group, row, replaces)
    if as_json:
        echo_json({"study": declared.study, "participant": participant, "group": who.group, "row": who.row})
    else:
        click.echo(f"{participant} has {describe_place((who.group, who.row))} of {declared.study}")


@participants.command(short_help="Say who dropped out of a study.")
@click.argument("study")
@click.argument("participant")
@click.option("--why", required=True, help="For the audit trail: no names.")
@LAB
@JSON
def release(study: str, participant: str, why: str, lab: Path, as_json: bool) -> None:
    """Record that a participant dropped out of STUDY; their row is free again.

    \b
    Example:
      palpate participants release door_ratings P003 --why "did not come back" --lab LAB
    """
    from palpate.studies.participants.identities import demand_nameless
    from palpate.studies.participants.rows import release as give_up

    declared, registry = _opened(study, lab)
    demand_nameless(lab, participant, why)
    released = give_up(registry, declared, participant, why)
    if as_json:
        echo_json({"study": declared.study, "participant": participant, "group": released.group, "row": released.row})
    else:
        click.echo(f"{released.describe()} of {declared.study} is on offer again; {participant} no longer holds it")


@participants.command(short_help="Certify a study's balance so far.")
@click.argument("study")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of sessions to come, for randomised orders.")
@LAB
@JSON
def balance(study: str, seed: int, lab: Path, as_json: bool) -> None:
    """Certify how balanced STUDY is so far; say who holds which row and which row comes next.

    \b
    Example:
      palpate participants balance door_ratings --lab LAB
    """
    from palpate.studies.participants.allocation_overview import group_allocations, overlaps

    declared, registry = _opened(study, lab)
    groups, shared = group_allocations(registry, declared, seed), overlaps(registry, declared.study)
    if as_json:
        echo_json(
            {"groups": [_group_data(item) for item in groups], "overlaps": [_overlap_data(item) for item in shared]}
        )
        return
    for item in groups:
        _show_group(item)
    for one in shared:
        click.echo(one.text())


@participants.command(short_help="Say who took part in what else.")
@click.argument("study")
@LAB
@JSON
def overlap(study: str, lab: Path, as_json: bool) -> None:
    """Say how many of STUDY's participants also took part in each other study of the lab.

    \b
    Example:
      palpate participants overlap door_ratings --lab LAB
    """
    from palpate.studies.participants.allocation_overview import overlaps

    declared, registry = _opened(study, lab)
    shared = overlaps(registry, declared.study)
    if as_json:
        echo_json([_overlap_data(item) for item in shared])
        return
    for item in shared:
        click.echo(item.text())
    if not shared:
        click.echo("nobody has taken part in any other study of this lab")


def _opened(study: str, lab: Path) -> tuple[Study, Registry]:
    from palpate.studies.catalogue import find, read_study
    from palpate.studies.lab import demand_lab
    from palpate.studies.participants.registry import open_registry

    demand_lab(lab)
    return read_study(find(study, lab)).study, open_registry(lab)


def _show_group(group: GroupAllocation) -> None:
    from palpate.protocols.balance import balance_lines

    name = "all" if group.group is None else group.group
    nobody = [f"group {name}: nobody has a row yet."]
    for line in balance_lines(name, group.certificates) if group.holders else nobody:
        click.echo(line)
    for item in group.holders:
        inherited = f", inherited from {item.replaces}" if item.replaces else ""
        click.echo(f"  row {item.row:>3}  {item.participant:<8} {item.status}{inherited}")
    for row, who in group.given_up:
        click.echo(f"  row {row:>3}  on offer, given up by {who}")
    click.echo(f"  next: row {group.next_row}")


def _group_data(group: GroupAllocation) -> dict[str, Any]:
    from palpate.protocols.balance import balance_data

    data = balance_data(group.certificates)
    counts = ("sequences", "balanced", "position_range", "carry_over_range", "sessions")
    certified = {key: data[key] for key in counts if key in data}
    return {
        "group": group.group,
        **certified,
        "balanced": data["balanced"] and bool(group.holders),
        "rows": [
            {"row": item.row, "participant": item.participant, "status": item.status, "replaces": item.replaces}
            for item in group.holders
        ],
        "on_offer": [{"row": row, "given_up_by": who} for row, who in group.given_up],
        "next_row": group.next_row,
    }


def _overlap_data(overlap: Any) -> dict[str, Any]:
    return {"study": overlap.other, "common": overlap.common, "of": overlap.of}
