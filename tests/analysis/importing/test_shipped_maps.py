"""The maps that come with Palpate read the tables that come with it."""

from __future__ import annotations

from pathlib import Path

import pytest

from palpate.analysis.importing.map_file import MapRefused, read_map
from palpate.analysis.importing.tables import import_table
from palpate.analysis.ratings.describe import describe
from palpate.analysis.ratings.design import check_ratings

MAPS = Path(__file__).parents[3] / "analysis" / "importing" / "maps"


@pytest.mark.parametrize("path", sorted(MAPS.glob("*.yaml")), ids=lambda path: path.stem)
def test_every_map_is_valid_and_says_whose_data_it_reads(path: Path) -> None:
    column_map = read_map(path)
    assert column_map.name == path.stem
    assert column_map.source and column_map.licence


def test_the_reasoning_data_are_complete_and_have_their_known_means() -> None:
    ratings = import_table(MAPS / "sk2011.yaml")
    assert check_ratings(ratings).ok
    assert (ratings.within, ratings.between) == (("inference", "plausibility"), ("instruction",))
    assert (len(ratings.participants), len(ratings.table)) == (40, 320)
    means = describe(ratings, ["attribute"])
    # Sum of the column y by awk over the file: 25325.
    assert means["mean"].tolist() == [25325 / 320]


@pytest.mark.parametrize(
    ("levels", "message"),
    [
        ("[{a: b}]", "line 3: columns.within.size: level 1 of the list is {'a': 'b'}; texts are expected"),
        ("[[a]]", "level 1 of the list is ['a']; texts are expected"),
        ("[a, a, b]", "the level 'a' appears twice"),
    ],
)
def test_levels_that_are_no_texts_or_repeated_are_refused_by_name(tmp_path, levels, message):
    path = tmp_path / "map.yaml"
    within = f"size: {{column: size, levels: {levels}}}"
    path.write_text(
        f"name: m\nfiles: t.csv\ncolumns: {{participant: who, value: v, attribute_is: Soft, within: {{{within}}}}}\n"
    )
    with pytest.raises(MapRefused) as refused:
        read_map(path)
    assert message in str(refused.value)
