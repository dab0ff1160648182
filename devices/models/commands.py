"""`palpate models`: list, show and compare trained models. `palpate predict`: ask one."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.devices.options import JSON, LAB
from palpate.protocols.shell_command import shell_command

if TYPE_CHECKING:
    from palpate.devices.models.comparison import Inputs
    from palpate.signals.models.runtime import Model

FILE = click.Path(exists=True, dir_okay=False, path_type=Path)
recording_option = click.option(
    "--recording", is_flag=True, help="FILE is a raw recording (angle_deg, force_N): normalise it first."
)
zero_option = click.option("--zero", is_flag=True, help="With --recording: count the angle from the first motion.")


@click.group()
def models() -> None:
    """Trained models: a lab's own in LAB/models, and the shipped ones. A model is named, or given as its card's path.

    \b
    Example:
      palpate models list --lab LAB
      palpate models card door-perception --lab LAB
    """


@models.command("list")
@LAB
@JSON
def list_command(lab: Path, as_json: bool) -> None:
    """List the models there are, of doors and of textures: what they take and give, their error, when they were made.

    Where a lab has a model of a shipped one's name, the lab's is used.
    """
    from palpate.devices.models.lookup import FOLDER, listed
    from palpate.devices.models.words import aligned, list_row

    rows = [list_row(model) for model in listed(lab)]
    if as_json:
        _echo(rows)
        return
    if not rows:
        click.echo(f"no models in {lab / FOLDER}: `palpate train` makes them")
        return
    heads = ("model", "where", "method", "takes -> gives", "MAE", "made", "size", "title")
    table = [[row["name"], row["where"], row["method"], row["direction"], row["error"], row["made"], row["size"],
             row["title"]] for row in rows]  # fmt: skip
    click.echo(aligned(heads, table))


@models.command("card")
@click.argument("name")
@LAB
@JSON
def card_command(name: str, lab: Path, as_json: bool) -> None:
    """Show model NAME's card in words, after checking that its numbers are those that it was written for.

    \b
    Example:
      palpate models card door-perception --lab LAB
    """
    from palpate.devices.models.lookup import find_model
    from palpate.devices.models.words import card_words
    from palpate.signals.models.file import read_model

    path = find_model(name, lab)
    model = read_model(path)
    if as_json:
        _echo({"file": str(path), **model.card.model_dump(mode="json")})
        return
    click.echo(card_words(model.card, model.tensors, str(path)))


@models.command("compare")
@click.argument("names", nargs=-1, required=True)
@click.option("--on", "files", type=FILE, multiple=True, help="A profile to ask about; may be given more than once.")
@LAB
@JSON
def compare_command(names: tuple[str, ...], files: tuple[Path, ...], lab: Path, as_json: bool) -> None:
    """Compare models that answer the same question: their metrics, their time, and how far their answers are apart.

    Models of a feeling are asked about the 90 profiles of door_ratings (or --on FILE); models of a profile, about all
    attributes at 50 and each one aside at 10 and 90. Models of one texture are asked about 25 windows that the first of
    them makes, at speeds and forces from the least to the greatest that it was recorded at.

    \b
    Example:
      palpate models compare door-perception other.json --lab LAB
      palpate models compare texture-cloth-foten_generative texture-cloth-ar --lab LAB
    """
    from palpate.devices.models.comparison import apart, milliseconds, require_alike
    from palpate.devices.models.words import apart_words, metrics_words

    if len(names) < 2:
        raise click.UsageError("two models or more are compared; `palpate models list` shows those there are")
    read = [_read(name, lab) for name in names]
    require_alike(read)
    inputs = _inputs(read, files)
    pairs = apart(read, names, inputs)
    times = [milliseconds(model, inputs, time.perf_counter) for model in read]
    if as_json:
        metrics = {name: {**model.card.metrics, "ms": ms} for name, model, ms in zip(names, read, times, strict=True)}
        _echo({"metrics": metrics, "apart": [vars(pair) for pair in pairs], "inputs": len(inputs.names)})
        return
    click.echo(metrics_words(names, read, times))
    click.echo(apart_words(pairs, read[0].card.gives, len(inputs.names)))


@click.command()
@click.argument("model")
@click.argument("given", nargs=-1, metavar="[FILE]...")
@click.option("--wish", "wishes", multiple=True, metavar="NAME=VALUE",
              help="For a model that makes profiles: what is wished for, 0 to 100; others stay at 50.")  # fmt: skip
@click.option("--to", type=click.Path(dir_okay=False, path_type=Path), help="Write the made profile to this file.")
@recording_option
@zero_option
@LAB
@JSON
def predict(
    model: str, given: tuple[str, ...], wishes: tuple[str, ...], to: Path | None, recording: bool, zero: bool,
    lab: Path, as_json: bool,
) -> None:  # fmt: skip
    """How a profile would feel, or a profile for a wished feeling: whichever MODEL answers.

    A model of a feeling is given profile FILEs (angle_deg, force_N; 621 rows); a model of a profile is given wishes,
    from 0 (the attribute's own word) to 100 (its antonym), and prints a profile file or writes it with --to.

    \b
    Example:
      palpate predict door-perception mydoor_g0.csv --lab LAB
      palpate predict door-force --wish Easy-to-pull=20 --wish Damped=30 --to door.csv --lab LAB
    """
    loaded = _read(model, lab)
    if loaded.card.texture is not None:
        raise click.UsageError(
            f"{loaded.card.name} makes a texture: {shell_command('render', loaded.card.texture.id)} plays it"
        )
    if loaded.card.takes.kind == "ratings":
        if recording or zero:
            raise click.UsageError(f"{loaded.card.name} makes profiles: it is given --wish, not a recording")
        _print_profile(loaded, (*wishes, *given), to, as_json)
        return
    if wishes or to is not None:
        raise click.UsageError(
            f"{loaded.card.name} predicts how profiles feel: it takes FILEs; --wish and --to are for a model that makes"
            " profiles"
        )
    if zero and not recording:
        raise click.UsageError("--zero counts a recording's angle from its start: it goes with --recording")
    if not given:
        raise click.UsageError("which profile? Give a profile FILE, as studies/door_ratings/profiles/K8_g0.csv")
    _print_ratings(loaded, [Path(path) for path in given], recording, zero, as_json)


def _print_ratings(model: Model, files: Sequence[Path], recording: bool, zero: bool, as_json: bool) -> None:
    from palpate.devices.models.answers import as_data, heading, in_words, profile_of, rated
    from palpate.signals.models.errors import in_file

    if gone := [path for path in files if not path.is_file()]:
        raise click.UsageError(f"there is no profile file {str(gone[0])!r}")
    answers = []
    for path in files:
        force_N = profile_of(path, recording, zero)
        with in_file(path):
            answers.append((str(path), rated(model, force_N)))
    if as_json:
        interval = model.card.interval
        _echo({"model": model.card.name, "coverage": interval and interval.coverage, "notes": model.card.notes,
               "profiles": [as_data(*answer) for answer in answers]})  # fmt: skip
        return
    click.echo("\n\n".join([heading(model), *(in_words(*answer) for answer in answers)]))


def _print_profile(model: Model, given: Sequence[str], to: Path | None, as_json: bool) -> None:
    from palpate.devices.door.stimuli import profile_text
    from palpate.devices.models.answers import wish_of
    from palpate.protocols.files import write_text
    from palpate.signals.doors.limits import refusal

    if not given:
        raise click.UsageError(f"what is wished for? Give --wish NAME=VALUE; {', '.join(model.card.takes.names)}")
    wish = wish_of(given, model.card.takes)
    force_N = model.run(wish)
    why = refusal(force_N)
    if to is not None:
        write_text(to, profile_text(force_N))
    if as_json:
        named = dict(zip(model.card.takes.names, wish.tolist(), strict=False))
        _echo({"model": model.card.name, "wish": named, "force_N": force_N.tolist(), "door_refuses": why,
               "file": None if to is None else str(to)})  # fmt: skip
        return
    click.echo(profile_text(force_N) if to is None else str(to), nl=to is not None)
    if why is not None:
        click.echo(f"the door would refuse to play it: {why}", err=True)


def _read(name: str, lab: Path) -> Model:
    from palpate.devices.models.lookup import find_model
    from palpate.signals.models.file import read_model

    return read_model(find_model(name, lab))


def _inputs(models: Sequence[Model], files: Sequence[Path]) -> Inputs:
    """Return the inputs on which the models are compared."""
    import numpy as np

    from palpate.devices.models.answers import profile_of
    from palpate.devices.models.comparison import DRIVE, STUDY, WINDOW, Inputs, texture_drives, texture_windows, wishes

    kind = models[0].card.takes.kind
    if files and kind != "force_profile":
        makes = "profiles" if kind == "ratings" else "a texture"
        raise click.UsageError(f"--on is for models that tell how profiles feel; these make {makes}")
    if kind == "ratings":
        return wishes(models[0])
    if kind == WINDOW:
        return Inputs(*texture_windows(models))
    if kind == DRIVE:
        return Inputs(*texture_drives(models[0]))
    chosen = files or sorted(STUDY.glob("*.csv"))
    if not chosen:
        raise click.UsageError(f"no profiles in {STUDY}; name some with --on FILE")
    rows = np.array([profile_of(path, recording=False, zero=False) for path in chosen])
    return Inputs(rows, tuple(path.stem for path in chosen))


def _echo(value: Any) -> None:
    from palpate.protocols.canonical import canonical

    click.echo(canonical(value).decode())
