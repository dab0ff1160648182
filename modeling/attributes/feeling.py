"""Rows of what was felt, a texture a job, saved by content (thesis 3.4.1): a lab's captures, or others' recordings."""

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
        """Return its features. Raises TextureDataError."""


@dataclass(frozen=True)
class _Felt:
    """A job: one texture, and the folder of its saved rows."""

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
    """Return the rows of each texture: what `folder` lacks is computed and saved there.

    One texture is in memory at a time in each of `workers` processes. A texture whose recordings cannot be used has no
    rows, and its notes say why.
    """
    own, jobs = "palpate.modeling.attributes.feeling", []
    for texture in textures:
        code = code_digest(module_of(texture), own)
        jobs.append(_Felt(texture, feature_key({"recorded": texture.key}, (code,), PACKAGES), folder))
    known = {job.key: entry for job in jobs if (entry := load_features(folder, job.key)) is not None}
    missing = [job for job in jobs if job.key not in known]
    computed = run_jobs(_entry, missing, workers=workers, report=report) if missing else []
    known |= {job.key: entry for job, entry in zip(missing, computed, strict=True)}
    result = []
    for texture, job in zip(textures, jobs, strict=True):  # an entry has no name: a recording may have several
        rows, metadata = known[job.key]
        made_from, notes = frozenset(metadata["made_from"]), tuple(metadata["notes"])
        result.append(FeltRows(texture.id, texture.label, texture.category, dict(rows), made_from, notes))
    return result


def _entry(job: _Felt) -> Entry:
    try:
        felt = job.recorded.rows()
    except TextureDataError as error:
        return {}, {"made_from": sorted(job.recorded.made_from), "notes": [f"{RECORDINGS_LEFT_OUT}: {error}"]}
    entry: Entry = (felt.touch, {"made_from": sorted(felt.made_from), "notes": list(felt.notes)})
    save_features(job.folder, job.key, *entry)
    return entry
