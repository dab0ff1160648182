"""Every setting of every test and figure of a plan changes what is answered, or is named as one without effect.

Kinds and their settings are found by their schemas. For each kind there are tests or figures in the tables below, one
for each combination of settings in which others may lose their effect. In each of them every setting is set to another
value: what the numbers or the picture are must change, or the schema must refuse it, or the setting must be among
those that `--check-plan` refuses and that a plan in use reports in a note, and then nothing may change. A kind
without an example and a setting without a value to try fail the test. The bare run takes the first case of each kind,
the full one all.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pytest
from pydantic import ValidationError

from palpate.analysis.plans.idle import idle_settings
from palpate.analysis.plans.kinds import FIGURES, TESTS
from palpate.analysis.plans.reading import AnalysisPlan, Plan
from palpate.analysis.plans.selecting import Selector
from palpate.analysis.power.simulated_studies import people, simulated_material
from palpate.analysis.ratings.people import People
from palpate.analysis.regenerating.plan_figures import figure_data
from palpate.analysis.regenerating.regeneration import by_name, run_tests
from palpate.protocols.study import Study
from palpate.protocols.yaml_text import load
from tests.analysis.choices.collected_for_tests import tracks

Settings = dict[str, Any]
Effects = list[tuple[str, str]]


class Outcome(NamedTuple):
    """What a test or figure tells, and what is noted beside it."""

    content: str
    notes: str


COMMON = {
    "task": "slider_rating",
    "opening": ["demographics"],
    "questions": ["age", "gender"],
    "order": {"design": "random"},
}
RATED = Study.model_validate(
    {
        **COMMON,
        "study": "rated",
        "participants": {"sessions": 2},
        "closing": ["questionnaire"],
        "questionnaire": {
            "items": [{"name": "ease", "text": "It was easy."}, {"name": "fun", "text": "It was fun."}],
            "points": 5,
        },
        "stimuli": [
            {"id": f"s{n}", "columns": {"cloth": "xy"[n % 2], "dose": str(n // 2), "far": str(n // 2 * n // 2),
                                        "wish": str(20 + 10 * n), "goal": str(30 + 5 * n), "side": "lr"[n // 3],
                                        "about": ("Soft", "Cold", "Calm")[n // 2], "of": ("Soft", "Cold")[n % 2]}}
            for n in range(6)
        ],
        "groups": {"bare": {"cloth": ["x", "y"]}, "glove": {"cloth": ["x", "y"]}},
        "attributes": [
            {"low": "Soft", "high": "Hard", "category": "physical"},
            {"low": "Cold", "high": "Warm", "category": "physical"},
            {"low": "Calm", "high": "Tense", "category": "emotional"},
            {"low": "Dear", "high": "Cheap", "category": "emotional"},
        ],
        "scale": {"from": 0, "to": 100},
        "simulation": {"latents": {"Soft": {"dose": 12}, "Calm": {"dose": 7}, "Cold": {"wish": 5}}, "noise_sd": 8,
                       "bias_sd": 5, "gain_sd": 0.2},
    }
)  # fmt: skip
TICKED = Study.model_validate(
    {
        **COMMON,
        "study": "ticked",
        "task": "adjective_selection",
        "stimuli": [{"id": f"s{n}", "columns": {"dose": str(n)}} for n in range(4)],
        "adjectives": {"words": ["Soft", "Hard", "Warm", "Cold"], "order": "random"},
        "simulation": {"latents": {"Soft": {"intercept": 1, "dose": -1}, "Hard": {"dose": 1}, "Warm": {"intercept": -2},
                                   "Cold": {"dose": 1.4}}},
    }
)  # fmt: skip


def _pairs_of_items() -> pd.DataFrame:
    rows = [("p", "q", 6, 0, "p"), ("q", "p", 3, 0, "p"), ("q", "r", 5, 0, "r"), ("r", "q", 2, 0, "q"),
            ("p", "r", 4, 0, "p"), ("r", "p", 2, 0, "p"),
            ("p", "q", 2, 1, "q"), ("q", "r", 1, 1, "q"), ("p", "r", 1, 1, "r")]  # fmt: skip
    table = pd.DataFrame(rows, columns=["winner", "loser", "times", "tied", "first"])
    return table.assign(
        better=table["loser"], worse=table["winner"], twice=2 * table["times"], who=[f"P{n % 3}" for n in range(9)]
    )


def _levels() -> pd.DataFrame:
    rng = np.random.default_rng(1)
    rows = []
    for who in ("P1", "P2"):
        for run in ("a", "b"):
            level, trial = 6.0, 0
            for _ in range(24):
                hit = int(rng.random() < 1 / (1 + np.exp(4 - level)))
                rows.append((who, run, trial, level, level / 2, hit, int(rng.random() < level / 8)))
                trial, level = trial + 1, max(1.0, level - 1 if hit and rng.random() < 0.7 else level + 1)
    table = pd.DataFrame(rows, columns=["participant", "run", "trial", "level", "half", "correct", "other"])
    return table.assign(back=-table["trial"], half_run=table["run"] + (table["trial"] // 12).map(str))


def _counted() -> pd.DataFrame:
    rows = [(1.0, 4, 30), (2.0, 5, 30), (3.0, 11, 30), (4.0, 20, 30), (5.0, 25, 30), (6.0, 27, 30)]
    return pd.DataFrame(rows, columns=["level", "correct", "n"]).assign(more=40)


def _predicted() -> pd.DataFrame:
    rng = np.random.default_rng(2)
    rows = [(f"s{n}", f"t{5 - n}", attribute, "ab"[n % 2], "ab"[n // 3], *rng.normal(50, 9, 4), *rng.uniform(1, 9, 2))
            for n in range(6) for attribute in ("Soft", "Cold")]  # fmt: skip
    names = ["stimulus", "piece", "attribute", "class", "kind", "actual", "predicted", "other", "truth", "sd", "sd2"]
    table = pd.DataFrame(rows, columns=names)
    table["predicted"] += 30.0 * (table["class"] == "b")
    table["truth"] -= 30.0 * (table["attribute"] == "Cold")
    return table.assign(low=table["predicted"] - 3, high=table["predicted"] + 4, low2=table["predicted"] - 1)


def _similar() -> pd.DataFrame:
    rng = np.random.default_rng(3)
    rows = [
        (f"P{n}", a, b, other, 10.0 * abs("uvwxy".index(a) - "uvwxy".index(b)) + rng.uniform(0, 9))
        for n in range(4)
        for i, a in enumerate("uvwxy")
        for b, other in zip("uvwxy"[i + 1 :], "vwxyu"[i + 1 :], strict=True)
    ]
    return pd.DataFrame(rows, columns=["participant", "one", "two", "three", "value"])  # fmt: skip


def _coarse() -> pd.DataFrame:
    """Answers of yes and no, so that many distances between stimuli are equal."""
    values = np.random.default_rng(18).integers(0, 2, (4, 6, 2))
    rows = [(f"P{n}", "ab"[n % 2], "cd"[n // 2], f"s{i}", str(i // 2), ("Soft", "Cold")[j], "xy"[j],
             float(values[n, i, j])) for n, i, j in np.ndindex(values.shape)]  # fmt: skip
    names = ["participant", "group", "gender", "stimulus", "dose", "attribute", "side", "value"]
    return pd.DataFrame(rows, columns=names)


def _detected() -> pd.DataFrame:
    """Same/different answers of two people on two tracks, one of them always right."""
    rows = [
        {"participant": who, "track": track, "design": "same_different", "alternatives": 2, "catch": "none",
         "target": target, "hit": float(i < hits), "correct": float((i < hits) == (target == "different")),
         "chosen": "different" if i < hits else "same"}
        for who, of_who in (("P1", (10, 0)), ("P2", (8, 3)))
        for track in ("f40", "f250")
        for target, hits in zip(("different", "same"), of_who, strict=True)
        for i in range(10)
    ]  # fmt: skip
    return pd.DataFrame(rows)


def _population() -> pd.DataFrame:
    """Hits of five people at five levels in two conditions, other levels, hits and numbers beside them."""
    rng = np.random.default_rng(4)
    rows = [
        {"participant": f"P{who}", "half": level / 2 + 1, "level": level, "where": where, "n": 20, "more": 21 + who}
        for who in range(5)
        for where in ("near", "far")
        for level in (-2.0, -1.0, 0.0, 1.0, 2.0)
    ]
    table = pd.DataFrame(rows)
    person = table["participant"].str[1:].astype(int)
    eta = 0.4 * (person - 2) + (0.6 + 0.25 * (person % 3)) * table["level"] + 0.3 * (table["where"] == "far")
    hits = rng.binomial(20, 1 / (1 + np.exp(-1.7 * eta)))
    return table.assign(correct=hits, other=np.maximum(hits - 1, 0))


def _magnitudes() -> pd.DataFrame:
    """Numbers that three people gave to four stimuli, and other numbers and intensities beside them."""
    rng = np.random.default_rng(5)
    rows = [
        {"participant": f"P{who}", "stimulus": f"s{n}", "period": 2.0**n, "wide": 3.0 + n,
         "number": 10 ** (0.2 * who + 0.1 * n * who + 0.1 * rng.normal()), "size": 1.0 + n + who}
        for who in range(3)
        for n in range(4)
    ]  # fmt: skip
    return pd.DataFrame(rows)


TABLES = {
    "choices": _pairs_of_items(),
    "levels": _levels(),
    "counted": _counted(),
    "predicted": _predicted(),
    "similar": _similar(),
    "coarse": _coarse(),
    "detected": _detected(),
    "population": _population(),
    "magnitudes": _magnitudes(),
}

COARSE = {"table": "coarse"}
MDS = {"replications": 19, "reference": 19, "starts": 2, "scree": 2}
WITHIN, BETWEEN, FIRST = {"within": ["cloth"]}, {"between": ["group"]}, {"outcomes": ["Soft"]}
COUNTED = {"table": "counted", "n": "n", "interval": "none"}
TRIALS = {"table": "levels", "by": ["participant"], "interval": "none"}
STAIRS = {**TRIALS, "method": "staircase", "order": "trial", "staircase": ["run"]}
REQUESTS: Mapping[str, list[Settings]] = {
    "anova": [
        {**FIRST, "within": ["dose"]}, {**FIRST, **BETWEEN}, {**FIRST, "within": ["dose"], "between": ["gender"]},
        {**FIRST, "between": ["group", "gender"]}, {**FIRST, "within": ["stimulus"], "missing": "mixed_model"},
    ],
    "pairs": [
        {**FIRST, "factor": "dose"}, {**FIRST, "factor": "group"}, {**FIRST, "factor": "dose", "correction": "none"},
        {**COARSE, "factor": "dose"},
    ],
    "equivalence": [{**FIRST, "factor": "dose", "bounds": [-5, 5]}, {**FIRST, "factor": "group", "bounds_dz": 0.5}],
    "mixed_model": [
        {**FIRST, "fixed": ["dose"]}, {**FIRST, "numeric": ["wish"]},
        {**FIRST, "fixed": ["cloth"], "numeric": ["wish"], "random": {"participant": ["wish"]}},
        {**FIRST, "random": {"participant": [], "stimulus": []}},
    ],
    "friedman": [{**FIRST, "factor": "dose"}],
    "cochran": [{"outcomes": ["Dear"], "factor": "stimulus", "yes": 40}],
    "nemenyi": [{"outcomes": ["Dear"], "factor": "stimulus"}],
    "wilcoxon": [
        {"outcomes": ["Dear"], "factor": "stimulus"}, {**FIRST, "factor": "group"},
        {"outcomes": ["Dear"], "factor": "stimulus", "correction": "none"},
    ],
    "aligned_ranks": [
        {**FIRST, "within": ["dose"]}, {**FIRST, **BETWEEN}, {**FIRST, "within": ["dose"], "between": ["gender"]},
        {**FIRST, "between": ["group", "gender"]},
    ],
    "ordinal_model": [
        {"source": "forms", "outcomes": ["ease"], "fixed": ["group"]},
        {"source": "forms", "outcomes": ["ease"], "numeric": ["age"]},
        {"source": "forms", "outcomes": ["ease"], "fixed": ["group"], "random": "participant"},
    ],
    "likert": [{}, {"by": "gender"}],
    "icc": [FIRST],
    "cronbach_alpha": [{}, {"cases": ["stimulus"]}, COARSE],
    "kendall_w": [{**FIRST, "p": how} for how in ("auto", "permutation", "chi2")],
    "krippendorff_alpha": [
        {**FIRST, "level": "ordinal", "where": {"session": "1"}}, {**FIRST, "level": "interval"},
        {**FIRST, "level": "interval", "units": ["gender"]},
    ],
    "retest": [FIRST],
    "raters": [{}, {**COARSE, "outcomes": ["Soft"]}],
    "relevance": [{"normalisation": "share_of_trials", "threshold": 0.6}],
    "adjective_pairs": [
        {"normalisation": "share_of_trials", "threshold": 0.6, "antonyms": [["Soft", "Hard"], ["Cold", "Warm"]]},
        {"normalisation": "share_of_trials", "threshold": 0.6, "antonyms": [["Soft", "Harsh"]], "new_words": True},
    ],
    "word_agreement": [{}],
    "lexicon": [{}, {"lists": {"other": ["light", "lighter", "big"]}}],
    "means": [
        *({**FIRST, "by": ["dose"], "interval": how}
          for how in ("cousineau_morey", "loftus_masson", "between", "none")),
        {**FIRST, "by": ["group"], "interval": "between"},
    ],
    "trends": [
        {"families": "cloth", "pooled": "stimulus"}, {"families": "cloth", "pooled": "stimulus", "correction": "none"},
        {"families": "cloth", "pooled": "stimulus", "numeric": "goal", "category": "none"},
    ],
    "categories": [{"by": ["dose"]}],
    "target_error": [{"target": "wish", "attribute_column": "of"}],
    "pca": [{}, {"scaled": True}, {"reference": "none"}, COARSE],
    "mds": [
        MDS, {**MDS, "method": "classical"}, {**MDS, "replications": 0}, {**MDS, "starts": 0, "dimensions": 1},
        {**MDS, "reference": 0},
        *({"reference": 0, "scree": 1, "starts": 0, "table": "similar", "pairs": ["one", "two"], "replications": 0,
           **more} for more in ({"meaning": "similarity", "top": 60}, {})),
    ],
    "procrustes": [
        *({"on": on, "draws": 19, "dimensions": 1} for on in ("classical", "pca", "attributes")),
        {**COARSE, "on": "nonmetric", "starts": 0, "dimensions": 1, "draws": 19}, {"halves": True, "draws": 19},
        {"stretch": False, "draws": 19},
    ],
    "vectors": [
        *({"on": on, "draws": 19} for on in ("classical", "pca")),
        {**COARSE, "on": "nonmetric", "starts": 0, "dimensions": 1, "draws": 19, "over": "stimulus"},
    ],
    "bradley_terry": [
        {"table": "choices", "count": "times"}, {"table": "choices", "tie": "tied", "first": "first", "count": "times"},
        {"table": "choices", "reference": "p", "count": "times"}, {"table": "choices", "participant": "who"},
    ],
    "thurstone": [
        *({"table": "choices", "method": how, "count": "times"} for how in ("likelihood", "least_squares")),
        {"table": "choices", "participant": "who"},
    ],
    "psychometric": [
        *({**COUNTED, "task": task} for task in ("symmetric", "yes_no", None)),
        {**COUNTED, "task": "forced_choice", "alternatives": 10}, {**TRIALS, "task": "yes_no"},
        {**STAIRS, "task": "yes_no"},
        *({**COUNTED, "task": "symmetric", "interval": how, "draws": 19} for how in ("profile", "posterior")),
        {**COUNTED, "task": "yes_no", "guess": 0.1, "lapse": 0.02},
        {**COUNTED, "task": "yes_no", "function": "weibull"},
    ],
    "dprime": [{"table": "detected"}],
    "binomial_mixed_model": [{"table": "population", "n": "n", "nodes": 1}],
    "power_law": [{"table": "magnitudes", "intensity": "period"}],
}  # fmt: skip
"""The tests in which every setting is tried, by kind."""

SHOWN = [
    {"name": "functions", "test": "psychometric", "source": "choices", "draws": 19},
    {"name": "map", "test": "mds", **MDS}, {"name": "arrows", "test": "vectors", "starts": 2, "draws": 19},
    {"name": "scale", "test": "bradley_terry", "table": "choices", "count": "times"},
    {"name": "exponent", "test": "power_law", "table": "magnitudes", "intensity": "period"},
    {"name": "parts", "test": "pca", "draws": 19}, {"name": "cloths", "test": "pairs", "factor": "dose", **FIRST},
    {"name": "ranks", "test": "wilcoxon", "factor": "dose", **FIRST},
    {"name": "of_x", "test": "pairs", "factor": "dose", "where": {"cloth": "x"}, **FIRST},
]  # fmt: skip
"""The tests that figures show."""
BARS = {**FIRST, "clusters": "cloth", "bars": "dose"}
PREDICTED = {"table": "predicted"}
LEVELS = [{"by": ["dose"], "whiskers": how} for how in ("sd", "cousineau_morey", "none")]
LEVELS.append({**COARSE, "by": ["dose"], "outcomes": ["Soft"]})
FIGURE_CASES: Mapping[str, list[Settings]] = {
    "bubbles": [{}, {"x": "Soft", "y": "Cold"}],
    "means": LEVELS,
    "trends": LEVELS,
    "raincloud": [{"by": ["dose"]}],
    "rating_heatmap": [{}],
    "order_effect": [{}, {"adjust": "none"}, {"carry_over": True}],
    "treemap": [{"tests": ["relevance"]}],
    "predicted": [PREDICTED, {**PREDICTED, "sd": 5}, {**PREDICTED, "panels": "attribute"},
                  {**PREDICTED, "panels": "attribute", "sd": 4}],
    "class_heatmap": [PREDICTED],
    "violins": [
        PREDICTED, {**PREDICTED, "value": "truth"}, {**PREDICTED, "signed": True}, {**PREDICTED, "by": "class"},
    ],
    "similarity_bars": [
        BARS, {**BARS, "clusters": None}, {**BARS, "tests": ["cloths"]}, {**BARS, "whiskers": "between"},
        {**BARS, "tests": ["cloths", "of_x"], "each": {"x": "of_x"}},
    ],
    "matching": [{"target": "wish", "attribute_column": "of"}],
    "likert": [{"source": "forms"}, {"source": "forms", "style": "bars", "where": {"session": "1"}}],
    "psychometric": [{"tests": ["functions"]}],
    "posterior": [{"tests": ["functions"]}],
    "track": [{"tests": ["functions"]}],
    "power_law": [{"tests": ["exponent"]}],
    "estimates": [{"tests": ["scale"], "value": "losses"}],
    "map": [
        {"tests": ["map", "arrows"]}, {"tests": ["map", "arrows"], "class_column": "cloth"},
        {"tests": ["map", "arrows"], "vectors": False},
        {"tests": ["map", "arrows"], "dimensions": [2, 1]},
    ],
}  # fmt: skip

OTHER: Settings = {
    "adjust": "none", "alternatives": 4, "attribute": "kind", "attribute_column": "about", "bars": "wish",
    "antonyms": [["Soft", "Warm"]], "band": "panel", "between": ["hand"], "bins": 4, "bounds": [-9, 20],
    "bounds_dz": 0.9, "by": ["stimulus"], "carry_over": True, "cases": ["session", "stimulus"], "category": "none",
    "class_column": "dose", "clusters": "wish", "coding": "sum", "colour": "Calm", "columns": 2, "confidence": 0.6,
    "correct": "other", "correction": "bonferroni", "count": "twice", "dimensions": 1, "dots": False, "draws": 150,
    "each": {"y": "cloths"}, "ellipses": False, "ends": ["no", "yes"], "eta": "partial", "exact": False,
    "factor": "wish", "falling": True, "families": "cloth", "family": 40, "first": "first", "fixed": ["stimulus"],
    "form": "demographics", "function": "gaussian", "groups": "gender", "guess": 0.05, "halves": True,
    "height_in": 5.0, "high": "truth", "independent": "choices",
    "inflected": False, "interactions": ["cloth:wish"], "interval": 0.6,
    "items": "side", "jnd": "x84_x50", "kinds": ["further"], "label": "dose", "label_column": "cloth", "lapse": 0.04,
    "last": 4, "least_r": 0.9, "letters": 9, "level": "half", "level_unit": "db", "levels": True, "link": "probit",
    "lists": {"own": ["tiny"]}, "loser": "worse", "low": "low2", "meaning": "similarity", "measure": "RMSE",
    "method": "classical", "missing": "listwise", "n": "more", "need_both": True, "new_words": False, "nodes": 3,
    "normalisation": "share_of_maximum", "normalise": "z_within_participant", "numeric": "goal", "on": "attributes",
    "order": ["trial", "session"], "outcomes": ["Calm"], "over": "wish", "p": "chi2", "pairs": ["one", "three"],
    "panels": "kind", "people": False, "participant": "who", "points": [0, 6], "pooled": "wish", "position": "session",
    "predicted": "other", "actual": "truth", "profile": True, "random": {"participant": [], "cloth": []},
    "raters": "session", "reference": "none", "reflection": False, "reml": False, "replications": 25,
    "response_time": False, "reverse": ["Soft"], "reversed": ["Soft"], "scaled": True, "scree": 3, "sd": "sd2",
    "signed": True, "size": "Dear", "sort": "as_listed", "source": "forms", "span": "data", "staircase": ["half_run"],
    "stars": [0.04], "starts": 4, "stimulus": "cloth", "stretch": False, "style": "bars", "sum_of_squares": "II",
    "synonyms": {"light": "big"}, "table": "levels", "target": "goal", "target_scale": [10, 90], "targets": "wish",
    "task": "symmetric", "tests": ["cloths"], "threshold": 0.4, "tie": "tied", "ties": "secondary", "title": "Another",
    "top": 70, "uncorrelated": ["participant"], "unit": "N", "units": ["cloth"], "value": "response_time_s",
    "vectors": False, "where": {"side": "l"}, "whiskers": "between", "width_in": 8.0, "winner": "better",
    "within": ["wish"], "yes": 55, "words": "kept", "x": "Calm", "y": "Calm", "zeros": "pratt",
}  # fmt: skip
"""Another value of each setting, by its name."""
OWN: Mapping[tuple[str, str], Any] = {
    ("mds", "reference"): 25,
    **{(kind, "reference"): "q" for kind in ("bradley_terry", "thurstone")},
    **{(kind, "by"): ["cloth"] for kind in ("means", "categories")},
    **{(kind, "by"): "wish" for kind in ("bubbles", "rating_heatmap", "class_heatmap", "violins")},
    ("krippendorff_alpha", "level"): "nominal", ("krippendorff_alpha", "units"): ["dose"],
    ("power_law", "intensity"): "wide", ("power_law", "value"): "size",
    ("estimates", "label"): "wins", ("estimates", "value"): "worth", ("estimates", "low"): "value",
    ("estimates", "high"): "value", ("estimates", "tests"): ["map"],
    ("trends", "reference"): "s1", ("trends", "pooled"): "dose", ("trends", "families"): "side",
    ("pca", "reference"): "permuted", ("pca", "over"): "dose", ("procrustes", "over"): "dose",
    ("categories", "over"): ["cloth"], ("mixed_model", "numeric"): ["goal"], ("ordinal_model", "numeric"): ["age"],
    ("relevance", "interval"): "bca", ("means", "interval"): "none", ("psychometric", "interval"): "bootstrap",
    **{(kind, "source"): "choices" for kind in ("psychometric", "dprime", "binomial_mixed_model")},
    **{(kind, "source"): "choices" for kind in ("bradley_terry", "thurstone")},
    ("psychometric", "prior"): "levels", ("psychometric", "easy_catch"): "counted",
    ("psychometric", "method"): "staircase", ("psychometric", "order"): "back", ("psychometric", "by"): ["run"],
    ("retest", "targets"): ["stimulus", "attribute"], ("raters", "targets"): ["dose"],
    ("ordinal_model", "random"): "participant", ("ordinal_model", "interactions"): ["group:gender"],
    ("ordinal_model", "fixed"): ["gender"], ("likert", "source"): "ratings", ("likert", "by"): "group",
    ("thurstone", "method"): "least_squares", ("vectors", "starts"): 9, ("anova", "correction"): "HF",
    ("nemenyi", "ties"): True, ("lexicon", "normalisation"): "as_written", ("vectors", "on"): "pca",
    ("likert", "order"): "mean", ("rating_heatmap", "order"): "number", ("class_heatmap", "order"): "error",
    ("violins", "order"): "median", ("raincloud", "whiskers"): "sd", ("map", "dimensions"): [2, 1],
    ("map", "where"): {"cloth": "x"}, ("treemap", "tests"): ["cloths"], ("violins", "stimulus"): "piece",
    ("predicted", "stimulus"): "piece", ("predicted", "colour"): "kind", ("class_heatmap", "stimulus"): "piece",
    ("kendall_w", "targets"): "dose", ("dprime", "by"): ["participant"], ("binomial_mixed_model", "condition"): "where",
    ("binomial_mixed_model", "random"): "intercept", ("binomial_mixed_model", "link"): "logit",
    ("binomial_mixed_model", "where"): {"where": "near"}, ("dprime", "where"): {"track": "f40"},
    ("dprime", "model"): "independent_observation", ("dprime", "correction"): "when_extreme",
    ("icc", "targets"): "dose",
}  # fmt: skip
"""The same for one kind, where the name means something else there."""


@pytest.fixture(scope="module")
def materials() -> Mapping[str, Any]:
    """What simulated people rated and ticked; the words that some of them wrote, too; and ratings with a gap."""
    rated, ticked = (simulated_material(study, Path("no lab"), people(8), 3) for study in (RATED, TICKED))
    who = list(rated.participants)
    answers = {"age": map(str, (31, 22, 45, 38, 27, 52, 19, 33)), "gender": "mfffmmff", "hand": "lrrrrlrl"}
    everybody = People({name: dict(zip(who, levels, strict=True)) for name, levels in answers.items()})
    table = rated.ratings.table.assign(value=rated.ratings.table["value"].round(-1))  # with ties
    points = rated.forms["value"].where(rated.forms["attribute"] != "fun", 5.0 - rated.forms["value"] % 2)
    rated = replace(
        rated,
        people=everybody,
        forms=rated.forms.assign(value=points),
        ratings=replace(rated.ratings, table=table),
        own={"choices": tracks()},
    )
    first = ticked.words.iloc[:5]
    written = first.assign(kind=["further"] * 3 + ["own"] * 2, word=["light", "Light", "soft", "big", "light"])
    gap = (table["participant"] == "P002") & (table["stimulus"] == "s3") & table["attribute"].isin(["Soft", "Dear"])
    forms = rated.forms.assign(value=rated.forms["value"].mask(rated.forms["participant"] == "P003"))
    incomplete = {"gender": {**everybody.answers["gender"]}}
    del incomplete["gender"]["P003"]
    return {
        "ratings": rated,
        "words": replace(ticked, words=pd.concat([ticked.words, written], ignore_index=True)),
        "gap": replace(
            rated, ratings=replace(rated.ratings, table=table[~gap].reset_index(drop=True)), forms=forms,
            people=People({**everybody.answers, **incomplete}),
        ),
    }  # fmt: skip


ONCE = {("mixed_model", "profile")}
"""Settings that are dear and do the same in every case: they are set in the first one only."""
SLOW = ("mixed_model", "mds", "procrustes", "psychometric")
BY_DATA = {
    ("adjective_pairs", "new_words"), ("cronbach_alpha", "missing"), ("mds", "ties"), ("procrustes", "items"),
    ("pairs", "missing"), ("pca", "missing"), ("procrustes", "missing"), ("procrustes", "reflection"),
    ("vectors", "missing"), ("violins", "order"), ("bradley_terry", "correction"), ("thurstone", "correction"),
}  # fmt: skip
"""Settings that change nothing where the data have no ties, gaps, new words or mirrored maps: in one case they do."""


def selecting(material: Any, tests: list[Any], figures: list[Any]) -> Selector:
    declared = AnalysisPlan.model_validate({"study": material.name, "draws": 100, "least_people": 1})
    plan = Plan(Path("analysis.yaml"), "", declared, tuple(tests), tuple(figures), load(b"a: 1", "analysis.yaml"))
    return Selector(material, plan, TABLES)


def answers(material: Any, requests: list[Any]) -> list[Outcome]:
    """What tests answer, without the words that may only repeat a setting; and their notes."""
    outcomes_by_name: dict[str, list[Any]] = {request.name: [] for request in requests}
    notes = dict.fromkeys(outcomes_by_name, "")
    for answered in run_tests(selecting(material, requests, [])):
        a = answered.answer
        outcomes_by_name[answered.settings.name].append(
            (answered.outcome, answered.refused) if a is None else (answered.outcome, a.rows, a.headline, a.more)
        )
        notes[answered.settings.name] += "" if a is None else " ".join(a.notes)
    return [Outcome(repr(outcomes_by_name[name]), notes[name]) for name in outcomes_by_name]


@pytest.fixture(scope="module")
def shown(materials: Mapping[str, Any]) -> Mapping[str, Any]:
    """The answers of the tests that figures show."""
    tests = [TESTS[one["test"]].settings.model_validate(one) for one in SHOWN]
    relevance = {"name": "relevance", "test": "relevance", "normalisation": "share_of_trials", "threshold": 0.6}
    words = [TESTS["relevance"].settings.model_validate(relevance)]
    return {
        **by_name(run_tests(selecting(materials["ratings"], tests, []))),
        **by_name(run_tests(selecting(materials["words"], words, []))),
    }


def pictures(material: Any, requests: list[Any], shown: Mapping[str, Any]) -> list[Outcome]:
    """What figures draw, without their captions; and their captions."""
    return [
        Outcome(figure.refused, "")
        if (data := figure.data) is None
        else Outcome(repr((data.rows, data.words, data.title)), data.caption)
        for figure in figure_data(selecting(material, [], requests), shown)
    ]


def tried(
    of: Any, key: str, kind: str, case: Settings, outcomes: Callable[[list[Any], bool], list[Outcome]]
) -> Effects:
    """Each setting of the kind set to another value in this case: its name, and what came of it.

    `outcomes` gives what comes of tests or figures, on data with gaps for `missing` and for mixed models.
    """
    model, base = of.settings, {"name": "base", key: kind, **case}
    gaps = case.get("missing") == "mixed_model"
    effects, others = [], {}
    for name in model.model_fields:
        value = OWN.get((kind, name), OTHER.get(name))
        again = (kind, name) in ONCE and case is not (REQUESTS | FIGURE_CASES)[kind][0]
        if again or name in ("name", key) or base.get(name, model.model_fields[name].default) == value:
            continue
        try:
            others[name] = model.model_validate({**base, "name": f"with_{name}", name: value})
        except ValidationError:
            effects.append((name, "refused"))
    for gap in (False, True):
        names = [name for name in others if gap == (gaps or name == "missing")]
        if not names:
            continue
        before, *after = outcomes([model.model_validate(base), *(others[name] for name in names)], gap)
        for name, outcome in zip(names, after, strict=True):
            idle = name in {setting.name for setting in idle_settings(others[name], of)}
            noted = idle or f"The plan's `{name}` has no effect" in outcome.notes
            changed = outcome.content.replace(f"with_{name}", "base") != before.content
            noted_as = "false note" if changed else "noted"
            effects.append((name, noted_as if noted else "changes" if changed else "no effect"))
    return effects


def test_every_kind_has_cases_and_every_setting_a_value_to_try() -> None:
    assert sorted(REQUESTS) == sorted(TESTS)
    assert sorted(FIGURE_CASES) == sorted(FIGURES)
    models = {kind: TESTS[kind].settings for kind in TESTS} | {f"{k} (figure)": FIGURES[k].settings for k in FIGURES}
    assert not {
        f"{kind}: {name}"
        for kind, model in models.items()
        for name in model.model_fields
        if name not in (*OTHER, "name", "test", "figure") and (kind, name) not in OWN
    }


@pytest.mark.parametrize("kind", [pytest.param(kind, marks=[pytest.mark.long] * (kind in SLOW)) for kind in REQUESTS])
def test_a_setting_of_a_test_changes_its_answer_or_is_noted(
    kind: str, materials: Mapping[str, Any], full_run: bool
) -> None:
    of = TESTS[kind]

    def outcomes(requests: list[Any], gap: bool) -> list[Outcome]:
        return answers(materials["words" if of.takes == "words" else "gap" if gap else "ratings"], requests)

    cases = REQUESTS[kind] if full_run else REQUESTS[kind][:1]
    demand_effects(kind, [(case, tried(of, "test", kind, case, outcomes)) for case in cases], full_run)


@pytest.mark.parametrize("kind", FIGURE_CASES)
def test_a_setting_of_a_figure_changes_it_or_is_noted(
    kind: str, materials: Mapping[str, Any], shown: Mapping[str, Any], full_run: bool
) -> None:
    of = FIGURES[kind]

    def outcomes(requests: list[Any], _gap: bool) -> list[Outcome]:
        return pictures(materials["words" if of.takes == "words" else "ratings"], requests, shown)

    cases = FIGURE_CASES[kind] if full_run else FIGURE_CASES[kind][:1]
    demand_effects(kind, [(case, tried(of, "figure", kind, case, outcomes)) for case in cases], full_run)


def demand_effects(kind: str, effects_of_cases: list[tuple[Settings, Effects]], whole: bool) -> None:
    """Nothing is without effect in silence, no note is false, and what is tried is not only refused."""
    assert not [(name, case) for case, settings in effects_of_cases for name, what in settings if what == "false note"]
    silent = [(name, case) for case, settings in effects_of_cases for name, what in settings if what == "no effect"]
    assert not [(name, case) for name, case in silent if (kind, name) not in BY_DATA]
    if not whole:
        return
    effects: dict[str, set[str]] = {}
    for _, settings in effects_of_cases:
        for name, what in settings:
            effects.setdefault(name, set()).add(what)
    assert not [name for name, what in effects.items() if what == {"refused"} and name != "whiskers"]
    assert not [name for name, what in effects.items() if "no effect" in what and "changes" not in what]
