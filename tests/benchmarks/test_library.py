"""The search against numerical integration, and what forgetting doubt costs."""

import pytest
from scipy.integrate import quad
from scipy.stats import norm

from benchmarks import library as bench
from palpate.modeling.library.search import wishes_of


def test_the_search_finds_what_the_exhaustive_one_finds_and_sure_means_do_not():
    library = bench.random_library(60)
    wishes = [wishes_of(library, [text]) for text in bench.WISHES]
    exact = [bench.exhaustive(library.textures, wish) for wish in wishes]
    result = bench.search_all(library.textures, wishes)
    assert bench.fit_error(exact, result) < 1e-9 and bench.share_missed(exact, result) == 0
    assert bench.share_missed(exact, bench.search_all(bench.without_uncertainty(library), wishes)) > 0


def test_the_exhaustive_search_is_an_integral():
    library = bench.random_library(3)
    (wish,) = wishes_of(library, ["rough"])
    entry = library.textures[1]
    low, high = entry.rated.mean[0] - 9 * entry.rated.se[0], entry.rated.mean[0] + 9 * entry.rated.se[0]
    value, _ = quad(
        lambda x: wish.soft.at(x) * norm.pdf(x, entry.rated.mean[0], entry.rated.se[0]), low, high,
        points=[x for x, _ in wish.soft.knots if low < x < high] or None, epsabs=1e-12,
    )  # fmt: skip
    assert bench.exhaustive([entry], (wish,))[entry.id] == pytest.approx(value, abs=1e-9)


def test_the_nearest_are_those_of_a_table_of_distances():
    names = [(case.case, case.input, case.method) for case in bench.cases(True)]
    assert len(set(names)) == len(names)
    case = next(case for case in bench.cases(True) if case.case == "library: nearest")
    nearest = case.run()
    assert case.error(nearest) == 0 and case.error(nearest[::-1]) == 1
