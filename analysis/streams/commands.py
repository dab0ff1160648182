"""`palpate streams`: what streams a session holds, and their export, aligned or as recorded."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.protocols.wording import some
from palpate.studies.options import JSON, echo_json

if TYPE_CHECKING:
    from palpate.analysis.streams.alignment import AlignmentOptions

LEDGER = click.Path(path_type=Path)
OUT = click.Path(path_type=Path)


class Listing(click.Group):
    """A command group in which `palpate streams LEDGER` lists: an argument that is no verb is a ledger."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Insert the verb `list` if it is left out."""
        if args and args[0] not in self.commands and args[0] not in ctx.help_option_names:
            args = ["list", *args]
        return super().parse_args(ctx, args)


@click.group(cls=Listing, subcommand_metavar="[LEDGER]... | COMMAND [ARGS]...")
def streams() -> None:
    """Recorded streams: what a session holds of them, and their export on one grid of time.

    \b
    Example:
      palpate streams LAB/sessions/*.sqlite
      palpate streams export SESSION.sqlite --trial 3 --rate 1000 --method bandlimited --out trial3.csv
    """


@streams.command("list")
@click.argument("ledger", nargs=-1, required=True, type=LEDGER)
@click.option("--trial", type=int, help="Only this trial.")
@JSON
def list_command(ledger: tuple[Path, ...], trial: int | None, as_json: bool) -> None:
    """What streams LEDGERs hold: samples, rate, drift, losses; of the attempt of each trial that counts.

    A LEDGER may be a folder of them. Attempts that were repeated or faulted are listed without their streams.

    \b
    Example:
      palpate streams LAB/sessions/texture_capture_P001_s1.sqlite --trial 2
    """
    from palpate.analysis.streams.listing import format_lines, list_streams
    from palpate.studies.sessions.record import read

    ledgers = [inner for path in ledger for inner in (sorted(path.glob("*.sqlite")) if path.is_dir() else [path])]
    if not ledgers:
        raise click.UsageError(f"no ledgers (*.sqlite) in {some(ledger)}")
    rows = [list_streams(read(path), trial) for path in ledgers]
    if as_json:
        echo_json(rows)
        return
    for row in rows:
        click.secho(f"{row['session']}  {row['ledger']}", bold=True)
        for line in format_lines(row["streams"]) or ["no streams"]:
            click.echo(f"  {line}")
        for line in row["not_used"]:
            click.secho(f"  {line}", fg="yellow")


@streams.command("export")
@click.argument("ledger", type=LEDGER)
@click.option("--trial", type=int, help="Only this trial; else all, and --out is a folder.")
@click.option("--attempt", type=int, help="This attempt, whatever became of it, instead of the one that counts.")
@click.option("--act", type=int, help="Which recording of the trial, where it has several (--trial).")
@click.option("--out", type=OUT, required=True, help="The CSV file to write, or a folder.")
@click.option("--rate", "rate_hz", type=float, default=1000.0, show_default=True, help="The grid's rate in Hz.")
@click.option("--method", default="bandlimited", show_default=True,
              help="hold, nearest, linear, pchip, cubic or bandlimited; then STREAM=METHOD,... for some.")  # fmt: skip
@click.option("--latency", default="", help="STREAM=SECONDS,...: how late even the promptest arrivals of a stream are.")
@click.option(
    "--by-stamps", multiple=True, help="STREAM: time it by its device's own stamps, not arrivals. Repeatable."
)
@click.option("--longest-gap", "longest_gap_s", type=float, help="Longest hole that is bridged, in s.  [default: 0.02]")
@click.option("--everything", is_flag=True, help="From the first sample of any stream to the last, not what all share.")
@click.option("--marks", is_flag=True, help="Adds columns STREAM_bridged: 1 where a short hole was bridged.")
@click.option("--hinge", help="STREAM of positions on a door: adds its angle about the hinge, column angle_deg.")
@click.option("--speed", multiple=True, help="STREAM of positions: adds STREAM_vx.. and _speed in mm/s. Repeatable.")
@click.option("--speed-window", type=int, help="Over how many samples a speed is taken.  [default: 7]")
@click.option("--causal", is_flag=True, help="Speeds take nothing from the future, at the cost of error and delay.")
@click.option("--raw", is_flag=True, help="Each stream as recorded, in its own file; --out is a folder.")
@JSON
def export_command(ledger: Path, trial: int | None, out: Path, raw: bool, as_json: bool, **how: Any) -> None:
    """Write streams of LEDGER as CSV, on one grid of session time or as recorded, and a JSON file that explains them.

    Columns: time_s, then STREAM_CHANNEL. Cells are empty where nothing is known: nothing is extrapolated, and holes
    longer than --longest-gap stay. The JSON file holds methods and their errors, clocks, gaps, units and the ledger's
    digest.

    \b
    Example:
      palpate streams export SESSION.sqlite --trial 3 --speed tool_position --out trial3.csv
      palpate streams export SESSION.sqlite --trial 1 --out door.csv
      palpate doors normalise door.csv --zero --out K8_g0.csv \\
        --angle-column door_angle_angle --force-column door_force_force
    """
    from palpate.analysis.streams.export import ExportSelection, export
    from palpate.studies.sessions.record import read

    chosen = ExportSelection(trial, how["attempt"], how["act"], how["hinge"], how["by_stamps"])
    if (how["speed_window"] is not None or how["causal"]) and not how["speed"]:
        raise click.UsageError("--speed-window and --causal are about a speed: say of which stream, --speed STREAM")
    if how["speed"] and raw:
        raise click.UsageError("--speed adds columns to the grid; --raw has none: leave one of them out")
    files = export(read(ledger), chosen, out, None if raw else _alignment_options(how))
    if as_json:
        echo_json({"files": [str(path) for path in files]})
        return
    for path in files:
        click.echo(str(path))


def _alignment_options(how: dict[str, Any]) -> AlignmentOptions:
    from palpate.analysis.streams.alignment import WINDOW, AlignmentOptions, SpeedOptions
    from palpate.signals.aligning.aligned import LONGEST_GAP_S
    from palpate.signals.aligning.methods import method_named

    default, single = "bandlimited", {}
    for part in how["method"].split(","):
        name, equals, method = part.strip().rpartition("=")
        if equals:
            single[name] = method_named(method)
        else:
            default = method
    gap_s = LONGEST_GAP_S if how["longest_gap_s"] is None else how["longest_gap_s"]
    late: dict[str, float] = {}
    for part in filter(None, (entry.strip() for entry in how["latency"].split(","))):
        name, _, seconds = part.partition("=")
        try:
            late[name] = float(seconds)
        except ValueError:
            raise click.UsageError(f"--latency {part!r}: STREAM=SECONDS is expected, as tool_position=0.0042") from None
    speed = SpeedOptions(how["speed"], WINDOW if how["speed_window"] is None else how["speed_window"], how["causal"])
    return AlignmentOptions(
        how["rate_hz"], method_named(default), single, late, gap_s, how["everything"], how["marks"], speed
    )
