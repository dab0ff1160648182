"""A data set in a folder: ratings.csv for any program, and dataset.json with the meaning of the data."""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd

from palpate.analysis.ratings.dataset import Crossing, DataRefused, Exclusion, Input, Ratings, Scale
from palpate.protocols.canonical import json_text
from palpate.protocols.files import UNFINISHED, staged_folder, write_bytes, write_text
from palpate.protocols.tables import parse_table

FORMAT = 1
TABLE = "ratings.csv"
DESCRIPTION = "dataset.json"
_READ: dict[str, Callable[[str], object]] = {
    "text": str,
    "number": float,
    "whole": int,
    "truth": lambda text: {"true": True, "false": False}[text],
}


def save_ratings(ratings: Ratings, folder: Path, *, replace: bool = False) -> None:
    """Write the data set to `folder`, all or nothing; reading it gives the same table, bit for bit.

    Raises DataRefused if the folder exists and is not to be replaced, contains anything but a data set, or a text
    column has other values.
    """
    if folder.exists() and not replace:
        raise DataRefused(f"{folder}: exists already; replace it with --replace, or give the data set another name")
    own = {TABLE, DESCRIPTION}
    there = (path.name for path in folder.iterdir()) if folder.exists() else ()
    if others := sorted(name for name in there if name not in own and not name.startswith(UNFINISHED)):
        raise DataRefused(f"{folder}: holds {others[0]}, which no import wrote; move it away, or give another name")
    kinds = {str(column): _kind(ratings.table[column], str(column)) for column in ratings.table.columns}
    # Texts quoted, numbers not; a float by its shortest text that reads back as the same float.
    text = io.StringIO(newline="")
    writer = csv.writer(text, quoting=csv.QUOTE_NONNUMERIC, lineterminator="\n")
    writer.writerow(list(kinds))
    columns = [
        [str(v).lower() for v in ratings.table[c].tolist()] if kind == "truth" else ratings.table[c].tolist()
        for c, kind in kinds.items()
    ]
    writer.writerows(zip(*columns, strict=True))
    table = text.getvalue().encode("utf-8")
    described = json_text(_description(ratings, kinds, table), indent=2)
    with staged_folder(folder) as draft:
        write_bytes(draft / TABLE, table)
        write_text(draft / DESCRIPTION, described)


def load_ratings(folder: Path) -> Ratings:
    """Return the data set that `save_ratings` wrote to `folder`.

    Raises DataRefused if it is no data set, has a newer format, or its table was changed since.
    """
    path = folder / DESCRIPTION
    if not path.is_file():
        raise DataRefused(f"{folder}: no imported data set ({DESCRIPTION} is missing); import the table first")
    try:
        described = json.loads(path.read_text(encoding="utf-8"))
        if described["format"] != FORMAT:
            raise DataRefused(f"{path}: format {described['format']!r}, this version reads {FORMAT}; import again")
        table = _checked_table(folder, described)
        crossings = (
            Crossing(crossing["between"], {name: tuple(levels) for name, levels in crossing["levels"].items()})
            for crossing in described["crossings"]
        )
        return Ratings(
            name=described["name"],
            table=table,
            within=tuple(described["within"]),
            between=tuple(described["between"]),
            attributes=tuple(described["attributes"]),
            scale=None if described["scale"] is None else Scale(**described["scale"]),
            inputs=tuple(Input(**entry) for entry in described["inputs"]),
            exclusions=tuple(Exclusion(**line) for line in described["exclusions"]),
            antonyms=described["antonyms"],
            categories=described["categories"],
            crossings=tuple(crossings),
            repeats=described["repeats"],
            pooled=described["pooled"],
            families=described["families"],
            simulated=described["simulated"],
            interrupted=tuple(described.get("interrupted", ())),
            seeds=tuple(described.get("seeds", ())),
            stimulus_sources=described.get("stimulus_sources", {}),
            source=described["source"],
            licence=described["licence"],
        )
    except (KeyError, TypeError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise DataRefused(f"{path}: not a description of a data set ({error!r}); import the table again") from None


def _kind(column: pd.Series[Any], name: str) -> str:
    if pd.api.types.is_bool_dtype(column):
        return "truth"
    if pd.api.types.is_integer_dtype(column):
        return "whole"
    if pd.api.types.is_float_dtype(column):
        return "number"
    for row, value in enumerate(column.tolist()):
        if not isinstance(value, str):
            raise DataRefused(f"column {name!r}, row {row + 1}: {value!r} is not a text; a text is expected")
    return "text"


def _description(ratings: Ratings, kinds: dict[str, str], table: bytes) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "name": ratings.name,
        "source": ratings.source,
        "licence": ratings.licence,
        "table": {"file": TABLE, "sha256": hashlib.sha256(table).hexdigest(), "rows": len(ratings.table)},
        "columns": kinds,
        "within": ratings.within,
        "between": ratings.between,
        "attributes": ratings.attributes,
        "antonyms": dict(ratings.antonyms),
        "categories": dict(ratings.categories),
        "scale": None if ratings.scale is None else asdict(ratings.scale),
        "crossings": [{"between": dict(c.between), "levels": dict(c.levels)} for c in ratings.crossings],
        "repeats": ratings.repeats,
        "pooled": ratings.pooled,
        "families": ratings.families,
        "simulated": ratings.simulated,
        "interrupted": ratings.interrupted,
        "seeds": ratings.seeds,
        "stimulus_sources": dict(ratings.stimulus_sources),
        "inputs": [asdict(entry) for entry in ratings.inputs],
        "exclusions": [asdict(line) for line in ratings.exclusions],
    }


def _checked_table(folder: Path, described: dict[str, Any]) -> pd.DataFrame:
    path = folder / TABLE
    if not path.is_file():
        raise DataRefused(f"{path}: the table is missing; import it again")
    data = path.read_bytes()
    if hashlib.sha256(data).hexdigest() != described["table"]["sha256"]:
        raise DataRefused(f"{path}: was changed after the import; change the source and import it again")
    table = parse_table(data, path)
    rows, kinds = list(table.records()), described["columns"]
    columns = {name: [_READ[kinds[name]](row[place]) for row in rows] for place, name in enumerate(table.header)}
    types = {"text": "str", "number": "float64", "whole": "int64", "truth": "bool"}
    return pd.DataFrame({name: pd.Series(cells, dtype=types[kinds[name]]) for name, cells in columns.items()})
