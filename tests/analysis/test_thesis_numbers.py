"""The published numbers that can be checked by arithmetic (thesis 4.7.2 and 5.7.1.3)."""

from __future__ import annotations

from statistics import fmean

import numpy as np
import pytest

from palpate.analysis import rm_anova
from palpate.analysis.statistics.f_and_t import eta_squared_interval, f_tail
from tests.analysis.statistics.anova_for_tests import long_table

F, DF1, DF2, PRINTED_ETA = 64.97, 3, 33, 0.8077
"""12 participants, 4 methods: the degrees of freedom are not printed."""

ERRORS = {  # mean absolute error of each attribute: printed mean, and its two profiles (Min, Max) where printed
    "Easy-to-pull": (5.83, (6.67, 5.00)),
    "Damped": (7.08, (None, 8.33)),
    "Consistent": (6.67, (None, None)),
    "Comfort": (9.17, (12.50, 5.83)),
    "Pleasant": (7.92, (None, None)),
    "New": (12.50, (None, 16.67)),
    "Luxurious": (16.67, (None, None)),
}
PHYSICAL = ("Easy-to-pull", "Damped", "Consistent", "Comfort")
EMOTIONAL = ("Pleasant", "New", "Luxurious")
LAST_DIGIT = 0.005 + 1e-9


def test_f_p_and_partial_eta_squared() -> None:
    """R 4.2.2: pf(64.97, 3, 33, lower.tail = FALSE) is 6.1855502084343673e-14."""
    assert f_tail(F, DF1, DF2) == pytest.approx(6.1855502084343673e-14, rel=1e-12)
    assert f_tail(F, DF1, DF2) < 0.01  # as printed
    partial = F * DF1 / (F * DF1 + DF2)
    assert round(partial, 4) == 0.8552
    low, high = eta_squared_interval(F, DF1, DF2)
    assert low < partial < high


def test_the_printed_eta_squared_is_no_partial_one() -> None:
    """.8077 is not what F and its degrees of freedom give, with any number of participants that 288 ratings allow."""
    for participants in (2, 3, 4, 6, 8, 9, 12, 16, 18, 24, 36, 48, 72):
        df2 = DF1 * (participants - 1)
        assert abs(F * DF1 / (F * DF1 + df2) - PRINTED_ETA) > 5e-5
    partial = F * DF1 / (F * DF1 + DF2)
    assert partial > PRINTED_ETA


def test_the_printed_eta_squared_can_be_the_generalized_one() -> None:
    """Given F, it fixes how far participants differ: their sum of squares is .4062 times the error's. Made so here."""
    odds = F * DF1 / DF2  # SS_effect / SS_error
    people = odds / PRINTED_ETA - odds - 1
    assert 0 < people == pytest.approx(0.40620741274325578, rel=1e-12)
    rng = np.random.default_rng(47)
    residual = rng.normal(size=(12, 4))
    residual -= residual.mean(axis=0)
    residual -= residual.mean(axis=1, keepdims=True)
    residual /= np.sqrt((residual**2).sum())
    participant = rng.normal(size=(12, 1))
    participant -= participant.mean()
    participant *= np.sqrt(people / 4 / (participant**2).sum())
    method = np.array([[-1.0, 0.2, -0.4, 1.2]])
    method *= np.sqrt(odds / 12 / (method**2).sum())
    row = rm_anova(long_table(50 + residual + participant + method), "y", "A", "subject").iloc[0]
    assert row["F"] == pytest.approx(F, rel=1e-9)
    assert (row["ddof1"], row["ddof2"]) == (DF1, DF2)
    assert round(row["ng2"], 4) == PRINTED_ETA
    assert round(row["np2"], 4) == 0.8552


def test_288_ratings() -> None:
    assert 12 * 4 * 6 == 288


@pytest.mark.parametrize(("printed", "attributes"), [(7.19, PHYSICAL), (12.36, EMOTIONAL), (9.40, ERRORS)])
def test_means_over_attributes(printed: float, attributes: tuple[str, ...]) -> None:
    assert fmean(ERRORS[name][0] for name in attributes) == pytest.approx(printed, abs=2 * LAST_DIGIT)


def test_comfort_was_counted_as_physical() -> None:
    """Listed as affective (5.3.4.2), but only with it among the physical ones do both printed means come out."""
    without = [ERRORS[name][0] for name in PHYSICAL if name != "Comfort"]
    assert abs(fmean(without) - 7.19) > 0.5
    assert abs(fmean([*(ERRORS[name][0] for name in EMOTIONAL), ERRORS["Comfort"][0]]) - 12.36) > 0.5


def test_an_attributes_error_is_the_mean_of_its_two_profiles() -> None:
    whole = {name: (mean, ends) for name, (mean, ends) in ERRORS.items() if None not in ends}
    assert set(whole) == {"Easy-to-pull", "Comfort"}
    for mean, ends in whole.values():
        assert fmean(ends) == pytest.approx(mean, abs=2 * LAST_DIGIT)


def test_errors_not_printed_follow_and_are_no_less_than_zero() -> None:
    for name, low in (("Damped", 5.83), ("New", 8.33)):
        mean, (_, high) = ERRORS[name]
        assert 2 * mean - high == pytest.approx(low, abs=3 * LAST_DIGIT)


def test_the_words_about_the_order_hold() -> None:
    means = {name: mean for name, (mean, _) in ERRORS.items()}
    assert min(means, key=means.__getitem__) == "Easy-to-pull"
    assert max(means, key=means.__getitem__) == "Luxurious"
    assert fmean(means[name] for name in PHYSICAL) < fmean(means[name] for name in EMOTIONAL)


def test_the_usability_study() -> None:
    """16 participants by 5 items are the 80 answers printed; a mean of 16 whole answers is a sixteenth (5.7.2.2)."""
    assert 16 * 5 == 80
    for printed in (5.94, 5.63, 5.44, 5.13, 4.81):
        assert abs(round(printed * 16) / 16 - printed) <= LAST_DIGIT


def test_the_errors_of_16_participants() -> None:
    """A mean of 16 absolute errors on a slider of whole points would be a sixteenth; the printed ones are twelfths."""
    printed = [value for mean, ends in ERRORS.values() for value in (mean, *ends) if value is not None]
    assert all(abs(round(value * 12) / 12 - value) <= LAST_DIGIT for value in printed)
    assert not all(abs(round(value * 16) / 16 - value) <= LAST_DIGIT for value in printed)
