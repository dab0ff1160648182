"""The declared figures run, our errors stay within the bounds, and importing the room costs nothing."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module

import pytest

from benchmarks.statistics.cases import PARTS, cases, worst_error
from palpate.protocols.bench import Case

TITLES = {
    *("ANOVA against R", "ANOVA, extreme tables", "p to report", "one-way ANOVA, NIST sets"),
    *("ANOVA, large tables", "ANOVA, types of labels", "mixed ANOVA against R", "Mauchly's test"),
    *("equivalence (TOST)", "ANOVA and every pair", "mixed ANOVA, large table", "exact self-check"),
}
"""The figures of this room; the other rooms' stand in their own tests."""


@pytest.fixture(scope="module")
def every_case() -> list[Case]:
    """Made when the first test asks: some are fitted."""
    return list(cases(quick=True))


@pytest.fixture(scope="module")
def ours(every_case: list[Case]) -> list[Case]:
    return [case for case in every_case if case.method == "palpate" and case.case in TITLES]


def test_the_cases_cover_the_room(ours: list[Case]) -> None:
    assert {case.case for case in ours} == TITLES
    assert len(ours) > 50
    assert len({(case.case, case.input) for case in ours}) == len(ours)


def test_every_part_of_statistics_has_its_cases(every_case: list[Case]) -> None:
    for part in PARTS:
        own = {case.case for case in part.cases(True)}
        assert own
        assert own <= {case.case for case in every_case} - TITLES


@pytest.mark.parametrize("title", sorted(TITLES))
def test_ours_is_right_or_refuses(title: str, ours: list[Case]) -> None:
    errors = {case.input: case.error(case.run()) for case in ours if case.case == title}
    assert {name: error for name, error in errors.items() if error is not None and not error < 1e-12} == {}


def test_the_oracle_agrees(every_case: list[Case]) -> None:
    exact = [case for case in every_case if case.method == "exact fractions"]
    assert len(exact) == 9
    for case in exact:
        assert (case.error(case.run()) or 0) < 1e-12


def test_worst_error_tells_refusals_from_wrong_numbers() -> None:
    nan, key = float("nan"), ("A", "F")
    assert worst_error({}, {key: 2.0}) is None
    assert worst_error({key: 3.0}, {key: 2.0}) == 0.5
    assert worst_error({key: 3.0}, {key: None}) == float("inf")
    assert str(worst_error({key: nan}, {key: None})) == "nan"
    assert str(worst_error({key: nan}, {key: 2.0})) == "nan"


def test_the_room_and_its_sentences_import_no_numbers() -> None:
    code = "import sys, palpate.analysis.statistics.apa; print(sorted({'numpy', 'pandas', 'scipy'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_public_calls_stay_functions_after_everything_is_imported() -> None:
    from palpate import analysis

    import_module("palpate.analysis.statistics.pairwise")

    for name in ("rm_anova", "anova", "pairwise_tests", "apa_f", "apa_p", "apa_t"):
        assert callable(getattr(analysis, name))
    assert not hasattr(analysis, "no_such_call")


def test_statistics_do_not_load_scipy_stats() -> None:
    code = "import sys; from palpate.analysis import rm_anova; print('scipy.stats' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
