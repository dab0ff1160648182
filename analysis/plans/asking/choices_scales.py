"""The answers about scales of items from comparisons of pairs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from palpate.analysis.choices.bradley_terry import bradley_terry
from palpate.analysis.choices.scales import SUM_ZERO, Scale, differences
from palpate.analysis.choices.thurstone import thurstone
from palpate.analysis.choices.triads import circular_triads
from palpate.analysis.plans.answers import Answer
from palpate.analysis.plans.asking.describing_rows import require_columns
from palpate.analysis.plans.asking.spaces_tables import numeric, rows_of, sentences
from palpate.analysis.statistics.apa import apa_p

if TYPE_CHECKING:
    import pandas as pd

    from palpate.analysis.plans.answers import Row, Selected
    from palpate.analysis.plans.asking.choices import BradleyTerry, Thurstone

KINDS = {
    "se": "standard error, inverse information",
    "wins": "times chosen",
    "losses": "times the other was chosen",
    "comparisons": "times compared",
}
NOT_INDEPENDENT = (
    "Several choices of one participant count as independent: where participants differ, standard errors are too small"
)


def bradley_terry_answer(selected: Selected, asked: BradleyTerry) -> Answer:
    """One row per item: its log odds."""
    table = _table(selected, asked, (asked.tie, asked.first))
    reference = SUM_ZERO if asked.reference is None else asked.reference
    found = bradley_terry(
        table, asked.winner, asked.loser, asked.tie, asked.first, asked.count, reference, asked.confidence
    )
    kinds = {"value": "log odds", "worth": "share of the summed odds", "ties": "times tied", **KINDS}
    sources = "Bradley & Terry 1952" + ("" if asked.tie is None else "; Davidson 1970")
    return _answer(asked, table, found, f"{found.model} by maximum likelihood ({sources})", kinds)


def thurstone_answer(selected: Selected, asked: Thurstone) -> Answer:
    """One row per item: its value in standard deviations of a difference."""
    table = _table(selected, asked, ())
    reference = SUM_ZERO if asked.reference is None else asked.reference
    found = thurstone(table, asked.winner, asked.loser, asked.count, asked.method, reference, asked.confidence)
    kinds = {"value": "in standard deviations of a difference of two items", **KINDS}
    return _answer(asked, table, found, f"{found.model} (Thurstone 1927; Mosteller 1951)", kinds)


def _table(selected: Selected, asked: BradleyTerry | Thurstone, more: tuple[str | None, ...]) -> pd.DataFrame:
    named = (asked.winner, asked.loser, asked.count, asked.participant, *more)
    require_columns(selected.table, [name for name in named if name is not None])
    return numeric(selected.table, () if asked.count is None else (asked.count,))


def _answer(
    asked: BradleyTerry | Thurstone, table: pd.DataFrame, found: Scale, method: str, kinds: dict[str, str]
) -> Answer:
    ranked = found.values.sort_values("value", ascending=False, kind="stable")["item"].tolist()
    fit = f"deviance({found.df}) = {found.deviance:.2f}, {apa_p(found.p)}" if found.df else "no test of fit"
    tie = asked.tie if asked.test == "bradley_terry" else None
    who = asked.participant or ("participant" if "participant" in table.columns else None)
    triads = circular_triads(table, asked.winner, asked.loser, who, tie, asked.count)
    zero = "values sum to 0" if asked.reference is None else f"{asked.reference} is 0"
    interval = f"{100 * asked.confidence:g} % normal interval of the value"
    covariance = found.covariance.set_axis([str(name) for name in found.covariance], axis=1).reset_index(names="item")
    more: dict[str, tuple[Row, ...]] = {
        "fit": ({"deviance": found.deviance, "df": found.df, "p": found.p if found.df else None},),
        "differences": rows_of(differences(found, asked.correction)),
        "covariance": rows_of(covariance),
        "pairs": rows_of(found.pairs),
        "triads": rows_of(triads),
    }
    people = int(table[who].nunique()) if who else 0
    circular, of = (triads[name].tolist()[0] for name in ("circular", "triads"))
    return Answer(
        rows=rows_of(found.values.drop(columns=["ties"] if asked.test == "thurstone" else [])),
        method=f"{method}; {zero}",
        kinds=kinds | {"ci_low": interval, "ci_high": interval},
        participants=people,
        values=int(found.values["comparisons"].sum()) // 2,
        headline=f"Most to least: {', '.join(map(str, ranked))}; fit: {fit}; "
        f"{circular} of {of} triads circular (all choices together)",
        notes=sentences([*found.notes, "" if people == 1 else NOT_INDEPENDENT]),
        more=more | ({"effects": rows_of(found.effects)} if len(found.effects) else {}),
    )
