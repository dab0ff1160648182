"""The sources of a lab's library: textures with ratings and features, the model of attributes, and pictures."""

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
"""The number of a picture behind the texture's name in a file name."""
NAMED = 5
"""The most textures without a picture that a note names."""


@dataclass(frozen=True)
class Pictures:
    """The file of each texture's picture, and the reason where a picture was taken but cannot be used."""

    files: Mapping[str, Path] = field(default_factory=dict)
    missing: Mapping[str, str] = field(default_factory=dict)


def pictures_taken(lab: Path, simulated: bool | None = None) -> Pictures:
    """Return the first usable picture of each texture that texture_photos took: unchanged, and in a trial that counts.

    Sessions and trials count as in `reading_pictures.texture_pictures`, which requires all of the pictures.
    Raises MaterialError for a damaged ledger.
    """
    files: dict[str, Path] = {}
    missing: dict[str, str] = {}
    counting, _ = real_or_simulated(list(pictured_trials(lab, PICTURES_STUDY)), simulated, "pictures")
    for trial in counting:
        folders = folders_of(lab, trial.record)
        for picture in trial.pictures:
            if trial.stimulus not in files and "file" in picture:
                file, sha256 = str(picture["file"]), str(picture["sha256"])
                try:
                    files[trial.stimulus] = picture_of(trial.record.path.stem, file, sha256, folders).path
                except MaterialError as error:
                    missing.setdefault(trial.stimulus, str(error))
    return Pictures(files, {name: why for name, why in missing.items() if name not in files})


def pictures_in(folder: Path, names: Sequence[str]) -> Iterator[tuple[str, Path]]:
    """Yield the first picture of each name: NAME.png, NAME_1.jpg, NAME/anything.png.

    A file goes to the longest name that it begins with (T1 and T1_2, oak and oak-dark). Raises LibraryError for a
    folder that does not exist.
    """
    if not folder.is_dir():
        raise LibraryError(f"{folder}: there is no such folder; one with pictures named as the textures is expected.")
    first: dict[str, tuple[int, Path]] = {}
    for path in sorted(filter(is_picture, folder.rglob("*"))):
        if (match := _texture_of(path.relative_to(folder), names)) is not None:
            name, number = match
            if name not in first or number < first[name][0]:
                first[name] = (number, path)
    yield from ((name, first[name][1]) for name in names if name in first)


def _texture_of(path: Path, names: Sequence[str]) -> tuple[str, int] | None:
    """Return the texture of a picture, by its folder or else its file name, and the picture's number; None for none."""
    if len(path.parts) > 1 and path.parts[0] in names:
        return path.parts[0], 0
    for name in sorted(names, key=len, reverse=True):
        if path.stem == name:
            return name, -1
        if path.stem.startswith(name) and (number := NUMBER.fullmatch(path.stem[len(name) :])):
            return name, int(number[1])
    return None


def missing_picture_notes(missing: Mapping[str, str]) -> tuple[str, ...]:
    """Return a note on the textures with unusable pictures and the reason of the first; empty where there are none."""
    if not missing:
        return ()
    names = list(missing)
    return (f"no picture is shown of {some(names, NAMED)}: {missing[names[0]].rstrip('.')}",)


@dataclass(frozen=True)
class LibraryOptions:
    """The sources that a library is built from.

    `model`: a card; None for the lab's own, where it has one and `without_model` is not set. `weights`: a file of
    ResNet-50's weights, where the model's features were computed with one. `folder`: a folder of images with a table of
    ratings (`ratings`, else its own; `scale`: the ends of the ratings) instead of the lab's sessions. `pictures`: a
    folder of images named as the textures; None for `folder`, else those that texture_photos took. `simulated`: only
    simulated sessions, or only real ones, where there are both. `recordings`: recordings of the folder's textures.
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
    """Return the model of the options, else the lab's own, if there is one.

    Raises LibraryError for `model` together with `without_model`, ModelFileError for a damaged model.
    """
    if options.without_model and options.model is not None:
        raise LibraryError(f"--without-model and --model {options.model.name}: one of the two is expected, or neither")
    own = options.lab / "models" / f"{NAME}.json"
    if options.without_model or (options.model is None and not own.is_file()):
        return None
    return read_model(options.model or own)


def material_of(options: LibraryOptions, model: AttributeModel | None, report: Report) -> Material:
    """Return the textures with the features that the model uses, or without a model with their ratings alone.

    Raises LibraryError where ResNet-50 has other weights than the model learned from, and the errors of reading a lab.
    """
    if options.folder is not None:
        result = _folder_material(options, options.folder, model, report)
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


def _folder_material(options: LibraryOptions, folder: Path, model: AttributeModel | None, report: Report) -> Material:
    """Return a folder's textures, with the features of pictures and recordings that the model uses."""
    recordings = options.recordings if model is not None and model.card.touch else None
    if model is None or not (model.card.sight or recordings):
        report("reading ratings")
        return read_rated(folder, options.ratings, options.scale)
    from palpate.modeling.attributes.reading_folder import read_folder

    report("making features")
    return read_folder(
        folder, options.lab, table=options.ratings, scale=options.scale, weights=options.weights,
        quick=model.card.quick, variants=0, workers=options.workers, recordings=recordings,
        sight=bool(model.card.sight), report=report,
    )  # fmt: skip


def predictor_of(model: AttributeModel, lab: Path) -> Predictor:
    """Return a trained model as a predictor; a model without intervals gets the width of `NOTHING_KNOWN`."""
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
    """Yield the files of the ratings: a folder's table, the sessions that count, or imported tables."""
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
    """Return the textures of a folder's table with their ratings alone. Raises as `reading_folder.read_folder` does."""
    table, lines, columns = rated_lines(folder, table, attributes_of(None), scale)
    textures = tuple(Texture(line.id, line.label, line.category, rated=line.rated) for line in lines)
    return Material(textures, columns.pairs, notes=(*columns.notes, f"ratings: {table.name} {file_sha256(table)}"))
