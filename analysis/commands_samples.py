"""`palpate samples`: files to try commands on."""

from __future__ import annotations

from pathlib import Path

import click

from palpate.protocols.shell_command import shell_command

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

    README.md beside them says which commands to try. A file of yours by the same name is never replaced.

    Example: palpate samples samples; palpate import samples/chairs.yaml --lab LAB
    """
    from palpate.protocols.files import staged_files, write_bytes

    files = sample_files()
    for name, content in files.items():
        path = folder / name
        if path.exists() and path.read_bytes() != content:
            raise click.UsageError(f"{path} is there already and is no sample file; give another folder")
    with staged_files(folder) as draft:
        for name, content in files.items():
            write_bytes(draft / name, content)
    click.echo(f"{len(files)} sample files in {folder}: {', '.join(sorted(files))}")
    click.echo(f"Try: {shell_command('import', folder / 'chairs.yaml')}")
    click.echo(f"     {shell_command('predict', 'door-perception', folder / 'door.csv')}")
