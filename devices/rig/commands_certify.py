"""`palpate rig certify`: measure when a vibration is felt after its command, and how strong."""

from __future__ import annotations

from datetime import date, datetime
from pathlib import Path

import click

from palpate.devices.options import JSON, LAB, RIG
from palpate.devices.rig.commands_calibrate import describe_result, measure_with


@click.command()
@click.argument("device")
@LAB
@RIG
@click.option("--with", "--sensor", "sensor", metavar="NAME",
              help="The accelerometer at the actuator; the rig's only one.")  # fmt: skip
@click.option("--bursts", type=click.IntRange(20, 1000), default=200, show_default=True, help="How many are measured.")
@click.option("--date", "on", type=click.DateTime(["%Y-%m-%d"]), metavar="DATE", show_default="today",
              help="When it was measured.")  # fmt: skip
@click.option("--write", is_flag=True, help="Put the certificate into the rig file.")
@click.option("--yes", is_flag=True, help="Do not ask for an Enter.")
@JSON
def certify(
    device: str, lab: Path, rig_file: Path | None, sensor: str | None, bursts: int, on: datetime | None, write: bool,
    yes: bool, as_json: bool,
) -> None:  # fmt: skip
    """Certify DEVICE, a calibrated vibrator: how long after a command a vibration begins, and at what level.

    Bursts are played and measured by an accelerometer at the actuator. Median, 99th percentile and maximum of the
    onset and the error of the level are printed, and put into the rig file with --write. Every session records them.
    Exit code 1 if what was measured certifies nothing.

    \b
    Example:
      palpate rig certify shaker --sensor vibration --write --lab LAB
    """
    from palpate.devices.rig.certification import certify as measure

    day = (on.date() if on else date.today()).isoformat()
    job, result = measure_with(lab, rig_file, device, day, yes, lambda job: measure(job, sensor, bursts))
    describe_result(job, result, write, as_json)
