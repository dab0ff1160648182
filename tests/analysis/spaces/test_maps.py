"""Maps are R's or better, unique, and say what is wrong with them."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.distance import pdist, squareform

from palpate.analysis.spaces.classical import classical_mds
from palpate.analysis.spaces.dissimilarities import (
    dissimilarities_of,
    distances,
    pair_dissimilarities,
    profile_distances,
)
from palpate.analysis.spaces.nonmetric import nonmetric_mds, stress_reference, stress_scree
from palpate.analysis.spaces.procrustes import procrustes
from palpate.analysis.spaces.profiles import gather_profiles
from palpate.analysis.spaces.replicated import confidence_ellipses
from palpate.analysis.spaces.stress import disparities, order_of
from palpate.analysis.statistics.refusals import BadOption, BadValue, IncompleteCells, StatisticsError, TooFew
from tests.analysis.spaces.spaces_for_tests import given_set, in_r, ratings

SETS = ("eurodist", "ekman", "attitude", "made")
NAMES = ("value", "stimulus", "attribute", "participant")


@pytest.mark.parametrize("name", SETS)
def test_the_classical_map_is_that_of_r(name: str) -> None:
    result, expected = classical_mds(given_set(name)), in_r()["cmdscale"][name]
    assert result.eigenvalues == pytest.approx(expected["eig"], abs=1e-12 * expected["eig"][0])
    assert [result.fit_absolute, result.fit_positive] == pytest.approx(expected["GOF"], rel=1e-12)
    points = pd.DataFrame(expected["points"], index=in_r()["sets"][name]["labels"])
    assert procrustes(points, result.points, scale=False).r == pytest.approx(1, abs=1e-12)
    assert pdist(result.points) == pytest.approx(pdist(points.loc[list(result.points.index)]), rel=1e-9)


@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("dimensions", [1, 2, 3])
def test_stress_is_never_above_that_of_r(name: str, dimensions: int) -> None:
    expected = in_r()["stress"][name][dimensions - 1]  # the best of 62 runs of isoMDS and monoMDS
    result = nonmetric_mds(given_set(name), dimensions, starts=8)
    assert result.stress <= min(expected["isoMDS"], expected["monoMDS_primary"]) + 1e-6


@pytest.mark.parametrize("name", SETS)
def test_tied_pairs_may_be_kept_tied(name: str) -> None:
    result = nonmetric_mds(given_set(name), 2, "secondary", starts=8)
    assert result.stress <= in_r()["stress"][name][1]["monoMDS_secondary"] + 1e-6
    tied = result.shepard.groupby("dissimilarity")["disparity"].nunique()
    assert (tied == 1).all()


def test_a_map_is_the_same_whatever_the_order_and_unit() -> None:
    result = in_r()["sets"]["ekman"]
    frame = pd.DataFrame(result["values"], index=result["labels"], columns=result["labels"])
    mixed = frame.sample(frac=1, random_state=1).sample(frac=1, axis=1, random_state=2)
    numbered = frame.set_axis([int(name) for name in frame], axis=0).set_axis([int(name) for name in frame], axis=1)
    one, two = (nonmetric_mds(dissimilarities_of(ratings), starts=4) for ratings in (frame, mixed))
    three, four = (nonmetric_mds(dissimilarities_of(ratings), starts=4) for ratings in (frame * 1024.0, numbered))
    assert one.points.equals(two.points)
    assert one.stress == two.stress == three.stress == four.stress
    assert one.points.equals(three.points)
    assert one.points.to_numpy().tolist() == four.points.to_numpy().tolist()


def test_a_map_lies_on_its_principal_axes_at_unit_size() -> None:
    points = nonmetric_mds(given_set("ekman"), starts=2).points.to_numpy()
    inner = points.T @ points
    assert abs(inner[0, 1]) < 1e-10
    assert inner[0, 0] >= inner[1, 1]
    assert np.trace(inner) == pytest.approx(len(points))
    assert (points[np.abs(points).argmax(axis=0), [0, 1]] > 0).all()


@pytest.mark.parametrize("name", ["eurodist", "ekman", "attitude"])
def test_places_have_all_their_digits_whatever_way_led_there(name: str) -> None:
    """The same order by another monotone scale: other starts, the same least stress, the same map.

    To 1e-11 on most processors; to 1.1e-10 (eurodist) where linear algebra adds up in another order.
    """
    one = given_set(name)
    labels = list(one.labels)
    two = dissimilarities_of(pd.DataFrame(one.values**1.3, index=labels, columns=labels))
    first, second = (nonmetric_mds(dissimilarities, starts=4).points.to_numpy() for dissimilarities in (one, two))
    assert first == pytest.approx(second, abs=1e-9)


def test_the_shepard_data_give_the_stress() -> None:
    result = nonmetric_mds(given_set("attitude"), starts=2)
    pairs = result.shepard
    squared = ((pairs["distance"] - pairs["disparity"]) ** 2).sum() / (pairs["distance"] ** 2).sum()
    assert np.sqrt(squared) == pytest.approx(result.stress, rel=1e-12)
    ordered = pairs.sort_values(["dissimilarity", "distance"])
    assert (np.diff(ordered["disparity"]) >= -1e-12).all()


def test_ties_by_rounding_are_ties() -> None:
    order = order_of(np.array([0.1 + 0.2, 0.3, 0.5]), "secondary")
    assert disparities(np.array([1.0, 2.0, 3.0]), order).tolist() == [1.5, 1.5, 3.0]


def test_a_plane_is_found_again() -> None:
    truth = pd.DataFrame(np.random.default_rng(3).normal(size=(20, 2)))
    result = nonmetric_mds(distances(truth), starts=5)
    assert result.stress < 1e-4
    assert procrustes(truth, result.points).r > 0.999
    assert not result.degenerate


def test_a_degenerate_map_says_so() -> None:
    far = np.full((12, 12), 5.0)
    for block in (slice(0, 6), slice(6, 12)):
        far[block, block] = 1.0
    far += squareform(np.random.default_rng(1).uniform(0, 0.5, 66))
    np.fill_diagonal(far, 0)
    result = nonmetric_mds(dissimilarities_of(pd.DataFrame(far)), starts=4)
    assert result.degenerate
    assert any("degenerate" in note for note in result.notes)
    few = nonmetric_mds(distances(pd.DataFrame(np.random.default_rng(1).normal(size=(5, 4)))), starts=4)
    assert "Kruskal & Wish" in " ".join(few.notes)


def test_distances_that_are_not_euclidean_say_so() -> None:
    assert "9 of 21 eigenvalues are negative" in classical_mds(given_set("eurodist")).notes[0]
    assert "equally large" in classical_mds(dissimilarities_of(pd.DataFrame(1 - np.eye(4)))).notes[-1]


def test_what_is_no_dissimilarity_is_refused() -> None:
    with pytest.raises(BadValue, match="not symmetric at 0, 1"):
        dissimilarities_of(pd.DataFrame([[0, 1, 2], [2, 0, 3], [2, 3, 0]]))
    with pytest.raises(BadValue, match="diagonal"):
        dissimilarities_of(pd.DataFrame(np.ones((3, 3))))
    with pytest.raises(BadValue, match="negative"):
        dissimilarities_of(pd.DataFrame([[0, 1, -2], [1, 0, 3], [-2, 3, 0]]))
    with pytest.raises(BadValue, match="all objects are the same"):
        distances(pd.DataFrame(np.ones((4, 2))))
    with pytest.raises(BadOption, match="equally dissimilar"):
        nonmetric_mds(dissimilarities_of(pd.DataFrame(1 - np.eye(4))))
    with pytest.raises(TooFew):
        distances(pd.DataFrame([[1, 2], [3, 4]]))
    with pytest.raises(BadOption, match="span 2"):
        classical_mds(distances(pd.DataFrame(np.random.default_rng(1).normal(size=(9, 2)))), 3)
    with pytest.raises(BadOption, match="dimensions=0"):
        classical_mds(given_set("ekman"), 0)


def test_an_offset_costs_no_digits_of_a_distance() -> None:
    whole = pd.DataFrame(np.random.default_rng(1).integers(-50, 50, (9, 3)) * 1.0)
    assert distances(whole + 1e9).values.tolist() == distances(whole).values.tolist()
    assert distances(whole * 2.0**-500).values.tolist() == (distances(whole).values * 2.0**-500).tolist()


def test_scaled_distances_do_not_depend_on_an_attributes_unit() -> None:
    whole = pd.DataFrame(np.random.default_rng(1).normal(size=(9, 3)))
    assert distances(whole, scaled=True).values == pytest.approx(distances(whole * [1, 1e6, 1e-6], scaled=True).values)
    with pytest.raises(BadValue, match="cannot be scaled"):
        distances(whole.assign(c=1.0), scaled=True)


def test_ratings_of_pairs_become_a_table_in_either_order() -> None:
    pairs = pd.DataFrame(
        [("p", "a", "b", 4), ("p", "c", "a", 6), ("p", "b", "c", 1), ("q", "b", "a", 6), ("p", "a", "a", 9)],
        columns=["participant", "one", "two", "value"],
    )
    result = pair_dissimilarities(pairs, "value", "one", "two", "participant")
    assert result.values.tolist() == [[0, 5, 6], [5, 0, 1], [6, 1, 0]]
    turned = pair_dissimilarities(pairs, "value", "two", "one", "participant", "similarity", top=10)
    assert turned.values.tolist() == [[0, 5, 4], [5, 0, 9], [4, 9, 0]]
    with pytest.raises(IncompleteCells, match="'b' and 'c'"):
        pair_dissimilarities(pairs.drop(index=2), "value", "one", "two", "participant")
    with pytest.raises(BadValue, match="negative"):
        pair_dissimilarities(pairs, "value", "one", "two", "participant", "similarity", top=5)


def test_stress_falls_with_dimensions_and_structure_is_distinguished_from_noise() -> None:
    scree = stress_scree(given_set("ekman"), 3, starts=4)
    assert scree["stress"].is_monotonic_decreasing
    real = stress_reference(given_set("ekman"), draws=19)
    assert real.p == 1 / 20
    assert real.observed < real.quantile_05 < real.mean
    noise = squareform(np.random.default_rng(4).uniform(1, 2, 66))
    assert stress_reference(dissimilarities_of(pd.DataFrame(noise)), draws=19).p > 0.05


@pytest.mark.parametrize("method", ["classical", "nonmetric"])
def test_ellipses_shrink_with_participants(method: str) -> None:
    areas = []
    for people in (8, 32):
        profiles = gather_profiles(ratings(people, stimuli=10), *NAMES)
        between = profile_distances(profiles)
        points = (classical_mds(between) if method == "classical" else nonmetric_mds(between, starts=2)).points
        result = confidence_ellipses(between, points, method, draws=60)
        assert (result[["x", "y"]].to_numpy() == points.to_numpy()).all()
        assert result["angle_deg"].between(-90, 90).all()
        spread = (points.to_numpy() ** 2).sum() / len(points)
        areas.append((result["major"] * result["minor"]).mean() / spread)
    assert areas[1] < 0.5 * areas[0]


def test_ellipses_cover_the_true_places() -> None:
    """Known truth, classical map: of 95 % ellipses about 95 % cover; 20 x 10 points, so the count has SD 3.1."""
    held = []
    truth = gather_profiles(ratings(people=1, stimuli=10, noise=0.0), *NAMES)
    target = classical_mds(profile_distances(truth)).points
    for repeat in range(20):
        noisy = ratings(people=1, stimuli=10, noise=0.0).drop(columns="participant")
        rng = np.random.default_rng(100 + repeat)
        table = pd.concat(
            [noisy.assign(participant=i, value=noisy["value"] + rng.normal(size=len(noisy))) for i in range(30)]
        )
        between = profile_distances(gather_profiles(table, *NAMES))
        points = procrustes(target, classical_mds(between).points, scale=False).fitted
        result = confidence_ellipses(between, points, draws=150)
        off = (target - points.to_numpy()).to_numpy()
        for row, miss in zip(result.itertuples(), off, strict=True):
            covariance = np.array([[row.var_x, row.cov_xy], [row.cov_xy, row.var_y]])
            held.append(miss @ np.linalg.solve(covariance, miss) <= -2 * np.log(0.05))
    assert 0.86 <= np.mean(held) <= 1.0


def test_without_participants_there_are_no_ellipses() -> None:
    between = given_set("ekman")
    with pytest.raises(BadOption, match="column of participants"):
        confidence_ellipses(between, classical_mds(between).points)
    alone = profile_distances(gather_profiles(ratings(people=1), *NAMES))
    with pytest.raises(StatisticsError, match="one participant"):
        confidence_ellipses(alone, classical_mds(alone).points)
