"""Rows of what was felt in a lab's captures, a texture a job, kept by content (thesis 3.4.1)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from modeling.attributes.features_kept import Entry, keep, kept, key_of
from modeling.attributes.reading_touch import FeltRows, Recorded, recorded, rows_of
from modeling.textures.judging_kept import files_digest, module_digest
from modeling.textures.recording import TextureDataError
from modeling.training.jobs import run_jobs
from modeling.training.progress import Report, silent

MODULE = "modeling.attributes.reading_touch"
KINDS = ("hand", "mfcc", "segments", "spectra", "tactile", "touch", "wavelets")
CODE = (
    *(f"analysis/features/{name}.py" for name in KINDS),
    "analysis/streams", "analysis/aligning", "studies/one_axis.py", "studies/texture_signals.py", "studies/record.py",
    "studies/stored_samples.py",
)  # fmt: skip
"""What makes these rows beside that module and what it imports of this room."""
PACKAGES = ("librosa", "numpy", "pywavelets", "scipy")


@dataclass(frozen=True)
class _Felt:
    """A job: one texture, and where its rows are kept."""

    recorded: Recorded
    key: str
    folder: Path | None

    @property
    def name(self) -> str:
        """As the job is called."""
        return f"recordings of {self.recorded.id}"


def felt_in(
    lab: Path, study: str, *, simulated: bool | None = None, folder: Path | None = None, workers: int | None = None,
    report: Report = silent,
) -> list[FeltRows]:  # fmt: skip
    """The rows of each texture that the lab's sessions of `study` captured: what `folder` lacks is computed, and kept.

    One texture is in memory at a time in each of `workers` processes. A texture whose recordings cannot be used has no
    rows, and its notes say why. `simulated`: only what twins recorded, or only what a rig did. Raises TextureDataError
    on a damaged ledger, and its NoCapture where no capture counts.
    """
    textures = recorded(lab, study=study, simulated=simulated)
    jobs = [_Felt(each, _key(each), folder) for each in textures]
    known = {job.key: entry for job in jobs if (entry := kept(folder, job.key)) is not None}
    lacking = [job for job in jobs if job.key not in known]
    made = run_jobs(_entry, lacking, workers=workers, report=report) if lacking else []
    known |= {job.key: entry for job, entry in zip(lacking, made, strict=True)}
    return [_rows(each, known[job.key]) for each, job in zip(textures, jobs, strict=True)]


def _key(texture: Recorded) -> str:
    return key_of({"recorded": texture.key}, (module_digest(MODULE), files_digest(CODE)), PACKAGES)


def _entry(job: _Felt) -> Entry:
    try:
        found = rows_of(job.recorded)
    except TextureDataError as error:
        made: Entry = ({}, {"made_from": sorted(job.recorded.made_from), "notes": [f"recordings left out: {error}"]})
    else:
        made = (found.touch, {"made_from": sorted(found.made_from), "notes": list(found.notes)})
    keep(job.folder, job.key, *made)
    return made


def _rows(texture: Recorded, entry: Entry) -> FeltRows:
    """What is kept does not know the texture's name: the same recording may have another one elsewhere."""
    rows, told = entry
    made_from, notes = frozenset(told["made_from"]), tuple(told["notes"])
    return FeltRows(texture.id, texture.label, texture.category, rows, made_from, notes)
