"""Real PsychoPy recordings against the summary that their authors made of them (data/psychopy/NOTICE)."""

from __future__ import annotations

import csv
import shutil
import statistics
from pathlib import Path

import pytest

from palpate.analysis.importing.dialects import TableRefused
from palpate.analysis.importing.tables import import_table
from palpate.analysis.ratings.dataset import Exclusion, Ratings
from palpate.analysis.ratings.design import check_ratings

DATA = Path(__file__).parents[1] / "data" / "psychopy"
MAP = Path(__file__).parents[3] / "analysis" / "importing" / "maps" / "psychopy_hussey2018.yaml"


@pytest.fixture(scope="module")
def ratings() -> Ratings:
    return import_table(MAP, DATA)


@pytest.fixture(scope="module")
def authors() -> dict[str, dict[str, str]]:
    with (DATA / "processed data.csv").open(newline="") as file:
        return {row["participant"]: row for row in csv.DictReader(file)}


@pytest.mark.parametrize(
    ("column", "pictures", "phase"),
    [
        ("ratings_pre", "chinese_symbols", "pre"),
        ("ratings_post", "chinese_symbols", "post"),
        ("valenced_stimuli_ratings", "flowers_or_insects", "pre"),
    ],
)
def test_the_means_are_those_of_the_authors(
    ratings: Ratings, authors: dict[str, dict[str, str]], column: str, pictures: str, phase: str
) -> None:
    table = ratings.table
    chosen = table[(table["pictures"] == pictures) & (table["phase"] == phase)]
    computed = {person: statistics.mean(values) for person, values in chosen.groupby("participant")["value"]}
    assert computed == {person: float(authors[person][column]) for person in ("1", "3", "12")}


def test_the_condition_is_that_of_the_authors(ratings: Ratings, authors: dict[str, dict[str, str]]) -> None:
    conditions = dict(zip(ratings.table["participant"], ratings.table["condition"], strict=True))
    assert conditions == {person: authors[person]["condition"] for person in ("1", "3", "12")}


def test_nothing_is_left_out_without_a_line(ratings: Ratings) -> None:
    assert ratings.exclusions == (
        Exclusion("rows", "3 files", "likertPre.thisN and likertPost.thisN are empty", 600),
        Exclusion("averaged", "3 participants", "20 ratings of each averaged into 4 cells", 60, 12),
    )
    assert [source.note.split(", ")[1] for source in ratings.inputs[1:]] == ["mac-roman", "mac-roman", "utf-8-sig"]
    assert check_ratings(ratings).ok


def test_without_averaging_every_picture_is_a_row(tmp_path: Path) -> None:
    text = MAP.read_text(encoding="utf-8").replace("duplicates: mean", "")
    text = text.replace("  attribute_is:", "  stimulus: exemplar\n  attribute_is:")
    (tmp_path / "map.yaml").write_text(text, encoding="utf-8")
    ratings = import_table(tmp_path / "map.yaml", DATA)
    assert len(ratings.table) == 3 * 20
    assert check_ratings(ratings).ok
    (tmp_path / "map.yaml").write_text(text.replace("  stimulus: exemplar\n", ""), encoding="utf-8")
    with pytest.raises(TableRefused, match="12 cells hold several ratings"):
        import_table(tmp_path / "map.yaml", DATA)


def test_one_participant_in_two_files_is_refused(tmp_path: Path) -> None:
    for name in ("1_IAT_and_likerts.csv", "3_IAT_and_likerts.csv"):
        shutil.copy(DATA / name, tmp_path / name)
    shutil.copy(DATA / "1_IAT_and_likerts.csv", tmp_path / "2_IAT_and_likerts.csv")
    with pytest.raises(TableRefused, match=r"2_IAT_and_likerts.csv: line 2: participant '1' stands in 1_IAT"):
        import_table(MAP, tmp_path)


def test_an_aborted_recording_is_noticed(tmp_path: Path) -> None:
    whole = (DATA / "12_IAT_and_likerts.csv").read_bytes()
    (tmp_path / "12_IAT_and_likerts.csv").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(TableRefused, match=r"line \d+ has|is a quote not closed"):
        import_table(MAP, tmp_path)
    with (DATA / "12_IAT_and_likerts.csv").open(newline="", encoding="utf-8") as file:
        records = list(csv.reader(file))[:100]
    with (tmp_path / "12_IAT_and_likerts.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(records)
    (tmp_path / "1_IAT_and_likerts.csv").write_bytes((DATA / "1_IAT_and_likerts.csv").read_bytes())
    missing = check_ratings(import_table(MAP, tmp_path)).of("missing")
    assert missing is not None
    assert {(place.participant, place.cell["phase"]) for place in missing.listed} == {("12", "post")}
    (tmp_path / "13_IAT_and_likerts.csv").write_bytes(b"")
    with pytest.raises(TableRefused, match=r"13_IAT_and_likerts.csv: the file is empty"):
        import_table(MAP, tmp_path)


def test_a_condition_that_no_row_tells_is_refused(tmp_path: Path) -> None:
    text = MAP.read_text(encoding="utf-8").replace("insects: insects", "insects: beetles")
    (tmp_path / "map.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(TableRefused, match="participant '3' has no 'condition'"):
        import_table(tmp_path / "map.yaml", DATA)
    (tmp_path / "map.yaml").write_text(text.replace("beetles", "block"), encoding="utf-8")
    with pytest.raises(TableRefused, match="participant '1' is 'insects' in 'condition', but 'flowers'"):
        import_table(tmp_path / "map.yaml", DATA)
