"""Each answer of a plan held against another package's: the largest relative difference, or why it is not checked."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from itertools import combinations, permutations, product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from analysis.crosschecking import conditions, packages
from analysis.plans.answers import Answer, Row, Value
from analysis.regenerating.running import Answered
from analysis.statistics.one_thread import one_thread

LIMIT = 1e-6
"""A larger relative difference is a disagreement."""
NEAR_ZERO = 1e-3
"""Statistics and coefficients are compared to LIMIT of this where they are smaller; p values never are."""
MOST_VALUES = 50_000
MOST_VALUES_SQUARED = 2_000
"""The same where a package makes a matrix of all values by all values."""
PINGOUIN, STATSMODELS = "pingouin", "statsmodels"
Progress = Callable[[int, int, str], None]
_FAILURES = (ArithmeticError, AssertionError, AttributeError, LookupError, TypeError, ValueError, np.linalg.LinAlgError)


class NotChecked(ValueError):
    """Why an answer is not compared."""


class Pair(NamedTuple):
    """One number of ours and theirs. `decimals`: theirs is rounded to so many; `floor`: the least size to relate to."""

    where: str
    ours: Value
    theirs: float
    floor: float = 0.0
    decimals: int | None = None


@dataclass(frozen=True)
class CrossCheck:
    """One answer held against another package, or the reason why it is not (`package` then may be "").

    `difference` is the largest relative difference over `numbers` numbers, `where` the number it is of.
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
        """Package and version, or why there is none."""
        return f"not checked: {self.reason}" if self.reason else f"{self.package} {self.version}"

    def text(self) -> str:
        """One line for a disagreement."""
        name = " ".join(filter(None, (self.test, self.outcome)))
        apart = difference_text(self)
        how = apart if math.isinf(self.difference or 0.0) else f"differs by {apart} of its value"
        return f"{name}: {self.where}: {how} ({self.checked_with()})"


def difference_text(check: CrossCheck) -> str:
    """The largest relative difference as a reader needs it, "" where nothing was compared."""
    if check.difference is None:
        return ""
    if math.isinf(check.difference):
        return "one of the two has no number"
    return f"{check.difference:.0e}" if check.difference else "0"


def cross_check(answered: Sequence[Answered], progress: Progress = lambda *_: None) -> tuple[CrossCheck, ...]:
    """A check of every answer of a kind that pingouin or statsmodels have, in the plan's order."""
    asked = [each for each in answered if each.asked.test in CHECKS and each.answer is not None]
    found = []
    with one_thread():
        for done, each in enumerate(asked):
            progress(done, len(asked), f"checking {each.asked.name} {each.outcome}".rstrip())
            found.append(_checked(each))
    progress(len(asked), len(asked), "")
    return tuple(found)


def _checked(each: Answered) -> CrossCheck:
    name, outcome = each.asked.name, each.outcome
    package = used = ""
    try:
        if each.answer is None or each.rows is None:
            raise NotChecked("there is no answer")
        package, pairs = CHECKS[each.asked.test](each, each.answer, each.rows)
        used = _version(package)
        differences = [(difference(pair), pair.where) for pair in pairs]
    except NotChecked as reason:
        return CrossCheck(name, outcome, package, used, reason=str(reason))
    except _FAILURES as error:  # the second opinion must not cost the first one
        what = f"{type(error).__name__}: {' '.join(str(error).split())[:120]}"
        return CrossCheck(name, outcome, package, used, reason=f"{package or 'the comparison'} failed ({what})")
    worst, where = max(differences, default=(0.0, ""))
    return CrossCheck(name, outcome, package, used, len(differences), worst, where)


def difference(pair: Pair) -> float:
    """The relative difference of one number: 0 where neither has one, infinite where only one of them has."""
    ours = math.nan if pair.ours is None else float(pair.ours)
    theirs = pair.theirs
    if math.isnan(ours) or math.isnan(theirs):
        return 0.0 if math.isnan(ours) and math.isnan(theirs) else math.inf
    if pair.decimals is not None and abs(ours - theirs) <= 0.5 * 10.0**-pair.decimals * (1 + 1e-9):
        return 0.0
    size = max(abs(ours), abs(theirs), pair.floor)
    return abs(ours - theirs) / size if size > 1e-290 else 0.0


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        raise NotChecked(f"{package} is not installed") from None


def _refuse(*reasons: str) -> None:
    """Raise NotChecked with the first reason that is one."""
    for reason in reasons:
        if reason:
            raise NotChecked(reason)


def _demand_size(values: int, most: int | None = None) -> None:
    most = MOST_VALUES if most is None else most
    if values > most:
        raise NotChecked(f"size ({values:,} values; at most {most:,})")


def _cells(rows: pd.DataFrame, factors: Sequence[str], value: str = "value") -> pd.DataFrame:
    """The mean of each cell under plain names: f0, f1, ... (labels as text) and y."""
    named = rows.loc[rows[value].notna(), [*factors, value]]
    named.columns = pd.Index([*(f"f{i}" for i in range(len(factors))), "y"])
    keys = list(named.columns[:-1])
    return named.astype(dict.fromkeys(keys, str)).groupby(keys, sort=False, observed=True)["y"].mean().reset_index()


def _wide(cells: pd.DataFrame, index: str, columns: Sequence[str]) -> pd.DataFrame:
    return cells.pivot(index=index, columns=list(columns), values="y")


Checked = tuple[str, Iterable[Pair]]
ETAS = {"ng2": "generalized_eta_squared", "np2": "partial_eta_squared"}


def _check_anova(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:
    asked: Any = each.asked
    within, between = list(asked.within), list(asked.between)
    if within and each.missing.cells and not each.missing.left_out:
        return _check_gaps(asked, answer, rows)
    cells = _cells(rows, ["participant", *within, *between])
    named = dict(zip((*within, *between), cells.columns[1:], strict=False))
    own, groups = [named[name] for name in within], [named[name] for name in between]
    _demand_size(len(cells))
    if not within:
        values, labels = cells["y"].to_numpy(), cells[groups].agg(", ".join, axis=1).tolist()
        _refuse(conditions.out_of_range(values), conditions.drowned(values, labels))
        return PINGOUIN, _anova_pairs(
            answer, named, packages.read_pingouin_anova, packages.pingouin_between, cells, "y", groups,
            asked.sum_of_squares,
        )  # fmt: skip
    wide = _wide(cells, "f0", own)
    _refuse(conditions.incomplete(wide))
    values = wide.to_numpy(dtype=float).reshape(len(wide), *(cells[name].nunique() for name in own))
    people = cells.drop_duplicates("f0").set_index("f0").loc[wide.index]
    of_groups = people[groups].agg(", ".join, axis=1).tolist() if groups else None
    _refuse(conditions.out_of_range(values), conditions.drowned(values, of_groups))
    if not groups and (len(own) == 1 or (len(own) == 2 and len(wide) > 2)):  # of two people pingouin gives no epsilon
        return PINGOUIN, _anova_pairs(
            answer, named, packages.read_pingouin_anova, packages.pingouin_within, cells, "y", own, "f0"
        )
    if not groups:
        _demand_size(len(cells), MOST_VALUES_SQUARED)
        return STATSMODELS, _anova_pairs(
            answer, named, packages.read_statsmodels_within, packages.statsmodels_within, cells, "y", own, "f0"
        )
    if len(own) > 1 or len(groups) > 1:
        raise NotChecked("neither package has a mixed ANOVA of more than one factor within or between")
    _refuse(conditions.another_type(people[groups[0]].value_counts().tolist(), asked.sum_of_squares))
    return PINGOUIN, _anova_pairs(
        answer, named, packages.read_pingouin_anova, packages.pingouin_mixed, cells, "y", own[0], groups[0], "f0"
    )


def _anova_pairs(
    answer: Answer,
    named: Mapping[str, str],
    read: Callable[[pd.DataFrame], packages.Numbers],
    run: Callable[..., pd.DataFrame],
    *inputs: Any,
) -> Iterator[Pair]:
    """F, p (as it is corrected in the row), epsilon and eta squared of every effect; `named`: its factors' names."""
    found = read(run(*inputs))
    by_factors = {(frozenset(source.split(":")), column): value for (source, column), value in found.items()}
    for row in answer.rows:
        effect = str(row["effect"])
        key = frozenset(_parts(effect, named))
        if (key, "F") not in by_factors:
            raise NotChecked(f"the other table has no effect {effect}")
        columns = {
            "F": "F",
            "p_uncorrected": "p_unc",
            "p_greenhouse_geisser": "p_GG_corr",
            "epsilon_greenhouse_geisser": "eps",
            "p": {"GG": "p_GG_corr", "none": "p_unc"}.get(str(row["correction"]), ""),
            **{ours: theirs for theirs, ours in ETAS.items()},
            "eta_squared": "np2",
        }
        for ours, theirs in columns.items():
            corrected = theirs in ("p_GG_corr", "eps")
            if ours in row and (key, theirs) in by_factors and not (corrected and row["correction"] == "none"):
                floor = 0.0 if ours.startswith("p") and ours != "partial_eta_squared" else NEAR_ZERO
                yield Pair(f"{ours} of {effect}", row[ours], by_factors[key, theirs], floor)


def _parts(effect: str, named: Mapping[str, str]) -> list[str]:
    """The plain names of an effect's factors, whose own names may hold a colon."""
    names = sorted(named, key=len, reverse=True)
    found = []
    for name in names:
        if name == effect or effect.startswith(f"{name}:") or effect.endswith(f":{name}") or f":{name}:" in effect:
            found.append(named[name])
            effect = f":{effect}:".replace(f":{name}:", ":", 1).strip(":")
    return found


def _check_gaps(asked: Any, answer: Answer, rows: pd.DataFrame) -> Checked:
    """An analysis of variance that a mixed model of the cells answered (`gaps_answer`)."""
    factors = [*asked.within, *asked.between]
    keys = ["participant", *factors]
    means = rows[rows["value"].notna()].groupby(keys, observed=True)["value"].mean().reset_index()
    crossed = [":".join(parts) for size in range(2, len(factors) + 1) for parts in combinations(factors, size)]
    orders = [parts for size in range(1, len(asked.within)) for parts in combinations(asked.within, size)]
    grouping = ("participant", *(":".join(("participant", *parts)) for parts in orders))
    model = Model(tuple(factors), (), tuple(crossed), dict.fromkeys(grouping, ()), "sum", True)
    return STATSMODELS, _check_model(model, means, answer, answer.more["coefficients"], answer.rows)


def _check_pairs(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:
    asked: Any = each.asked
    values, paired = _levels(rows, asked.factor)
    return STATSMODELS, _pairs_of(answer, values, paired, asked.correction, asked.family)


def _levels(rows: pd.DataFrame, factor: str) -> tuple[dict[str, Any], bool]:
    """The values of each level, and whether they are paired: then in the order of the participants."""
    cells = _cells(rows, ["participant", factor])
    _demand_size(len(cells))
    values = cells["y"].to_numpy()
    _refuse(conditions.out_of_range(values))
    paired = bool(cells.groupby("f0")["f1"].nunique().max() > 1)
    if paired:
        wide = _wide(cells, "f0", ["f1"])
        _refuse(conditions.incomplete(wide), conditions.undefined_pair(wide))
        return {str(level): wide[level].to_numpy() for level in wide.columns}, True
    _refuse(conditions.constant_groups(values, cells["f1"].tolist()))
    return {str(level): own["y"].to_numpy() for level, own in cells.groupby("f1")}, False


def _pairs_of(
    answer: Answer, values: Mapping[str, Any], paired: bool, correction: str, family: int | None
) -> Iterator[Pair]:
    found = [packages.statsmodels_t(values[str(row["a"])], values[str(row["b"])], paired) for row in answer.rows]
    adjusted = packages.statsmodels_adjusted([theirs["p_unc"] for theirs in found], correction)
    for row, theirs, p in zip(answer.rows, found, adjusted, strict=True):
        pair = f"{row['a']} and {row['b']}"
        yield Pair(f"t of {pair}", row["t"], theirs["T"], NEAR_ZERO)
        yield Pair(f"df of {pair}", row["df"], theirs["dof"])
        yield Pair(f"p_uncorrected of {pair}", row["p_uncorrected"], theirs["p_unc"])
        if family is None:  # statsmodels' family is always the pairs that it is given
            yield Pair(f"p of {pair}", row["p"], p)


def _check_equivalence(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:
    asked: Any = each.asked
    values, paired = _levels(rows, asked.factor)
    return STATSMODELS, _equivalence_pairs(answer, values, paired)


def _equivalence_pairs(answer: Answer, values: Mapping[str, Any], paired: bool) -> Iterator[Pair]:
    for row in answer.rows:
        a, b = str(row["a"]), str(row["b"])
        low, high = (float(row[name] or 0.0) for name in ("bound_low", "bound_high"))
        found = packages.statsmodels_equivalence(values[a], values[b], low, high, paired)
        for name, value in zip(("p_low", "p_high"), found, strict=True):
            yield Pair(f"{name} of {a} and {b}", row[name], value)


def _check_friedman(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:
    asked: Any = each.asked
    cells = _cells(rows, ["participant", asked.factor])
    _demand_ranks(cells, "f0", "f1")
    columns = {"chi2": "chi2", "ddof1": "ddof1", "p_unc": "p_unc", "W": "W"}
    return PINGOUIN, _friedman_pairs(answer, cells, "f1", "f0", columns)


def _check_kendall_w(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:
    asked: Any = each.asked
    cells = _cells(rows, [asked.raters, asked.targets], asked.value)
    _demand_ranks(cells, "f0", "f1")
    columns = {"chi2": "chi2", "df": "ddof1", "p_chi2": "p_unc", "W": "W"}
    return PINGOUIN, _friedman_pairs(answer, cells, "f1", "f0", columns)


def _demand_ranks(cells: pd.DataFrame, people: str, factor: str) -> None:
    _demand_size(len(cells))
    wide = _wide(cells, people, [factor])
    _refuse(conditions.incomplete(wide), conditions.nearly_tied(wide), conditions.all_tied(wide))


def _friedman_pairs(
    answer: Answer, cells: pd.DataFrame, within: str, subject: str, columns: Mapping[str, str]
) -> Iterator[Pair]:
    found = packages.read_pingouin_friedman(packages.pingouin_friedman(cells, "y", within, subject))
    for row in answer.rows:
        for ours, theirs in columns.items():
            if ours in row:
                yield Pair(ours, row[ours], found[theirs], 0.0 if ours.startswith("p") else NEAR_ZERO)


def _check_icc(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:
    asked: Any = each.asked
    cells = _cells(rows, [asked.targets, asked.raters], asked.value)
    _demand_size(len(cells))
    _demand_icc(_wide(cells, "f0", ["f1"]))
    return PINGOUIN, _icc_pairs(answer.rows, cells, asked.confidence, "type")


def _demand_icc(wide: pd.DataFrame) -> None:
    values = wide.to_numpy(dtype=float)
    _refuse(conditions.incomplete(wide), conditions.out_of_range(values))
    _refuse(conditions.drowned(values), conditions.undefined_icc(values))


def _icc_pairs(rows: Sequence[Mapping[str, Value]], cells: pd.DataFrame, confidence: float, by: str) -> Iterator[Pair]:
    found = packages.read_pingouin_icc(packages.pingouin_icc(cells, "y", "f0", "f1"))
    for row in rows:
        kind = str(row[by])
        for name in ("ICC", "F", "p"):
            if name in row:
                yield Pair(f"{name} of {kind}", row[name], found[kind, name], 0.0 if name == "p" else NEAR_ZERO)
        for name in ("ci_low", "ci_high") if confidence == 0.95 else ():
            yield Pair(f"{name} of {kind}", row[name], found[kind, name], decimals=packages.ICC_INTERVAL_DECIMALS)


def _check_alpha(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:
    asked: Any = each.asked
    cases = list(asked.cases or [name for name in ("participant", "stimulus") if name in rows.columns])
    cells = _cells(rows, [*cases, asked.items], asked.value)
    _demand_size(len(cells))
    wide = cells.pivot(index=list(cells.columns[: len(cases)]), columns=f"f{len(cases)}", values="y")
    if asked.missing == "listwise":
        wide = wide.dropna()
    turned = wide.assign(**{name: -wide[name] for name in map(str, asked.reverse) if name in wide})
    _refuse(conditions.incomplete(wide), conditions.out_of_range(wide.to_numpy()))
    values = wide.to_numpy(dtype=float)
    _refuse(conditions.drowned(values), conditions.drowned(values.mean(axis=1)))
    return PINGOUIN, _alpha_pairs(answer, turned, asked.confidence)


def _alpha_pairs(answer: Answer, wide: pd.DataFrame, confidence: float) -> Iterator[Pair]:
    found = packages.pingouin_alpha(wide, confidence)
    for row in answer.rows:
        yield Pair("alpha", row["alpha"], found["alpha"], NEAR_ZERO)
        for name in ("ci_low", "ci_high"):
            yield Pair(name, row[name], found[name], decimals=packages.ALPHA_INTERVAL_DECIMALS)


def _check_retest(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:  # noqa: ARG001
    asked: Any = each.asked
    pairs = pd.DataFrame([dict(row) for row in answer.more.get("pairs", ())])
    if not len(pairs):
        raise NotChecked("the answer lists no pairs")
    wide = pairs[["first", "second"]].astype("float64")
    _demand_size(wide.size)
    _demand_icc(wide)
    cells = wide.rename_axis("f0").reset_index().melt(id_vars="f0", var_name="f1", value_name="y")
    names = {"ICC(A,1)": "ICC2", "ICC(C,1)": "ICC3"}
    measured = [
        {"type": names[str(row["measure"])], "ICC": row["value"], "ci_low": row["ci_low"], "ci_high": row["ci_high"]}
        for row in answer.rows
        if row["measure"] in names
    ]
    return PINGOUIN, _icc_pairs(measured, cells, asked.confidence, "type")


@dataclass(frozen=True)
class Model:
    """What a mixed model is asked for, as in a plan."""

    fixed: tuple[str, ...]
    numeric: tuple[str, ...]
    interactions: tuple[str, ...]
    random: Mapping[str, Sequence[str]]
    coding: str
    reml: bool


def _check_mixed_model(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:
    asked: Any = each.asked
    model = Model(asked.fixed, asked.numeric, asked.interactions, asked.random, asked.coding, asked.reml)
    if asked.uncorrelated and any(asked.random.values()):
        raise NotChecked("MixedLM has no uncorrelated slopes")
    table = rows[rows["value"].notna()].reset_index(drop=True)
    return STATSMODELS, _check_model(model, table, answer, answer.rows, answer.more["effects"])


def _check_model(
    model: Model, table: pd.DataFrame, answer: Answer, coefficients: Sequence[Row], effects: Sequence[Row]
) -> Iterable[Pair]:
    slopes = [name for names in model.random.values() for name in names]
    if slopes and (len(model.random) > 1 or any(name not in model.numeric for name in slopes)):
        raise NotChecked("MixedLM has random slopes of numbers within one grouping factor only")
    _demand_size(len(table))
    columns = {str(row["effect"]): f"x{place}" for place, row in enumerate(coefficients)}
    values = _fixed_columns(table, model, list(columns))
    groups = {f"g{place}": _grouping(table, name) for place, name in enumerate(model.random)}
    numbers = {f"s{place}": _numbers(table[name]) for place, name in enumerate(slopes)}
    own = table["value"].to_numpy(dtype=float)
    frame = pd.DataFrame({"y": own, **dict(zip(columns.values(), values, strict=True)), **groups, **numbers})
    if not packages.nested(frame, list(groups)):
        _demand_size(len(table), MOST_VALUES_SQUARED)
    _refuse(conditions.out_of_range(own))
    _refuse(conditions.extreme_ratio(own, np.column_stack(values), list(groups.values())))
    names = {**dict(zip(model.random, groups, strict=True)), **dict(zip(slopes, numbers, strict=True))}
    tested = effects if model.coding == "sum" or not model.interactions else ()
    return _model_pairs(answer, coefficients, tested, frame, columns, names, list(numbers), model.reml)


def _grouping(table: pd.DataFrame, name: str) -> list[str]:
    parts = [name] if name in table.columns else name.split(":")
    return [":".join(labels) for labels in zip(*(table[part].astype(str) for part in parts), strict=True)]


def _numbers(column: pd.Series[Any]) -> Any:
    return pd.to_numeric(column).to_numpy(dtype=float)


def _fixed_columns(table: pd.DataFrame, model: Model, effects: Sequence[str]) -> list[Any]:
    """The columns of the fixed effects, read from the names of our coefficients, such as "car[K8]:damping"."""
    parts: dict[str, dict[str, Any]] = {name: {name: _numbers(table[name])} for name in model.numeric}
    for name in model.fixed:
        if name not in parts:
            parts[name] = _indicators(table[name].astype(str), name, effects, model.coding)
    known: dict[frozenset[str], Any] = {frozenset(["(Intercept)"]): np.ones(len(table))}
    for crossed in (*([name] for name in parts), *(text.split(":") for text in model.interactions)):
        for labels in product(*(parts[name].items() for name in crossed)):
            known[frozenset(label for label, _ in labels)] = np.prod([column for _, column in labels], axis=0)
    by_name = {":".join(order): column for labels, column in known.items() for order in permutations(labels)}
    return [by_name[name] for name in effects]


def _indicators(column: pd.Series[Any], name: str, effects: Sequence[str], coding: str) -> dict[str, Any]:
    levels = {f"{name}[{level}]": (column == level).to_numpy(dtype=float) for level in column.unique()}
    omitted = next(own for label, own in levels.items() if label not in effects)
    shown = {label: own for label, own in levels.items() if label in effects}
    return {label: own - omitted for label, own in shown.items()} if coding == "sum" else shown


def _model_pairs(
    answer: Answer, coefficients: Sequence[Row], effects: Sequence[Row], frame: pd.DataFrame,
    columns: Mapping[str, str], names: Mapping[str, str], slopes: Sequence[str], reml: bool,
) -> Iterator[Pair]:  # fmt: skip
    """Coefficients, standard errors, F, variances and likelihood; `names` are those of groups and slopes in `frame`."""
    groups = [name for name in names.values() if name not in slopes]
    start = {names[group]: matrix for group, matrix in _covariances(answer).items()}
    fitted = packages.statsmodels_mixed_model(frame, list(columns.values()), groups, slopes, reml, start)
    if not fitted.converged:
        raise NotChecked("MixedLM did not converge")
    found = packages.read_statsmodels_mixed_model(fitted, groups)
    for row in coefficients:
        name, plain = str(row["effect"]), columns[str(row["effect"])]
        yield Pair(f"estimate of {name}", row["estimate"], found[plain, "estimate"], float(row["se"] or 0.0))
        yield Pair(f"standard error of {name}", row["se"], found[plain, "se"])
    for row in effects:
        source = str(row["Source"])
        own = [plain for name, plain in columns.items() if _effect_of(name) == set(source.split(":"))]
        yield Pair(f"F of {source}", row["F"], packages.wald_f(fitted, own), NEAR_ZERO)
    total = math.fsum(float(row["variance"] or 0.0) for row in answer.more["variances"]) if not slopes else 0.0
    for row in answer.more["variances"]:
        group, effect = str(row["group"]), str(row["effect"])
        key = "Residual" if group == "Residual" else f"{names[group]} {names.get(effect, effect)}"
        yield Pair(f"variance of {group} {effect}".rstrip(), row["variance"], found[key, "variance"], total)
    yield Pair("log likelihood", answer.more["fit"][0]["log_likelihood"], found["fit", "log_likelihood"], 1.0)


def _covariances(answer: Answer) -> dict[str, Any]:
    """The covariance matrix of each group's random effects, in units of the residual variance."""
    *rows, residual = answer.more["variances"]
    found: dict[str, Any] = {}
    for group in dict.fromkeys(str(row["group"]) for row in rows):
        effects = {str(row["effect"]): float(row["variance"] or 0.0) for row in rows if row["group"] == group}
        matrix = np.diag(list(effects.values()))
        for row in answer.more.get("correlations", ()):
            if row["group"] == group:
                i, j = (list(effects).index(str(row[name])) for name in ("effect_1", "effect_2"))
                matrix[i, j] = matrix[j, i] = float(row["covariance"] or 0.0)
        found[group] = matrix / float(residual["variance"] or 1.0)
    return found


def _effect_of(coefficient: str) -> set[str]:
    """The factors of a coefficient: "car[K8]:damping" is of car and damping."""
    return set(re.sub(r"\[.*?\](?=:|$)", "", coefficient).split(":"))


def _no_counterpart(each: Answered, answer: Answer, rows: pd.DataFrame) -> Checked:  # noqa: ARG001
    raise NotChecked("neither pingouin nor statsmodels has it")


CHECKS: Mapping[str, Callable[[Answered, Answer, pd.DataFrame], Checked]] = {
    "anova": _check_anova,
    "pairs": _check_pairs,
    "equivalence": _check_equivalence,
    "friedman": _check_friedman,
    "mixed_model": _check_mixed_model,
    "icc": _check_icc,
    "cronbach_alpha": _check_alpha,
    "kendall_w": _check_kendall_w,
    "krippendorff_alpha": _no_counterpart,
    "retest": _check_retest,
}
