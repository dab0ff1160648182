"""Comparison of each answer of a plan with another package's: the largest relative difference, or why there is none."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations, product
from typing import Any

import numpy as np
import pandas as pd

from palpate.analysis.crosschecking import conditions, packages
from palpate.analysis.crosschecking.conditions import (
    MOST_VALUES_SQUARED,
    NEAR_ZERO,
    PINGOUIN,
    STATSMODELS,
    Checked,
    NotChecked,
    Pair,
    cells_of,
    demand_size,
    refuse,
    wide_table,
)
from palpate.analysis.crosschecking.variance_checks import (
    check_aligned_ranks,
    check_anova,
    check_equivalence,
    check_friedman,
    check_kendall_w,
    check_nemenyi,
    check_pairs,
    check_wilcoxon,
)
from palpate.analysis.plans.answers import Answer, QuestionResult, Row, Value
from palpate.analysis.statistics.one_thread import one_thread
from palpate.protocols.canonical import json_text
from palpate.protocols.extras import installed_version
from palpate.protocols.progress import Progress
from palpate.protocols.wording import count, phrase

LIMIT = 1e-6
"""A larger relative difference is a disagreement."""
_FAILURES = (ArithmeticError, AssertionError, AttributeError, LookupError, TypeError, ValueError, np.linalg.LinAlgError)
FILE = "crosscheck.json"


@dataclass(frozen=True)
class CrossCheck:
    """The comparison of one answer with another package's, or the reason why there is none (`package` then may be "").

    `difference` is the largest relative difference over `numbers` numbers, `where` names that number.
    """

    test: str
    outcome: str
    package: str = ""
    version: str = ""
    numbers: int = 0
    difference: float | None = None
    where: str = ""
    reason: str = ""

    @property
    def disagrees(self) -> bool:
        """Whether the packages give different numbers where neither is known to be wrong."""
        return self.difference is not None and not self.difference <= LIMIT

    def checked_with(self) -> str:
        """Return package and version, or the reason why none was used."""
        return f"not checked: {self.reason}" if self.reason else f"{self.package} {self.version}"

    def text(self) -> str:
        """Return one line for a disagreement."""
        name = " ".join(filter(None, (self.test, self.outcome)))
        apart = difference_text(self)
        how = apart if math.isinf(self.difference or 0.0) else f"differs by {apart} of its value"
        return f"{name}: {self.where}: {how} ({self.checked_with()})"


def difference_text(check: CrossCheck) -> str:
    """Return the largest relative difference as text, "" if nothing was compared."""
    if check.difference is None:
        return ""
    if math.isinf(check.difference):
        return "one of the two has no number"
    return f"{check.difference:.0e}" if check.difference else "0"


def cross_check(answered: Sequence[QuestionResult], progress: Progress = lambda *_: None) -> tuple[CrossCheck, ...]:
    """Check every answer of a kind that another package supports, in the plan's order."""
    comparable = [
        answered_test
        for answered_test in answered
        if answered_test.settings.test in CHECKS and answered_test.answer is not None
    ]
    checks = []
    with one_thread():
        for done, answered_test in enumerate(comparable):
            progress(done, len(comparable), f"checking {answered_test.settings.name} {answered_test.outcome}".rstrip())
            checks.append(_checked(answered_test))
    progress(len(comparable), len(comparable), "")
    return tuple(checks)


def _checked(answered: QuestionResult) -> CrossCheck:
    name, outcome = answered.settings.name, answered.outcome
    package = used = ""
    try:
        if answered.answer is None or answered.rows is None:
            raise NotChecked("there is no answer")
        package, pairs = CHECKS[answered.settings.test](answered, answered.answer, answered.rows)
        if (installed := installed_version(package)) is None:
            raise NotChecked(f"{package} is not installed")
        used = installed
        differences = [(difference(pair), pair.where) for pair in pairs]
    except NotChecked as reason:
        return CrossCheck(name, outcome, package, used, reason=str(reason))
    except _FAILURES as error:  # the second opinion must not cost the first one
        what = f"{type(error).__name__}: {' '.join(str(error).split())[:120]}"
        return CrossCheck(name, outcome, package, used, reason=f"{package or 'the comparison'} failed ({what})")
    worst, where = max(differences, default=(0.0, ""))
    return CrossCheck(name, outcome, package, used, len(differences), worst, where)


def difference(pair: Pair) -> float:
    """Return the relative difference of one number: 0 if both are undefined, infinite if only one of them is."""
    ours = math.nan if pair.ours is None else float(pair.ours)
    theirs = pair.theirs
    if math.isnan(ours) or math.isnan(theirs):
        return 0.0 if math.isnan(ours) and math.isnan(theirs) else math.inf
    if pair.decimals is not None and abs(ours - theirs) <= 0.5 * 10.0**-pair.decimals * (1 + 1e-9):
        return 0.0
    size = max(abs(ours), abs(theirs), pair.floor)
    return abs(ours - theirs) / size if size > 1e-290 else 0.0


def _check_anova(answered: QuestionResult, answer: Answer, rows: pd.DataFrame) -> Checked:
    settings: Any = answered.settings
    if settings.within and answered.missing.cells and not answered.missing.left_out:
        # An analysis of variance that a mixed model of the cells answered (`gaps_answer`).
        factors = [*settings.within, *settings.between]
        keys = ["participant", *factors]
        means = rows[rows["value"].notna()].groupby(keys, observed=True)["value"].mean().reset_index()
        crossed = [":".join(parts) for size in range(2, len(factors) + 1) for parts in combinations(factors, size)]
        orders = [parts for size in range(1, len(settings.within)) for parts in combinations(settings.within, size)]
        grouping = ("participant", *(":".join(("participant", *parts)) for parts in orders))
        model = Model(tuple(factors), (), tuple(crossed), dict.fromkeys(grouping, ()), "sum", True)
        return STATSMODELS, _check_model(model, means, answer, answer.more["coefficients"], answer.rows)
    return check_anova(answered, answer, rows)


def _check_icc(answered: QuestionResult, answer: Answer, rows: pd.DataFrame) -> Checked:
    settings: Any = answered.settings
    cells = cells_of(rows, [settings.targets, settings.raters], settings.value)
    demand_size(len(cells))
    _demand_icc(wide_table(cells, "f0", ["f1"]))
    return PINGOUIN, _icc_pairs(answer.rows, cells, settings.confidence, "type")


def _demand_icc(wide: pd.DataFrame) -> None:
    values = wide.to_numpy(dtype=float)
    refuse(conditions.incomplete(wide), conditions.out_of_range(values))
    refuse(conditions.drowned(values), conditions.undefined_icc(values))


def _icc_pairs(rows: Sequence[Mapping[str, Value]], cells: pd.DataFrame, confidence: float, by: str) -> Iterator[Pair]:
    numbers = packages.read_pingouin_icc(packages.pingouin_icc(cells, "y", "f0", "f1"))
    for row in rows:
        kind = str(row[by])
        for name in ("ICC", "F", "p"):
            if name in row:
                yield Pair(f"{name} of {kind}", row[name], numbers[kind, name], 0.0 if name == "p" else NEAR_ZERO)
        for name in ("ci_low", "ci_high") if confidence == 0.95 else ():
            yield Pair(f"{name} of {kind}", row[name], numbers[kind, name], decimals=packages.ICC_INTERVAL_DECIMALS)


def _check_alpha(answered: QuestionResult, answer: Answer, rows: pd.DataFrame) -> Checked:
    settings: Any = answered.settings
    cases = list(settings.cases or [name for name in ("participant", "stimulus") if name in rows.columns])
    cells = cells_of(rows, [*cases, settings.items], settings.value)
    demand_size(len(cells))
    wide = cells.pivot(index=list(cells.columns[: len(cases)]), columns=f"f{len(cases)}", values="y")
    if settings.missing == "listwise":
        wide = wide.dropna()
    turned = wide.assign(**{name: -wide[name] for name in map(str, settings.reverse) if name in wide})
    refuse(conditions.incomplete(wide), conditions.out_of_range(wide.to_numpy()))
    values = wide.to_numpy(dtype=float)
    refuse(conditions.drowned(values), conditions.drowned(values.mean(axis=1)))

    def pairs() -> Iterator[Pair]:  # computed only where the package is installed
        numbers = packages.pingouin_alpha(turned, settings.confidence)
        for row in answer.rows:
            yield Pair("alpha", row["alpha"], numbers["alpha"], NEAR_ZERO)
            for name in ("ci_low", "ci_high"):
                yield Pair(name, row[name], numbers[name], decimals=packages.ALPHA_INTERVAL_DECIMALS)

    return PINGOUIN, pairs()


def _check_retest(answered: QuestionResult, answer: Answer, rows: pd.DataFrame) -> Checked:  # noqa: ARG001
    settings: Any = answered.settings
    pairs = pd.DataFrame([dict(row) for row in answer.more.get("pairs", ())])
    if not len(pairs):
        raise NotChecked("the answer lists no pairs")
    wide = pairs[["first", "second"]].astype("float64")
    demand_size(wide.size)
    _demand_icc(wide)
    cells = wide.rename_axis("f0").reset_index().melt(id_vars="f0", var_name="f1", value_name="y")
    names = {"ICC(A,1)": "ICC2", "ICC(C,1)": "ICC3"}
    measured = [
        {"type": names[str(row["measure"])], "ICC": row["value"], "ci_low": row["ci_low"], "ci_high": row["ci_high"]}
        for row in answer.rows
        if row["measure"] in names
    ]
    return PINGOUIN, _icc_pairs(measured, cells, settings.confidence, "type")


@dataclass(frozen=True)
class Model:
    """The specification of a mixed model, as in a plan."""

    fixed: tuple[str, ...]
    numeric: tuple[str, ...]
    interactions: tuple[str, ...]
    random: Mapping[str, Sequence[str]]
    coding: str
    reml: bool


def _check_mixed_model(answered: QuestionResult, answer: Answer, rows: pd.DataFrame) -> Checked:
    settings: Any = answered.settings
    model = Model(
        settings.fixed, settings.numeric, settings.interactions, settings.random, settings.coding, settings.reml
    )
    if settings.uncorrelated and any(settings.random.values()):
        raise NotChecked("MixedLM has no uncorrelated slopes")
    table = rows[rows["value"].notna()].reset_index(drop=True)
    return STATSMODELS, _check_model(model, table, answer, answer.rows, answer.more["effects"])


def _check_model(
    model: Model, table: pd.DataFrame, answer: Answer, coefficients: Sequence[Row], effects: Sequence[Row]
) -> Iterable[Pair]:
    slopes = [name for names in model.random.values() for name in names]
    if slopes and (len(model.random) > 1 or any(name not in model.numeric for name in slopes)):
        raise NotChecked("MixedLM has random slopes of numbers within one grouping factor only")
    demand_size(len(table))
    columns = {str(row["effect"]): f"x{place}" for place, row in enumerate(coefficients)}
    values = _fixed_columns(table, model, list(columns))
    groups: dict[str, list[str]] = {}
    for place, name in enumerate(model.random):
        parts = [name] if name in table.columns else name.split(":")
        labels = zip(*(table[part].astype(str) for part in parts), strict=True)
        groups[f"g{place}"] = [":".join(own) for own in labels]
    numbers = {f"s{place}": _numbers(table[name]) for place, name in enumerate(slopes)}
    own = table["value"].to_numpy(dtype=float)
    frame = pd.DataFrame({"y": own, **dict(zip(columns.values(), values, strict=True)), **groups, **numbers})
    if not packages.nested(frame, list(groups)):
        demand_size(len(table), MOST_VALUES_SQUARED)
    refuse(conditions.out_of_range(own))
    refuse(conditions.extreme_ratio(own, np.column_stack(values), list(groups.values())))
    names = {**dict(zip(model.random, groups, strict=True)), **dict(zip(slopes, numbers, strict=True))}
    tested = effects if model.coding == "sum" or not model.interactions else ()
    return _model_pairs(answer, coefficients, tested, frame, columns, names, list(numbers), model.reml)


def _numbers(column: pd.Series[Any]) -> Any:
    return pd.to_numeric(column).to_numpy(dtype=float)


def _fixed_columns(table: pd.DataFrame, model: Model, effects: Sequence[str]) -> list[Any]:
    """Return the columns of the fixed effects from the names of Palpate's coefficients, such as "car[K8]:damping"."""
    parts: dict[str, dict[str, Any]] = {name: {name: _numbers(table[name])} for name in model.numeric}
    for name in model.fixed:
        if name not in parts:
            column = table[name].astype(str)
            levels = {f"{name}[{level}]": (column == level).to_numpy(dtype=float) for level in column.unique()}
            omitted = next(own for label, own in levels.items() if label not in effects)
            named_levels = {label: own for label, own in levels.items() if label in effects}
            parts[name] = (
                {label: own - omitted for label, own in named_levels.items()} if model.coding == "sum" else named_levels
            )
    known: dict[frozenset[str], Any] = {frozenset(["(Intercept)"]): np.ones(len(table))}
    for crossed in (*([name] for name in parts), *(text.split(":") for text in model.interactions)):
        for labels in product(*(parts[name].items() for name in crossed)):
            known[frozenset(label for label, _ in labels)] = np.prod([column for _, column in labels], axis=0)
    by_name = {":".join(order): column for labels, column in known.items() for order in permutations(labels)}
    return [by_name[name] for name in effects]


def _model_pairs(
    answer: Answer, coefficients: Sequence[Row], effects: Sequence[Row], frame: pd.DataFrame,
    columns: Mapping[str, str], names: Mapping[str, str], slopes: Sequence[str], reml: bool,
) -> Iterator[Pair]:  # fmt: skip
    """Yield coefficients, standard errors, F, variances and likelihood; `names` are those of groups and slopes."""
    groups = [name for name in names.values() if name not in slopes]
    start = {names[group]: matrix for group, matrix in _covariances(answer).items()}
    fitted = packages.statsmodels_mixed_model(frame, list(columns.values()), groups, slopes, reml, start)
    if not fitted.converged:
        raise NotChecked("MixedLM did not converge")
    numbers = packages.read_statsmodels_mixed_model(fitted, groups)
    for row in coefficients:
        name, plain = str(row["effect"]), columns[str(row["effect"])]
        yield Pair(f"estimate of {name}", row["estimate"], numbers[plain, "estimate"], float(row["se"] or 0.0))
        yield Pair(f"standard error of {name}", row["se"], numbers[plain, "se"])
    for row in effects:
        source = str(row["Source"])
        own = [
            plain
            for name, plain in columns.items()
            if set(re.sub(r"\[.*?\](?=:|$)", "", name).split(":")) == set(source.split(":"))
        ]
        yield Pair(f"F of {source}", row["F"], packages.wald_f(fitted, own), NEAR_ZERO)
    total = math.fsum(float(row["variance"] or 0.0) for row in answer.more["variances"]) if not slopes else 0.0
    for row in answer.more["variances"]:
        group, effect = str(row["group"]), str(row["effect"])
        key = "Residual" if group == "Residual" else f"{names[group]} {names.get(effect, effect)}"
        yield Pair(f"variance of {group} {effect}".rstrip(), row["variance"], numbers[key, "variance"], total)
    yield Pair("log likelihood", answer.more["fit"][0]["log_likelihood"], numbers["fit", "log_likelihood"], 1.0)


def _covariances(answer: Answer) -> dict[str, Any]:
    """Return the covariance matrix of each group's random effects, in units of the residual variance."""
    *rows, residual = answer.more["variances"]
    matrices: dict[str, Any] = {}
    for group in dict.fromkeys(str(row["group"]) for row in rows):
        effects = {str(row["effect"]): float(row["variance"] or 0.0) for row in rows if row["group"] == group}
        matrix = np.diag(list(effects.values()))
        for row in answer.more.get("correlations", ()):
            if row["group"] == group:
                i, j = (list(effects).index(str(row[name])) for name in ("effect_1", "effect_2"))
                matrix[i, j] = matrix[j, i] = float(row["covariance"] or 0.0)
        matrices[group] = matrix / float(residual["variance"] or 1.0)
    return matrices


def _no_counterpart(answered: QuestionResult, answer: Answer, rows: pd.DataFrame) -> Checked:  # noqa: ARG001
    raise NotChecked("neither pingouin nor statsmodels has it")


CHECKS: Mapping[str, Callable[[QuestionResult, Answer, pd.DataFrame], Checked]] = {
    "anova": _check_anova,
    "pairs": check_pairs,
    "equivalence": check_equivalence,
    "friedman": check_friedman,
    "nemenyi": check_nemenyi,
    "wilcoxon": check_wilcoxon,
    "aligned_ranks": check_aligned_ranks,
    "mixed_model": _check_mixed_model,
    "icc": _check_icc,
    "cronbach_alpha": _check_alpha,
    "kendall_w": check_kendall_w,
    "krippendorff_alpha": _no_counterpart,
    "retest": _check_retest,
}


def crosscheck_json(checks: Sequence[CrossCheck]) -> str:
    """Return every check: test, outcome, package, version, number of values, largest relative difference, reason."""
    rows: list[dict[str, Any]] = []
    for check in checks:
        one_missing = check.difference is not None and check.difference == float("inf")
        rows.append(
            {
                "test": check.test,
                "outcome": check.outcome or None,
                "package": check.package or None,
                "version": check.version or None,
                "numbers": check.numbers,
                "largest_relative_difference": None if one_missing else check.difference,
                "of": check.where or None,
                "agrees": None if check.difference is None else not check.disagrees,
                "note": "one of the two has no number" if one_missing else None,
                "not_checked": check.reason or None,
            }
        )
    return json_text({"limit": LIMIT, "disagreements": len(disagreements(checks)), "checks": rows}, indent=1)


def disagreements(checks: Sequence[CrossCheck] | None) -> list[CrossCheck]:
    """Return the answers for which another package gives another number without being known to be wrong."""
    return [check for check in checks or () if check.disagrees]


def sentence(checks: Sequence[CrossCheck] | None) -> str:
    """Return how many answers were checked with what, how well they agree, and why others were not checked."""
    if checks is None:
        return "No second opinion was requested."
    if not checks:
        return "No test of the plan has a counterpart in pingouin, statsmodels or SciPy."
    compared = [check for check in checks if check.difference is not None]
    clauses = [f"{len(compared)} of {count(len(checks), 'answer')} checked with another package"]
    if compared:
        packages = phrase(sorted({f"{check.package} {check.version}" for check in compared}))
        worst = max(compared, key=lambda check: check.difference or 0.0)
        clauses = [f"{len(compared)} of {count(len(checks), 'answer')} checked with {packages}"]
        if not disagreements(checks):
            clauses.append(f"the largest relative difference is {difference_text(worst)}")
    reasons = Counter(check.reason for check in checks if check.reason)
    clauses += [f"not checked: {reason} ({number})" for reason, number in reasons.items()]
    return "; ".join(clauses) + "."


def line_of(checks: Sequence[CrossCheck]) -> str:
    """Return the cross-check of one test as a sentence, "" if there is none."""
    return f"Checked with another package: {sentence(checks)}" if checks else ""
