"""Sources of a data set: a lab's session files, a collected database, or an imported table."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from sqlalchemy import Engine, text

from palpate.analysis.ratings.dataset import DataRefused, Ratings
from palpate.analysis.ratings.design import without_incomplete
from palpate.analysis.ratings.rating_files import load_ratings
from palpate.analysis.ratings.reading import read_ratings
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.files import UNFINISHED
from palpate.protocols.progress import Progress
from palpate.studies.collecting.collect import fill, open_database, scratch_database
from palpate.studies.participants.registry import withdrawn
from palpate.studies.sessions.session_files import ledgers_in

Missing = Literal["refuse", "listwise"]
IMPORTED = "imported"


@dataclass(frozen=True)
class DataRequest:
    """A request for a study or an imported data set by name, its source, and which of its sessions.

    `missing` decides about participants who lack a cell: the tests that need it are refused, or the participants are
    left out ("listwise").
    """

    name: str
    lab: Path
    url: str | None = None
    digest: str | None = None
    include_incomplete: bool = False
    simulated: bool | None = None
    missing: Missing = "refuse"


def read_source(request: DataRequest, progress: Progress = lambda *_: None) -> tuple[Ratings, str]:
    """Return the requested ratings and their title ("" without one).

    Session files are first collected into a database in memory, so that all sources are read in the same way. Raises
    DataRefused if there is no such data set, and the errors of reading it.
    """
    ratings, title = _read(request, progress)
    return (without_incomplete(ratings) if request.missing == "listwise" else ratings), title


def _read(request: DataRequest, progress: Progress) -> tuple[Ratings, str]:
    if request.url is not None:
        return _from_database(open_database(request.url, lab=request.lab), request)
    paths = ledgers_in(request.lab, request.name)
    folder = request.lab / IMPORTED / request.name
    if paths and folder.exists():
        raise both_of(request.name, folder)
    if paths:
        engine = gathered(paths, request.lab, progress)
        try:
            return _from_database(engine, request)
        finally:
            engine.dispose()
    if not folder.exists():
        raise nothing_of(request.name, request.lab)
    return load_ratings(folder), ""


def gathered(paths: list[Path], lab: Path, progress: Progress = lambda *_: None) -> Engine:
    """Return a temporary database of the session files' answers; people who withdrew from the lab are marked."""
    engine = scratch_database()
    progress(0, len(paths), "reading")
    with closing(fill(engine, paths, withdrawn(lab), with_events=False)) as read:
        for done, _ in enumerate(read, start=1):
            progress(done, len(paths), "reading")
    return engine


def _from_database(engine: Engine, request: DataRequest) -> tuple[Ratings, str]:
    ratings = read_ratings(
        engine,
        request.name,
        digest=request.digest,
        include_incomplete=request.include_incomplete,
        simulated=request.simulated,
        withdrawn=withdrawn(request.lab),
    )
    # The title stands in the study's definition, whose digest is the first input of the ratings.
    query = text("SELECT title FROM studies WHERE study_digest = :digest")
    with engine.connect() as connection:
        title = connection.execute(query, {"digest": ratings.inputs[0].sha256}).scalar_one_or_none()
    return ratings, str(title) if title else ""


def both_of(name: str, folder: Path) -> DataRefused:
    """Return the error for a lab with sessions of a study and an imported data set of the same name."""
    return DataRefused(f"{name!r} is both a study with sessions and imported in {folder}; rename the import")


def nothing_of(name: str, lab: Path) -> DataRefused:
    """Return the error for a lab with neither sessions of a study nor an imported data set of that name."""
    imported = lab / IMPORTED
    folders = [path for path in imported.iterdir() if path.is_dir()] if imported.is_dir() else []
    known = sorted(path.name for path in folders if not path.name.startswith(UNFINISHED))
    known += sorted({path.name.rsplit("_", 2)[0] for path in ledgers_in(lab)})
    where = f"{lab}: no sessions of a study {name!r} and no imported data set of that name"
    if not known:
        return DataRefused(
            f"{where}; the lab holds no data yet: run a session, import a table, or name another lab with --lab"
        )
    return DataRefused(f"{where}; {nearest(name, known)}")
