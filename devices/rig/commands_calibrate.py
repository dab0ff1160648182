"""`palpate rig calibrate`: measure a device, and say or write the settings that come of it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import date, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.devices.options import JSON, LAB, RIG
from palpate.protocols.canonical import json_text
from palpate.protocols.shell_command import shell_command

if TYPE_CHECKING:
    from palpate.devices.rig.calibration import CalibrationJob, CalibrationResult
    from palpate.devices.rig.file import RigFile

SPELLED = {"sensor": "--with", "level_V": "--level"}


@click.command()
@click.argument("device")
@LAB
@RIG
@click.option("--seconds", type=click.FloatRange(0.2, 60), show_default="2; of an actuator 8",
              help="How long each position is read, or an actuator measured.")  # fmt: skip
@click.option("--with", "--sensor", "sensor", metavar="NAME",
              help="The accelerometer on the voice coil or vibrator; the rig's only one.")  # fmt: skip
@click.option("--level", "level_V", type=click.FloatRange(0.001, 10), metavar="V",
              show_default="half of peak_V, at most 0.5; of a vibrator what the sensor bears",
              help="Peak of what shakes the actuator, V.")  # fmt: skip
@click.option("--pairs", type=click.Path(exists=True, dir_okay=False, path_type=Path), metavar="FILE.csv",
              help="Measured pressure,force_N of a tablet.")  # fmt: skip
@click.option("--figure", type=click.Path(path_type=Path), metavar="FILE",
              help="Draw a tablet's pairs and curve: .png, .svg, .pdf; without an ending .svg and .png.")  # fmt: skip
@click.option("--date", "on", type=click.DateTime(["%Y-%m-%d"]), metavar="DATE", show_default="today",
              help="When it was measured.")  # fmt: skip
@click.option("--write", is_flag=True, help="Put the settings into the rig file.")
@click.option("--force", is_flag=True, help="Overwrite an actuator's file of the same day.")
@click.option("--yes", is_flag=True, help="Do not ask for an Enter: an actuator, or a twin.")
@JSON
def calibrate(
    device: str, lab: Path, rig_file: Path | None, on: datetime | None, write: bool, as_json: bool, **given: Any
) -> None:
    """Calibrate DEVICE: an accelerometer, a voice coil, a vibrator or a tablet of the rig.

    An accelerometer is laid in six positions, each axis up and down. A voice coil or a vibrator is shaken with an
    accelerometer on it; what was found is written beside the rig file. A tablet's pressure becomes newtons by measured
    pairs. The settings are printed, and put into the rig file with --write: the rest of the file stays as it is. Exit
    code 1 if what was measured calibrates nothing.

    \b
    Example:
      palpate rig calibrate vibration --lab LAB
      palpate rig calibrate actuator --with vibration --lab LAB
      palpate rig calibrate stylus --pairs pairs.csv --figure force --write --lab LAB
    """
    from palpate.devices.rig.calibration import CalibrationJob
    from palpate.devices.rig.file import read_rig, rig_path

    file = read_rig(rig_file or rig_path(lab))
    _demand_usable(file, device, given)
    day = (on.date() if on else date.today()).isoformat()
    job = CalibrationJob(file, device, day, _make_ask(given["yes"], _may_skip(file, device)), _say)
    describe_result(job, _measure(job, given), write, as_json)


def describe_result(job: CalibrationJob, result: CalibrationResult, write: bool, as_json: bool) -> None:
    """Print what was measured and the settings that come of it, and put them into the rig file if `write`."""
    from palpate.devices.rig.calibration import is_in_braces, settings_text, write_settings

    file, device = job.file, job.name
    if not as_json:
        twin = ", twin" if file.is_twin(device) else ""
        click.echo(f"{device} ({file.kind(device).replace('_', ' ')}{twin}):")
        for line in result.lines:
            click.echo(f"  {line}")
        where = "" if write else f" of {file.path}; --write puts it there"
        click.echo(f"for its entry{where}:")
        click.echo(settings_text(result.settings, is_in_braces(file.path, device)))
    if write:
        write_settings(file.path, device, result.settings)
    if as_json:
        answer = {
            "device": device, "kind": file.kind(device), "twin": file.is_twin(device),
            "settings": dict(result.settings), "figures": dict(result.figures), "rig": str(file.path),
            "written": write,
        }  # fmt: skip
        click.echo(json_text(answer, indent=2), nl=False)
    elif write:
        click.echo(f"written into {file.path}; see: {shell_command('rig', 'check', device, '--rig', file.path)}")


def measure_with(
    lab: Path, rig_file: Path | None, device: str, day: str, yes: bool,
    measure: Callable[[CalibrationJob], CalibrationResult],
) -> tuple[CalibrationJob, CalibrationResult]:  # fmt: skip
    """Return the job of a device that nobody has to turn, and what is measured; exit with code 1 if it is nothing."""
    from palpate.devices.rig.calibration import CalibrationJob
    from palpate.devices.rig.file import read_rig, rig_path
    from palpate.protocols.did_you_mean import nearest

    file = read_rig(rig_file or rig_path(lab))
    if device not in file.devices:
        raise click.UsageError(f"{file.path} names no device {device!r}; {nearest(device, list(file.devices))}")
    job = CalibrationJob(file, device, day, _make_ask(yes, True), _say)
    with _exit_if_unfit("not certified"):
        result = measure(job)
    return job, result


@contextmanager
def _exit_if_unfit(what: str) -> Iterator[None]:
    """Print why nothing could be measured, and exit with code 1."""
    from palpate.devices.device import DeviceFault
    from palpate.devices.rig.calibration import UnfitMeasurement

    try:
        yield
    except (UnfitMeasurement, DeviceFault) as error:
        click.echo(f"{click.style(what, fg='red')}: {error}", err=True)
        raise click.exceptions.Exit(1) from None


def _demand_usable(file: RigFile, device: str, given: dict[str, Any]) -> None:
    """Raise an error for a device that is missing or calibrated elsewhere, and for options that its kind does not
    use.
    """
    from palpate.devices.kinds import KINDS, CalibrationMethod
    from palpate.protocols.did_you_mean import nearest

    if device not in file.devices:
        raise click.UsageError(f"{file.path} names no device {device!r}; {nearest(device, list(file.devices))}")
    kind = file.kind(device)
    calibration = KINDS[kind].calibration
    if isinstance(calibration, str):
        raise click.UsageError(f"{device}: a {kind.replace('_', ' ')} {calibration}")
    for name, value in given.items():
        if name not in calibration.options and value not in (None, False):
            others = {other: described.calibration for other, described in KINDS.items()}
            methods = {other: how for other, how in others.items() if isinstance(how, CalibrationMethod)}
            takers = " or ".join(other for other, how in methods.items() if name in how.options)
            raise click.UsageError(f"{SPELLED.get(name, f'--{name}')} is for {takers}; {device} is of kind {kind}")
    for name, advice in calibration.required.items():
        if given[name] is None:
            raise click.UsageError(f"{device}: {advice}")
    if given["yes"] and not _may_skip(file, device):
        raise click.UsageError(f"--yes: {device} is a real one, somebody has to turn it; leave --yes out")


def _may_skip(file: RigFile, device: str) -> bool:
    """Return whether the device can be calibrated unattended: only a real sensor has to be turned by hand."""
    from palpate.devices.kinds import KINDS, CalibrationMethod

    calibration = KINDS[file.kind(device)].calibration
    return file.is_twin(device) or not (isinstance(calibration, CalibrationMethod) and calibration.by_hand)


def _measure(job: CalibrationJob, given: dict[str, Any]) -> CalibrationResult:
    """Return the result of the calibration; exit with code 1 if there is none."""
    from palpate.devices.kinds import KINDS
    from palpate.protocols.registry import load_object

    how: Any = KINDS[job.file.kind(job.name)].calibration
    with _exit_if_unfit("not calibrated"):
        result: CalibrationResult = load_object(how.call)(
            job, **{name: given[name] for name in how.options if name != "yes"}
        )
    return result


def _say(text: str) -> None:
    """Print a progress message to standard error; standard output is for the result."""
    click.echo(text, err=True)


def _make_ask(yes: bool, may_skip: bool) -> Callable[[str], None]:
    """Return a function that asks for Enter at the terminal, unless nothing has to be done by hand."""

    def ask(text: str) -> None:
        if yes:
            _say(text)
            return
        click.echo(f"{text} Enter: done ", nl=False, err=True)
        if not sys.stdin.readline():
            _say("")
            other = ", or give --yes" if may_skip else ""
            raise click.UsageError(f"nobody answered: run this at a terminal{other}")

    return ask
