"""`palpate doors`: make, normalise, vary, compare and draw door profiles."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.devices.options import JSON
from palpate.protocols.canonical import json_text
from palpate.protocols.wording import count
from palpate.signals.doors.grid import STUDY_SEED, DoorDataError

if TYPE_CHECKING:
    pass

FILE = click.Path(exists=True, dir_okay=False, path_type=Path)
OUT = click.Path(path_type=Path)
seed_option = click.option("--seed", default=STUDY_SEED, show_default=True, help="Seed of the drawn variants g8, g9.")


@click.group()
def doors() -> None:
    """Car-door force profiles: 621 points over 0 to 62 degrees (thesis 5.3).

    \b
    Example:
      palpate doors normalise recording.csv --zero --out mydoor_g0.csv
      palpate doors augment mydoor_g0.csv --out variants/
    """


@doors.command("normalise")
@click.argument("recording", type=FILE)
@click.option("--out", type=OUT, required=True, help="The profile file to write.")
@click.option("--angle-column", default="angle_deg", show_default=True)
@click.option("--force-column", default="force_N", show_default=True)
@click.option("--time-column", default="time_s", show_default=True, help="Used with --angle-file only.")
@click.option("--angle-file", type=FILE, help="The angle's own recording, at its own rate; both need a time column.")
@click.option("--zero", is_flag=True, help="Count the angle from the first motion.")
@click.option("--radians", is_flag=True, help="The angle column is in radians.")
@click.option("--largest-gap", default=2.0, show_default=True, help="Widest gap that is bridged, in degrees.")
@JSON
def normalise_command(
    recording: Path,
    out: Path,
    angle_column: str,
    force_column: str,
    time_column: str,
    angle_file: Path | None,
    zero: bool,
    radians: bool,
    largest_gap: float,
    as_json: bool,
) -> None:
    """Turn a RECORDING of an opening into a profile (thesis 5.3.1.2).

    RECORDING is a CSV file with an angle and a force column; or with a time and a force column, and --angle-file
    with a time and an angle column, whose slower angle is then interpolated to the force's times.

    \b
    Example:
      palpate doors normalise force.csv --angle-file tracker.csv --zero --out k8_g0.csv
    """
    from dataclasses import asdict

    import numpy as np

    from palpate.devices.door.stimuli import profile_text
    from palpate.protocols.files import write_text
    from palpate.signals.doors.profiles import normalise

    angle, force = _read(recording, angle_file, angle_column, force_column, time_column)
    angle = np.degrees(angle) if radians else np.asarray(angle)
    try:
        made = normalise(angle, force, zero=zero, largest_gap_deg=largest_gap)
    except DoorDataError as error:
        raise DoorDataError(f"{recording}: {error}") from error
    write_text(out, profile_text(made.force_N))
    answer = {"file": str(out), **{name: value for name, value in asdict(made).items() if name != "force_N"}}
    text = (
        f"{out}: {len(made.force_N)} points from {count(made.rows, 'row')}\n"
        f"  {count(made.backward_rows, 'row')} moved backwards and {made.rows_after_opening} came after the opening: "
        "left out\n"
        f"  angle counted from {made.zero_deg:.3f} degrees, widest gap {made.widest_gap_deg:.2f} degrees, "
        f"{count(made.padded_points, 'point')} padded with zero"
    )
    _answer(as_json, answer, text)


@doors.command("simulate")
@click.option("--door", "labels", multiple=True, help="Label of a simulated door; may be given more than once.")
@click.option("--all", "every", is_flag=True, help="All doors of the catalogue.")
@click.option("--parameters", type=FILE, help="A catalogue of your own, in the form of devices/door/doors.yaml.")
@click.option("--out", type=OUT, required=True, help="Folder for the profiles, named LABEL_g0.csv.")
@JSON
def simulate_command(labels: tuple[str, ...], every: bool, parameters: Path | None, out: Path, as_json: bool) -> None:
    """Compute profiles from the mechanical door model.

    \b
    Example:
      palpate doors simulate --door G90 --door K8 --out profiles/
    """
    from palpate.devices.door.stimuli import DOORS_FILE, find_door, profile_text, read_catalogue
    from palpate.protocols.files import write_texts
    from palpate.signals.doors.mechanics import simulate

    catalogue = read_catalogue(parameters or DOORS_FILE)
    if bool(labels) == every:
        raise DoorDataError(f"Name a door with --door, or all with --all. There are: {', '.join(catalogue)}.")
    entries = [find_door(catalogue, label) for label in (catalogue if every else labels)]
    texts = {f"{entry.label}_g0.csv": profile_text(simulate(entry.door, entry.label)) for entry in entries}
    _answer_files(as_json, write_texts(out, texts))


@doors.command("augment")
@click.argument("source", type=click.Path(exists=True, path_type=Path))
@click.option("--out", type=OUT, required=True, help="Folder for the variants.")
@seed_option
@JSON
def augment_command(source: Path, out: Path, seed: int, as_json: bool) -> None:
    """Make the variants g1 to g14 (thesis 5.3.4.1) of a profile, or of every *_g0.csv in a folder.

    \b
    Example:
      palpate doors augment profiles/K8_g0.csv --out profiles/
    """
    import numpy as np

    from palpate.devices.door.stimuli import profile_text
    from palpate.protocols.files import write_texts
    from palpate.signals.doors.augment import VARIANTS, augment
    from palpate.signals.doors.profile_file import read_profile

    texts: dict[str, str] = {}
    paths = [source] if source.is_file() else sorted(source.glob("*_g0.csv"))
    if not paths:
        raise DoorDataError(f"{source}: no file named *_g0.csv; give one profile file, or rename the originals.")
    for path in paths:
        label = path.stem.removesuffix("_g0")
        base = np.array(read_profile(path))
        for variant in VARIANTS:
            try:
                made = augment(base, variant, door=label, seed=seed)
            except DoorDataError as error:
                raise DoorDataError(f"{path}: {error} No variant was written.") from error
            texts[f"{label}_{variant}.csv"] = profile_text(made)
    _answer_files(as_json, write_texts(out, texts))


@doors.command("make")
@click.option("--study", default="door_ratings", show_default=True, help="Whose stimuli, as door_matching.")
@click.option("--out", type=OUT, help="Folder to write stimuli.csv and profiles/ into.")
@click.option("--check", metavar="FOLDER", help="Folder to compare; or a shipped study, as door_ratings.")
@click.option("--measured", type=FILE, help="Another measured recording (angle_deg, force_N) in the first place.")
@seed_option
@JSON
def make_command(
    study: str, out: Path | None, check: str | None, measured: Path | None, seed: int, as_json: bool
) -> None:
    """Make the stimuli of a door study (the 90 of door_ratings), or check that a folder holds exactly these.

    --measured and --seed are for door_ratings; the other studies' stimuli are not drawn by chance.

    Exit code 1: the folder given to --check differs.

    \b
    Example:
      palpate doors make --check door_ratings
      palpate doors make --study door_matching --check studies/door_matching
    """
    folder = None if check is None else _stimulus_folder(check)
    if folder is not None and check in _shipped():
        study = check
    make, differences = _makers(study, measured, seed)
    if (out is None) == (folder is None):
        raise DoorDataError("Say either --out FOLDER to write the stimuli, or --check FOLDER to compare them.")
    if out is not None:
        _answer_files(as_json, make(out))
    elif folder is not None:
        lines = differences(folder)
        _answer(as_json, {"equal": not lines, "differences": lines}, "\n".join(lines) or f"{folder}: equal")
        if lines:
            raise SystemExit(1)


def _shipped() -> tuple[str, ...]:
    """Return the shipped studies whose stimuli can be made here."""
    from palpate.devices.door.sets import SETS

    return ("door_ratings", *SETS)


def _stimulus_folder(text: str) -> Path:
    """Return the folder, or that of the shipped study of this name. Raises DoorDataError if there is none."""
    from palpate.devices.door.stimuli import STUDIES

    if Path(text).is_dir():
        return Path(text)
    if text in _shipped():
        return STUDIES / text
    raise DoorDataError(
        f"{text}: no such folder, and no shipped study with made stimuli; known: {', '.join(_shipped())}"
    )


def _makers(
    study: str, measured: Path | None, seed: int
) -> tuple[Callable[[Path], list[Path]], Callable[[Path], list[str]]]:
    """Return a function that writes a study's stimuli to a folder, and one that compares a folder with them."""
    from palpate.devices.door import sets, stimuli

    if study == "door_ratings":
        recording = measured or stimuli.MEASURED_FILE
        return (
            lambda folder: stimuli.make(folder, recording, seed),
            lambda folder: stimuli.differences(folder, recording, seed),
        )
    if measured is not None:
        raise DoorDataError(f"--measured is for door_ratings; {study} takes its profiles from there, or from wishes.")
    return partial(sets.make, study), partial(sets.differences, study)


@doors.command("draw")
@click.argument("folder")
@click.option(
    "--out", type=OUT, required=True, help="The picture: .png, .svg or .pdf; without an ending .svg and .png."
)
@click.option("--features", is_flag=True, help="Only the originals, with peaks, intervals, slopes and plateaus marked.")
@click.option("--opening", "openings", metavar="DOOR=FILE.csv", multiple=True,
              help="Only the originals, and this recording's angle over time below. Repeatable.")  # fmt: skip
@click.option("--angle-column", default="angle_deg", show_default=True, help="Of --opening.")
@click.option("--time-column", default="time_s", show_default=True, help="Of --opening.")
def draw_command(
    folder: str, out: Path, features: bool, openings: tuple[str, ...], angle_column: str, time_column: str
) -> None:
    """Draw the profiles that FOLDER's stimuli.csv lists: all variants (thesis Figure 5.7).

    FOLDER may also be the name of a shipped study, as door_ratings.

    Or the originals alone: --features marks what the variants change (Figure 5.6), --opening shows beside them how
    doors were opened when they were recorded (Figure 5.3). Both write the numbers that they show as .csv, too.

    \b
    Example:
      palpate doors draw door_ratings --out doors.png
      palpate doors draw door_ratings --features --out features
      palpate doors draw door_ratings --opening BC3=bc3.csv --opening K8=k8.csv --out openings
    """
    from palpate.devices.door.draw import draw, draw_features, draw_openings

    if features and openings:
        raise click.UsageError("--features and --opening are two pictures: give one of them")
    recordings: dict[str, Path] = {}
    for text in openings:
        name, _, file = text.partition("=")
        if not name or not file:
            raise click.UsageError(f"--opening {text!r}: DOOR=FILE.csv is expected, as K8=k8.csv")
        recordings[name] = Path(file)
    if len(recordings) < len(openings):
        raise click.UsageError("--opening: a door is named twice; one recording a door is drawn")
    if recordings:
        files = draw_openings(_stimulus_folder(folder), recordings, out, time_column, angle_column)
    else:
        files = (draw_features if features else draw)(_stimulus_folder(folder), out)
    click.echo("\n".join(map(str, files)))


def _read(recording: Path, angle_file: Path | None, angle: str, force: str, time: str) -> tuple[Any, Any]:
    """Return the columns of angle and force, from one file or from two with a time column each."""
    from palpate.devices.door.recording import read_columns
    from palpate.signals.doors.profiles import upsample_angle

    if angle_file is None:
        columns = read_columns(recording, (angle, force))
        return columns[angle], columns[force]
    forces, angles = read_columns(recording, (time, force)), read_columns(angle_file, (time, angle))
    try:
        return upsample_angle(forces[time], forces[force], angles[time], angles[angle])
    except DoorDataError as error:
        raise DoorDataError(f"{recording} and {angle_file}: {error}") from error


def _answer(as_json: bool, answer: dict[str, Any], text: str) -> None:
    click.echo(json_text(answer, indent=2) if as_json else text, nl=not as_json)


def _answer_files(as_json: bool, files: list[Path]) -> None:
    names = [str(path) for path in files]
    _answer(
        as_json,
        {"files": names},
        f"{count(len(names), 'file')} written to {', '.join(sorted({str(p.parent) for p in files}))}",
    )
