"""What a lab's library is made from: its textures with ratings and features, its model of attributes, its pictures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.modeling.attributes.material import Material, Texture
from palpate.modeling.attributes.model_file import NAME, AttributeModel, Card, read_model
from palpate.modeling.attributes.reading_folder import rated_lines, table_in
from palpate.modeling.attributes.reading_ratings import STUDY, RatedTextures, attributes_of, read_ratings
from palpate.modeling.library.entries import NOTHING_KNOWN, Z90, LibraryError, Source
from palpate.modeling.library.indexing import Predictor
from palpate.modeling.library.pictures import Pictures, pictures_in, pictures_taken
from palpate.protocols.files import file_sha256
from palpate.protocols.progress import Report

if TYPE_CHECKING:
    from palpate.modeling.attributes.reading_recordings import Recordings


@dataclass(frozen=True)
class Wanted:
    """What a library is made from.

    `model`: a card; None: the lab's own, where it has one and `without_model` is not said. `weights`: those of
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


def model_of(wanted: Wanted) -> AttributeModel | None:
    """The model that was named, else the lab's own where it has one.

    Raises LibraryError for one that is named and left out at once, ModelFileError for a damaged one.
    """
    if wanted.without_model and wanted.model is not None:
        raise LibraryError(f"--without-model and --model {wanted.model.name}: one of the two is expected, or neither")
    own = wanted.lab / "models" / f"{NAME}.json"
    if wanted.without_model or (wanted.model is None and not own.is_file()):
        return None
    return read_model(wanted.model or own)


def material_of(wanted: Wanted, model: AttributeModel | None, report: Report) -> Material:
    """The lab's textures: with the features that a model looks at, else with their ratings alone.

    Raises LibraryError where ResNet-50 has other weights than the model learned from, and what reading a lab raises.
    """
    if wanted.folder is not None:
        found = _of_folder(wanted, wanted.folder, model, report)
    elif model is None:
        report("reading ratings")
        return _rated_only(read_ratings(wanted.lab, wanted.study, wanted.simulated))
    else:
        found = _of_sessions(wanted, model.card, report)
    if model is not None and "resnet" in model.card.sight and found.weights != model.card.weights:
        raise LibraryError(
            f"{model.path}: it learned from ResNet-50 with {model.card.weights or 'other weights'}, and these features "
            f"have {found.weights or 'none'}: give the same file with --weights, or train the model anew."
        )
    return found


def _of_sessions(wanted: Wanted, card: Card, report: Report) -> Material:
    from palpate.modeling.attributes.reading import read_material

    report("making features")
    return read_material(
        wanted.lab, study_ratings=wanted.study, weights=wanted.weights, quick=card.quick, variants=0,
        workers=wanted.workers, touch=bool(card.touch), sight=bool(card.sight), simulated=wanted.simulated,
        report=report,
    )  # fmt: skip


def _of_folder(wanted: Wanted, folder: Path, model: AttributeModel | None, report: Report) -> Material:
    """A folder's textures; the features of their pictures and recordings only for a model that looks at them."""
    felt = wanted.recordings if model is not None and model.card.touch else None
    if model is None or not (model.card.sight or felt):
        report("reading ratings")
        return read_rated(folder, wanted.ratings, wanted.scale)
    from palpate.modeling.attributes.reading_folder import read_folder

    report("making features")
    return read_folder(
        folder, wanted.lab, table=wanted.ratings, scale=wanted.scale, weights=wanted.weights,
        quick=model.card.quick, variants=0, workers=wanted.workers, recordings=felt, sight=bool(model.card.sight),
        report=report,
    )  # fmt: skip


def predictor_of(model: AttributeModel, lab: Path) -> Predictor:
    """A trained model as this lab's library asks it; one without an interval leaves anything possible."""
    half, notes = model.half_width, model.card.notes
    if half is None:
        half = np.full(len(model.attributes), Z90 * NOTHING_KNOWN[1])
        notes = (*notes, f"{model.card.name} has no intervals (too few textures): what it predicts counts as unsure.")
    told = file_sha256(model.path)
    source = Source(what=f"model: {model.card.method}", file=_in_lab(model.path, lab), sha256=told)
    learned = frozenset(model.card.learned)
    return Predictor(model.attributes, model.predictions, -half, half, learned, (source,), tuple(notes))


def _in_lab(file: Path, lab: Path) -> str:
    """A file's path from the lab; the name alone of one that lies elsewhere, whose content tells it."""
    here, root = file.resolve(), lab.resolve()
    return here.relative_to(root).as_posix() if here.is_relative_to(root) else file.name


def rating_sources(wanted: Wanted) -> Iterator[Source]:
    """The files that the ratings were read from: a folder's table, the sessions that count, or what was imported."""
    if wanted.folder is not None:
        table = wanted.ratings or table_in(wanted.folder)
        yield Source(what="ratings", file=table.name, sha256=file_sha256(table))
        return
    from palpate.modeling.lab_answers import answer_files

    for path in answer_files(wanted.lab, wanted.study, wanted.simulated):
        yield Source(what="ratings", file=path.relative_to(wanted.lab).as_posix(), sha256=file_sha256(path))


def first_pictures(wanted: Wanted, names: Sequence[str]) -> Pictures:
    """The first picture of each texture that has one."""
    if folder := wanted.pictures or wanted.folder:
        return Pictures(dict(pictures_in(folder, names)))
    return pictures_taken(wanted.lab, wanted.simulated)


def _rated_only(ratings: RatedTextures) -> Material:
    textures = tuple(_texture(name, ratings) for name in ratings.rated)
    notes = (*ratings.notes, *(f"{name}: {why}" for name, why in ratings.incomplete.items()))
    return Material(textures, ratings.attributes, simulated=ratings.simulated, notes=notes)


def _texture(name: str, ratings: RatedTextures) -> Texture:
    columns: Mapping[str, str] = ratings.columns.get(name, {})
    return Texture(name, columns.get("label") or name, columns.get("class") or "", rated=ratings.rated[name])


def read_rated(folder: Path, table: Path | None = None, scale: tuple[float, float] | None = None) -> Material:
    """The textures of the table with their ratings, read and refused as by `reading_folder.read_folder`."""
    table, lines, columns = rated_lines(folder, table, attributes_of(None), scale)
    textures = tuple(Texture(line.id, line.label, line.category, rated=line.rated) for line in lines)
    return Material(textures, columns.pairs, notes=(*columns.notes, f"ratings: {table.name} {file_sha256(table)}"))
