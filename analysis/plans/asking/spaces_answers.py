"""The answers about components, and about attributes as directions in a map."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from palpate.analysis.plans.answers import Answer
from palpate.analysis.plans.asking.spaces_tables import (
    configuration,
    gap_notes,
    points_rows,
    profiles_of,
    rows_of,
    sentences,
)
from palpate.analysis.spaces.components import Components, pca
from palpate.analysis.spaces.profiles import Profiles
from palpate.analysis.spaces.retained import parallel_analysis, share_intervals
from palpate.analysis.spaces.vectors import property_vectors
from palpate.analysis.statistics.apa import apa_p
from palpate.analysis.statistics.refusals import StatisticsError

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import Row, Selected
    from palpate.analysis.plans.asking.spaces import Pca, Vectors
    from palpate.analysis.spaces.components import Kind as Variances


def pca_answer(selected: Selected, asked: Pca) -> Answer:
    """Scores of the stimuli; variances, loadings and means beside."""
    profiles = profiles_of(selected, asked)
    kind: Variances = "correlation" if asked.scaled else "covariance"
    found = pca(profiles.shifted_means(), kind)
    variances, kept, notes = _variances(selected, asked, profiles, found)
    first = ", ".join(f"{share:.1%}" for share in found.shares[:2])
    retained = "" if kept is None else f"; parallel analysis keeps {kept}"
    return Answer(
        rows=points_rows(found.scores, asked.over, "pc"),
        method=f"Principal components of the {asked.over} means, by singular values of the centred {kind} table;"
        " of each component the largest coefficient is positive"
        + ("" if asked.reference == "none" else f"; parallel analysis ({asked.reference} reference, Horn 1965)"),
        kinds={f"pc{i + 1}": f"score on component {i + 1}" for i in range(found.scores.shape[1])},
        participants=len(profiles.participants),
        values=int(selected.table["value"].notna().sum()),
        headline=f"The first components hold {first} of the variance{retained}",
        notes=sentences([*found.notes, *gap_notes(profiles, selected), *notes]),
        more={
            "variances": rows_of(variances),
            "loadings": _loadings(found, asked.items),
            "means": rows_of(profiles.means().reset_index(names=asked.over)),
        },
    )


def _variances(
    selected: Selected, asked: Pca, profiles: Profiles, found: Components
) -> tuple[pd.DataFrame, int | None, list[str]]:
    """Variance and share of each component, with interval and reference; how many to keep; what lacks and why."""
    draws, notes = asked.draws or selected.draws, []
    table = pd.DataFrame({"component": found.scores.columns, "variance": found.variances, "share": found.shares})
    table["cumulative"] = np.minimum(np.cumsum(table["share"]), 1.0)
    try:
        ends = share_intervals(profiles, found.kind, draws, asked.confidence, selected.seed)
        table = table.merge(ends[["component", "ci_low", "ci_high"]], on="component", how="left")
    except StatisticsError as refusal:
        table = table.assign(ci_low=np.nan, ci_high=np.nan)
        notes.append(f"no intervals of the shares: {refusal}")
    if asked.reference == "none":
        return table, None, notes
    means = profiles.shifted_means()
    parallel = parallel_analysis(means, found.kind, asked.reference, draws, seed=selected.seed)
    return table.merge(parallel.table.drop(columns="variance"), on="component", how="left"), parallel.kept, notes


def _loadings(found: Components, items: str) -> tuple[Row, ...]:
    """Each attribute's coefficient in and correlation with each component."""
    names = {name: str(name).lower() for name in found.directions.columns}
    one = found.directions.rename(columns={name: f"direction_{short}" for name, short in names.items()})
    two = found.loadings.rename(columns={name: f"correlation_{short}" for name, short in names.items()})
    return rows_of(pd.concat([one, two], axis=1).reset_index(names=items))


def vectors_answer(selected: Selected, asked: Vectors) -> Answer:
    """One row per attribute: its direction in the map, and how well the map explains it."""
    profiles = profiles_of(selected, asked)
    points = configuration(profiles, asked, selected.seed)
    draws = asked.draws or selected.draws
    found = property_vectors(points, profiles.shifted_means(), draws, selected.seed)
    named = {str(name): f"direction_{i + 1}" for i, name in enumerate(points.columns)}
    table = found.rename(columns={"property": asked.items, **named})
    reached = int((found["p"] < selected.alpha).sum())
    ranked = found.dropna(subset=["r2"]).sort_values("r2", ascending=False, kind="stable").head(1)
    told = "".join(
        f"; best explained: {name}, R² = {r2:.2f}, {apa_p(p)}"
        for name, r2, p in zip(ranked["property"], ranked["r2"], ranked["p"], strict=True)
    )
    return Answer(
        rows=rows_of(table),
        method=f"Property fitting: {asked.items} means regressed on the {asked.dimensions} coordinates of the"
        f" {asked.on} configuration; p by permutation of the {asked.over} means (vegan's envfit), not adjusted",
        kinds={
            **{name: f"direction cosine on dimension {i + 1}" for i, name in enumerate(named.values())},
            "r2": "squared multiple correlation",
            "r": "multiple correlation",
            "F": "F of the regression",
            "p_F": "p of F, normal theory, not adjusted",
            "p": f"p by permutation ({draws} draws), not adjusted",
        },
        participants=len(profiles.participants),
        values=int(selected.table["value"].notna().sum()),
        headline=f"The map explains {reached} of {len(found)} {asked.items}s (p < {selected.alpha:g}){told}",
        notes=sentences(gap_notes(profiles, selected)),
        more={"configuration": points_rows(points, asked.over)},
    )
