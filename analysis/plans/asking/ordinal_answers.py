"""The answers of ordinal models and of Likert summaries, from the rows that a test is asked about."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from palpate.analysis.ordinal.likert import MOST_POINTS, likert
from palpate.analysis.ordinal.ordinal_model import OrdinalModel, ordinal_model
from palpate.analysis.plans.asking.describing_rows import (
    answer_of,
    plain_row,
    plain_rows,
    require_columns,
    share,
    with_numbers,
)
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.statistics.apa import apa_p, number
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from collections.abc import Hashable, Sequence

    import pandas as pd

    from palpate.analysis.plans.answers import Answer, Row, Selected
    from palpate.analysis.plans.asking.ordinal import Likert, Ordinal

LINK_NAMES = {"logit": "proportional odds (logit)", "probit": "probit"}
SOURCE = "McCullagh 1980; Christensen 2018"


def model_answer(selected: Selected, asked: Ordinal) -> Answer:
    """One row per threshold and slope, and the participants' SD; the likelihood ratio tests beside."""
    needed = (*asked.fixed, *asked.numeric)
    require_columns(selected.table, ("participant", *needed, "value"))
    table, notes = _answered(selected.table, asked)
    model = ordinal_model(
        with_numbers(table, asked.numeric),
        "value",
        fixed=asked.fixed,
        numeric=asked.numeric,
        interactions=asked.interactions,
        random=asked.random,
        link=asked.link,
        coding=asked.coding,
        orders={name: selected.levels[name] for name in asked.fixed if name in selected.levels},
        confidence=asked.confidence,
    )
    wald = share(asked.confidence, "Wald interval")
    kinds = {
        **{"estimate": "maximum likelihood estimate on the latent scale", "se": "standard error", "z": "Wald z"},
        **{"p": "two-sided p of Wald's z", "ci_low": wald, "ci_high": wald, "ddof": "degrees of freedom"},
        **{"LR": "likelihood ratio", "p_unc": "p of the likelihood ratio, type II"},
        **{"log_likelihood": "log likelihood", "aic": "Akaike's criterion", "n": "answers"},
        "participants": "participants with an intercept of their own",
    }
    if asked.random is None and bool(table["participant"].duplicated().any()):
        notes.append("Answers of one participant count as independent; `random: participant` would not.")
    more = {
        "tests": tuple(plain_rows(model.tests)),
        "proportional": tuple(plain_rows(model.proportional)),
        "fit": (_fit_row(model),),
    }
    return answer_of(
        selected, _model_rows(model), _method(asked), kinds, table=table, headline=_words(model), notes=notes, more=more
    )


def _answered(table: pd.DataFrame, asked: Ordinal) -> tuple[pd.DataFrame, list[str]]:
    """The rows with an answer, where the test leaves others out."""
    empty = int(table["value"].isna().sum())
    if not empty or asked.missing != "listwise":
        return table, []
    return table[table["value"].notna()], [f"Left out: {count(empty, 'row')} without an answer."]


def _model_rows(model: OrdinalModel) -> list[Row]:
    rows = [row | {"note": ""} for row in model.coefficients.to_dict("records")]
    if model.sd is not None:
        undefined: dict[Hashable, Any] = dict.fromkeys(("z", "p", "ci_low", "ci_high"), math.nan)
        note = model.note or "z and p of a standard deviation are undefined; see its likelihood ratio test"
        rows.append(
            {"kind": "sd", "term": "participant", "estimate": model.sd, "se": model.sd_error, **undefined, "note": note}
        )
    return [plain_row(row) for row in rows]


def _fit_row(model: OrdinalModel) -> Row:
    numbers = {"log_likelihood": model.log_likelihood, "aic": model.aic, "n": model.n}
    return plain_row({**numbers, "participants": model.participants, "levels": ", ".join(model.levels)})


def _method(asked: Ordinal) -> str:
    intercept = (
        "" if asked.random is None else ", a normal intercept per participant (adaptive Gauss-Hermite, 25 nodes)"
    )
    return (
        f"Cumulative link model, {LINK_NAMES[asked.link]}, maximum likelihood{intercept}; {asked.coding} coding;"
        f" proportional odds tested by likelihood ratio ({SOURCE})"
    )


def _words(model: OrdinalModel) -> str:
    told = [
        f"{row['Source']}: χ²({row['ddof']}) = {number(float(row['LR']))}, {apa_p(float(row['p_unc']))}"
        for row in model.tests.to_dict("records")
    ]
    return "; ".join(told)


def likert_answer(selected: Selected, asked: Likert) -> Answer:
    """One row per item (and level of `by`), in the order that the items are asked in."""
    columns = () if asked.by is None else (asked.by,)
    require_columns(selected.table, ("attribute", "value", *columns))
    table = _of_form(selected.table, asked.form)
    points = asked.points or _points(selected)
    items = [name for name in selected.outcomes if (table["attribute"] == name).any()]
    rows: list[Row] = []
    words = []
    for name in items or list(dict.fromkeys(table["attribute"])):
        own = table[table["attribute"] == name]
        if own["value"].isna().all() and "text" in own and own["text"].fillna("").ne("").any():
            words.append(name)
            continue
        rows += _item_rows(own, name, asked.by, points)
    if not rows:
        raise DataRefused("no item was answered with a number")
    notes = [f"Answered in words, not summarised: {', '.join(words)}."] if words else []
    return answer_of(selected, rows, _LIKERT, _likert_kinds(), table=table, notes=notes)


_LIKERT = (
    "Counts and shares of each point; median and quartiles linear between order statistics (type 7 of Hyndman & Fan"
    " 1996); mean and SD take the points as equally far apart"
)


def _likert_kinds() -> dict[str, str]:
    return {
        **{"n": "answers", "missing": "answers not given", "median": "median", "q1": "lower quartile, type 7"},
        **{"q3": "upper quartile, type 7", "mean": "mean of the points", "sd": "SD of the points (n - 1)"},
        **{"agree": "share of answers above the middle", "disagree": "share of answers below the middle"},
    }


def _of_form(table: pd.DataFrame, form: str | None) -> pd.DataFrame:
    if form is None:
        return table
    require_columns(table, ("form",))
    known = sorted(set(table["form"].astype(str)))
    if form not in known:
        raise DataRefused(f"no form {form!r}; {nearest(form, known)}")
    return table[table["form"].astype(str) == form]


def _points(selected: Selected) -> Sequence[float]:
    """Every whole number of the scale."""
    if selected.scale is None:
        raise DataRefused("the scale is not known; set `points`, as points: [1, 2, 3, 4, 5, 6, 7]")
    low, high = selected.scale
    if low != int(low) or high != int(high) or not 1 <= high - low < MOST_POINTS:
        raise DataRefused(f"a scale from {low:g} to {high:g} has no countable points; set `points`")
    return [float(point) for point in range(int(low), int(high) + 1)]


def _item_rows(own: pd.DataFrame, name: str, by: str | None, points: Sequence[float]) -> list[Row]:
    if by is None:
        return plain_rows(likert(own, "value", "attribute", points))
    found = plain_rows(likert(own, "value", by, points))
    return [{"item": name, by: row["item"], **{key: row[key] for key in row if key != "item"}} for row in found]
