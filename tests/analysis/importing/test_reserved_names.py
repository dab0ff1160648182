"""A factor may not be named like a column that means something else: it would be overwritten without a word."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from palpate.analysis.first_look.analysis import analyse_ratings
from palpate.analysis.first_look.page import report_html
from palpate.analysis.importing.map_file import MapRefused, read_map
from palpate.analysis.ratings.dataset import RESERVED, DataRefused
from palpate.analysis.ratings.describe import describe
from palpate.analysis.ratings.reading import read_ratings
from tests.analysis.ratings_for_tests import add_session, add_study, database, definition, small_ratings
from tests.analysis.tables_for_tests import COLUMNS, imported, write_map

NAMED = (
    "n", "mean", "sd", "kind", "sd_reason", "ratings", "ratings_min", "ratings_max", "category", "session", "revised",
    "response_time_s", "stimulus", "participant", "attribute", "value", "trial", "block", "study",
)  # fmt: skip
CLEAN = "who,item,car,score,sex\nP1,soft,K3,1,f\nP1,soft,K8,2,f\nP2,soft,K3,3,m\nP2,soft,K8,5,m\n"


def roles(name: str) -> list[dict[str, Any]]:
    """Maps that give the name to each kind of column that a map may name."""
    return [
        {"columns": {**COLUMNS, "within": {name: "car"}}},
        {"columns": {**COLUMNS, "between": {name: "sex"}}},
        {"columns": COLUMNS, "loop": {name: {"a": "car", "b": "sex"}}},
        {"columns": {**COLUMNS, "keep": [name]}},
    ]


@pytest.mark.parametrize("name", NAMED)
def test_a_map_that_takes_a_name_with_a_meaning_is_refused_by_name(tmp_path: Path, name: str) -> None:
    for keys in roles(name):
        with pytest.raises(MapRefused, match=f"the name {name!r} has a special meaning"):
            read_map(write_map(tmp_path, **keys))


@pytest.mark.parametrize("name", NAMED)
def test_a_data_set_with_such_a_factor_is_refused_by_name(name: str) -> None:
    rows = [("P1", "Soft", "x", 1.0), ("P2", "Soft", "y", 2.0)]
    table = small_ratings(rows).table.assign(**({} if name in ("participant", "attribute", "value") else {name: "a"}))
    fields: list[dict[str, Any]] = [{"between": (name,)}]
    if name != "stimulus":  # the factor of a study whose stimuli nothing crosses
        fields.append({"within": (name,)})
    for arguments in fields:
        with pytest.raises(DataRefused, match=f"{name!r}|named twice"):
            small_ratings([], table=table, attributes=("Soft",), **arguments)


def test_a_group_is_what_a_group_is_called(tmp_path: Path) -> None:
    ratings = imported(tmp_path, CLEAN, columns={**COLUMNS, "between": {"group": "sex"}})
    assert ratings.between == ("group",)
    assert "group f: 1" in report_html(analyse_ratings(ratings))
    with pytest.raises(MapRefused, match="within: the name 'group' has a special meaning"):
        read_map(write_map(tmp_path, columns={**COLUMNS, "within": {"group": "car"}}))


def test_every_column_that_means_are_given_in_is_reserved() -> None:
    rows = [(p, a, level, 1.0) for p in ("P1", "P2") for a in ("Soft", "Warm") for level in ("x", "y")]
    ratings = small_ratings(rows)
    tables = [describe(ratings, ("attribute", "level"), kind=kind) for kind in ("over ratings", "over participants")]
    columns = {str(name) for table in tables for name in table.columns}
    assert columns - {"level"} <= RESERVED


@pytest.mark.parametrize("name", ["n", "mean", "kind", "category", "group"])
def test_a_studys_stimulus_column_is_renamed_instead(name: str) -> None:
    stimuli = [{"id": f"s{i}", "columns": {name: f"a{i % 2}", "b": f"b{i // 2}"}} for i in range(4)]
    engine = database()
    add_study(engine, "d1", definition(stimuli=stimuli, groups={}))
    for person in ("P1", "P2", "P3"):
        add_session(engine, person, None, [f"s{i}" for i in range(4)])
    ratings = read_ratings(engine, "doors")
    assert ratings.within == (f"stimulus.{name}", "b")
    described = describe(ratings, ("attribute", *ratings.within), kind="over participants")
    assert described[f"stimulus.{name}"].tolist()[:4] == ["a0", "a0", "a1", "a1"]
    assert described["n"].tolist() == [3] * 8
