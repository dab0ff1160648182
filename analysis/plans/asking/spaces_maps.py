"""The answer about a map of stimuli: places, ellipses, stress by dimension, the Shepard diagram's data."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import pandas as pd

from palpate.analysis.plans.answers import Answer
from palpate.analysis.plans.asking.describing_rows import require_columns
from palpate.analysis.plans.asking.spaces_tables import gap_notes, numeric, points_rows, profiles_of, rows_of, sentences
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.spaces.classical import classical_mds
from palpate.analysis.spaces.dissimilarities import Dissimilarities, pair_dissimilarities, profile_distances
from palpate.analysis.spaces.judging import stress_reference, stress_scree
from palpate.analysis.spaces.nonmetric import nonmetric_mds
from palpate.analysis.spaces.replicated import confidence_ellipses
from palpate.analysis.statistics.apa import apa_p
from palpate.analysis.statistics.refusals import StatisticsError

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import Row, Selected
    from palpate.analysis.plans.asking.spaces import Mds

SCREE_STARTS = 2  # beside the classical one and the hops; the map's own dimensions have all of its starts


class _Map(NamedTuple):
    """Points, what to say of them, and further tables."""

    points: pd.DataFrame
    method: str
    headline: str
    notes: list[str]
    more: dict[str, tuple[Row, ...]]


def mds_answer(selected: Selected, asked: Mds) -> Answer:
    """One row per stimulus: its place in the map."""
    between, notes = _between(selected, asked)
    made = _classical(between, asked) if asked.method == "classical" else _nonmetric(selected, between, asked)
    ellipses, why = _ellipses(selected, asked, between, made.points)
    places = {f"dim{i + 1}": f"coordinate on dimension {i + 1}" for i in range(asked.dimensions)}
    return Answer(
        rows=points_rows(made.points, asked.over),
        method=f"{made.method}, {between.source}; turned to principal axes, the largest coordinate of each positive",
        kinds=places,
        participants=_people(selected.table),
        values=int(selected.table["value"].notna().sum()),
        headline=made.headline,
        notes=sentences([*made.notes, *notes, why]),
        more=made.more | ({"ellipses": ellipses} if ellipses else {}),
    )


def _between(selected: Selected, asked: Mds) -> tuple[Dissimilarities, list[str]]:
    if asked.pairs is None:
        profiles = profiles_of(selected, asked)
        return profile_distances(profiles, asked.scaled), gap_notes(profiles, selected)
    require_columns(selected.table, (*asked.pairs, "value"))
    if len(selected.outcomes) > 1:
        raise DataRefused(f"`pairs` needs one outcome; found {', '.join(selected.outcomes)}: name it in `outcomes`")
    first, second = asked.pairs
    top = None if asked.top is None else float(asked.top)
    people = "participant" if "participant" in selected.table else None
    table = numeric(selected.table, ("value",))
    return pair_dissimilarities(table, "value", first, second, people, asked.meaning, top), []


def _people(table: pd.DataFrame) -> int:
    return int(table["participant"].nunique()) if "participant" in table else 0


def _classical(between: Dissimilarities, asked: Mds) -> _Map:
    found = classical_mds(between, asked.dimensions)
    eigenvalues = pd.DataFrame({"dimension": range(1, len(found.eigenvalues) + 1), "eigenvalue": found.eigenvalues})
    return _Map(
        found.points,
        "Classical multidimensional scaling (Torgerson 1952; Gower 1966)",
        f"{asked.dimensions} dimensions hold {found.fit_positive:.1%} of the positive eigenvalues "
        f"({found.fit_absolute:.1%} of all sizes)",
        list(found.notes),
        {"eigenvalues": rows_of(eigenvalues)},
    )


def _nonmetric(selected: Selected, between: Dissimilarities, asked: Mds) -> _Map:
    seed = selected.seed if asked.starts else 0
    found = nonmetric_mds(between, asked.dimensions, asked.ties, asked.starts, seed)
    more = {
        "shepard": rows_of(found.shepard),
        "starts": rows_of(pd.DataFrame({"start": range(len(found.starts)), "stress": found.starts})),
    }
    if asked.scree:
        starts = min(asked.starts, SCREE_STARTS)
        more["scree"] = rows_of(stress_scree(between, asked.scree, asked.ties, starts, selected.seed, found))
    headline = f"Stress-1 = {found.stress:.3g} in {asked.dimensions} dimensions"
    if asked.reference:
        held = stress_reference(between, asked.dimensions, asked.ties, asked.reference, selected.seed)
        more["reference"] = ({name: getattr(held, name) for name in held.__dataclass_fields__},)
        headline += f" ({held.draws} shuffles of the dissimilarities: {held.mean:.3g} on average, {apa_p(held.p)})"
    reached = f"{found.reached} of {len(found.starts)} starts ended within 1e-4 of the best stress"
    method = f"Non-metric multidimensional scaling, stress formula 1, {asked.ties} treatment of ties (Kruskal 1964)"
    return _Map(found.points, method, headline, [reached, *found.notes], more)


def _ellipses(
    selected: Selected, asked: Mds, between: Dissimilarities, points: pd.DataFrame
) -> tuple[tuple[Row, ...], str]:
    """The ellipses' rows, or why there are none."""
    if not asked.replications:
        return (), ""
    if asked.dimensions < 2:
        return (), "no ellipses: the map has one dimension"
    try:
        found = confidence_ellipses(
            between, points, asked.method, asked.ties, asked.replications, asked.confidence, selected.seed
        )
    except StatisticsError as refusal:
        return (), f"no ellipses: {refusal}"
    named = {"label": asked.over, "x": "centre_1", "y": "centre_2", "major": "semi_major", "minor": "semi_minor"}
    return rows_of(found.rename(columns=named)), (
        f"ellipses: {100 * asked.confidence:g} % normal regions from {asked.replications} resamples of the"
        " participants, each map turned onto their mean (generalized Procrustes)"
    )
