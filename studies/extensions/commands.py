"""The verb `extensions`: a lab's own parts, listed, made from templates, and tried by the contracts of their kinds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import click

from palpate.protocols.command_group import NearestGroup
from palpate.protocols.wording import count
from palpate.studies.options import JSON, LAB, echo_json


@click.group(cls=NearestGroup)
def extensions() -> None:
    """A lab's own tasks, forms, needs, procedures, devices, participants, tests and figures.

    They lie in LAB/extensions, or come with an installed package (docs/reference/extensions.md).

    \b
    Example:
      palpate extensions new task acme.grip
      palpate extensions check acme.grip
    """


@extensions.command("list")
@LAB
@JSON
def list_(lab: Path, as_json: bool) -> None:
    """List the extensions of the lab and of installed packages, and their parts. Imports none of them.

    \b
    Example:
      palpate extensions list --lab LAB
    """
    from palpate.studies.extensions.check import listed

    rows = listed(lab)
    if as_json:
        echo_json(rows)
        return
    for row in rows:
        for line in _lines(row):
            click.echo(line)
    if not rows:
        click.echo("no extensions here. Begin one with: palpate extensions new task acme.grip")


def _lines(row: Mapping[str, Any]) -> Iterator[str]:
    code = f"{row['package']} {row['version']}" if "package" in row else f"SHA-256 {row['sha256'][:12]}"
    yield f"{row['extension']}: {code}, {row['where']}"
    if not row["allowed"]:
        yield "  not allowed: it is code, and lab.yaml does not say `extensions: true`"
    for other in row["conflicts"]:
        yield f"  CONFLICT: {other} has the same name; rename one"
    if "problem" in row:
        yield f"  BROKEN: {row['problem']}"
    for kind, parts in row["parts"].items():
        yield f"  {kind}: {', '.join(parts)}"


@extensions.command()
@click.argument("kind")
@click.argument("name")
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), help="The folder of the package.  [default: ./EXTENSION]"
)
@click.option("--in-lab", is_flag=True, help="Write a module into LAB/extensions, in place of a package.")
@LAB
def new(kind: str, name: str, out: Path | None, in_lab: bool, lab: Path) -> None:
    """Write a small extension that works, to begin with: a package with a study and a test.

    KIND is device, task, form, procedure, need, participant, test or figure. NAME is EXTENSION.PART, as acme.grip.
    Nothing is overwritten.

    \b
    Example:
      palpate extensions new task acme.grip
      palpate extensions new device acme.plate --in-lab --lab LAB
    """
    from palpate.studies.extensions.templates import write_module, write_package
    from palpate.studies.lab import settings

    if in_lab and out is not None:
        raise click.UsageError("--in-lab writes into LAB/extensions; leave --out out")
    files = write_module(kind, name, lab) if in_lab else write_package(kind, name, out)
    for file in files:
        click.echo(f"written: {file}")
    if not in_lab:
        click.echo(f"next: pip install -e {files[0].parent}, then: palpate extensions check {name}")
    elif settings(lab).extensions:
        click.echo(f"next: palpate extensions check {name}")
    else:
        click.echo(f"next: write `extensions: true` into {lab / 'lab.yaml'}, then: palpate extensions check {name}")


@extensions.command()
@click.argument("name")
@LAB
@JSON
def check(name: str, lab: Path, as_json: bool) -> None:
    """Try an extension, or one part of it, by the contract of each part's kind. Exit code 1 if a demand is not kept.

    Devices are tried with their twins, other parts in simulated sessions of studies that name them.

    \b
    Example:
      palpate extensions check acme
      palpate extensions check acme.grip
    """
    from palpate.studies.extensions.check import check as verdicts_on

    verdicts = verdicts_on(name, lab)
    failed = [verdict for verdict in verdicts if not verdict.ok]
    if as_json:
        echo_json([{**vars(verdict), "ok": verdict.ok} for verdict in verdicts])
    else:
        for part in dict.fromkeys(verdict.part for verdict in verdicts):
            click.echo(part)
            for verdict in verdicts:
                if verdict.part == part:
                    click.echo(f"  {verdict}")
        kept = "all kept" if not failed else f"{len(failed)} not kept"
        click.echo(f"{count(len(verdicts), 'demand')}, {kept}")
    if failed:
        raise click.exceptions.Exit(1)
