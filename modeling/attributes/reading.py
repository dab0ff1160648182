"""The material of a lab: each texture's recordings, pictures and ratings of its sessions, for models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.modeling.attributes.feature_cache import FOLDER
from palpate.modeling.attributes.folds import sample_textures
from palpate.modeling.attributes.joining import CATEGORY, NOTHING, Parts, join_textures
from palpate.modeling.attributes.material import FEW_READ, QUICK_LOOK, Material, MaterialError, Texture
from palpate.modeling.attributes.reading_pictures import STUDY as PHOTOS
from palpate.modeling.attributes.reading_pictures import TexturePictures, texture_pictures
from palpate.modeling.attributes.reading_ratings import STUDY as RATINGS
from palpate.modeling.attributes.reading_ratings import RatedTextures, read_ratings
from palpate.modeling.attributes.resnet_weights import weights_from
from palpate.modeling.attributes.seeing import Album, PictureRows, Sight, picture_rows, sight_with, thin
from palpate.protocols.progress import Report, silent
from palpate.studies.sessions.session_files import ledgers_in

if TYPE_CHECKING:
    from palpate.modeling.attributes.reading_touch import FeltRows, Recorded

CAPTURE = "texture_capture"
MOST_WHEN_QUICK = 15
"""The most textures of a quick evaluation."""


def read_material(
    lab: Path, *, study_capture: str = CAPTURE, study_photos: str = PHOTOS, study_ratings: str = RATINGS,
    weights: Path | None = None, sha256: str | None = None, quick: bool = False, variants: int = 1,
    workers: int | None = None, touch: bool = True, sight: bool = True, simulated: bool | None = None,
    keep: bool = True, most: int | None = None, seed: int = 0, report: Report = silent,
) -> Material:  # fmt: skip
    """Return the textures of a lab with the features of their recordings and pictures, and their mean ratings.

    `weights` is a file of ResNet-50's weights, with the SHA-256 `sha256` if that is given; without a file they are
    random. `variants` is the number of augmented versions of each picture, for training. `quick` uses 4 of 49 patches
    of at most 3 pictures. `touch` and `sight` False leave those features out. `simulated` chooses between simulated and
    real sessions where a lab has both; with None the real ones are used. Where a lab has more than `most` textures, a
    sample of `most` is read from those with all data that the lab has: in turn from each class, drawn by `seed`. A
    texture with missing or unusable recordings, pictures or ratings stays, with a note. Features are cached in
    LAB/features unless `keep` is False. Each of `workers` processes has one texture's recordings, or one picture, in
    memory at a time.

    Raises MaterialError where there is nothing to learn from, for a picture that is missing or has changed, and for a
    file of weights that cannot be used; TextureDataError for captures and DataRefused for ratings that cannot be read.
    """
    if not lab.is_dir():
        raise MaterialError(f"{lab}: no such lab; the folder of a lab is expected")
    if not (touch or sight):
        raise MaterialError("neither touch nor sight is requested: there is nothing to learn from")
    run = _Run(lab / FOLDER if keep else None, workers, report)
    how = sight_with(weights_from(weights, sha256), variants, quick)
    rated = read_ratings(lab, study_ratings, simulated)
    photos = texture_pictures(lab, study_photos, simulated) if sight else ()
    captured, unfelt = _captured(lab, study_capture, simulated) if touch else ((), ())
    names = None if most is None else _sample(most, seed, rated, photos, captured)
    rated, photos, captured = _select(names, rated, photos, captured)
    rows = run.sight_rows([thin(photo.album) if quick else photo.album for photo in photos], how)
    felt = run.touch_rows(captured)
    parts = Parts(rated, felt, {photo.id: photo for photo in photos}, rows, touch, sight)
    textures = join_textures(parts)
    _demand_any(lab, textures, [*([study_capture] if touch else []), *([study_photos] if sight else [])], unfelt)
    weights_text = how.weights.description if any(texture.sight for texture in textures) else ""
    unseen = (f"no session of {study_photos}: {NOTHING['picture']}",) if sight and not photos else ()
    few = () if names is None else (FEW_READ,)
    notes = (*rated.notes, *unfelt, *unseen, *few, *((QUICK_LOOK,) if quick and photos else ()))
    # The material counts as simulated where any ratings, recordings or pictures are simulated.
    recorded = any(texture.simulated for texture in parts.felt.values())
    simulated = rated.simulated or recorded or any(photo.simulated for photo in photos)
    return Material(textures, rated.attributes, weights_text, simulated, notes)


@dataclass(frozen=True)
class _Run:
    """The cache of features, the number of processes that compute them, and the progress report."""

    folder: Path | None
    workers: int | None
    report: Report

    def sight_rows(self, albums: Sequence[Album], how: Sight) -> dict[str, PictureRows]:
        """Return the features of pictures, by texture."""
        return picture_rows(albums, how, folder=self.folder, workers=self.workers, report=self.report)

    def touch_rows(self, captured: Sequence[Recorded]) -> dict[str, FeltRows]:
        """Return the features of recordings, by texture."""
        if not captured:
            return {}
        from palpate.modeling.attributes.feeling import felt_rows

        rows = felt_rows(captured, self.folder, self.workers, self.report)
        return {row.id: row for row in rows}


def _captured(lab: Path, study: str, simulated: bool | None) -> tuple[tuple[Recorded, ...], tuple[str, ...]]:
    """Return the textures that the lab's sessions captured, or none and a note with the reason."""
    if not ledgers_in(lab, study):
        return (), (f"no session of {study}: {NOTHING['recording']}",)
    from palpate.modeling.attributes.reading_touch import recorded
    from palpate.modeling.textures.reading_ledgers import NoCapture

    try:
        return recorded(lab, study=study, simulated=simulated), ()
    except NoCapture as nothing:
        return (), (f"{NOTHING['recording']}: {nothing}",)


def _sample(
    most: int, seed: int, rated: RatedTextures, photos: Sequence[TexturePictures], captured: Sequence[Recorded]
) -> frozenset[str] | None:  # fmt: skip
    """Return a sample of `most` textures that have all data; None where the lab has no more, or none has all."""
    parts: tuple[Sequence[TexturePictures | Recorded], ...] = (
        tuple(photo for photo in photos if photo.pictures),
        captured,
    )
    classes = {name: columns.get(CATEGORY, "") for name, columns in rated.columns.items()}
    classes |= {texture.id: texture.category for part in parts for texture in part if texture.category}
    known = {*rated.rated, *rated.incomplete, *(texture.id for part in parts for texture in part)}
    whole = set(rated.rated).intersection(*({texture.id for texture in part} for part in parts if part))
    if len(known) <= most or not whole:
        return None
    return frozenset(sample_textures({name: classes.get(name, "") for name in whole}, most, seed))


def _select(
    names: frozenset[str] | None,
    rated: RatedTextures,
    photos: tuple[TexturePictures, ...],
    captured: tuple[Recorded, ...],
) -> tuple[RatedTextures, tuple[TexturePictures, ...], tuple[Recorded, ...]]:
    """Return the data of these textures, or with None of all."""
    if names is None:
        return rated, photos, captured
    own = replace(rated, rated={name: texture for name, texture in rated.rated.items() if name in names}, incomplete={})
    photos = tuple(photo for photo in photos if photo.id in names)
    return own, photos, tuple(capture for capture in captured if capture.id in names)


def _demand_any(lab: Path, textures: Sequence[Texture], studies: Sequence[str], unfelt: Sequence[str]) -> None:
    """Raise MaterialError unless a texture has features of touch or sight."""
    if any(texture.touch or texture.sight for texture in textures):
        return
    why = next((f"; {texture.id}: {texture.notes[0]}" for texture in textures if texture.notes), "")
    why = "".join(f"; {reason}" for reason in unfelt) + why
    where = " or ".join(studies)
    raise MaterialError(
        f"{lab}: no recording and no picture of a texture in {where} that can be used{why}; record them, or make a"
        " simulated lab (palpate textures simulate)"
    )
