"""Touch features of recorded textures, one job per texture, cached by content (thesis 3.4.1)."""

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
"""Packages that compute these features; entries of other versions are not used."""


class Recording(Protocol):
    """One texture's recordings before they are read: a lab's (`reading_touch`) or others' (`reading_recordings`)."""

    @property
    def id(self) -> str:
        """The texture's id."""

    @property
    def label(self) -> str:
        """The texture's name on pictures."""

    @property
    def category(self) -> str:
        """The texture's class."""

    @property
    def key(self) -> str:
        """A digest of all that the features depend on, except the code."""

    @property
    def made_from(self) -> frozenset[str]:
        """Digests of the recorded data."""

    def rows(self) -> FeltRows:
        """Return the texture's features. Raises TextureDataError for recordings that cannot be used."""


@dataclass(frozen=True)
class _Job:
    """A job: one texture, the key of its rows, and the folder of the cache."""

    recorded: Recording
    key: str
    folder: Path | None

    @property
    def name(self) -> str:
        """The job's name in progress reports and errors."""
        return f"recordings of {self.recorded.id}"


def felt_rows(
    textures: Sequence[Recording], folder: Path | None = None, workers: int | None = None, report: Report = silent
) -> list[FeltRows]:
    """Return the rows of each texture, from the cache in `folder` or computed and saved there.

    Each of `workers` processes has one texture in memory at a time. A texture whose recordings cannot be used has no
    rows and a note with the reason.
    """
    own, jobs = "palpate.modeling.attributes.feeling", []
    for texture in textures:
        code = code_digest(module_of(texture), own)
        jobs.append(_Job(texture, feature_key({"recorded": texture.key}, (code,), PACKAGES), folder))
    known = {job.key: entry for job in jobs if (entry := load_features(folder, job.key)) is not None}
    missing = [job for job in jobs if job.key not in known]
    computed = run_jobs(_entry, missing, workers=workers, report=report) if missing else []
    known |= {job.key: entry for job, entry in zip(missing, computed, strict=True)}
    result = []
    for texture, job in zip(textures, jobs, strict=True):  # an entry has no name: textures may share a recording
        rows, metadata = known[job.key]
        made_from, notes = frozenset(metadata["made_from"]), tuple(metadata["notes"])
        result.append(FeltRows(texture.id, texture.label, texture.category, dict(rows), made_from, notes))
    return result


def _entry(job: _Job) -> Entry:
    """Compute and save the rows of a texture; return them, or no rows with a note."""
    try:
        felt = job.recorded.rows()
    except TextureDataError as error:
        return {}, {"made_from": sorted(job.recorded.made_from), "notes": [f"{RECORDINGS_LEFT_OUT}: {error}"]}
    entry: Entry = (felt.touch, {"made_from": sorted(felt.made_from), "notes": list(felt.notes)})
    save_features(job.folder, job.key, *entry)
    return entry
