"""What was felt of textures as others recorded it: tables, the Haptic Texture Toolkit's files, the Cluster data set.

Their textures are known by the files' names (oak.csv, oak.xml; cluster_0), and go with a table's ids.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

from analysis.features.tactile import touch_features
from modeling.attributes.reading_touch import FeltRows, felt_of
from modeling.attributes.touching import filtering
from modeling.textures import reading_cluster, reading_hatt, reading_tables
from modeling.textures.preparing import Filtering, Touched
from modeling.textures.reading_tables import Held
from modeling.textures.recording import TextureDataError
from studies.content import file_sha256


@dataclass(frozen=True)
class TableFile:
    """One texture's table, and what it does not say."""

    path: Path
    held: Held

    @property
    def files(self) -> dict[str, Path]:
        """By what they hold."""
        return {"table": self.path}


Source: TypeAlias = TableFile | reading_hatt.Source | reading_cluster.Slide


@dataclass(frozen=True)
class Filed:
    """One texture's recordings in files, and how they are to be read: no sample in it, so that it can be a job."""

    id: str
    label: str
    category: str
    sources: tuple[Source, ...]
    way: Filtering

    @cached_property
    def made_from(self) -> frozenset[str]:
        """SHA-256 of the files."""
        return frozenset(self._digests())

    @property
    def key(self) -> str:
        """SHA-256 of all that decides what is felt, but for the program."""
        found = hashlib.sha256(f"{self.way}".encode())
        for source in self.sources:
            told = source.held if isinstance(source, TableFile) else ""
            found.update(f"{type(source).__name__} {told}".encode())
        for digest in self._digests():
            found.update(digest.encode())
        return found.hexdigest()

    def _digests(self) -> list[str]:
        return [file_sha256(file) for each in self.sources for file in dict.fromkeys(each.files.values())]

    def rows(self) -> FeltRows:
        """Its features. Raises TextureDataError on what cannot be read, and as `touch_of` does."""
        found = felt_of(self.id, self.label, self.category, map(_touched, self.sources), self.way)
        rows = touch_features(found.touch)
        return FeltRows(found.id, found.label, found.category, rows, found.made_from, found.notes)


@dataclass(frozen=True)
class Recordings:
    """Where recordings lie: tables, or the Toolkit's, or the Cluster data set.

    `held` is what tables do not say. `trim_s` is left out at both ends of each recording; None: what thesis 3.4.1 does,
    but nothing of a slide of the Cluster data set, which a machine began and ended.
    """

    tables: tuple[Path, ...] = ()
    hatt: Path | None = None
    cluster: Path | None = None
    held: Held = field(default_factory=Held)
    trim_s: float | None = None

    @property
    def way(self) -> Filtering:
        """How they are filtered. Raises TextureDataError for a time that is none."""
        if self.trim_s is not None:
            return filtering(self.trim_s)
        return filtering(0.0) if self.cluster is not None else filtering()

    def sources(self) -> dict[str, tuple[Source, ...]]:
        """Each texture's files, by its name; none is read. Raises TextureDataError where there is none."""
        if self.hatt is not None:
            return {each.name: (each,) for each in reading_hatt.sources(self.hatt)}
        if self.cluster is not None:
            return {name: tuple(every) for name, every in reading_cluster.slides(self.cluster).items()}
        return {file.stem: (TableFile(file, self.held),) for file in reading_tables.files_in(self.tables)}


def filed(
    recordings: Recordings, named: Mapping[str, tuple[str, str]]
) -> tuple[tuple[Filed, ...], tuple[str, ...]]:  # fmt: skip
    """The textures that are `named` (label and category by id) and were recorded; and notes on the others' recordings.

    Raises TextureDataError where there is no recording, or none of a texture that is named.
    """
    sources = recordings.sources()
    found = tuple(Filed(name, *told, sources[name], recordings.way) for name, told in named.items() if name in sources)
    if not found:
        raise TextureDataError(
            f"no recording is of a texture in the table: recordings of {_some(list(sources))}, and the ids"
            f" {_some(list(named))}; a texture has the name of its recording"
        )
    loose = [name for name in sources if name not in named]
    if not loose:
        return found, ()
    return found, (f"{len(loose)} recorded textures are not in the table ({loose[0]} first): left aside",)


def _some(names: Sequence[str], most: int = 4) -> str:
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def _touched(source: Source) -> Touched:
    if isinstance(source, TableFile):
        return reading_tables.touched(source.path, source.held)
    if isinstance(source, reading_cluster.Slide):
        return reading_cluster.touched(source)
    return reading_hatt.touched(source)
