"""Touch recordings of other sources: tables, the Haptic Texture Toolkit's files, the Cluster data set.

Textures have the names of the files (oak.csv, oak.xml; cluster_0), which match a table's ids.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from palpate.modeling.attributes.reading_touch import FeltRows, felt_of, filtering, rows_from
from palpate.modeling.textures import reading_cluster, reading_hatt, reading_tables
from palpate.modeling.textures.preparing import Filtering, Touched
from palpate.modeling.textures.reading_cluster import Slide
from palpate.modeling.textures.reading_tables import Held
from palpate.modeling.textures.recording import TextureDataError, TooShort
from palpate.protocols.files import file_sha256
from palpate.protocols.wording import some


@dataclass(frozen=True)
class TableFile:
    """One texture's table, and the constants for its missing columns."""

    path: Path
    held: Held

    @property
    def files(self) -> dict[str, Path]:
        """The files by their content."""
        return {"table": self.path}

    @property
    def description(self) -> str:
        """The constants as text, for a digest."""
        return f"{self.held}"


Source: TypeAlias = TableFile | reading_hatt.Source | Slide


@dataclass(frozen=True)
class RecordingFiles:
    """One texture's files of recordings and their filtering; without samples, so that it can be sent to a job."""

    id: str
    label: str
    category: str
    sources: tuple[Source, ...]
    way: Filtering

    @property
    def made_from(self) -> frozenset[str]:
        """The SHA-256 of the files."""
        return frozenset(digest for source in self.sources for digest in _digests(source))

    @property
    def key(self) -> str:
        """The SHA-256 of all that the features depend on, except the code; a slide's name has its commanded values."""
        state = hashlib.sha256(f"{self.way}".encode())
        for source in self.sources:
            name = (
                source.description
                if isinstance(source, TableFile)
                else source.stem
                if isinstance(source, Slide)
                else ""
            )
            state.update("\0".join((type(source).__name__, name, *_digests(source))).encode())
        return state.hexdigest()

    def rows(self) -> FeltRows:
        """Return the texture's features. Raises TextureDataError for an unreadable file, and as `touch_of` does."""
        try:
            return rows_from(felt_of(self.id, self.label, self.category, map(_touched, self.sources), self.way))
        except TooShort as error:
            advice = ", or trim less (--trim-s)" if self.way.trim_s else ""
            raise TooShort(f"{error}{advice}") from None


@dataclass(frozen=True)
class Recordings:
    """The paths of recordings: tables, or the Haptic Texture Toolkit, or the Cluster data set.

    `held` are the constants for columns that tables do not have. `trim_s` seconds are left out at both ends of each
    recording; None for those of thesis 3.4.1, or for 0 with the Cluster data set, whose slides a machine ran.
    """

    tables: tuple[Path, ...] = ()
    hatt: Path | None = None
    cluster: Path | None = None
    held: Held | None = None
    trim_s: float | None = None

    @property
    def way(self) -> Filtering:
        """The filtering of the recordings. Raises TextureDataError for an invalid `trim_s`."""
        if self.trim_s is not None:
            return filtering(self.trim_s)
        return filtering(0.0) if self.cluster is not None else filtering()

    def names(self) -> tuple[str, ...]:
        """Return the names of all recorded textures. Raises TextureDataError where there is none."""
        if self.hatt is not None:
            return tuple(reading_hatt.names_in(self.hatt))
        if self.cluster is not None:
            return tuple(reading_cluster.names_in(self.cluster))
        return tuple(file.stem for file in reading_tables.files_in(self.tables))

    def sources(self, names: Sequence[str]) -> dict[str, tuple[Source, ...]]:
        """Return the files of each of these textures, unread. Raises TextureDataError for a missing file."""
        if self.hatt is not None:
            return {source.name: (source,) for source in reading_hatt.sources(self.hatt, names)}
        if self.cluster is not None:
            return {name: tuple(every) for name, every in reading_cluster.slides(self.cluster, names).items()}
        files = reading_tables.files_in(self.tables)
        return {file.stem: (TableFile(file, self.held or Held()),) for file in files if file.stem in names}


def recording_files(
    recordings: Recordings, named: Mapping[str, tuple[str, str]], table: Path | None = None
) -> tuple[tuple[RecordingFiles, ...], tuple[str, ...]]:  # fmt: skip
    """Return the recorded textures of `named` (label and category by id), and notes on recordings of others.

    `table` is the table of ratings, which may lie among tables of recordings. Raises TextureDataError where there is no
    recording of a named texture, or a file is missing.
    """
    there = [name for name in recordings.names() if not (recordings.tables and table and name == table.stem)]
    recorded = [name for name in named if name in there]
    if not recorded:
        raise TextureDataError(
            f"no recording is of a texture in the table: recordings of {some(there)}, and the ids"
            f" {some(named)}; a texture has the name of its recording"
        )
    sources = recordings.sources(recorded)
    files = tuple(RecordingFiles(name, *named[name], sources[name], recordings.way) for name in recorded)
    others = [name for name in there if name not in named]
    return files, (f"recorded, but not in the table: {some(others)}",) if others else ()


def _digests(source: Source) -> list[str]:
    """Return the digests of a source's files; an unreadable file has the error instead, and is refused when read."""
    result = []
    for file in dict.fromkeys(source.files.values()):
        try:
            result.append(file_sha256(file))
        except OSError as error:
            result.append(f"{file}: {error.strerror}")
    return result


def _touched(source: Source) -> Touched:
    """Return the signals of a source. Raises TextureDataError for an unreadable file."""
    if isinstance(source, TableFile):
        return reading_tables.touched(source.path, source.held)
    if isinstance(source, Slide):
        return reading_cluster.touched(source)
    return reading_hatt.touched(source)
