"""Finding a study by name or path, and reading it with its stimulus table and files."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.protocols.did_you_mean import nearest
from palpate.protocols.reading import StudyError, study_from
from palpate.protocols.study import LARGEST_STUDY, Study
from palpate.protocols.tables import Row, TableFormat, read_table
from palpate.protocols.wording import some
from palpate.protocols.yaml_text import Document, load

SHIPPED = Path(__file__).resolve().parent
STUDY_FILE = "study.yaml"
STIMULI = TableFormat(
    error=StudyError,
    strict=True,
    encoding=lambda wrong: f"{wrong.path}: byte {wrong.byte} is not UTF-8; save the table as UTF-8",
    quoting=lambda wrong: f"{wrong.path}: line {wrong.line}: {wrong.reason}",
    width=lambda wrong: (
        f"{wrong.path}: line {wrong.line}: {wrong.cells} cells, {len(wrong.header)} columns are expected"
    ),
)


@dataclass(frozen=True)
class StudyFiles:
    """A study and the folder that its files lie in."""

    study: Study
    folder: Path


def names(lab: Path) -> dict[str, Path]:
    """Return every study by name: the lab's own (LAB/studies/NAME/study.yaml) and the shipped ones."""
    paths = {}
    for root in (SHIPPED, lab / "studies"):
        for file in sorted(root.glob(f"*/{STUDY_FILE}")):
            paths[file.parent.name] = file
    return paths


def find(name: str, lab: Path) -> Path:
    """Return the study file that `name` means: a path to it, a folder that holds it, or a study's name.

    Raises StudyError with the nearest known name.
    """
    path = Path(name)
    if path.suffix in {".yaml", ".yml"}:
        if not path.is_file():
            raise StudyError(f"{path}: no such study file")
        return path
    if (path / STUDY_FILE).is_file():
        return path / STUDY_FILE
    if path.exists():
        raise StudyError(f"{path}: a study's name, its folder or its study.yaml is expected")
    known = names(lab)
    if name not in known:
        raise StudyError(f"no study is called {name!r}; {nearest(name, known)}")
    return known[name]


def read_study(path: Path) -> StudyFiles:
    """Read and check a study file, its stimulus table and the files that the table names.

    Raises StudyError, or YamlError, with what is wrong, where, and the nearest valid name.
    """
    return read_with_document(path)[0]


def read_with_document(path: Path) -> tuple[StudyFiles, Document]:
    """Read a study as `read_study` does; return its document, too, which has the line of each of its keys."""
    document = load(_bytes(path), str(path))
    rows = list(_stimuli(document, path))
    study = study_from(document, rows, str(path))
    folder = path.resolve().parent
    if folder.parent.name == "studies" and study.study != folder.name:
        raise StudyError(
            f"{path}: study: found {study.study!r} in a folder named {folder.name!r}; let both be the same"
        )
    return StudyFiles(study, path.parent), document


def _stimuli(document: Document, path: Path) -> Iterator[dict[str, Any]]:
    named = document.data.get("stimuli") if isinstance(document.data, dict) else None
    if isinstance(named, list):
        for place, item in enumerate(named):
            line = document.lines.get(("stimuli", place), 0)
            yield (
                _parameters(item, f"{path}: line {line}: stimuli[{place}]") if isinstance(item, dict) else {"id": item}
            )
    elif isinstance(named, str):
        where = f"{path}: line {document.lines[('stimuli',)]}: stimuli"
        table = _inside(path.parent, named, where)
        if not table.is_file():
            csv_files = sorted(file.name for file in path.parent.glob("*.csv"))
            raise StudyError(f"{where}: no file {named!r} in {path.parent}; {nearest(named, csv_files)}")
        for row in stimulus_rows(table):
            columns = {key: value for key, value in row.cells.items() if key != "id"}
            stimulus = {"id": row["id"], "columns": columns}
            if columns.get("file"):
                stimulus["sha256"] = _file_digest(path.parent, columns["file"], f"{table}: line {row.line}")
            yield stimulus
    elif named is not None:
        raise StudyError(f"{path}: stimuli: found {named!r:.60}, expected the name of a CSV file or a list of ids")


def _parameters(item: dict[str, Any], where: str) -> dict[str, Any]:
    """Return a stimulus that is written as its parameters, {id: f250, frequency_hz: 250}."""
    if "id" not in item:
        raise StudyError(f"{where}: id is missing, as in {{id: f250, frequency_hz: 250}}")
    for name, value in item.items():
        if type(value) not in (str, int, float):
            raise StudyError(f"{where}: {name}: found {value!r:.60}, expected a text or a number")
    return {"id": item["id"], "columns": {str(name): str(value) for name, value in item.items() if name != "id"}}


def stimulus_rows(path: Path) -> Iterator[Row]:
    """Yield the rows of a stimulus table, which has a column `id` and others. Raises StudyError."""
    table = read_table(path, (), STIMULI)
    if table.empty:
        raise StudyError(f"{path}: the file is empty; a header with the column id is expected")
    if "id" not in table.header:
        raise StudyError(f"{path}: line 1: no column 'id'; found {some(table.header) or 'nothing'}")
    if len(set(table.header)) != len(table.header) or "" in table.header:
        raise StudyError(f"{path}: line 1: every column needs its own name; found {some(table.header)}")
    for number, row in enumerate(table.rows(), 1):
        if number > LARGEST_STUDY:
            raise StudyError(f"{path}: more than {LARGEST_STUDY} stimuli")
        yield row


def _file_digest(folder: Path, name: str, where: str) -> str:
    file = _inside(folder, name, where)
    if not file.is_file():
        raise StudyError(f"{where}: the stimulus file {name!r} is not in {folder}")
    return hashlib.sha256(_bytes(file)).hexdigest()


def _inside(folder: Path, name: str, where: str) -> Path:
    if "\0" in name:
        raise StudyError(f"{where}: {name!r} is not a file name")
    file = folder / name
    if not file.resolve().is_relative_to(folder.resolve()):
        raise StudyError(f"{where}: {name!r} leads out of the study's folder; put the file into it")
    return file


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise StudyError(f"{path}: cannot be read ({error.strerror})") from None
