"""Ratings of a lab: means and SDs between raters against numpy's, on 0 to 100; who counts; what is missing."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.sources import DataRequest, read_source
from palpate.modeling.attributes.material import MaterialError, Pair
from palpate.modeling.attributes.reading_ratings import attributes_of, read_ratings
from palpate.studies.participants.people import add as enter
from palpate.studies.participants.registry import open_registry
from palpate.studies.participants.withdrawal import withdraw
from tests.modeling.attributes.photo_labs import rated_by

RECORDED = Path(__file__).parents[2] / "recorded"
PAIRS = (Pair("Rough", "Smooth"), Pair("Flat", "Bumpy"), Pair("Sticky", "Slippery"), Pair("Hard", "Soft"))


def answers(lab, people=None):
    """What each person answered: (people, textures, attributes)."""
    table = read_source(DataRequest("texture_ratings", lab))[0].table
    people = people or sorted(set(table["participant"]))
    cell = {(r.participant, r.stimulus, r.attribute): r.value for r in table.itertuples()}
    return np.array([[[cell[p, t, pair.low] for pair in PAIRS] for t in ("T01", "T02", "T03")] for p in people])


def test_means_and_sds_are_those_of_the_raters(tmp_path):
    rated_by(tmp_path, ("P001", "P002", "P003"))
    ratings = read_ratings(tmp_path)
    values = answers(tmp_path)
    assert ratings.attributes == PAIRS and ratings.simulated
    assert list(ratings.rated) == ["T01", "T02", "T03"] and ratings.incomplete == {}
    for place, texture in enumerate(ratings.rated):
        rated = ratings.rated[texture]
        np.testing.assert_allclose(rated.mean, values[:, place].mean(axis=0), rtol=1e-12)
        np.testing.assert_allclose(rated.sd, values[:, place].std(axis=0, ddof=1), rtol=1e-12)
        assert rated.raters == 3
    assert ratings.columns["T01"]["class"] == "wood"


def test_one_rater_has_no_sd(tmp_path):
    rated_by(tmp_path, ("P001",))
    rated = read_ratings(tmp_path).rated["T02"]
    assert rated.raters == 1 and np.isnan(rated.sd).all() and np.isfinite(rated.mean).all()


def test_a_scale_of_minus_ten_to_ten_becomes_0_to_100(tmp_path):
    rated_by(tmp_path, ("P001", "P002"), scale={"from": -10, "to": 10, "step": 1})
    ratings, values = read_ratings(tmp_path), answers(tmp_path)
    assert values.min() < 0
    np.testing.assert_allclose(ratings.rated["T01"].mean, 5 * (values[:, 0].mean(axis=0) + 10), rtol=1e-12)
    np.testing.assert_allclose(ratings.rated["T01"].sd, 5 * values[:, 0].std(axis=0, ddof=1), rtol=1e-12)


def test_who_withdrew_and_whom_the_plan_leaves_out_do_not_count(tmp_path):
    rated_by(tmp_path, ("P001", "P002", "P003", "P004"))
    registry = open_registry(tmp_path)
    for name in ("P001", "P002", "P003", "P004"):
        enter(registry, name)
    withdraw(registry, "P002", "asked to")
    assert read_ratings(tmp_path).rated["T01"].raters == 3
    plan = tmp_path / "studies" / "texture_ratings" / "analysis.yaml"
    plan.parent.mkdir(parents=True)
    plan.write_text("study: texture_ratings\nexclusions: [{participants: [P003], because: sneezed}]\ntests: []\n")
    ratings = read_ratings(tmp_path)
    assert ratings.rated["T01"].raters == 2
    np.testing.assert_allclose(ratings.rated["T01"].mean, answers(tmp_path, ["P001", "P004"])[:, 0].mean(axis=0))
    assert any("P003" in note and "sneezed" in note for note in ratings.notes)


def test_somebody_who_rated_twice_counts_once(tmp_path):
    rated_by(tmp_path, ("P001", "P002"), order={"design": "williams", "repeats": 2})
    table = read_source(DataRequest("texture_ratings", tmp_path))[0].table
    rated = read_ratings(tmp_path).rated["T01"]
    of_one = table[(table["stimulus"] == "T01") & (table["attribute"] == "Rough")]
    assert len(of_one) == 4 and rated.raters == 2
    assert rated.mean[0] == pytest.approx(of_one.groupby("participant")["value"].mean().mean())


def test_a_lab_without_ratings_has_the_study_s_attributes(tmp_path):
    ratings = read_ratings(tmp_path)
    assert ratings.attributes == PAIRS == attributes_of(None) and ratings.rated == {} and not ratings.simulated
    assert "no session of texture_ratings" in ratings.notes[0]


def test_ratings_that_were_collected_are_read_without_their_files(tmp_path):
    from palpate.studies.collecting.collect import collect, open_database

    paths = rated_by(tmp_path, ("P001", "P002"))
    engine = open_database(f"sqlite:///{tmp_path / 'lab.sqlite'}")
    list(collect(paths, engine))
    engine.dispose()
    here = read_ratings(tmp_path)
    for path in paths:
        path.unlink()
    collected = read_ratings(tmp_path)
    np.testing.assert_array_equal(collected.rated["T03"].mean, here.rated["T03"].mean)
    assert read_ratings(tmp_path, "texture_similarity").rated == {}


def test_what_reading_refuses_is_refused(tmp_path):
    rated_by(tmp_path, ("P001",))
    with pytest.raises(DataRefused, match="no session is left"):
        read_ratings(tmp_path, simulated=False)
    (tmp_path / "sessions" / "texture_photos_P001_s1.sqlite").write_bytes(b"")
    with pytest.raises(ValueError, match="not a ledger"):
        read_ratings(tmp_path, "texture_photos")


def test_a_study_that_rates_nothing_is_refused(tmp_path):
    name = "texture_adjectives_P001_s1.sqlite"
    (tmp_path / "sessions").mkdir()
    shutil.copyfile(RECORDED / "ten" / name, tmp_path / "sessions" / name)
    with pytest.raises(MaterialError, match="texture_adjectives: holds no ratings"):
        read_ratings(tmp_path, "texture_adjectives")
