"""Verbs about rows of a study's counterbalancing square: allocate, release, balance, overlap."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.studies.options import JSON, LAB, echo_json

if TYPE_CHECKING:
    from palpate.protocols.study import Study
    from palpate.studies.participants.allocation_overview import GroupAllocation
    from palpate.studies.participants.registry import Registry


@click.command(short_help="Allocate a row of a study.")
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
    from palpate.studies.participants.allocations import place_told
    from palpate.studies.participants.rows import allocate_row

    declared, registry = _opened(study, lab)
    who = allocate_row(registry, declared, participant, group, row, replaces)
    if as_json:
        echo_json({"study": declared.study, "participant": participant, "group": who.group, "row": who.row})
    else:
        click.echo(f"{participant} has {place_told((who.group, who.row))} of {declared.study}")


@click.command(short_help="Say who dropped out of a study.")
@click.argument("study")
@click.argument("participant")
@click.option("--why", required=True, help="For the audit trail: no names.")
@LAB
@JSON
def release(study: str, participant: str, why: str, lab: Path, as_json: bool) -> None:
    """Put on record that a participant dropped out of STUDY; their row is on offer again.

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
        click.echo(f"{released.told()} of {declared.study} is on offer again; {participant} no longer holds it")


@click.command(short_help="Certify a study's balance so far.")
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


@click.command(short_help="Say who took part in what else.")
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
    found = overlaps(registry, declared.study)
    if as_json:
        echo_json([_overlap_data(item) for item in found])
        return
    for item in found:
        click.echo(item.text())
    if not found:
        click.echo("nobody has taken part in any other study of this lab")


def _opened(study: str, lab: Path) -> tuple[Study, Registry]:
    from palpate.studies.catalogue import find, read_study
    from palpate.studies.participants.lab import demand_lab
    from palpate.studies.participants.registry import open_registry

    demand_lab(lab)
    return read_study(find(study, lab)).study, open_registry(lab)


def _show_group(group: GroupAllocation) -> None:
    from palpate.protocols.balance import balance_lines

    name = "all" if group.group is None else group.group
    nobody = [f"group {name}: nobody holds a row yet."]
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
