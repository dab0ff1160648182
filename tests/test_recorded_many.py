"""CI regenerates eight studies from their recorded sessions: statistics to 1e-9, tables to the letter."""

import json
import shutil
from functools import cache

import pytest

from palpate.analysis.ratings.sources import DataRequest
from palpate.analysis.regenerating.comparison import differences
from palpate.analysis.regenerating.outputs import file_texts
from palpate.analysis.regenerating.regeneration import regenerate
from palpate.studies.catalogue import SHIPPED, read_study
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import replay
from tests.recorded import make_many
from tests.recorded.make_many import EXPECTED, MANY, PEOPLE

texts_of = cache(make_many.texts_of)
LEDGERS = sorted((MANY / "sessions").glob("*.sqlite"))


def test_all_sessions_are_there_and_none_is_large():
    assert len(LEDGERS) == sum(PEOPLE.values())
    assert sum(path.stat().st_size for path in LEDGERS) < 4_500_000


@pytest.mark.parametrize("path", LEDGERS, ids=lambda path: path.stem)
def test_a_recorded_session_repeats_event_by_event(path):
    result = replay(path)
    assert result.complete and result.events == len(read(path).events)


@pytest.mark.parametrize("name", PEOPLE)
def test_what_is_regenerated_is_what_was_committed(name):
    assert [difference.text() for difference in differences(texts_of(name), EXPECTED / name)] == []


def test_statistics_say_what_the_ends_of_an_outcome_mean_whatever_it_is_called():
    ends = {"low": "Completely different", "high": "Completely the same", "from": 0, "to": 100}
    outcomes = json.loads(texts_of("texture_similarity")["statistics.json"])["outcomes"]
    assert outcomes == [{"name": "Completely different", **ends}], "recorded before it was called Similarity"
    [declared] = read_study(SHIPPED / "texture_similarity" / "study.yaml").study.attributes
    assert (declared.name, declared.low, declared.high) == ("Similarity", ends["low"], ends["high"])


def test_the_order_of_session_files_and_where_they_lie_change_nothing(tmp_path):
    """Ledgers are read in the order of their names; here another one comes first, from another folder."""
    lab = tmp_path / "another lab"
    (lab / "sessions").mkdir(parents=True)
    for path in LEDGERS:
        if path.name.startswith("texture_similarity"):
            shutil.copy(path, lab / "sessions")
    assert file_texts(regenerate(DataRequest("texture_similarity", lab)), {}) == texts_of("texture_similarity")
