"""What the door plant's bench declares and draws."""

from collections import Counter

import pytest

from benchmarks.plant.cases import OURS, RACE_STEPS_S, Racer, Solved, cases, figures
from benchmarks.plant.problems import problems, solve


@pytest.fixture(scope="module")
def declared():
    return list(cases(quick=True))


def test_every_method_is_shown_at_five_settings_beside_the_others(declared):
    arms = [case for case in declared if case.case.startswith("arm: ")]
    for name in {case.case for case in arms}:
        counted = Counter(case.method for case in arms if case.case == name)
        assert set(counted.values()) == {5}
        assert {OURS, "explicit Euler", "semi-implicit Euler", "RK4", "Radau, events", "LSODA, events"} <= set(counted)


def test_no_two_cases_are_the_same(declared):
    names = [(case.case, case.input, case.method) for case in declared]
    assert len(set(names)) == len(names)


@pytest.mark.long
def test_a_run_that_diverges_has_an_infinite_error_and_no_warning(declared):
    steel = [case for case in declared if "hard stop" in case.case and case.input == "step 4 ms"]
    errors = {case.method: case.error(case.run()) for case in steel}
    assert errors[OURS] < 1e-3
    assert {errors[name] for name in ("explicit Euler", "semi-implicit Euler", "RK4")} == {float("inf")}


def test_a_method_that_is_never_good_enough_refuses():
    solved = Solved(problems()[0])
    bad = Racer(solved, (lambda problem: [9.0] * problem.samples,))
    assert solved.error_rad(bad.run()) is None
    good = Racer(solved, tuple(lambda problem, h=h: solve(problem, h) for h in RACE_STEPS_S))
    assert solved.error_rad(good.run()) <= 1e-4


@pytest.mark.long
def test_the_figures_are_drawn(tmp_path):
    assert [path.stat().st_size > 20_000 for path in figures(tmp_path / "out", quick=True)] == [True, True]
