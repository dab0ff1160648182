"""Pictures that sessions of texture_photos took: which count, where their files lie, and that none has changed."""

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
    """The pictures of one texture that count, in the order of sessions, trials and lights."""

    id: str
    label: str
    category: str
    pictures: tuple[Picture, ...]
    simulated: bool
    notes: tuple[str, ...] = ()

    @property
    def album(self) -> Album:
        """As pictures are looked at."""
        return Album(self.id, self.pictures)


@dataclass(frozen=True)
class PicturedTrial:
    """A trial that counts: what its reply says of each picture."""

    record: Record
    stimulus: str
    pictures: Sequence[Mapping[str, Any]]
    simulated: bool


def texture_pictures(lab: Path, study: str = STUDY, simulated: bool | None = None) -> tuple[TexturePictures, ...]:
    """Return the textures whose pictures a lab's sessions took, in the order of their first appearance.

    Of each trial the last attempt counts that was neither repeated nor faulted; sessions of people who withdrew do not
    count. `simulated` takes only the sessions of twins, or only real ones; None takes real ones where there are any. A
    twin that kept no file gave no picture. Files lie in LAB/pictures, or where the session's rig put them; each is
    read here once. Raises MaterialError on one that is missing or has changed, and on a damaged ledger.
    """
    counting, notes = real_or_simulated(list(pictured_trials(lab, study)), simulated, "pictures")
    by_texture: dict[str, list[PicturedTrial]] = {}
    for trial in counting:
        by_texture.setdefault(trial.stimulus, []).append(trial)
    return tuple(_photographed(lab, texture, trials, notes) for texture, trials in by_texture.items())


def pictured_trials(lab: Path, study: str) -> Iterator[PicturedTrial]:
    """Yield every trial of a study that counts, of people who did not withdraw; a damaged ledger: MaterialError."""
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
    """Return where the pictures of a session may lie: what a rig file names lies beside it, in LAB/stations/HOST."""
    settings = record.header["rig"].get("settings") or {}
    named = [
        str(setting[PICTURES])
        for setting in settings.values()
        if isinstance(setting, Mapping) and setting.get(PICTURES)
    ]
    stations = sorted(path for path in (lab / "stations").glob("*") if path.is_dir())
    return [lab / PICTURES, *(folder / name for name in named for folder in (*stations, lab))]


def picture_of(name: str, file: str, sha256: str, folders: Sequence[Path]) -> Picture:
    """Return the file that has this SHA-256. Raises MaterialError where none has."""
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
