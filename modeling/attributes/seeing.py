"""Rows of pictures: ResNet-50's average pool and co-occurrence of gray levels, saved by content (thesis 3.4.2)."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.analysis.features.augmenting import NOISE_SD, chance_of, varied
from palpate.analysis.features.glcm import glcm
from palpate.analysis.features.pictures import Looking, PictureError, patches, square
from palpate.modeling.attributes.feature_cache import Entry, feature_key, load_features, save_features
from palpate.modeling.attributes.material import PICTURE_LEFT_OUT, SIGHT_KINDS, FeatureRows, MaterialError
from palpate.modeling.attributes.resnet_weights import Weights
from palpate.modeling.training.jobs import run_jobs
from palpate.modeling.training.refusals import JobError
from palpate.protocols.code_digest import code_digest
from palpate.protocols.progress import Report, silent

if TYPE_CHECKING:
    from palpate.modeling.attributes.resnet import ResNet50

PACKAGES = ("numpy", "pillow", "scikit-image", "scipy", "torch")
"""What makes these rows beside our own code; an entry of other versions is not used."""
QUICK_GRID = 2
"""Patches along each side, and pictures of a texture, that are looked at in a hurry."""
VARIANT_GRID = 3
"""Patches along each side of a further version: a fifth of all, since training wants their noise and not their time."""
JOBS = 20
"""So many at most: loading the network for each takes half a second."""


@dataclass(frozen=True)
class Picture:
    """A picture in a file; `name` is for people. Its bytes must still have this SHA-256 when it is looked at."""

    path: Path
    sha256: str
    name: str


@dataclass(frozen=True)
class Album:
    """All pictures of one texture."""

    id: str
    pictures: tuple[Picture, ...]


@dataclass(frozen=True)
class PictureRows:
    """A texture's pictures as rows, and those of `variants` versions of each: pictures, and then versions of them.

    `blank` are the SHA-256 of pictures of one brightness: a second texture that has such a one shares nothing with it.
    """

    sight: Mapping[str, FeatureRows]
    variants: Mapping[str, FeatureRows]
    notes: tuple[str, ...]
    blank: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Sight:
    """How pictures are looked at: where, with which weights, with how many further versions of each for training.

    Of a further version 3 x 3 patches are looked at, spread over all.
    """

    looking: Looking = field(default_factory=Looking)
    weights: Weights = field(default_factory=Weights)
    variants: int = 0
    noise_sd: float = NOISE_SD
    seed: int = 0

    def __post_init__(self) -> None:
        if self.variants < 0:
            raise MaterialError(f"variants is {self.variants}: 0 or more further versions of each picture are made")

    def at(self, version: int) -> Looking:
        """Return where a version of a picture is looked at; version 0 is the picture as it is."""
        few = min(VARIANT_GRID, len(self.looking.starts))
        return replace(self.looking, grid=few) if version else self.looking

    def key(self, picture: Picture, version: int) -> str:
        """Return the key of a version of a picture."""
        chance = (self.noise_sd, self.seed, version) if version else ()
        looking, weights = self.at(version), self.weights.key
        decides = {"sha256": picture.sha256, "looking": looking, "weights": weights, "chance": chance}
        return feature_key(decides, (code_digest("palpate.modeling.attributes.seeing"),), PACKAGES)


@dataclass(frozen=True)
class _Look:
    """A job: the pictures of some textures, each with the versions of it that lack."""

    name: str
    wanted: tuple[tuple[Picture, tuple[int, ...]], ...]
    how: Sight
    folder: Path | None


def sight_with(weights: Weights, variants: int, quick: bool) -> Sight:
    """Return the options for looking at pictures; `quick` looks at fewer patches of each."""
    return Sight(Looking(grid=QUICK_GRID if quick else None), weights, variants)


def thin(album: Album, count: int = 3) -> Album:
    """Return the album with at most `count` pictures, evenly spaced, because neighbouring lights look alike."""
    every = album.pictures
    if len(every) <= count:
        return album
    places = np.linspace(0, len(every) - 1, count)
    return Album(album.id, tuple(every[round(float(place))] for place in places))


def picture_rows(
    albums: Sequence[Album], how: Sight, *, folder: Path | None = None, workers: int | None = None,
    report: Report = silent,
) -> dict[str, PictureRows]:  # fmt: skip
    """Return the rows of each texture's pictures, by its id: what `folder` does not hold is computed and saved there.

    One picture is in memory at a time in each of `workers` processes (None: as many as cores). A picture that shows
    nothing that can be looked at is left out, and the notes say why. Raises MaterialError on a file that is not the
    one it should be.
    """
    versions = range(how.variants + 1)
    keys = [how.key(picture, version) for album in albums for picture in album.pictures for version in versions]
    known = {key: entry for key in keys if (entry := load_features(folder, key)) is not None}
    jobs = list(_jobs(albums, how, folder, known.keys()))
    try:
        for computed in run_jobs(_looked, jobs, workers=workers, report=report) if jobs else ():
            known |= computed
    except JobError as error:
        raise MaterialError(str(error)) from None
    return {album.id: _gathered(album, how, known) for album in albums}


def _jobs(albums: Sequence[Album], how: Sight, folder: Path | None, known: Collection[str]) -> Iterator[_Look]:
    """Yield what lacks, a few textures a job."""
    lacking: dict[str, list[tuple[Picture, tuple[int, ...]]]] = {}
    for album in albums:
        for picture in album.pictures:
            versions = tuple(v for v in range(how.variants + 1) if how.key(picture, v) not in known)
            if versions:
                lacking.setdefault(album.id, []).append((picture, versions))
    names, size = list(lacking), -(-len(lacking) // JOBS)
    for first in range(0, len(names), size or 1):
        some = names[first : first + size]
        name = some[0] if len(some) == 1 else f"{some[0]} to {some[-1]}"
        yield _Look(f"pictures of {name}", tuple(look for one in some for look in lacking[one]), how, folder)


def _looked(job: _Look) -> dict[str, Entry]:
    """Return every missing version of every picture by its key; each is saved as soon as it is computed."""
    from palpate.modeling.attributes.resnet import fold_batch_norms, load_network

    network = fold_batch_norms(load_network(job.how.weights.state()))
    result: dict[str, Entry] = {}
    for picture, versions in job.wanted:
        for version, entry in _versions(picture, versions, job.how, network):
            key = job.how.key(picture, version)
            save_features(job.folder, key, *entry)
            result[key] = entry
    return result


def _versions(
    picture: Picture, versions: Sequence[int], how: Sight, network: ResNet50
) -> Iterator[tuple[int, Entry]]:  # fmt: skip
    from palpate.modeling.attributes.resnet import pool_of_patches

    try:
        view = square(_bytes(picture), picture.name, how.looking.side)
    except PictureError as error:
        yield from ((version, ({}, {"notes": [f"{PICTURE_LEFT_OUT}: {error}"]})) for version in versions)
        return
    for version in versions:
        values = view.values
        if version > 0:
            values = varied(values, chance_of(picture.sha256, version, how.seed), how.noise_sd)
        pooled = pool_of_patches(network, patches(values, how.at(version)))
        notes = [] if version else list(view.notes)
        yield version, ({"resnet": pooled, "glcm": glcm(values)}, {"notes": notes, "blank": view.blank})


def _bytes(picture: Picture) -> bytes:
    """Return the file's bytes. Raises MaterialError where they are not those that are on record."""
    try:
        data = picture.path.read_bytes()
    except OSError as error:
        raise MaterialError(f"{picture.name}: {picture.path} cannot be read ({error.strerror})") from None
    if hashlib.sha256(data).hexdigest() != picture.sha256:
        raise MaterialError(
            f"{picture.name}: {picture.path} is not the recorded picture (its SHA-256 differs); restore it"
        )
    return data


def _gathered(album: Album, how: Sight, known: Mapping[str, Entry]) -> PictureRows:
    def of(versions: Sequence[int]) -> dict[str, FeatureRows]:
        entries = [known[how.key(picture, version)][0] for version in versions for picture in album.pictures]
        whole = [rows for rows in entries if rows]
        return {kind: np.stack([rows[kind] for rows in whole]) for kind in SIGHT_KINDS} if whole else {}

    looked = [(picture.sha256, known[how.key(picture, 0)][1]) for picture in album.pictures]
    notes = tuple(note for _, metadata in looked for note in metadata["notes"])
    blank = frozenset(sha256 for sha256, metadata in looked if metadata.get("blank"))
    return PictureRows(of([0]), of(range(1, how.variants + 1)), notes, blank)
