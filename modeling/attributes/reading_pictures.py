"""Pictures of texture_photos sessions: those that count, with their files, verified by SHA-256."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.attributes.seeing import Album, Picture
from palpate.protocols.files import file_sha256
from palpate.studies.collecting.study_sessions import real_or_simulated, sessions_of
from palpate.studies.sessions.record import LedgerError, Record
from palpate.studies.sessions.session_files import by_twins, stimulus_columns

STUDY = "texture_photos"
PICTURES = "pictures"
"""The folder of a lab that holds its cameras' pictures."""


@dataclass(frozen=True)
class TexturePictures:
    """One texture with its pictures that count, in the order of sessions, trials and lights."""

    id: str
    label: str
    category: str
    pictures: tuple[Picture, ...]
    simulated: bool
    notes: tuple[str, ...] = ()

    @property
    def album(self) -> Album:
        """The pictures as an album, for `seeing.picture_rows`."""
        return Album(self.id, self.pictures)


@dataclass(frozen=True)
class PicturedTrial:
    """A trial that counts, with its reply's description of each picture."""

    record: Record
    stimulus: str
    pictures: Sequence[Mapping[str, Any]]
    simulated: bool


def texture_pictures(lab: Path, study: str = STUDY, simulated: bool | None = None) -> tuple[TexturePictures, ...]:
    """Return the textures that a lab's sessions photographed, in the order of their first appearance.

    Of each trial the last attempt counts that was neither repeated nor faulted; sessions of people who withdrew do not
    count. `simulated` selects sessions of twins or real ones; with None real ones are used where there are any. A
    picture of a twin that saved no file is left out. Files are in LAB/pictures, or in the folder of the session's rig;
    each is read once. Raises MaterialError for a file that is missing or has changed, and for a damaged ledger.
    """
    counting, notes = real_or_simulated(list(pictured_trials(lab, study)), simulated, "pictures")
    by_texture: dict[str, list[PicturedTrial]] = {}
    for trial in counting:
        by_texture.setdefault(trial.stimulus, []).append(trial)
    return tuple(_photographed(lab, texture, trials, notes) for texture, trials in by_texture.items())


def pictured_trials(lab: Path, study: str) -> Iterator[PicturedTrial]:
    """Yield a study's trials that count, of people who did not withdraw. Raises MaterialError for a damaged ledger."""
    try:
        for record in sessions_of(lab, study):
            simulated = by_twins(record.header)
            for attempt in record.state.counting:
                for event in record.events_of(attempt):
                    if event.kind == "reply" and PICTURES in event.value:
                        yield PicturedTrial(record, attempt.stimulus, event.value[PICTURES], simulated)
    except LedgerError as error:
        raise MaterialError(str(error)) from None


def _photographed(lab: Path, texture: str, trials: Sequence[PicturedTrial], notes: tuple[str, ...]) -> TexturePictures:
    columns = stimulus_columns(trials[0].record.header).get(texture, {})
    pictures = {picture.sha256: picture for trial in trials for picture in _pictures(lab, trial)}
    without = sum("file" not in picture for trial in trials for picture in trial.pictures)
    if without:
        notes = (*notes, f"{without} simulated pictures were not saved as files: they show nothing here")
    label, category = columns.get("label") or texture, columns.get("class") or ""
    return TexturePictures(texture, label, category, tuple(pictures.values()), trials[0].simulated, notes)


def _pictures(lab: Path, trial: PicturedTrial) -> Iterator[Picture]:
    for picture in trial.pictures:
        if "file" in picture:
            light = f", light {picture['light']}" if "light" in picture else ""
            name = f"{trial.stimulus}{light} ({trial.record.path.stem})"
            yield picture_of(name, str(picture["file"]), str(picture["sha256"]), folders_of(lab, trial.record))


def folders_of(lab: Path, record: Record) -> list[Path]:
    """Return the folders that may have a session's pictures: LAB/pictures, and those of a rig file, relative to it."""
    settings = record.header["rig"].get("settings") or {}
    named = [
        str(setting[PICTURES])
        for setting in settings.values()
        if isinstance(setting, Mapping) and setting.get(PICTURES)
    ]
    stations = sorted(path for path in (lab / "stations").glob("*") if path.is_dir())
    return [lab / PICTURES, *(folder / name for name in named for folder in (*stations, lab))]


def picture_of(name: str, file: str, sha256: str, folders: Sequence[Path]) -> Picture:
    """Return the picture with this file name and SHA-256. Raises MaterialError where there is none in the folders."""
    there = [path for path in dict.fromkeys(folder / file for folder in folders) if path.is_file()]
    for path in there:
        if picture_sha256(path) == sha256:
            return Picture(path, sha256, name)
    if there:
        raise MaterialError(
            f"{name}: {there[0]} is not the recorded picture (its SHA-256 differs); restore it from a copy"
        )
    raise MaterialError(f"{name}: no picture {folders[0] / file}; copy the pictures of the lab there")


def picture_sha256(path: Path) -> str:
    """Return the SHA-256 of a file. Raises MaterialError where it cannot be read."""
    try:
        return file_sha256(path)
    except OSError as error:
        raise MaterialError(f"{path}: cannot be read ({error.strerror}); a file is expected") from None
