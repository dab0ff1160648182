"""What a lab's library is made from: its textures with ratings and features, its model of attributes, its pictures.

A texture whose picture is missing gets a plain tile, and a note."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.modeling.attributes.material import Material, MaterialError, Texture
from palpate.modeling.attributes.model_file import NAME, AttributeModel, read_model
from palpate.modeling.attributes.reading_folder import is_picture, rated_lines, table_in
from palpate.modeling.attributes.reading_pictures import STUDY as PICTURES_STUDY
from palpate.modeling.attributes.reading_pictures import folders_of, picture_of, pictured_trials
from palpate.modeling.attributes.reading_ratings import STUDY, attributes_of, read_ratings
from palpate.modeling.library.entries import NOTHING_KNOWN, Z90, LibraryError, Source
from palpate.modeling.library.indexing import Predictor
from palpate.protocols.files import file_sha256
from palpate.protocols.progress import Report
from palpate.protocols.wording import some
from palpate.studies.collecting.study_sessions import real_or_simulated

if TYPE_CHECKING:
    from palpate.modeling.attributes.reading_recordings import Recordings


NUMBER = re.compile(r"[_\-. ](\d+)")
"""What may stand behind a texture's name: the number of its picture."""
NAMED = 5
"""So many textures without a picture are named in a note."""


@dataclass(frozen=True)
class Pictures:
    """By texture its picture's file; and why of others there is none, though one was taken."""

    files: Mapping[str, Path] = field(default_factory=dict)
    lacking: Mapping[str, str] = field(default_factory=dict)


def pictures_taken(lab: Path, simulated: bool | None = None) -> Pictures:
    """The first picture that counts of each texture that texture_photos saw, and that lies unchanged where it was kept.

    Which sessions and trials count is decided as by `reading_pictures.photographed`, which wants all of the pictures.
    Raises MaterialError on a damaged ledger.
    """
    files: dict[str, Path] = {}
    lacking: dict[str, str] = {}
    counting, _ = real_or_simulated(list(pictured_trials(lab, PICTURES_STUDY)), simulated, "pictures")
    for trial in counting:
        folders = folders_of(lab, trial.record)
        for picture in trial.pictures:
            if trial.stimulus not in files and "file" in picture:
                file, sha256 = str(picture["file"]), str(picture["sha256"])
                try:
                    files[trial.stimulus] = picture_of(trial.record.path.stem, file, sha256, folders).path
                except MaterialError as error:
                    lacking.setdefault(trial.stimulus, str(error))
    return Pictures(files, {name: why for name, why in lacking.items() if name not in files})


def pictures_in(folder: Path, names: Sequence[str]) -> Iterator[tuple[str, Path]]:
    """Yield the first picture of each name: NAME.png, NAME_1.jpg, NAME/anything.png. Raises LibraryError for no folder.

    Where one name begins another (T1 and T1_2, oak and oak-dark), a file is the one's that its name is nearest to.
    """
    if not folder.is_dir():
        raise LibraryError(f"{folder}: there is no such folder; one with pictures named as the textures is expected.")
    first: dict[str, tuple[int, Path]] = {}
    for path in sorted(filter(is_picture, folder.rglob("*"))):
        if (claimed := _whose(path.relative_to(folder), names)) is not None:
            name, number = claimed
            if name not in first or number < first[name][0]:
                first[name] = (number, path)
    yield from ((name, first[name][1]) for name in names if name in first)


def _whose(path: Path, names: Sequence[str]) -> tuple[str, int] | None:
    """Which texture a file shows, and as which of its pictures: in a texture's own folder its, else by its name."""
    if len(path.parts) > 1 and path.parts[0] in names:
        return path.parts[0], 0
    for name in sorted(names, key=len, reverse=True):
        if path.stem == name:
            return name, -1
        if path.stem.startswith(name) and (number := NUMBER.fullmatch(path.stem[len(name) :])):
            return name, int(number[1])
    return None


def missing_picture_notes(lacking: Mapping[str, str]) -> tuple[str, ...]:
    """A note on the textures whose picture could not be had, with why of the first; none where there are none."""
    if not lacking:
        return ()
    names = list(lacking)
    return (f"no picture is shown of {some(names, NAMED)}: {lacking[names[0]].rstrip('.')}",)


@dataclass(frozen=True)
class LibraryOptions:
    """What a library is made from.

    `model`: a card; None: the lab's own, where it has one and `without_model` is not set. `weights`: those of
    ResNet-50, where the model's features were made with a file. `folder`: one of images with a table of ratings
    (`ratings`, else its own; `scale`: the ends of its ratings) instead of the lab's sessions. `pictures`: a folder of
    images named as the textures; None: `folder`, else those that texture_photos took. `simulated`: only such sessions,
    or only real ones, where there are both. `recordings` are what was felt of the folder's textures elsewhere.
    """

    lab: Path
    study: str = STUDY
    model: Path | None = None
    without_model: bool = False
    weights: Path | None = None
    folder: Path | None = None
    ratings: Path | None = None
    scale: tuple[float, float] | None = None
    pictures: Path | None = None
    simulated: bool | None = None
    workers: int | None = None
    recordings: Recordings | None = None


def model_of(options: LibraryOptions) -> AttributeModel | None:
    """Return the model that was named, else the lab's own where it has one.

    Raises LibraryError for one that is named and left out at once, ModelFileError for a damaged one.
    """
    if options.without_model and options.model is not None:
        raise LibraryError(f"--without-model and --model {options.model.name}: one of the two is expected, or neither")
    own = options.lab / "models" / f"{NAME}.json"
    if options.without_model or (options.model is None and not own.is_file()):
        return None
    return read_model(options.model or own)


def material_of(options: LibraryOptions, model: AttributeModel | None, report: Report) -> Material:
    """Return the lab's textures: with the features that a model looks at, else with their ratings alone.

    Raises LibraryError where ResNet-50 has other weights than the model learned from, and what reading a lab raises.
    """
    if options.folder is not None:
        result = _of_folder(options, options.folder, model, report)
    elif model is None:
        report("reading ratings")
        ratings = read_ratings(options.lab, options.study, options.simulated)
        columns = {name: ratings.columns.get(name, {}) for name in ratings.rated}
        textures = tuple(
            Texture(name, columns[name].get("label") or name, columns[name].get("class") or "", rated=rated)
            for name, rated in ratings.rated.items()
        )
        notes = (*ratings.notes, *(f"{name}: {why}" for name, why in ratings.incomplete.items()))
        return Material(textures, ratings.attributes, simulated=ratings.simulated, notes=notes)
    else:
        from palpate.modeling.attributes.reading import read_material

        report("making features")
        result = read_material(
            options.lab,
            study_ratings=options.study,
            weights=options.weights,
            quick=model.card.quick,
            variants=0,
            workers=options.workers,
            touch=bool(model.card.touch),
            sight=bool(model.card.sight),
            simulated=options.simulated,
            report=report,
        )
    if model is not None and "resnet" in model.card.sight and result.weights != model.card.weights:
        raise LibraryError(
            f"{model.path}: it learned from ResNet-50 with {model.card.weights or 'other weights'}, and these features "
            f"have {result.weights or 'none'}: give the same file with --weights, or train the model again."
        )
    return result


def _of_folder(options: LibraryOptions, folder: Path, model: AttributeModel | None, report: Report) -> Material:
    """Return a folder's textures; the features of their pictures and recordings only for a model that looks at them."""
    felt = options.recordings if model is not None and model.card.touch else None
    if model is None or not (model.card.sight or felt):
        report("reading ratings")
        return read_rated(folder, options.ratings, options.scale)
    from palpate.modeling.attributes.reading_folder import read_folder

    report("making features")
    return read_folder(
        folder, options.lab, table=options.ratings, scale=options.scale, weights=options.weights,
        quick=model.card.quick, variants=0, workers=options.workers, recordings=felt, sight=bool(model.card.sight),
        report=report,
    )  # fmt: skip


def predictor_of(model: AttributeModel, lab: Path) -> Predictor:
    """Return a trained model as this lab's library asks it; one without an interval leaves anything possible."""
    half, notes = model.half_width, model.card.notes
    if half is None:
        half = np.full(len(model.attributes), Z90 * NOTHING_KNOWN[1])
        notes = (*notes, f"{model.card.name} has no intervals (too few textures): what it predicts counts as unsure.")
    sha256 = file_sha256(model.path)
    here, root = model.path.resolve(), lab.resolve()
    source = Source(
        what=f"model: {model.card.method}",
        file=here.relative_to(root).as_posix() if here.is_relative_to(root) else model.path.name,
        sha256=sha256,
    )
    learned = frozenset(model.card.learned)
    return Predictor(model.attributes, model.predictions, -half, half, learned, (source,), tuple(notes))


def rating_sources(options: LibraryOptions) -> Iterator[Source]:
    """The files that the ratings were read from: a folder's table, the sessions that count, or what was imported."""
    if options.folder is not None:
        table = options.ratings or table_in(options.folder)
        yield Source(what="ratings", file=table.name, sha256=file_sha256(table))
        return
    from palpate.modeling.lab_answers import answer_files

    for path in answer_files(options.lab, options.study, options.simulated):
        yield Source(what="ratings", file=path.relative_to(options.lab).as_posix(), sha256=file_sha256(path))


def first_pictures(options: LibraryOptions, names: Sequence[str]) -> Pictures:
    """Return the first picture of each texture that has one."""
    if folder := options.pictures or options.folder:
        return Pictures(dict(pictures_in(folder, names)))
    return pictures_taken(options.lab, options.simulated)


def read_rated(folder: Path, table: Path | None = None, scale: tuple[float, float] | None = None) -> Material:
    """Return the textures of the table with their ratings, read and refused as by `reading_folder.read_folder`."""
    table, lines, columns = rated_lines(folder, table, attributes_of(None), scale)
    textures = tuple(Texture(line.id, line.label, line.category, rated=line.rated) for line in lines)
    return Material(textures, columns.pairs, notes=(*columns.notes, f"ratings: {table.name} {file_sha256(table)}"))
