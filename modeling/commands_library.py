"""The verb `textures`: a library of textures to search by feel."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.modeling.commands_data import demand_folder_alone, recording_options, requested_recordings
from palpate.modeling.commands_texture_set import simulate
from palpate.modeling.options import WORKERS
from palpate.studies.options import JSON, LAB, echo_json, only_simulated, sessions_option, with_options

if TYPE_CHECKING:
    from palpate.modeling.library.answer import LabLibrary, LibraryRequest
    from palpate.modeling.library.wishes import Wish

FILE = click.Path(dir_okay=False, path_type=Path)
COUNT = click.option(
    "-n", "count", type=click.IntRange(1, 9999), default=10, show_default=True, help="At most this many."
)
SHEET = click.option("--sheet", type=FILE, help="Write a contact sheet of them: FILE.png or FILE.jpg.")
AT = click.option(
    "--at", "at", metavar="WORD=VALUE", multiple=True,
    help="A value from 0 to 100: Smooth=80, Smooth=60-80, Rough-Smooth=20 (0 is Rough).",
)  # fmt: skip
VALUE = re.compile(r"[^=:]*\w[^=:]*[=:][^=:]*\d[^=:]*")
OPTIONS = (
    LAB,
    click.option("--class", "classes", metavar="NAME", multiple=True, help="Only this class; may be given again."),
    click.option("--rated-only", is_flag=True, help="Only what people rated."),
    click.option("--predicted", is_flag=True, help="Only what the model predicted, also where people rated."),
    JSON,
)


@click.group(options_metavar="", subcommand_metavar="WHAT [OPTIONS]")
def textures() -> None:
    """A library of textures to search by feel: by words, by values, by likeness.

    \b
    Example:
      palpate textures index --lab LAB
      palpate textures find "rough, a bit sticky, not bumpy" --lab LAB --sheet found.png
    """


def library_options(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with the shared options, which it receives as one `LibraryRequest`."""

    @wraps(command)
    def with_request(
        *, lab: Path, classes: tuple[str, ...], rated_only: bool, predicted: bool, as_json: bool, **others: Any
    ) -> None:
        from palpate.modeling.library.answer import LibraryRequest

        if rated_only and predicted:
            raise click.UsageError("--rated-only and --predicted: one of the two is expected, or neither for both")
        command(
            LibraryRequest(lab, classes, "rated" if rated_only else "predicted" if predicted else None, as_json),
            **others,
        )

    return with_options(with_request, OPTIONS)


textures.add_command(simulate)


@textures.command("index")
@LAB
@click.option("--study", default="texture_ratings", show_default=True, help="Of the ratings: sessions, or imported.")
@click.option("--folder", type=click.Path(exists=True, file_okay=False, path_type=Path),
              help="A folder of images with a table of ratings instead of the lab's sessions.")  # fmt: skip
@click.option("--ratings", type=FILE, help="The table that goes with --folder.  [default: FOLDER/ratings.csv]")
@click.option("--scale", type=(float, float), metavar="LOW HIGH",
              help="The ends of that table's ratings, such as 1 7 or -100 100.  "
              "[default: 0 100; asked for if all are small]")  # fmt: skip
@recording_options
@click.option("--model", type=FILE, help="A model's card.  [default: LAB/models/texture-attributes.json, if any]")
@click.option("--without-model", is_flag=True, help="What people rated, and nothing predicted.")
@click.option("--weights", type=FILE, help="Weights of ResNet-50, where the model learned from features with a file.")
@click.option("--pictures", type=click.Path(file_okay=False, path_type=Path),
              help="Images named as the textures.  [default: those of texture_photos, or of --folder]")  # fmt: skip
@sessions_option()
@WORKERS
@JSON
def index_command(as_json: bool, **values: Any) -> None:
    """Make the library of a lab: what people rated, what the model predicts, a small picture of each texture.

    Writes LAB/library/index.json and pictures beside it. Of a rating it keeps mean, SD between people, their number; of
    a prediction what holds 90 % of new ratings, from textures that were left out of a training. Made again from the
    same sources, it is the same file.

    Example: palpate textures index --lab LAB
    """
    from palpate.modeling.commands_data import exit_on_interrupt, progress_lines
    from palpate.modeling.library.answer import print_index
    from palpate.modeling.library.lab import index
    from palpate.modeling.library.sources import LibraryOptions

    demand_folder_alone(values)
    recordings = requested_recordings(values)
    only = only_simulated(values.pop("sessions"))
    options = LibraryOptions(**values, recordings=recordings, simulated=only)
    with exit_on_interrupt("what is left"), progress_lines() as report:
        written = index(options, report)
    if as_json:
        left_out = dict(written.indexed.left_out)
        echo_json({**written.counts, "file": str(written.path), "changed": written.changed, "gone": written.removed,
                   "left_out": left_out, "notes": written.indexed.library.notes})  # fmt: skip
        return
    print_index(written)


@textures.command("find")
@click.argument("wish", nargs=-1)
@AT
@COUNT
@SHEET
@click.option("--map", "plane", type=FILE, help="Mark them on the map of the library: FILE.png, with FILE.svg.")
@library_options
def find_command(
    request: LibraryRequest,
    wish: tuple[str, ...],
    at: tuple[str, ...],
    count: int,
    sheet: Path | None,
    plane: Path | None,
) -> None:
    """Find the textures that feel as WISH says, the best first.

    Words of the attributes, or other words for them, with how much of each: very, a bit, not, neither ... nor, or a
    number from 0 to 100. A texture whose attributes are not known for sure ranks behind one that surely fits.

    \b
    Example:
      palpate textures find "rough, a bit sticky, not bumpy" --lab LAB
      palpate textures find "neither hard nor soft" --at Smooth=80 --class leather --lab LAB
    """
    from palpate.modeling.library.answer import Beside, open_library
    from palpate.modeling.library.listing import matches_data, percent, wish_words
    from palpate.modeling.library.search import find, fitting, none_fits

    here = open_library(request)
    wishes = _wishes(here, wish, at)
    if sheet is not None and plane is not None and sheet.resolve() == plane.resolve():
        raise click.UsageError(f"--sheet and --map are both to be written to {sheet}: give two files")
    here.demand(sheet, plane)
    matches = fitting(find(here.entries, wishes, request.kind), count)
    entries, texts = [match.entry for match in matches], [wish_words(wish, here.library) for wish in wishes]
    fits = {match.entry.id: (percent(match.fit), match.fit) for match in matches}
    files = here.sheet(sheet, entries, Beside(", ".join(wish.text for wish in wishes), texts, fits, wishes))
    files += here.map(plane, fits)
    if request.as_json:
        echo_json({**matches_data(matches, wishes, here.library, request.kind), "files": list(map(str, files))})
        return
    click.echo("\n".join(texts))
    if matches:
        here.show(entries, {"fit": [text for text, _ in fits.values()]})
    else:
        click.echo(none_fits(here.entries, wishes, request.kind))
        if sheet is not None:
            click.echo(f"There is nothing to show: {sheet} was not written.")
    here.close(files)


@textures.command("nearest")
@click.argument("texture")
@COUNT
@SHEET
@library_options
def nearest_command(request: LibraryRequest, texture: str, count: int, sheet: Path | None) -> None:
    """Find the textures that feel most like TEXTURE (its id or label).

    Distances are the root of the mean square of the attributes' differences in JNDs (10 of 100). `alike` is how likely
    no attribute differs by a JND.

    Example: palpate textures nearest T17 --lab LAB
    """
    from palpate.modeling.library.answer import Beside, name_of, open_library
    from palpate.modeling.library.listing import description, distance_text, percent, plain_near
    from palpate.modeling.library.search import find_texture, near, require_known

    here = open_library(request)
    here.demand(sheet)
    entry = require_known(find_texture(here.library, texture), request.kind)
    neighbours = near(entry, here.entries, len(here.library.attributes), request.kind)[:count]
    entries = [neighbour.entry for neighbour in neighbours]
    texts: dict[str, tuple[str, float | None]] = {
        neighbour.entry.id: (f"{distance_text(neighbour)} JND", None) for neighbour in neighbours
    }
    files = here.sheet(sheet, [entry, *entries], Beside(f"What feels most like {name_of(entry)}", (), texts))
    if request.as_json:
        echo_json({**plain_near(neighbours, entry, here.library, request.kind), "files": list(map(str, files))})
        return
    click.echo(f"{name_of(entry)}: {description(entry, here.library, request.kind)}")
    here.show(
        entries,
        {
            "JND": [distance_text(neighbour) for neighbour in neighbours],
            "alike": [percent(neighbour.alike) for neighbour in neighbours],
        },
    )
    here.close(files)


@textures.command("show")
@click.argument("texture", required=False)
@SHEET
@library_options
def show_command(request: LibraryRequest, texture: str | None, sheet: Path | None) -> None:
    """Show TEXTURE (its id or label): what people and the model say of it; without one, the whole library.

    With --rated-only or --predicted, only what the one or the other says. With --class, what is most like it is of that
    class.

    Example: palpate textures show T17 --lab LAB
    """
    from palpate.modeling.library.answer import Beside, name_of, open_library
    from palpate.modeling.library.listing import description_lines, plain_library, plain_whole
    from palpate.modeling.library.search import find_texture, require_known

    here = open_library(request)
    here.demand(sheet)
    if texture is None:
        files = here.sheet(sheet, here.entries, Beside("The library"))
        if request.as_json:
            echo_json({**plain_library(here.entries, here.library, request.kind), "files": list(map(str, files))})
            return
        here.show(here.entries)
    else:
        entry = require_known(find_texture(here.library, texture), request.kind)
        files = here.sheet(sheet, [entry], Beside(name_of(entry)))
        if request.as_json:
            echo_json({**plain_whole(entry, here.library, request.kind), "files": list(map(str, files))})
            return
        click.echo("\n".join(description_lines(entry, here.library, here.entries, here.folder, request.kind)))
    here.close(files)


@textures.command("map")
@click.argument("wish", nargs=-1)
@AT
@COUNT
@click.option("--to", type=FILE, help="Where to: FILE.png, with FILE.svg.  [default: LAB/library/map.png]")
@library_options
def map_command(
    request: LibraryRequest, wish: tuple[str, ...], at: tuple[str, ...], count: int, to: Path | None
) -> None:
    """Draw the library as a plane (thesis Figure 3.3c); with a WISH, what fits it is marked.

    From left to right hard to soft, upwards flat to bumpy; a larger bubble is rougher, its colour says how sticky.

    Example: palpate textures map "very soft, not slippery" --lab LAB
    """
    from palpate.modeling.library.answer import open_library
    from palpate.modeling.library.search import find, fitting

    here = open_library(request)
    here.demand(None, to)
    matches = fitting(find(here.entries, _wishes(here, wish, at), request.kind), count) if wish or at else []
    marked = [match.entry.id for match in matches]
    files = here.map(to or here.folder / "map.png", marked)
    if request.as_json:
        echo_json({"marked": marked, "files": list(map(str, files))})
        return
    if wish or at:
        click.echo(f"marked: {', '.join(marked) or 'none, since none fits'}")
    here.close(files)


@textures.command("draw")
@click.argument("texture")
@LAB
@click.option("--seconds", type=click.FloatRange(0.5, 600), default=10.0, show_default=True,
              help="How much of it the picture of segments shows.")  # fmt: skip
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), required=True, help="The folder to write into."
)
@JSON
def draw_command(texture: str, lab: Path, seconds: float, out: Path, as_json: bool) -> None:
    """Draw what a lab's sessions recorded of TEXTURE (its id): vibration and spectrum, and its segments.

    figure_3_5: the axes of acceleration as recorded, all on one axis, its power over frequency (thesis Figure 3.5).
    figure_3_6: acceleration, speed and force as the models of touch meet them, with the segments' borders (Figure 3.6).
    Each as .svg and .png, with its numbers as .csv.

    Example: palpate textures draw T50 --lab LAB --out figures
    """
    from palpate.modeling.attributes.signal_figures import draw_signals

    files, notes = draw_signals(lab, texture, out, seconds)
    if as_json:
        echo_json({"files": list(map(str, files)), "notes": notes})
        return
    click.echo("\n".join([*map(str, files), *(f"note: {note}" for note in notes)]))


def _wishes(here: LabLibrary, wish: tuple[str, ...], at: tuple[str, ...]) -> tuple[Wish, ...]:
    """Return the wishes in words and in values. Raises UsageError for none, or an invalid --at."""
    from palpate.modeling.library.search import wishes_of

    if not wish and not at:
        raise click.UsageError('what is wished for? Say it in words, as "rough, a bit sticky", or with --at Smooth=80')
    for text in at:
        if not VALUE.fullmatch(text):
            raise click.UsageError(
                f"--at {text!r}: WORD=VALUE is expected, as Smooth=80, Smooth=60-80, Rough-Smooth=20"
            )
    return wishes_of(here.library, (*([" ".join(wish)] if wish else []), *at))
