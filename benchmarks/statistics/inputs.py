"""The tables that the statistics are measured on, each with the right answer."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, partial
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.statistics.cells import Aggregate, gather
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.exact import exact_within
from palpate.analysis.statistics.f_and_t import f_tail
from palpate.analysis.statistics.references import (
    edge_cases,
    edge_table,
    nist_table,
    nist_values,
    reference_table,
    reference_values,
)

Answer: TypeAlias = dict[tuple[str, str], float | None]
"""The right numbers by (effect, kind of number); None where no number exists."""

R_KINDS = {"F": "F", "p": "p", "p_GG": "p_GG", "eps": "GG_eps", "np2": "pes", "ng2": "ges"}


@dataclass(frozen=True)
class Input:
    """A long table with its columns' roles; `answer` is computed once, at its first call."""

    name: str
    table: pd.DataFrame
    within: tuple[str, ...]
    answer: Callable[[], Answer]
    subject: str = "subject"
    aggregate: Aggregate = None

    @cached_property
    def cells(self) -> Floats:
        """The table as an array (participants, levels of factor 1, ...)."""
        return gather(self.table, "y", list(self.within), self.subject, aggregate=self.aggregate).values

    @cached_property
    def averaged(self) -> pd.DataFrame:
        """The table with one value per cell, for methods that do not average by themselves."""
        if self.aggregate is None:
            return self.table
        grouped = self.table.groupby([self.subject, *self.within])["y"].mean()
        return grouped.reset_index()


def reference_inputs() -> Iterator[Input]:
    """Yield the within-participant reference sets with R's values."""
    for name, entry in reference_values("r_reference").items():
        if "effects" in entry and not entry["between"]:
            table, within = reference_table(f"csv/{entry['csv']}"), tuple(entry["within"])
            repeated = table.duplicated(["subject", *within]).any()
            yield Input(name, table, within, _r_answer(entry["effects"]), aggregate="mean" if repeated else None)


def _r_answer(effects: dict[str, Any]) -> Callable[[], Answer]:
    return lambda: {
        (source, kind): float(values[key])
        for source, values in effects.items()
        for kind, key in R_KINDS.items()
        if values.get(key) is not None
    }


def edge_inputs() -> Iterator[Input]:
    """Yield tables that break common implementations: those with stored exact answers, and five more."""
    stored = reference_values("edge_cases_exact")
    for name in edge_cases():
        yield Input(name, edge_table(name), ("cond",), _edge_answer(stored[name]))
    steps = np.arange(12)[:, None] * 0.1 + np.arange(4) * 0.3
    tables = {
        "constant_0.1": np.full((12, 4), 0.1),
        "constant_0.3": np.full((12, 4), 0.3),
        "constant_100_two_way": np.full((12, 3, 3), 100.0),
        "additive_decimals": steps,
        "subj_offsets_1e+09_int": edge_cells("base_int") + 1e9 * np.arange(12)[:, None],
    }
    for name, cells in tables.items():
        yield Input(name, long_table(cells), factor_names(cells), _exact_answer(cells, name.startswith("additive")))


def _edge_answer(values: dict[str, Any]) -> Callable[[], Answer]:
    numbers = {"F": values["F"], "eps": values.get("GG_eps")}
    kinds = ("F",) if numbers["F"] is None else tuple(kind for kind in numbers if numbers[kind] is not None)
    return lambda: {("cond", kind): None if numbers[kind] is None else float(numbers[kind]) for kind in kinds}


def _exact_answer(cells: Floats, rounding_only: bool) -> Callable[[], Answer]:
    """Return F and epsilon in exact arithmetic; no F where rounding alone makes the residual."""

    @cache
    def answer() -> Answer:
        effects = exact_within(cells.ravel().tolist(), cells.shape, factor_names(cells))
        numbers: Answer = {}
        for effect in effects:
            defined = effect.f is not None and not rounding_only
            numbers[effect.source, "F"] = float(effect.f) if effect.f is not None and defined else None
            if effect.eps is not None and defined:
                numbers[effect.source, "eps"] = float(effect.eps)
        return numbers

    return answer


def edge_cells(name: str) -> Floats:
    """Return an edge case as an array (participants, conditions)."""
    return gather(edge_table(name), "y", "cond", "subject").values


def wide_input() -> Input:
    """Return 12 participants by 90 conditions: more conditions than participants."""
    cells = np.round(random_cells(12, 90, seed=90, effect=4.0), 1)

    def answer() -> Answer:
        effect = exact_within(cells.ravel().tolist(), cells.shape, ("A",))[0]
        f, eps = float(effect.f or 0), float(effect.eps or 0)
        return {("A", "p_GG"): f_tail(f, effect.df1 * eps, effect.df2 * eps)}

    return Input("12 x 90", long_table(cells), ("A",), cache(answer))


def nist_inputs() -> Iterator[Input]:
    """Yield the NIST StRD one-way sets with the exact F of their binary doubles."""
    for name, values in nist_values().items():
        exact = float(values["exact_of_doubles"]["F"])
        yield Input(name, nist_table(name), (), partial(dict, {("group", "F"): exact}))


def big_inputs(quick: bool) -> Iterator[Input]:
    """Yield 500 (and, unless quick, 5000) participants by 90 conditions, rows in random order."""
    for n in (500,) if quick else (500, 5000):
        cells = random_cells(n, 90, seed=n, effect=3 / n**0.5)
        table = long_table(cells).sample(frac=1, random_state=n, ignore_index=True)
        yield Input(f"{n} x 90", table, ("A",), cache(partial(extended_answer, cells)))


LABEL_TYPES = {"integers": "int64", "text": "str", "categories": "category", "objects": "object"}


def label_inputs(quick: bool) -> Iterator[Input]:
    """Yield 5000 (500, if quick) participants by 90 conditions, rows in random order, labels of each type."""
    n = 500 if quick else 5000
    cells = random_cells(n, 90, seed=n + 1, effect=3 / n**0.5)
    answer = cache(partial(extended_answer, cells))
    table = long_table(cells).sample(frac=1, random_state=n, ignore_index=True)
    numbered = {name: table[name].str[1:].astype("int64") for name in ("subject", "A")}
    for name, kind in LABEL_TYPES.items():
        labelled = table.assign(**numbered) if kind == "int64" else table.astype({"subject": kind, "A": kind})
        yield Input(f"{n} x 90, {name}", labelled, ("A",), answer)


def random_cells(n: int, k: int, seed: int, effect: float) -> Floats:
    """Return ratings around 50 with a participant's level, a condition's effect and noise, the same in every run."""
    rng = np.random.default_rng(seed)
    people, conditions = rng.normal(50, 10, (n, 1)), rng.normal(0, effect, k)
    cells: Floats = people + conditions + rng.normal(0, 5, (n, k))
    return cells


def long_table(cells: Floats, names: Sequence[str] | None = None) -> pd.DataFrame:
    """Return one row per value, with a column for each axis (subject, A, B, ... without `names`) and y."""
    where = np.indices(cells.shape).reshape(cells.ndim, -1)
    names = names or ("subject", *factor_names(cells))
    labels = {name: [f"{name[0]}{i:04d}" for i in axis] for name, axis in zip(names, where, strict=True)}
    return pd.DataFrame({**labels, "y": cells.ravel()})


def factor_names(cells: Floats) -> tuple[str, ...]:
    """Return A, B, ... for the axes after the first."""
    return tuple("ABCDEFGH"[: cells.ndim - 1])


def extended_answer(cells: Floats) -> Answer:
    """Return one-way statistics in extended precision (64-bit significand), from the textbook's residuals."""
    x = cells.astype(np.longdouble)
    n, k = x.shape
    x = x - x.mean()
    people, conditions = x.mean(axis=1, keepdims=True), x.mean(axis=0, keepdims=True)
    residual = x - people - conditions
    error, effect = (residual**2).sum(), n * (conditions**2).sum()
    products = residual.T.dot(residual)
    df1, df2 = k - 1, (n - 1) * (k - 1)
    f = float((effect / df1) / (error / df2))
    eps = float(error**2 / (df1 * (products**2).sum()))
    total = effect + error + k * (people**2).sum()
    p, p_gg = f_tail(f, df1, df2), f_tail(f, df1 * eps, df2 * eps)
    numbers = {
        "F": f,
        "p": p,
        "p_GG": p_gg,
        "eps": eps,
        "np2": float(effect / (effect + error)),
        "ng2": float(effect / total),
    }
    return {("A", kind): value for kind, value in numbers.items()}
