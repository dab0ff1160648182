"""Features of pictures: ResNet-50's average pool and co-occurrence of gray levels, cached by content (thesis 3.4.2)."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
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
"""Packages that compute these features; entries of other versions are not used."""
QUICK_GRID = 2
"""Patches along each side of a picture in a quick run."""
VARIANT_GRID = 3
"""Patches along each side of a variant: a fifth of all, since training needs the variants' noise, not all patches."""
JOBS = 20
"""The most jobs, since each loads the network, which takes half a second."""


@dataclass(frozen=True)
class Picture:
    """A picture's file, its SHA-256, which is verified when the picture is read, and its name in messages."""

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
    """The features of a texture's pictures and of their variants, by kind, (pictures, features) each.

    `blank` are the SHA-256 of pictures of a single brightness, which two textures may share.
    """

    sight: Mapping[str, FeatureRows]
    variants: Mapping[str, FeatureRows]
    notes: tuple[str, ...]
    blank: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Sight:
    """Options of pictures' features: the patches, the weights, and the number and noise of variants for training.

    A variant is a version with noise, of which 3 x 3 patches are used. Raises MaterialError for a negative number.
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
        """Return the patches of a version of a picture; version 0 is the picture itself."""
        few = min(VARIANT_GRID, len(self.looking.starts))
        return replace(self.looking, grid=few) if version else self.looking

    def key(self, picture: Picture, version: int) -> str:
        """Return the cache key of a version of a picture."""
        chance = (self.noise_sd, self.seed, version) if version else ()
        looking, weights = self.at(version), self.weights.key
        decides = {"sha256": picture.sha256, "looking": looking, "weights": weights, "chance": chance}
        return feature_key(decides, (code_digest("palpate.modeling.attributes.seeing"),), PACKAGES)


@dataclass(frozen=True)
class _Job:
    """A job: pictures, each with the versions to compute."""

    name: str
    missing: tuple[tuple[Picture, tuple[int, ...]], ...]
    how: Sight
    folder: Path | None


def sight_with(weights: Weights, variants: int, quick: bool) -> Sight:
    """Return the options of pictures' features; `quick` uses fewer patches of each picture."""
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
    """Return the features of each texture's pictures, from the cache in `folder` or computed and saved there.

    Each of `workers` processes (None: one per core) has one picture in memory at a time. An unusable picture is left
    out, with a note. Raises MaterialError for a file that is missing or has changed.
    """
    versions = range(how.variants + 1)
    keys = [how.key(picture, version) for album in albums for picture in album.pictures for version in versions]
    known = {key: entry for key in keys if (entry := load_features(folder, key)) is not None}
    jobs = list(_jobs(albums, how, folder, known.keys()))
    try:
        for computed in run_jobs(_compute, jobs, workers=workers, report=report) if jobs else ():
            known |= computed
    except JobError as error:
        raise MaterialError(str(error)) from None
    return {album.id: _gathered(album, how, known) for album in albums}


def _jobs(albums: Sequence[Album], how: Sight, folder: Path | None, known: Collection[str]) -> Iterator[_Job]:
    """Yield jobs for the versions that are not known, with a few textures each."""
    missing: dict[str, list[tuple[Picture, tuple[int, ...]]]] = {}
    for album in albums:
        for picture in album.pictures:
            versions = tuple(v for v in range(how.variants + 1) if how.key(picture, v) not in known)
            if versions:
                missing.setdefault(album.id, []).append((picture, versions))
    names, size = list(missing), -(-len(missing) // JOBS)
    for first in range(0, len(names), size or 1):
        textures = names[first : first + size]
        name = textures[0] if len(textures) == 1 else f"{textures[0]} to {textures[-1]}"
        pictures = tuple(entry for texture in textures for entry in missing[texture])
        yield _Job(f"pictures of {name}", pictures, how, folder)


def _compute(job: _Job) -> dict[str, Entry]:
    """Compute the versions of a job's pictures, save each at once, and return them by key."""
    network = _network(job.how.weights)
    result: dict[str, Entry] = {}
    for picture, versions in job.missing:
        for version, entry in _versions(picture, versions, job.how, network):
            key = job.how.key(picture, version)
            save_features(job.folder, key, *entry)
            result[key] = entry
    return result


@lru_cache(maxsize=1)
def _network(weights: Weights) -> ResNet50:
    """Return the network with these weights, ready to look at patches; built once a process, not once a job."""
    from palpate.modeling.attributes.resnet import fold_batch_norms, load_network

    return fold_batch_norms(load_network(weights.state()))


def _versions(
    picture: Picture, versions: Sequence[int], how: Sight, network: ResNet50
) -> Iterator[tuple[int, Entry]]:  # fmt: skip
    """Yield each version of a picture with its features, or with a note where the picture is unusable."""
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
    """Return the file's bytes. Raises MaterialError where they cannot be read or do not have the recorded SHA-256."""
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
    """Return the features of an album from the computed versions by key."""

    def of(versions: Sequence[int]) -> dict[str, FeatureRows]:
        entries = [known[how.key(picture, version)][0] for version in versions for picture in album.pictures]
        usable = [rows for rows in entries if rows]
        return {kind: np.stack([rows[kind] for rows in usable]) for kind in SIGHT_KINDS} if usable else {}

    originals = [(picture.sha256, known[how.key(picture, 0)][1]) for picture in album.pictures]
    notes = tuple(note for _, metadata in originals for note in metadata["notes"])
    blank = frozenset(sha256 for sha256, metadata in originals if metadata.get("blank"))
    return PictureRows(of([0]), of(range(1, how.variants + 1)), notes, blank)
