"""`palpate rig`: check a lab's devices, write a rig of twins, say what a rig file may hold."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.devices.options import JSON, LAB, RIG
from palpate.devices.rig.commands_calibrate import calibrate
from palpate.devices.rig.commands_certify import certify
from palpate.protocols.canonical import json_text
from palpate.protocols.shell_command import shell_command
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from palpate.devices.device import Health
    from palpate.devices.rig.file import RigFile


@click.group()
def rig() -> None:
    """A lab's devices: open, read and describe what the rig file names.

    \b
    Example:
      palpate rig simulate --lab LAB
      palpate rig check --lab LAB
    """


rig.add_command(calibrate)
rig.add_command(certify)


@rig.command()
@click.argument("device", nargs=-1)
@LAB
@RIG
@click.option(
    "--seconds", type=click.FloatRange(0.2, 60), default=1.0, show_default=True, help="How long each is read."
)
@JSON
def check(device: tuple[str, ...], lab: Path, rig_file: Path | None, seconds: float, as_json: bool) -> None:
    """Open each DEVICE of the rig (all, where none is named), read it, and say how it is.

    Health, measured rate, mean and noise floor of every channel, and when it was calibrated. Nothing moves.
    Exit code 1 if a device is not as it should be.

    \b
    Example:
      palpate rig check force --seconds 5 --lab LAB
    """
    from palpate.devices.rig.file import read_rig, rig_path
    from palpate.devices.rig.opened import check_device, describe_health
    from palpate.protocols.did_you_mean import nearest

    file = read_rig(rig_file or rig_path(lab))
    for name in device:
        if name not in file.devices:
            raise click.UsageError(f"{file.path} names no device {name!r}; {nearest(name, list(file.devices))}")
    health_of = {name: check_device(file, name, seconds) for name in device or file.devices}
    if as_json:
        _echo_json({name: _as_data(file, name, health) for name, health in health_of.items()})
    else:
        click.echo(f"{file.path}: {file.name}")
        for name, health in health_of.items():
            mark = click.style("ok    ", fg="green") if health.ok else click.style("NOT OK", fg="red")
            twin = ", twin" if file.is_twin(name) else ""
            click.echo(f"{mark} {name} ({file.kind(name).replace('_', ' ')}{twin}): {health.summary}")
            for line in describe_health(health):
                click.echo(f"         {line}")
    if not all(health.ok for health in health_of.values()):
        raise click.exceptions.Exit(1)


def _as_data(file: RigFile, name: str, health: Health) -> dict[str, Any]:
    readings = [
        {
            "signal": reading.signal.name, "channels": list(reading.signal.channels),
            "units": list(reading.signal.units), "nominal_hz": reading.signal.rate_hz, "rate_hz": reading.rate_hz,
            "mean": list(reading.mean), "noise": list(reading.noise), "lost": reading.lost,
            "calibration": reading.signal.calibration,
        }
        for reading in health.readings
    ]  # fmt: skip
    return {
        "kind": file.kind(name), "twin": file.is_twin(name), "ok": health.ok, "told": health.summary,
        "calibrated": health.calibrated, "facts": dict(health.facts), "readings": readings,
    }  # fmt: skip


def _echo_json(data: Any) -> None:

    def plain(value: Any) -> Any:
        """Return the value for JSON, with null for NaN: a number that could not be measured."""
        if isinstance(value, dict):
            return {key: plain(inner) for key, inner in value.items()}
        if isinstance(value, list):
            return [plain(inner) for inner in value]
        return None if isinstance(value, float) and not abs(value) < float("inf") else value

    click.echo(json_text(plain(data), indent=2), nl=False)


@rig.command()
@LAB
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), show_default="LAB/stations/HOST/rig.yaml",
              help="The file to write.")  # fmt: skip
@click.option("--force", is_flag=True, help="Overwrite an existing file.")
def simulate(lab: Path, out: Path | None, force: bool) -> None:
    """Write a rig of twins: every device simulated behind the code that drives the real one.

    \b
    Example:
      palpate rig simulate --lab LAB
      palpate record texture_capture --participant P001 --lab LAB
    """
    from palpate.devices.rig.file import read_rig, rig_path
    from palpate.protocols.files import write_bytes

    file = out or rig_path(lab)
    if file.exists() and not force:
        raise click.UsageError(f"{file} exists; give another --out, or --force to overwrite it")
    write_bytes(file, Path(__file__).resolve().with_name("twins.yaml").read_bytes())
    named = read_rig(file)
    check = shell_command("rig", "check", "--rig", file)
    click.echo(f"wrote {file}: {count(len(named.devices), 'twin')}; see them at work: {check}")


@rig.command()
@click.argument("kind", required=False)
@LAB
def kinds(kind: str | None, lab: Path) -> None:  # noqa: ARG001 - the lab's own kinds are found by the option
    """List the kinds of devices, or every setting of one KIND: what it takes, its default, what it means.

    A kind that the lab adds by itself is named in full, as acme.grip.

    \b
    Example:
      palpate rig kinds force_torque
    """
    from palpate.devices.kinds import KINDS
    from palpate.devices.rig.meanings import settings_of_kind
    from palpate.protocols.needs import NEEDS

    if kind is None:
        for name in KINDS:
            needs = ", ".join(need for need, known in NEEDS.items() if name in known.takes)
            click.echo(f"{name:<14} for {needs}")
        return
    if (missing := KINDS.why_not(kind, "kind")) is not None:
        raise click.UsageError(missing)
    for setting in settings_of_kind(KINDS[kind]):
        default = setting.default if setting.default == "required" else f"default {setting.default}"
        click.echo(f"{setting.name:<22} {setting.takes}; {default}\n    {setting.meaning}")
