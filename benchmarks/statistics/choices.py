"""Figures of choices: each implementation's error beside its time, on R's answers and where there is no answer."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.statistics.measuring import Way, comparison, relative_error
from palpate.analysis.choices.bradley_terry import bradley_terry
from palpate.analysis.choices.intervals import profile_interval, resampled_answers
from palpate.analysis.choices.posterior import posterior
from palpate.analysis.choices.psychometric import Psychometric, fit_psychometric
from palpate.analysis.choices.thurstone import thurstone
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import StatisticsError
from palpate.protocols.bench import Case

OURS = "palpate"
TRUTH = Path(__file__).with_name("choices_truth.json")
SHAPES: dict[str, Any] = {"logit": "logistic", "probit": "gaussian", "cloglog": "weibull"}


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of scales, psychometric functions, uninformative answers, and intervals against the profile's."""
    truth = json.loads(TRUTH.read_text())
    yield from _scales(truth)
    for fit in truth["plain"].values():
        yield from _plain(pd.DataFrame(truth["sets"][fit["set"]]), fit, 0.0)
    yield from _plain(pd.DataFrame(truth["sets"]["yes_no"]), truth["plain"]["yes_no logit"], 1e6)
    yield from _nothing()
    yield from _intervals(pd.DataFrame(truth["sets"]["yes_no"]), 500 if quick else 5000)


def _scales(truth: Any) -> Iterator[Case]:
    games = pd.DataFrame(truth["baseball"])
    won = games.rename(columns={"home": "winner", "away": "loser", "home_wins": "n"})
    lost = games.rename(columns={"away": "winner", "home": "loser", "away_wins": "n"})
    table = pd.concat([won, lost])[["winner", "loser", "n"]]
    names = [key.removeprefix("Xp") for key in truth["bradley_terry"]]
    for title, link, model in (("Bradley-Terry", "Logit", bradley_terry), ("Thurstone V", "Probit", thurstone)):
        right = np.array(list(truth["bradley_terry" if link == "Logit" else "thurstone"].values()))

        def ours(table: pd.DataFrame, model: Any = model) -> Floats:
            values = model(table, "winner", "loser", count="n", constraint="Baltimore").values
            return np.asarray(values.set_index("item")["value"][names], dtype=float)

        ways: list[Way] = [(OURS, "numpy", ours), ("statsmodels GLM", "statsmodels", _glm_of_pairs(names, link))]
        if model is bradley_terry:
            ways.append(("choix, ILSR", "choix", _choix(names)))
        kind = "relative, worst value; against R"
        yield from comparison(title, "baseball, 7 teams", len(table), ways, table, relative_error(right), kind)


def _glm_of_pairs(names: list[str], link: str) -> Callable[[pd.DataFrame], Floats]:
    def fit(table: pd.DataFrame) -> Floats:
        import statsmodels.api as sm

        design = np.column_stack([(table["winner"] == n).astype(float) - (table["loser"] == n) for n in names])
        # Each choice as its own row, won: both directions of a pair are in the design by their sign.
        family = sm.families.Binomial(getattr(sm.families.links, link)())
        model = sm.GLM(np.ones(len(table)), design, family=family, freq_weights=table["n"].to_numpy())
        return np.asarray(model.fit(tol=1e-14, maxiter=200).params)

    return fit


def _choix(names: list[str]) -> Callable[[pd.DataFrame], Floats]:
    """Return choix's iterative Luce spectral ranking (Maystre & Grossglauser 2015), with Baltimore at 0."""

    def fit(table: pd.DataFrame) -> Floats:
        import choix

        place = {name: number for number, name in enumerate([*names, "Baltimore"])}
        rows = table.iloc[np.repeat(np.arange(len(table)), table["n"])]
        pairs = list(zip(rows["winner"].map(place), rows["loser"].map(place), strict=True))
        values = np.asarray(choix.ilsr_pairwise(len(place), pairs, tol=1e-12), dtype=np.float64)
        return np.asarray(values[:-1] - values[-1])

    return fit


def _plain(table: pd.DataFrame, truth: Any, offset: float) -> Iterator[Case]:
    right = np.array([-truth["intercept"] / truth["slope"] + offset, truth["slope"]])
    function = SHAPES[truth["link"]]

    def ours(table: pd.DataFrame) -> Floats:
        fit = fit_psychometric(table, "level", "k", "n", task="yes_no", function=function, guess=0, lapse=0)
        return np.array([fit.centre, 1 / fit.spread])

    def glm(table: pd.DataFrame) -> Floats:
        import statsmodels.api as sm

        level = np.log(table["level"]) if function == "weibull" else table["level"]
        links = {"logistic": "Logit", "gaussian": "Probit", "weibull": "CLogLog"}
        family = sm.families.Binomial(getattr(sm.families.links, links[function])())
        counts = np.column_stack([table["k"], table["n"] - table["k"]])
        b = sm.GLM(counts, sm.add_constant(level), family=family).fit(tol=1e-14, maxiter=200).params.to_numpy()
        return np.array([-b[0] / b[1], b[1]])

    ways: list[Way] = [(OURS, "numpy", ours), ("statsmodels GLM", "statsmodels", glm)]
    if function != "weibull":
        ways.append(("scipy curve_fit", "scipy", _least_squares(function)))
    name = f"{truth['set']}, {function}" + (f", offset {offset:g}" if offset else "")
    kind = "relative, worst of place and slope; against R"
    moved = table.assign(level=table["level"] + offset)
    yield from comparison("psychometric function", name, len(moved), ways, moved, relative_error(right), kind)


def _least_squares(function: str) -> Callable[[pd.DataFrame], Floats]:
    """Return a common fit: least squares of the shares, as if all were equally certain."""

    def fit(table: pd.DataFrame) -> Floats:
        from scipy.optimize import curve_fit
        from scipy.special import expit, ndtr

        shape = expit if function == "logistic" else ndtr
        begin = [float(table["level"].mean()), 1.0]
        place, slope = curve_fit(lambda x, m, b: shape(b * (x - m)), table["level"], table["k"] / table["n"], begin)[0]
        return np.array([place, slope])

    return fit


def _nothing() -> Iterator[Case]:
    """Yield the cases of answers that step from one side to the other and have no slope: any number for it is wrong."""
    step = pd.DataFrame({"level": [1.0, 2, 3, 4], "k": [0, 0, 20, 20], "n": 20})

    def ours(table: pd.DataFrame) -> Floats | None:
        try:
            return np.array([1 / fit_psychometric(table, "level", "k", "n", task="yes_no", guess=0, lapse=0).spread])
        except StatisticsError:
            return None

    def glm(table: pd.DataFrame) -> Floats | None:
        import statsmodels.api as sm

        counts = np.column_stack([table["k"], table["n"] - table["k"]])
        fit = sm.GLM(counts, sm.add_constant(table["level"]), family=sm.families.Binomial()).fit()
        return np.array([fit.params.iloc[1]])

    ways: list[Way] = [(OURS, "numpy", ours), ("statsmodels GLM", "statsmodels", glm)]
    kind = "infinite for a slope where there is none"
    yield from comparison(
        "psychometric function, a step", "4 levels x 20", len(step), ways, step, lambda _: math.inf, kind
    )


def _intervals(table: pd.DataFrame, draws: int) -> Iterator[Case]:
    """Yield the cases of other intervals: how far their ends lie from the profile's, and their cost."""
    fit: Psychometric = fit_psychometric(table, "level", "k", "n", task="yes_no", guess=0, lapse=0)
    right = np.array(profile_interval(fit, "threshold", draws=0)[:2])
    width = float(right[1] - right[0])

    def bayes(table: pd.DataFrame) -> Floats:
        fit = posterior(table, "level", "k", "n", task="yes_no", guess=0, lapse=0, overdispersed=False)
        return np.array(fit.threshold_interval)

    ways: list[Way] = [
        (f"{OURS}, profile", "numpy", lambda _: np.array(profile_interval(fit, "threshold", draws=0)[:2])),
        (f"{OURS}, profile, Bartlett's factor", "numpy", lambda _: np.array(profile_interval(fit, "threshold")[:2])),
        (f"{OURS}, bootstrap of {draws}", "numpy", lambda _: np.array(resampled_answers(fit, draws).threshold[:2])),
        (f"{OURS}, posterior on a grid", "numpy", bayes),
    ]

    def error(ends: Floats) -> float:
        return float(np.abs(ends - right).max()) / width

    kind = "worst end, share of the profile interval's width"
    yield from comparison("interval of a threshold", "yes_no", len(table), ways, table, error, kind)
