"""Every option of every public function changes what the function says, or is refused where it could not.

The functions and their options are found by `inspect`. For each function there are calls in the table below, one for
each combination of arguments in which options may lose their effect. In each of them every option is set to
another value: the answer must differ, apart from a field that only repeats the option, or the call must be refused.
A function without calls and an option without a value to try fail the test.
"""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd
import pytest

from palpate import analysis
from palpate.analysis.spaces.dissimilarities import dissimilarities_of, profile_distances
from palpate.analysis.spaces.profiles import gather_profiles
from palpate.analysis.statistics.refusals import BadOption

Call = dict[str, Any]


def _ratings() -> pd.DataFrame:
    """Nine people in three groups of 4, 3 and 2 and of two sexes; 3 x 2 ratings each, many of them equal."""
    rng = np.random.default_rng(11)
    groups, sexes = ["a", "a", "a", "a", "b", "b", "b", "c", "c"], ["f", "m", "f", "m", "f", "m", "m", "f", "m"]
    rows = [
        {"who": f"P{i}", "other": f"Q{i % 4}", "group": groups[i], "sex": sexes[i], "age": 20 + 3 * i + i % 2,
         "item": item, "side": side, "value": float(rng.integers(-3, 4) + j + k * (i % 3)),
         "second": float(rng.integers(-3, 4))}
        for i in range(9)
        for j, item in enumerate(("x", "y", "z"))
        for k, side in enumerate(("l", "r"))
    ]  # fmt: skip
    return pd.DataFrame(rows)


RATINGS = _ratings()
ONE_SIDE = RATINGS[RATINGS["side"] == "l"].reset_index(drop=True)
PEOPLE = ONE_SIDE[ONE_SIDE["item"] == "x"].reset_index(drop=True)


def with_gap(call: Call) -> Call:
    """The same with a value missing."""
    data = call["data"].copy()
    data.loc[4, call.get("dv", "value")] = np.nan
    return call | {"data": data}


def with_repeats(call: Call) -> Call:
    """The same with a person's answers given twice, the second time otherwise."""
    data = call["data"]
    again = data[data["who"] == "P1"].assign(value=lambda rows: rows["value"] + 1)
    return call | {"data": pd.concat([data, again], ignore_index=True)}


def _choices() -> pd.DataFrame:
    rows = [("p", "q", 6, 0, "p"), ("q", "p", 3, 0, "p"), ("q", "r", 5, 0, "r"), ("r", "q", 2, 0, "q"),
            ("p", "r", 4, 0, "p"), ("r", "p", 2, 0, "p"),
            ("p", "q", 2, 1, "q"), ("q", "r", 1, 1, "q"), ("p", "r", 1, 1, "r")]  # fmt: skip
    return pd.DataFrame(rows, columns=["winner", "loser", "times", "tied", "first"])


def _levels() -> pd.DataFrame:
    rows = [(1.0, 3, 30), (2.0, 5, 30), (3.0, 11, 30), (4.0, 20, 30), (5.0, 25, 30), (6.0, 27, 30)]
    return pd.DataFrame(rows, columns=["level", "hits", "of"]).assign(more=40)


def _staircase() -> pd.DataFrame:
    levels = [8, 7, 6, 5, 6, 7, 6, 5, 4, 5, 6, 5, 6, 5, 4, 5, 6, 7, 6, 5]
    hits = [int(after <= before) for before, after in zip(levels, [*levels[1:], 4], strict=True)]
    turns = np.random.default_rng(1).permutation(len(levels))
    return pd.DataFrame({"level": levels, "hit": hits, "turn": turns})


def _words() -> tuple[pd.DataFrame, pd.DataFrame]:
    """Ticked words, and the trials: everyone meets two stimuli twice. The columns with a 2 hold something else."""
    rng = np.random.default_rng(3)
    trials = [
        {"participant": f"P{i}", "participant2": f"P{i % 2}", "session": "s", "trial": 2 * j + k, "block": j,
         "stimulus": f"s{j}", "stimulus2": f"t{(2 * j + k) % 3}"}
        for i in range(6) for j in range(4) for k in range(2)
    ]  # fmt: skip
    offered = ["Soft", "hard", "warm", "cold"]
    ticks = [
        {**trial, "word": word, "word2": offered[(n + 1) % 4]}
        for trial in trials
        for n, word in enumerate(offered)
        if rng.random() < 0.3 + 0.12 * n
    ]
    return pd.DataFrame(ticks), pd.DataFrame(trials)


def _targets() -> pd.DataFrame:
    rng = np.random.default_rng(4)
    rows = [
        {"participant": f"P{i}", "pair": f"R{i // 2}", "attribute": a, "stimulus.attribute": a, "about": "hot",
         "target": t, "goal": t / 2, "value": t + float(rng.integers(-3, 4))}
        for i in range(6) for a in ("hot", "hard") for t in (-6.0, 6.0)
    ]  # fmt: skip
    return pd.DataFrame(rows)


WORDS, TRIALS = _words()
CHOICES, LEVELS, TARGETS = _choices(), _levels(), _targets()
MAP = pd.DataFrame([[0.0, 1], [2, 0.5], [1, 3], [4, 1], [2, 2], [5, 4]], index=list("uvwxyz"), columns=["Dim1", "Dim2"])
TURNED = pd.DataFrame([[1.0, 0], [0, 2], [3, 1], [1, 4], [2, 0], [0, 1]], index=MAP.index, columns=MAP.columns)


def _profiles() -> Any:
    rng = np.random.default_rng(6)
    rows = [
        {"who": f"P{i}", "what": what, "attribute": f"a{j}", "value": float(rng.integers(0, 3) + n % (j + 2))}
        for i in range(2)
        for n, what in enumerate("uvwxyz")
        for j in range(3)
    ]
    return gather_profiles(pd.DataFrame(rows), "value", "what", "attribute", "who")


TIED = np.array([[0, 1, 2, 3, 2, 1], [1, 0, 3, 2, 1, 3], [2, 3, 0, 1, 3, 2], [3, 2, 1, 0, 2, 2], [2, 1, 3, 2, 0, 1],
                 [1, 3, 2, 2, 1, 0]])  # fmt: skip
ORDERED = dissimilarities_of(pd.DataFrame(TIED, index=list("uvwxyz"), columns=list("uvwxyz")))
BETWEEN = profile_distances(_profiles())
WIDE = _profiles().means()
MODEL = {"data": RATINGS, "dv": "value", "fixed": ["item"], "random": {"who": []}, "reml": False}
ORDINAL = {"data": RATINGS.assign(value=RATINGS["value"].clip(-2, 2)), "dv": "value"}
WITHIN = {"data": RATINGS, "dv": "value", "within": ["item", "side"], "subject": "who"}
GROUPS = {"data": RATINGS, "dv": "value", "between": "group"}
PERSONS = {"data": PEOPLE, "dv": "value", "between": "group", "subject": "who"}
ONE = {"data": ONE_SIDE, "dv": "value", "within": "item", "subject": "who"}
CROSSED = {"data": ONE_SIDE, "dv": "value", "targets": "item", "raters": "who"}
MANY = {**CROSSED, "data": RATINGS.assign(item=RATINGS["item"] + RATINGS["side"])}
COUNTED = {"data": LEVELS, "level": "level", "correct": "hits", "n": "of"}
TASKS: list[Call] = [{"task": "symmetric"}, {"task": "yes_no"}, {"task": "forced_choice", "alternatives": 10}]
TICKED: Call = {"words": WORDS, "trials": TRIALS, "trial": ["session", "trial"]}


def selections() -> Any:
    """Which words were ticked by whom."""
    return analysis.gather_selections(WORDS, TRIALS)


def model(**options: Any) -> Any:
    """A fitted mixed model."""
    return analysis.mixed_model(**MODEL | options)


def psychometric() -> Any:
    """A fitted function."""
    return analysis.fit_psychometric(LEVELS, "level", "hits", "of", task="symmetric", lapse=0)


CALLS: Mapping[str, Callable[[], list[Call]]] = {
    "aligned_ranks": lambda: [
        {**ONE},
        {**PERSONS},
        {**ONE, "between": "group"},
        {**PERSONS, "between": ["group", "sex"]},
    ],
    "anova": lambda: [GROUPS, PERSONS, {**GROUPS, "subject": "who", "aggregate": "mean"}],
    "antonym_pairs": lambda: [
        {"kept": ["soft", "warm"], "table": pd.DataFrame({"word": ["soft", "warm"], "antonym": ["hard", "cold"]})}
    ],
    "apa_f": lambda: [{"row": analysis.mixed_anova(**ONE).to_dict("records")[0]}],
    "apa_p": lambda: [{"p": 0.04}],
    "apa_t": lambda: [{"row": analysis.pairwise_tests(**ONE).to_dict("records")[0]}],
    "bradley_terry": lambda: [
        {"data": CHOICES, "winner": "winner", "loser": "loser"},
        {"data": CHOICES, "winner": "winner", "loser": "loser", "tie": "tied", "first": "first", "count": "times"},
    ],
    "cohen_kappa": lambda: [{"counts": np.array([[6, 1, 0], [2, 5, 1], [0, 1, 4]])}],
    "classical_mds": lambda: [{"between": BETWEEN, "dimensions": 1}],
    "compare_models": lambda: [
        {
            "smaller": model(),
            "larger": model(fixed=["item", "side"]),
        }
    ],
    "confidence_ellipses": lambda: [
        {"between": BETWEEN, "points": analysis.classical_mds(BETWEEN).points, "draws": 30},
        {"between": BETWEEN, "points": MAP, "method": "nonmetric", "draws": 20},
    ],
    "cronbach_alpha": lambda: [{"data": ONE_SIDE, "dv": "value", "items": "item", "cases": "who"}],
    "dz_interval": lambda: [{"dz": 0.4, "n": 12}],
    "equivalence_tests": lambda: [
        {**ONE, "bounds": (-1, 1)},
        {**PERSONS, "bounds_dz": 0.5},
        {**GROUPS, "bounds": (-1, 1)},
    ],
    "eta_squared_interval": lambda: [{"f": 5.0, "df1": 2, "df2": 20}],
    "eta_squared_intervals": lambda: [
        {"table": analysis.rm_anova(**ONE)},
        {"table": analysis.anova(**PERSONS)},
    ],
    "fit_psychometric": lambda: [COUNTED | task for task in TASKS],
    "fleiss_kappa": lambda: [{"counts": np.array([[3, 1], [2, 2], [0, 4]])}],
    "friedman": lambda: [{**ONE, "draws": 100}],
    "gather_selections": lambda: [TICKED],
    "hedges_interval": lambda: [{"g": 0.5, "n1": 8, "n2": 9}],
    "icc": lambda: [CROSSED],
    "kendall_w": lambda: [{**MANY, "p": how} for how in ("auto", "exact", "permutation", "chi2")],
    "krippendorff_alpha": lambda: [
        {"data": ONE_SIDE, "dv": "value", "units": "who", "raters": "item", "level": "interval", "draws": draws}
        for draws in (100, 0)
    ],
    "lexicon": lambda: [{"data": WORDS}],
    "likert": lambda: [{"data": PEOPLE, "dv": "value", "item": "group", "points": range(-9, 10)}],
    "mauchly_tests": lambda: [ONE],
    "mean_intervals": lambda: [
        {"data": ONE_SIDE, "by": ["item"], "subject": "who", "method": how}
        for how in ("cousineau_morey", "loftus_masson", "between", "none")
    ],
    "merge_word_lists": lambda: [{"lists": {"one": ["Soft", "softer", "warm"], "two": ["soft", "hot"]}}],
    "mixed_anova": lambda: [
        {**ONE},
        {**PERSONS},
        {"data": PEOPLE, "dv": "value", "between": "group"},
        {"data": PEOPLE, "dv": "value", "between": ["group", "sex"]},
        {**ONE, "between": "group"},
    ],
    "mixed_model": lambda: [
        MODEL,
        {**MODEL, "fixed": [], "numeric": ["age"]},
        {**MODEL, "fixed": ["item", "side"], "random": {"who": ["side"]}},
    ],
    "nemenyi": lambda: [ONE],
    "nonmetric_mds": lambda: [{"between": ORDERED, "dimensions": 1, "starts": starts} for starts in (2, 0)],
    "normalised": lambda: [
        {"table": ONE_SIDE.assign(participant=ONE_SIDE["who"]), "scale": (-9, 9), "how": "to_0_100"}
    ],
    "ordinal_model": lambda: [
        {**ORDINAL, "fixed": ["item"]},
        {**ORDINAL, "numeric": ["age"]},
        {**ORDINAL, "fixed": ["item"], "random": "who"},
    ],
    "pairwise_tests": lambda: [ONE, {**ONE, "padjust": "bonf"}, PERSONS, GROUPS],
    "parallel_analysis": lambda: [{"table": WIDE, "draws": 50, "kind": kind} for kind in ("correlation", "covariance")],
    "pca": lambda: [{"table": WIDE}],
    "posterior": lambda: [COUNTED | task | {"overdispersed": False} for task in TASKS],
    "procrustes": lambda: [{"target": MAP, "other": TURNED}, {"target": MAP, "other": TURNED, "draws": 99}],
    "profile_interval": lambda: [{"fit": psychometric(), "which": "threshold", "draws": draws} for draws in (100, 0)],
    "resampled_answers": lambda: [{"fit": psychometric(), "draws": 100}],
    "profile_intervals": lambda: [{"model": model()}],
    "property_vectors": lambda: [{"points": MAP, "properties": WIDE}, {"points": MAP, "properties": WIDE, "draws": 99}],
    "random_effects": lambda: [{"model": model()}],
    "relevance": lambda: [
        {"selections": selections(), "normalisation": "share_of_trials", "threshold": 0.5, "draws": draws}
        for draws in (100, 0)
    ],
    "retest": lambda: [
        {"data": RATINGS, "dv": "value", "subject": "who", "targets": "item", "order": "side"},
    ],
    "rm_anova": lambda: [ONE, WITHIN],
    "self_check": lambda: [ONE, {**ONE, "between": "group"}, {"data": PEOPLE, "dv": "value", "between": "group"}],
    "staircase": lambda: [{"data": _staircase(), "level": "level", "correct": "hit"}],
    "target_errors": lambda: [{"data": TARGETS}, {"data": TARGETS, "scale": (-20, 20)}],
    "thurstone": lambda: [
        {"data": CHOICES, "winner": "winner", "loser": "loser", "method": how}
        for how in ("likelihood", "least_squares")
    ],
    "wilcoxon_tests": lambda: [ONE, {**ONE, "padjust": "bonf"}, PERSONS, GROUPS],
    "word_agreement": lambda: [{"selections": selections(), "draws": draws} for draws in (100, 0)],
}
"""For each function the calls in which every option is tried."""

OTHER: Mapping[str, Any] = {
    "added": 3.0,
    "aggregate": "mean",
    "alpha": 0.2,
    "alternatives": 3,
    "attribute_column": "about",
    "between": "sex",
    "bounds": (-2, 3),
    "bounds_dz": 0.3,
    "categories": {"hot": "physical", "hard": "emotional"},
    "coding": "sum",
    "confidence": 0.6,
    "constraint": "q",
    "correction": "GG",
    "count": "times",
    "dimensions": 2,
    "draws": 150,
    "dv": "second",
    "effect_interval": 0.9,
    "eta": "generalized",
    "exact": False,
    "falling": True,
    "family": 9,
    "first": "first",
    "fixed": ["side"],
    "function": "gaussian",
    "guess": (0.0, 0.01),
    "inflected": False,
    "interactions": ["item:side"],
    "interval": "bca",
    "jnd": "x84_x50",
    "kind": "correlation",
    "lapse": 0.02,
    "last": 4,
    "levels": {"item": ["z", "y", "x"]},
    "link": "probit",
    "method": "least_squares",
    "missing": "listwise",
    "most": 5,
    "n": "of",
    "need_both": True,
    "normalisation": "as_written",
    "numeric": ["age"],
    "offered": ["Soft", "hard", "warm", "cold", "dry"],
    "order": "turn",
    "orders": {"item": ["z", "y", "x"]},
    "overdispersed": True,
    "p": "chi2",
    "padjust": "holm",
    "participant": "participant2",
    "quantile": 0.5,
    "random": "who",
    "reference": "permuted",
    "reflection": False,
    "reml": True,
    "reverse": ["x"],
    "scale": (-5, 5),
    "seed": 5,
    "starts": 3,
    "stimulus": "stimulus2",
    "subject": "other",
    "sum_of_squares": "II",
    "synonyms": {"soft": "warm"},
    "target": "goal",
    "target_scale": (-10, 10),
    "threshold": 0.3,
    "tie": "tied",
    "ties": True,
    "trial": ["session", "turn"],
    "uncorrelated": ["who"],
    "within": "side",
    "word": "word2",
    "zeros": "pratt",
}
"""Another value of each option, by its name."""

OWN: Mapping[tuple[str, str], Any] = {
    ("confidence_ellipses", "method"): "nonmetric",
    ("confidence_ellipses", "ties"): "secondary",
    ("cronbach_alpha", "missing"): "drop_cases",
    ("icc", "missing"): "drop_raters",
    ("kendall_w", "missing"): "drop_raters",
    ("mean_intervals", "method"): "between",
    ("mean_intervals", "between"): ["item"],
    ("nonmetric_mds", "ties"): "secondary",
    ("ordinal_model", "levels"): [2, 1, 0, -1, -2],
    ("procrustes", "scale"): False,
    ("target_errors", "levels"): {"attribute": ["hot", "hard"]},
    ("target_errors", "subject"): "pair",
    ("apa_f", "correction"): "none",
    ("fit_psychometric", "n"): "more",
    ("posterior", "n"): "more",
    ("gather_selections", "trial"): ["block"],
    ("lexicon", "trial"): ["session"],
    ("antonym_pairs", "offered"): ["soft", "warm", "cold"],
}
"""The same for one function, where the name means something else there."""

CHANGED: Mapping[str, Callable[[Call], Call]] = {"missing": with_gap, "aggregate": with_repeats}
"""What data an option is about."""


def options(name: str) -> list[str]:
    """Every parameter of a function that has a default."""
    parameters = inspect.signature(getattr(analysis, name)).parameters.values()
    return [parameter.name for parameter in parameters if parameter.default is not inspect.Parameter.empty]


def functions() -> list[str]:
    """Every public function."""
    return [name for name in analysis.__all__ if not inspect.isclass(getattr(analysis, name))]


def plain(value: Any, repeated: tuple[str, Any]) -> Any:
    """An answer as plain values that can be compared, without fields that only repeat the option and its value."""
    if isinstance(value, pd.DataFrame):
        value = {str(name): value[name].tolist() for name in value}
    elif isinstance(value, pd.Series | np.ndarray):
        value = value.tolist()
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        hidden = ("asked", "fit", "maximum")  # the request, and methods of the result
        value = {f.name: getattr(value, f.name) for f in dataclasses.fields(value) if f.name not in hidden}
    elif hasattr(value, "_asdict"):
        value = value._asdict()
    if isinstance(value, Mapping):
        return {str(name): plain(own, repeated) for name, own in value.items() if not _repeats(name, own, repeated)}
    if isinstance(value, list | tuple):
        return [plain(item, repeated) for item in value]
    return "NaN" if isinstance(value, float) and np.isnan(value) else value


def _repeats(name: object, value: Any, repeated: tuple[str, Any]) -> bool:
    option, given = repeated
    return name == option and (value is given or (isinstance(value, list) and all(item == given for item in value))
                               or (isinstance(value, str | int | float) and value == given))  # fmt: skip


def outcome(name: str, call: Call, option: str) -> tuple[str, Any]:
    """What a call gives, or the reason of its refusal."""
    default = inspect.signature(getattr(analysis, name)).parameters[option].default
    try:
        return "answer", plain(getattr(analysis, name)(**call), (option, call.get(option, default)))
    except BadOption as refusal:
        return "refused", str(refusal)
    except ValueError as refusal:
        return "impossible", str(refusal)


def call_text(call: Call) -> Call:
    """What of a call can be shown."""
    return {key: value for key, value in call.items() if isinstance(value, str | int | float | list)}


def tried(name: str) -> Iterator[tuple[str, Call, str]]:
    """Each option in each call: its name, the call, and what came of setting it."""
    for call in CALLS[name]():
        for option in options(name):
            value, given = OWN.get((name, option), OTHER[option]), CHANGED.get(option, dict)(call)
            if call.get(option) == value:
                continue
            base, with_it = (outcome(name, options, option) for options in (given, given | {option: value}))
            assert base[0] != "refused", (name, option, call_text(call), base)
            what = "refused" if with_it[0] == "refused" else "changes" if with_it != base else "no effect"
            yield option, call, what


def test_every_function_has_calls_and_every_option_a_value_to_try() -> None:
    assert sorted(CALLS) == sorted(functions())
    unknown = {f"{name}({option})" for name in functions() for option in options(name)
               if option not in OTHER and (name, option) not in OWN}  # fmt: skip
    assert not unknown, "give them a value to try in OTHER or OWN"


@pytest.mark.parametrize("name", [name for name in functions() if options(name)])
def test_an_option_changes_the_answer_or_is_refused(name: str) -> None:
    outcomes = list(tried(name))
    assert not [(option, call_text(call)) for option, call, what in outcomes if what == "no effect"]
    useful = {option for option, _, what in outcomes if what == "changes"}
    assert useful == set(options(name))
