"""Textures from a folder of pictures and a wide table of ratings, the usual form of other people's data."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.modeling.attributes.feature_cache import FOLDER
from palpate.modeling.attributes.joining import missing_touch_notes
from palpate.modeling.attributes.material import (
    NOT_PHOTOGRAPHED,
    QUICK_LOOK,
    Material,
    MaterialError,
    Pair,
    Rated,
    Texture,
)
from palpate.modeling.attributes.reading_pictures import picture_sha256
from palpate.modeling.attributes.reading_ratings import attributes_of
from palpate.modeling.attributes.resnet_weights import weights_from
from palpate.modeling.attributes.seeing import Album, Picture, PictureRows, picture_rows, sight_with, thin
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.progress import Report, silent
from palpate.protocols.tables import DELIMITERS, Row, TableFormat, read_table
from palpate.protocols.wording import count, some

if TYPE_CHECKING:
    from palpate.modeling.attributes.reading_recordings import Recordings
    from palpate.modeling.attributes.reading_touch import FeltRows


SUFFIXES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp", ".bmp")
SCALE = (0.0, 100.0)
FEW_STEPS = 10.0
"""The greatest rating of scales with 5, 7, 9 or 11 steps: a table without a greater one is hardly on 0 to 100."""
TABLE = "ratings.csv"
"""The table's name, unless another one is given or it is the folder's only one."""
RATINGS = TableFormat(
    error=MaterialError,
    delimiters=DELIMITERS,
    strip=True,
    strict=True,
    counted=any,
    unreadable=lambda wrong: f"{wrong.path}: cannot be read ({wrong.reason}); a CSV table of ratings is expected",
    encoding=lambda wrong: f"{wrong.path}: byte {wrong.byte} is not UTF-8; save the table as UTF-8",
    width=lambda wrong: f"{wrong.where}: {count(wrong.cells, 'cell')} found, {len(wrong.header)} columns are expected",
)
TOP = 100.0
RATERS = "raters"
KNOWN = ("id", "label", "category", "class", RATERS)
SD = ".sd"
BETWEEN = re.compile(r"[\s_/–—-]+(?:to[\s_/–—-]+)?")
"""The separators that may stand between the two words of an attribute."""
MOST_RATERS = 10**9


@dataclass(frozen=True)
class Line:
    """A line of the table, one texture: its place for messages, its cells by column, and its parsed ratings."""

    place: str
    cells: Mapping[str, str]
    rated: Rated | None = None

    @property
    def id(self) -> str:
        """The texture's id."""
        return self.cells["id"]

    @property
    def label(self) -> str:
        """The texture's name on pictures."""
        return self.cells.get("label") or self.id

    @property
    def category(self) -> str:
        """The texture's class, or ""."""
        return self.cells.get("category") or self.cells.get("class") or ""


def read_folder(
    folder: Path, lab: Path | None = None, *, table: Path | None = None, pairs: Sequence[Pair] | None = None,
    scale: tuple[float, float] | None = None, weights: Path | None = None, sha256: str | None = None,
    quick: bool = False, variants: int = 1, workers: int | None = None, simulated: bool = False,
    recordings: Recordings | None = None, sight: bool = True, report: Report = silent,
) -> Material:  # fmt: skip
    """Return the textures of a CSV table, with the pictures of each in a folder: FOLDER/ID/*.jpg or FOLDER/ID_01.jpg.

    The table (FOLDER/ratings.csv, or the folder's only .csv, unless it is given) has the column id and one for each
    attribute, named by both its words, the lower end of the `scale` first (Rough-Smooth; lower case, spaces and
    underscores are allowed, and a column Smooth-Rough is reversed). Without a `scale` it is 0 to 100. Optional columns
    are label, category (or class), raters and SDs (Rough-Smooth.sd). Where cells are separated by semicolons or tabs, a
    comma is a decimal point. `pairs` are the attributes, by default those of texture_ratings. A texture without any
    rating counts as not rated. `recordings` are touch recordings of these textures; with them a texture may have no
    recording or no picture, with a note. Without `sight` pictures are not used. Pictures are the files of `is_picture`.
    Features are cached in LAB/features where a `lab` is given; the other options are those of `reading.read_material`.

    Raises MaterialError, with the line, for an unknown, missing or duplicate column, a duplicate id, a cell that is not
    a number or is off the scale, ratings within 0 to 10 without a `scale`, a texture without a picture, a duplicate
    picture, and where nothing can be used; TextureDataError where none of the textures was recorded.
    """
    table, lines, columns = rated_lines(folder, table, tuple(pairs or attributes_of(None)), scale)
    how = sight_with(weights_from(weights, sha256), variants, quick)
    may_lack = recordings is not None
    albums = [Album(line.id, tuple(_pictures(folder, line, may_lack)) if sight else ()) for line in lines]
    # refuse a file that belongs to two textures by its name (T1_2 and T1), and the same content under two names
    seen_before: dict[str, Picture] = {}
    for picture in (shot for album in albums for shot in album.pictures):
        if (other := seen_before.setdefault(picture.sha256, picture)) is not picture:
            same = "claimed twice" if other.path == picture.path else f"the same picture as {other.path}"
            raise MaterialError(f"{picture.name}: {picture.path} is {same}; each picture shows one texture, once")
    used = [thin(album) if quick else album for album in albums]
    rows = picture_rows(used, how, folder=None if lab is None else lab / FOLDER, workers=workers, report=report)
    felt, aside = _felt(lines, recordings, table, lab, workers, report)
    textures = tuple(
        _texture(line, album, rows[line.id], felt.get(line.id), sight)
        for line, album in zip(lines, albums, strict=True)
    )
    if not any(texture.touch or texture.sight for texture in textures):
        why = f"{textures[0].id}: {textures[0].notes[0]}"
        raise MaterialError(f"{folder}: no recording and no picture of its textures can be used; {why}")
    unused = _unused_pictures(folder, albums) if sight else ()
    file_notes = (*aside, *columns.notes, *unused, f"ratings: {table.name} {picture_sha256(table)}")
    has_pictures = any(album.pictures for album in albums)
    weights_text, quick_note = (how.weights.description, (QUICK_LOOK,) if quick else ()) if has_pictures else ("", ())
    return Material(textures, columns.pairs, weights_text, simulated, (*file_notes, *quick_note))


def rated_lines(
    folder: Path, table: Path | None, pairs: tuple[Pair, ...], scale: tuple[float, float] | None
) -> tuple[Path, list[Line], Columns]:
    """Return the table's path, its lines with their ratings, and its columns. Raises MaterialError as `read_folder`."""
    low, high = scale or SCALE
    if not low < high:
        raise MaterialError(f"a scale from {low:g} to {high:g}: the lower end comes first")
    table = table or table_in(folder)
    opened = read_table(table, (), RATINGS)
    columns = columns_of(f"{table}, line 1", opened.header, pairs)
    decimal = columns.of_numbers if opened.delimiter != "," else frozenset[str]()
    lines = [_line(row, decimal) for row in opened.rows()]
    if not lines:
        raise MaterialError(f"{table}: no texture under the header; one a line is expected")
    seen_before: dict[str, str] = {}
    for line in lines:
        if not line.id:
            raise MaterialError(f"{line.place}: the column 'id' is empty")
        if line.id in seen_before:
            raise MaterialError(f"{line.place}: the texture {line.id!r} stood at {seen_before[line.id]} already")
        if Path(line.id).name != line.id:
            raise MaterialError(f"{line.place}: {line.id!r} cannot name a file; letters, digits, - and _ can")
        seen_before[line.id] = line.place
    lines = [replace(line, rated=rated_in(line.cells, line.place, columns, (low, high))) for line in lines]
    if scale is None:
        # without a scale, ratings of 1 to 7 must not count as the low end of 0 to 100
        values = [float(line.cells[rating.column]) for line in lines if line.rated for rating in columns.ratings]
        if values and max(values) <= FEW_STEPS:
            raise MaterialError(
                f"{table}: all ratings lie from {min(values):g} to {max(values):g}, which ratings on 0 to 100"
                " hardly do: say what the ends of their scale are, such as --scale 1 7 (or --scale 0 100, where they"
                " are those)"
            )
    return table, lines, columns


def table_in(folder: Path) -> Path:
    """Return the path of the table in a folder. Raises MaterialError where there is none, or more than one."""
    if not folder.is_dir():
        raise MaterialError(f"{folder}: no such folder; one with pictures and a table of ratings is expected")
    if (folder / TABLE).is_file():
        return folder / TABLE
    tables = sorted(folder.glob("*.csv"))
    if len(tables) != 1:
        there = ", ".join(path.name for path in tables) or "none"
        raise MaterialError(f"{folder}: a table of ratings called {TABLE} is expected; tables there: {there}")
    return tables[0]


def _felt(
    lines: Sequence[Line],
    recordings: Recordings | None,
    table: Path,
    lab: Path | None,
    workers: int | None,
    report: Report,
) -> tuple[dict[str, FeltRows], tuple[str, ...]]:
    """Return the touch features by texture, and notes on recordings of unknown textures."""
    if recordings is None:
        return {}, ()
    from palpate.modeling.attributes.feeling import felt_rows
    from palpate.modeling.attributes.reading_recordings import recording_files

    filed_recordings, notes = recording_files(
        recordings, {line.id: (line.label, line.category) for line in lines}, table
    )
    rows = felt_rows(filed_recordings, None if lab is None else lab / FOLDER, workers, report)
    return {row.id: row for row in rows}, notes


def _texture(line: Line, album: Album, rows: PictureRows, felt: FeltRows | None, sight: bool) -> Texture:
    """Return a texture from its parts; `sight` is whether pictures are used."""
    texture_notes = [*(felt.notes if felt else ()), *rows.notes, *missing_touch_notes(felt)]
    if not album.pictures and sight:
        texture_notes.append(NOT_PHOTOGRAPHED)
    if not line.rated:
        texture_notes.append("not rated")
    files = frozenset(picture.sha256 for picture in album.pictures) - rows.blank
    return Texture(
        line.id, line.label, line.category, felt.touch if felt else {}, rows.sight, rows.variants, line.rated,
        made_from=files | (felt.made_from if felt else frozenset()), notes=tuple(dict.fromkeys(texture_notes)),
    )  # fmt: skip


def _line(row: Row, decimal: Collection[str]) -> Line:
    """Return a line of the table; in the columns of `decimal` a comma is a decimal point."""
    cells = {name: cell.replace(",", ".") if name in decimal else cell for name, cell in row.cells.items()}
    return Line(row.where, cells)


def _pictures(folder: Path, line: Line, may_lack: bool) -> Iterator[Picture]:
    """Yield the pictures of a texture. Raises MaterialError where there are none, unless `may_lack`."""
    files = sorted(pictures_of(folder, line.id))
    if not files and not may_lack:
        where = f"{folder / line.id}/*.jpg or {folder}/{line.id}_01.jpg"
        raise MaterialError(f"{line.place}: no picture of {line.id!r}; {where} are expected ({', '.join(SUFFIXES)})")
    yield from (Picture(file, picture_sha256(file), f"{line.id} ({file.name})") for file in files)


def pictures_of(folder: Path, name: str) -> Iterator[Path]:
    """Yield the pictures in the texture's own folder, and beside it those with its name, with a number or without."""
    own = re.compile(rf"{re.escape(name)}([_-]\d+)?")
    if (folder / name).is_dir():
        yield from (path for path in (folder / name).iterdir() if is_picture(path))
    if folder.is_dir():
        yield from (path for path in folder.iterdir() if is_picture(path) and own.fullmatch(path.stem))


def is_picture(path: Path) -> bool:
    """Return whether a path is a file with a picture's ending that is not hidden."""
    return path.suffix.lower() in SUFFIXES and path.name[0] != "." and path.is_file()


def _unused_pictures(folder: Path, albums: Sequence[Album]) -> Iterator[str]:
    """Yield a note where pictures belong to no texture of the table."""
    used = {picture.path for album in albums for picture in album.pictures}
    loose = [path for path in sorted(folder.rglob("*")) if is_picture(path) and path not in used]
    if loose:
        yield f"left aside: {count(len(loose), 'picture')} that no texture of the table has ({loose[0].name} first)"


@dataclass(frozen=True)
class Rating:
    """The column of an attribute, and that of its SD ("" for none); `turned`: the column names the high end first."""

    pair: Pair
    column: str
    sd: str
    turned: bool


@dataclass(frozen=True)
class Columns:
    """The attributes that the table rates, in the order of the pairs."""

    ratings: tuple[Rating, ...]

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """The attributes."""
        return tuple(rating.pair for rating in self.ratings)

    @property
    def of_numbers(self) -> frozenset[str]:
        """The columns that hold numbers."""
        return frozenset({*(name for rating in self.ratings for name in (rating.column, rating.sd) if name), RATERS})

    @property
    def notes(self) -> tuple[str, ...]:
        """A note for each column whose values are reversed."""
        return tuple(
            f"column {rating.column!r} turned: 0 is {rating.pair.low}, 100 {rating.pair.high}"
            for rating in self.ratings if rating.turned
        )  # fmt: skip


def columns_of(place: str, header: Sequence[str], pairs: Sequence[Pair]) -> Columns:
    """Return the columns of the attributes. Raises MaterialError for an unknown, missing or duplicate column."""
    for name in header:
        if header.count(name) > 1:
            raise MaterialError(f"{place}: the column {name!r} appears there twice")
    if "id" not in header:
        raise MaterialError(f"{place}: a column 'id' is expected; found {some(header) or 'nothing'}")
    meanings = {name: _meant(name, pairs) for name in header if name not in KNOWN and not name.endswith(SD)}
    _demand_known(place, header, meanings, pairs)
    return Columns(tuple(_rating(place, pair, header, meanings) for pair in pairs))


def _meant(name: str, pairs: Sequence[Pair]) -> tuple[Pair, bool] | None:
    """Return the attribute that a column names, and whether the high end comes first; None for another name."""
    plain = _plain(name)
    for pair in pairs:
        if plain == _plain(f"{pair.low}-{pair.high}"):
            return pair, False
        if plain == _plain(f"{pair.high}-{pair.low}"):
            return pair, True
    return None


def _plain(name: str) -> str:
    """Return a column's name in lower case, with spaces as separators."""
    return BETWEEN.sub(" ", name.strip().lower())


def _demand_known(
    place: str, header: Sequence[str], meanings: Mapping[str, tuple[Pair, bool] | None], pairs: Sequence[Pair]
) -> None:
    """Raise MaterialError for a column with an unknown name, or an SD without its mean."""
    words = {word.lower(): pair for pair in pairs for word in (pair.low, pair.high)}
    for name, meant in meanings.items():
        if meant is None and name.lower() in words:
            text = f"both its words say which end is which: {words[name.lower()].name}"
            raise MaterialError(f"{place}: the column {name!r} names one word of an attribute; {text}")
        if meant is None:
            known = (*KNOWN, *(pair.name for pair in pairs))
            raise MaterialError(f"{place}: no column is called {name!r}; {nearest(name, known)}")
    for name in header:
        if name.endswith(SD) and name.removesuffix(SD) not in meanings:
            raise MaterialError(f"{place}: {name!r} is an SD, and no column {name.removesuffix(SD)!r} is there")


def _rating(place: str, pair: Pair, header: Sequence[str], meanings: Mapping[str, tuple[Pair, bool] | None]) -> Rating:
    """Return the columns of an attribute. Raises MaterialError unless exactly one column has its means."""
    names = [name for name, meant in meanings.items() if meant is not None and meant[0] == pair]
    if len(names) != 1:
        text = f"two columns rate it: {', '.join(names)}" if names else f"found {', '.join(header)}"
        raise MaterialError(f"{place}: one column {pair.name!r} is expected, the mean rating on it; {text}")
    meant, sd = meanings[names[0]], f"{names[0]}{SD}"
    return Rating(pair, names[0], sd if sd in header else "", meant is not None and meant[1])


def rated_in(cells: Mapping[str, str], place: str, columns: Columns, scale: tuple[float, float]) -> Rated | None:
    """Return the ratings in the cells of a line, on 0 to 100; None where all of them are empty.

    A missing SD is NaN, and a missing number of raters 0. Raises MaterialError for an invalid cell.
    """
    if not any(cells[rating.column] for rating in columns.ratings):
        return None
    wide = TOP / (scale[1] - scale[0])
    mean = np.array([_mean(cells, place, rating, scale) for rating in columns.ratings])
    sd = np.array([_sd(cells, place, rating) * wide for rating in columns.ratings])
    return Rated(mean, sd, _raters(cells, place))


def _mean(cells: Mapping[str, str], place: str, rating: Rating, scale: tuple[float, float]) -> float:
    low, high = scale
    value = _number(cells, place, rating.column)
    if not low <= value <= high:
        raise MaterialError(
            f"{place}: {rating.column} is {value:g}, a mean rating on the scale from {low:g} to {high:g} is expected"
        )
    share = TOP * (value - low) / (high - low)
    return TOP - share if rating.turned else share


def _sd(cells: Mapping[str, str], place: str, rating: Rating) -> float:
    if not rating.sd or not cells[rating.sd]:
        return math.nan
    value = _number(cells, place, rating.sd)
    if value < 0:
        raise MaterialError(f"{place}: {rating.sd} is {value:g}, an SD of 0 or more is expected")
    return value


def _raters(cells: Mapping[str, str], place: str) -> int:
    if not cells.get(RATERS):
        return 0
    value = _number(cells, place, RATERS)
    if value != int(value) or not 1 <= value <= MOST_RATERS:
        raise MaterialError(f"{place}: raters is {value:g}, a whole number of people is expected")
    return int(value)


def _number(cells: Mapping[str, str], place: str, column: str) -> float:
    try:
        value = float(cells[column])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise MaterialError(f"{place}: {column} is {cells[column]!r}, a finite number is expected")
    return value
