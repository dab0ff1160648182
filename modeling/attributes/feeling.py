"""Rows of what was felt, a texture a job, kept by content (thesis 3.4.1): a lab's captures, or others' recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from palpate.modeling.attributes.feature_cache import Entry, feature_key, load_features, save_features
from palpate.modeling.attributes.material import RECORDINGS_LEFT_OUT
from palpate.modeling.attributes.reading_touch import FeltRows
from palpate.modeling.textures.recording import TextureDataError
from palpate.modeling.training.jobs import run_jobs
from palpate.protocols.code_digest import code_digest, module_of
from palpate.protocols.progress import Report, silent

PACKAGES = ("librosa", "numpy", "pywavelets", "scipy")
"""What makes these rows beside our own code; an entry of other versions is not used."""


class Recording(Protocol):
    """One texture's recordings, not read yet: a lab's (`reading_touch`) or others' (`reading_recordings`)."""

    @property
    def id(self) -> str:
        """The texture."""

    @property
    def label(self) -> str:
        """What it is called on pictures."""

    @property
    def category(self) -> str:
        """Its class."""

    @property
    def key(self) -> str:
        """A digest of all that decides what is felt, but for the program."""

    @property
    def made_from(self) -> frozenset[str]:
        """Digests of what was recorded."""

    def rows(self) -> FeltRows:
        """Its features. Raises TextureDataError."""


@dataclass(frozen=True)
class _Felt:
    """A job: one texture, and where its rows are kept."""

    recorded: Recording
    key: str
    folder: Path | None

    @property
    def name(self) -> str:
        """As the job is called."""
        return f"recordings of {self.recorded.id}"


def felt_rows(
    textures: Sequence[Recording], folder: Path | None = None, workers: int | None = None, report: Report = silent
) -> list[FeltRows]:
    """The rows of each texture: what `folder` lacks is computed, and kept there.

    One texture is in memory at a time in each of `workers` processes. A texture whose recordings cannot be used has no
    rows, and its notes say why.
    """
    jobs = [_Felt(each, _key(each), folder) for each in textures]
    known = {job.key: entry for job in jobs if (entry := load_features(folder, job.key)) is not None}
    lacking = [job for job in jobs if job.key not in known]
    made = run_jobs(_entry, lacking, workers=workers, report=report) if lacking else []
    known |= {job.key: entry for job, entry in zip(lacking, made, strict=True)}
    return [_rows(each, known[job.key]) for each, job in zip(textures, jobs, strict=True)]


def _key(texture: Recording) -> str:
    code = code_digest(module_of(texture), "palpate.modeling.attributes.feeling")
    return feature_key({"recorded": texture.key}, (code,), PACKAGES)


def _entry(job: _Felt) -> Entry:
    try:
        found = job.recorded.rows()
    except TextureDataError as error:
        return {}, {"made_from": sorted(job.recorded.made_from), "notes": [f"{RECORDINGS_LEFT_OUT}: {error}"]}
    made: Entry = (found.touch, {"made_from": sorted(found.made_from), "notes": list(found.notes)})
    save_features(job.folder, job.key, *made)
    return made


def _rows(texture: Recording, entry: Entry) -> FeltRows:
    """What is kept does not know the texture's name: the same recording may have another one elsewhere."""
    rows, told = entry
    made_from, notes = frozenset(told["made_from"]), tuple(told["notes"])
    return FeltRows(texture.id, texture.label, texture.category, dict(rows), made_from, notes)
