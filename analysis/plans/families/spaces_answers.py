"""The answers about components, maps and their comparison, and about attributes as directions in a map."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.analysis.plans.answers import Answer, plain_rows, require_columns
from palpate.analysis.ratings.dataset import DataRefused, DeclarationRefused
from palpate.analysis.spaces.classical import classical_mds
from palpate.analysis.spaces.components import Components, parallel_analysis, pca, share_intervals
from palpate.analysis.spaces.dissimilarities import Dissimilarities, pair_dissimilarities, profile_distances
from palpate.analysis.spaces.nonmetric import nonmetric_mds, stress_reference, stress_scree
from palpate.analysis.spaces.procrustes import Procrustes as Compared
from palpate.analysis.spaces.procrustes import procrustes
from palpate.analysis.spaces.profiles import Profiles, gather_profiles, of_people
from palpate.analysis.spaces.replicated import confidence_ellipses
from palpate.analysis.spaces.vectors import property_vectors
from palpate.analysis.statistics.apa import apa_p
from palpate.analysis.statistics.cells import coded
from palpate.analysis.statistics.draws import stream
from palpate.analysis.statistics.refusals import StatisticsError, TooFew
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import Row, Selected
    from palpate.analysis.plans.families.spaces import Mds, Pca, Procrustes, Vectors
    from palpate.analysis.spaces.components import Kind as Variances


def pca_answer(selected: Selected, settings: Pca) -> Answer:
    """Return the scores of the stimuli, with variances, loadings and means in `more`."""
    profiles = profiles_of(selected, settings)
    kind: Variances = "correlation" if settings.scaled else "covariance"
    components = pca(profiles.shifted_means(), kind)
    variances, retained_count, notes = _variances(selected, settings, profiles, components)
    first = ", ".join(f"{share:.1%}" for share in components.shares[:2])
    retained = "" if retained_count is None else f"; parallel analysis keeps {retained_count}"
    # Each attribute's coefficient in and correlation with each component.
    directions = components.directions.rename(columns=lambda name: f"direction_{str(name).lower()}")
    correlations = components.loadings.rename(columns=lambda name: f"correlation_{str(name).lower()}")
    return Answer(
        rows=points_rows(components.scores, settings.over, "pc"),
        method=f"Principal components of the {settings.over} means, by singular values of the centred {kind} table;"
        " of each component the largest coefficient is positive"
        + ("" if settings.reference == "none" else f"; parallel analysis ({settings.reference} reference, Horn 1965)"),
        kinds={f"pc{i + 1}": f"score on component {i + 1}" for i in range(components.scores.shape[1])},
        participants=len(profiles.participants),
        values=int(selected.table["value"].notna().sum()),
        headline=f"The first components hold {first} of the variance{retained}",
        notes=sentences([*components.notes, *gap_notes(profiles, selected), *notes]),
        more={
            "variances": rows_of(variances),
            "loadings": rows_of(pd.concat([directions, correlations], axis=1).reset_index(names=settings.items)),
            "means": rows_of(profiles.means().reset_index(names=settings.over)),
        },
    )


def _variances(
    selected: Selected, settings: Pca, profiles: Profiles, components: Components
) -> tuple[pd.DataFrame, int | None, list[str]]:
    """Return variance and share of each component with interval and reference, the number to keep, and notes."""
    draws, notes = settings.draws or selected.draws, []
    table = pd.DataFrame(
        {"component": components.scores.columns, "variance": components.variances, "share": components.shares}
    )
    table["cumulative"] = np.minimum(np.cumsum(table["share"]), 1.0)
    try:
        ends = share_intervals(profiles, components.kind, draws, settings.confidence, selected.seed)
        table = table.merge(ends[["component", "ci_low", "ci_high"]], on="component", how="left")
    except StatisticsError as refusal:
        table = table.assign(ci_low=np.nan, ci_high=np.nan)
        notes.append(f"no intervals of the shares: {refusal}")
    if settings.reference == "none":
        return table, None, notes
    means = profiles.shifted_means()
    parallel = parallel_analysis(means, components.kind, settings.reference, draws, seed=selected.seed)
    return table.merge(parallel.table.drop(columns="variance"), on="component", how="left"), parallel.kept, notes


def vectors_answer(selected: Selected, settings: Vectors) -> Answer:
    """Return one row per attribute with its direction in the map, and how well the map explains it."""
    profiles = profiles_of(selected, settings)
    points = configuration(profiles, settings, selected.seed)
    draws = settings.draws or selected.draws
    vectors = property_vectors(points, profiles.shifted_means(), draws, selected.seed)
    named = {str(name): f"direction_{i + 1}" for i, name in enumerate(points.columns)}
    table = vectors.rename(columns={"property": settings.items, **named})
    reached = int((vectors["p"] < selected.alpha).sum())
    ranked = vectors.dropna(subset=["r2"]).sort_values("r2", ascending=False, kind="stable").head(1)
    listing = "".join(
        f"; best explained: {name}, R² = {r2:.2f}, {apa_p(p)}"
        for name, r2, p in zip(ranked["property"], ranked["r2"], ranked["p"], strict=True)
    )
    return Answer(
        rows=rows_of(table),
        method=f"Property fitting: {settings.items} means regressed on the {settings.dimensions} coordinates of the"
        f" {settings.on} configuration; p by permutation of the {settings.over} means (vegan's envfit), not adjusted",
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
        headline=f"The map explains {reached} of {len(vectors)} {settings.items}s (p < {selected.alpha:g}){listing}",
        notes=sentences(gap_notes(profiles, selected)),
        more={"configuration": points_rows(points, settings.over)},
    )


def profiles_of(selected: Selected, settings: Pca | Mds | Procrustes | Vectors) -> Profiles:
    """Return each participant's ratings of each stimulus on each attribute, with gaps as the test's `missing` says.

    Without it, a mean is over those who rated a stimulus, since a study's groups may have different stimuli.
    """
    require_columns(selected.table, (settings.over, settings.items))
    gaps = {None: "available", "listwise": "listwise"}.get(settings.missing, "raise")
    return gather_profiles(
        selected.table,
        "value",
        settings.over,
        settings.items,
        "participant",
        missing="listwise" if gaps == "listwise" else ("raise" if gaps == "raise" else "available"),
        aggregate="mean",
    )


def gap_notes(profiles: Profiles, selected: Selected) -> list[str]:
    """Return notes on the means: repetitions averaged, participants left out, stimuli that not everyone rated."""
    notes = []
    least, most = profiles.raters
    if profiles.dropped:
        notes.append(f"Left out listwise: {', '.join(map(str, profiles.dropped))}.")
    if least < len(profiles.participants):
        notes.append(
            f"Not everyone rated everything: each mean is over those who did ({least} to {most} of "
            f"{count(len(profiles.participants), 'participant')}), so it also carries who they were."
        )
    cells = int((~np.isnan(profiles.own)).sum())
    used = int(selected.table["value"].notna().sum())
    if not profiles.dropped and used > cells:
        notes.append("A participant's repeated ratings of a stimulus on an attribute were averaged first.")
    return notes


def configuration(profiles: Profiles, settings: Procrustes | Vectors, seed: int) -> pd.DataFrame:
    """Return the points of a test's configuration, stimuli x dimensions."""
    if settings.on == "attributes":
        return profiles.means()
    if settings.on == "pca":
        scores = pca(profiles.shifted_means(), "correlation" if settings.scaled else "covariance").scores
        if settings.dimensions > scores.shape[1]:
            raise DataRefused(f"dimensions: {settings.dimensions}, but there are {scores.shape[1]} components")
        return scores.iloc[:, : settings.dimensions]
    between = profile_distances(profiles, settings.scaled)
    if settings.on == "classical":
        return classical_mds(between, settings.dimensions).points
    return nonmetric_mds(
        between, settings.dimensions, settings.ties, settings.starts, seed if settings.starts else 0
    ).points


def points_rows(points: pd.DataFrame, label: str, prefix: str = "dim") -> tuple[Row, ...]:
    """Return one row per object: its label as text, and its coordinates as `dim1`, `dim2`, ..."""
    named = points.set_axis([f"{prefix}{i + 1}" for i in range(points.shape[1])], axis=1)
    return rows_of(named.assign(**{label: [str(name) for name in points.index]})[[label, *named.columns]])


def numeric(table: pd.DataFrame, names: Iterable[str]) -> pd.DataFrame:
    """Return the table with these columns as numbers, which a plan's own tables may hold as text."""
    numbers_table = table.copy()
    for name in names:
        if _labels(numbers_table[name]):
            column = numbers_table[name]
            words = {"true": "1", "false": "0", "yes": "1", "no": "0"}
            texts = [str(value).strip() for value in column.tolist()]
            numbers = pd.to_numeric(pd.Series([words.get(text.lower(), text) for text in texts]), errors="coerce")
            wrong = [
                i for i, (text, number) in enumerate(zip(texts, numbers, strict=True)) if text and math.isnan(number)
            ]
            if wrong:
                raise DeclarationRefused(
                    f"column {name!r} must hold numbers; found {texts[wrong[0]]!r} in row {wrong[0] + 1}"
                )
            numbers_table[name] = pd.Series(numbers.to_numpy(dtype="float64"), index=column.index)
    return numbers_table


def rows_of(table: pd.DataFrame) -> tuple[Row, ...]:
    """Return a table as plain rows, with labels as text."""
    texts = {name: [str(value) for value in table[name]] for name in table.columns if _labels(table[name])}
    return plain_rows(table.assign(**texts))


def _labels(column: pd.Series[Any]) -> bool:
    return not (pd.api.types.is_numeric_dtype(column) or pd.api.types.is_bool_dtype(column))


def sentences(notes: Iterable[str]) -> tuple[str, ...]:
    """Return the notes as sentences without duplicates."""
    texts = (note if note.endswith(".") else f"{note[:1].upper()}{note[1:]}." for note in notes if note)
    return tuple(dict.fromkeys(texts))


SCREE_STARTS = 2  # beside the classical one and the hops; the map's own dimensions have all of its starts


class _Map(NamedTuple):
    """The points of a map, notes on them, and further tables."""

    points: pd.DataFrame
    method: str
    headline: str
    notes: list[str]
    more: dict[str, tuple[Row, ...]]


def mds_answer(selected: Selected, settings: Mds) -> Answer:
    """Return one row per stimulus with its place in the map."""
    if settings.pairs is None:
        profiles = profiles_of(selected, settings)
        between, notes = profile_distances(profiles, settings.scaled), gap_notes(profiles, selected)
    else:
        require_columns(selected.table, (*settings.pairs, "value"))
        if len(selected.outcomes) > 1:
            raise DataRefused(f"`pairs` needs one outcome; found {', '.join(selected.outcomes)}: name it in `outcomes`")
        first, second = settings.pairs
        top = None if settings.top is None else float(settings.top)
        people = "participant" if "participant" in selected.table else None
        table = numeric(selected.table, ("value",))
        between, notes = pair_dissimilarities(table, "value", first, second, people, settings.meaning, top), []
    if settings.method == "classical":
        solution = classical_mds(between, settings.dimensions)
        eigenvalues = pd.DataFrame(
            {"dimension": range(1, len(solution.eigenvalues) + 1), "eigenvalue": solution.eigenvalues}
        )
        result = _Map(
            solution.points,
            "Classical multidimensional scaling (Torgerson 1952; Gower 1966)",
            f"{settings.dimensions} dimensions hold {solution.fit_positive:.1%} of the positive eigenvalues "
            f"({solution.fit_absolute:.1%} of all sizes)",
            list(solution.notes),
            {"eigenvalues": rows_of(eigenvalues)},
        )
    else:
        result = _nonmetric(selected, between, settings)
    ellipses, why = _ellipses(selected, settings, between, result.points)
    places = {f"dim{i + 1}": f"coordinate on dimension {i + 1}" for i in range(settings.dimensions)}
    return Answer(
        rows=points_rows(result.points, settings.over),
        method=f"{result.method}, {between.source}; turned to principal axes, the largest coordinate of each positive",
        kinds=places,
        participants=int(selected.table["participant"].nunique()) if "participant" in selected.table else 0,
        values=int(selected.table["value"].notna().sum()),
        headline=result.headline,
        notes=sentences([*result.notes, *notes, why]),
        more=result.more | ({"ellipses": ellipses} if ellipses else {}),
    )


def _nonmetric(selected: Selected, between: Dissimilarities, settings: Mds) -> _Map:
    seed = selected.seed if settings.starts else 0
    solution = nonmetric_mds(between, settings.dimensions, settings.ties, settings.starts, seed)
    more = {
        "shepard": rows_of(solution.shepard),
        "starts": rows_of(pd.DataFrame({"start": range(len(solution.starts)), "stress": solution.starts})),
    }
    if settings.scree:
        starts = min(settings.starts, SCREE_STARTS)
        more["scree"] = rows_of(stress_scree(between, settings.scree, settings.ties, starts, selected.seed, solution))
    headline = f"Stress-1 = {solution.stress:.3g} in {settings.dimensions} dimensions"
    if settings.reference:
        held = stress_reference(between, settings.dimensions, settings.ties, settings.reference, selected.seed)
        more["reference"] = ({name: getattr(held, name) for name in held.__dataclass_fields__},)
        headline += f" ({held.draws} shuffles of the dissimilarities: {held.mean:.3g} on average, {apa_p(held.p)})"
    reached = f"{solution.reached} of {len(solution.starts)} starts ended within 1e-4 of the best stress"
    method = f"Non-metric multidimensional scaling, stress formula 1, {settings.ties} treatment of ties (Kruskal 1964)"
    return _Map(solution.points, method, headline, [reached, *solution.notes], more)


def _ellipses(
    selected: Selected, settings: Mds, between: Dissimilarities, points: pd.DataFrame
) -> tuple[tuple[Row, ...], str]:
    """Return the ellipses' rows, or the reason why there are none."""
    if not settings.replications:
        return (), ""
    if settings.dimensions < 2:
        return (), "no ellipses: the map has one dimension"
    try:
        ellipses = confidence_ellipses(
            between, points, settings.method, settings.ties, settings.replications, settings.confidence, selected.seed
        )
    except StatisticsError as refusal:
        return (), f"no ellipses: {refusal}"
    named = {"label": settings.over, "x": "centre_1", "y": "centre_2", "major": "semi_major", "minor": "semi_minor"}
    return rows_of(ellipses.rename(columns=named)), (
        f"ellipses: {100 * settings.confidence:g} % normal regions from {settings.replications} resamples of the"
        " participants, each map turned onto their mean (generalized Procrustes)"
    )


MOST_SPLITS = 200


def procrustes_answer(selected: Selected, settings: Procrustes) -> Answer:
    """Return one row per pair of groups, or one for all splits into halves."""
    profiles = profiles_of(selected, settings)
    rows, more, headline = (
        _halves(selected, settings, profiles) if settings.halves else _groups(selected, settings, profiles)
    )
    between = "random halves of the participants" if settings.halves else f"levels of {settings.groups}"
    moved = (
        "turned, shifted" + (", reflected" if settings.reflection else "") + (", stretched" if settings.stretch else "")
    )
    return Answer(
        rows=rows,
        method=f"Procrustes fit of {settings.on} configurations of {between} ({moved}; Gower 1975)"
        + ("" if settings.halves else "; permutation test of r (Jackson 1995), p not adjusted"),
        kinds={
            "r": "Procrustes correlation of configurations of unit size",
            "m2": "1 - r squared",
            "squares": "sum of squared distances from the first group's points",
            "p": "p by permutation of the stimuli, not adjusted",
            "r_low": "lowest of the middle splits",
            "r_high": "highest of the middle splits",
        },
        participants=len(profiles.participants),
        values=int(selected.table["value"].notna().sum()),
        headline=headline,
        notes=sentences(gap_notes(profiles, selected)),
        more=more,
    )


def _groups(
    selected: Selected, settings: Procrustes, profiles: Profiles
) -> tuple[tuple[Row, ...], dict[str, tuple[Row, ...]], str]:
    # The participants of each group, by their places.
    require_columns(selected.table, (settings.groups,))
    own = selected.table[["participant", settings.groups]].drop_duplicates()
    if own["participant"].duplicated().any():
        who = sorted(set(map(str, own.loc[own["participant"].duplicated(), "participant"])))[:5]
        raise DataRefused(f"{settings.groups!r} has several levels for {', '.join(who)}; groups are of participants")
    level = {str(who): str(group) for who, group in zip(own["participant"], own[settings.groups], strict=True)}
    labels = [str(name) for name in coded(own[settings.groups].astype(object), settings.groups).labels]
    parts = {name: [i for i, who in enumerate(profiles.participants) if level[str(who)] == name] for name in labels}
    if len(parts) < 2:
        raise TooFew(f"{settings.groups!r} has one level, {labels[0]!r}; a comparison needs two (or `halves: true`)")
    rows: list[dict[str, Any]] = []
    residuals: list[dict[str, Any]] = []
    for (one, first), (two, second) in combinations(parts.items(), 2):
        fit, people = _compared(selected, settings, profiles, first, second)
        rows.append(
            {
                "group_a": one,
                "group_b": two,
                "participants_a": people[0],
                "participants_b": people[1],
                "stimuli": len(fit.fitted),
                "r": fit.r,
                "m2": fit.m2,
                "squares": fit.squares,
                "stretch": fit.stretch,
                "reflected": fit.reflection,
                "p": fit.p,
                "draws": fit.draws,
                "exact": fit.exact,
            }
        )
        for name, distance in fit.residuals.items():
            residuals.append({"group_a": one, "group_b": two, settings.over: str(name), "residual": float(distance)})
    named = "; ".join(
        f"{row['group_a']} and {row['group_b']}: r = {row['r']:.2f}, {apa_p(row['p'])}" for row in rows[:3]
    )
    return tuple(rows), {"residuals": tuple(residuals)}, named


def _compared(
    selected: Selected, settings: Procrustes, profiles: Profiles, first: list[int], second: list[int], test: bool = True
) -> tuple[Compared, tuple[int, int]]:
    """Return the fit of the second group's configuration to the first's, over the stimuli that both rated."""
    one, two = of_people(profiles, first), of_people(profiles, second)
    shared = [name for name in one.stimuli if name in set(two.stimuli)]
    if len(shared) < 3:
        raise TooFew(f"the two parts rated {len(shared)} stimuli in common; a comparison of maps needs three or more")
    maps = []
    for own in (one, two):
        kept = [i for i, name in enumerate(own.stimuli) if name in set(shared)]
        stimuli = tuple(own.stimuli[i] for i in kept)
        both_rated = Profiles(own.own[:, kept], own.offset, own.participants, stimuli, own.attributes)
        maps.append(configuration(both_rated, settings, selected.seed))
    drawn = {"draws": settings.draws or selected.draws, "seed": selected.seed} if test else {}
    fit = procrustes(maps[0], maps[1], settings.stretch, settings.reflection, **drawn)
    return fit, (len(first), len(second))


def _halves(
    selected: Selected, settings: Procrustes, profiles: Profiles
) -> tuple[tuple[Row, ...], dict[str, tuple[Row, ...]], str]:
    """Return the similarity of the maps of random halves: median and range of r over many splits, without a p."""
    people = len(profiles.participants)
    if people < 4:
        raise TooFew(f"{people} participants; halves need two each")
    splits = min(settings.draws or selected.draws, MOST_SPLITS)
    rng = stream(selected.seed, "halves")
    correlations = []
    for _ in range(splits):
        order = rng.permutation(people).tolist()
        parts = sorted(order[: people // 2]), sorted(order[people // 2 :])
        correlations.append(_compared(selected, settings, profiles, *parts, test=False)[0].r)
    low, middle, high = np.quantile(
        correlations, [(1 - settings.confidence) / 2, 0.5, (1 + settings.confidence) / 2]
    ).tolist()
    row: dict[str, Any] = {"splits": splits, "r": middle, "r_low": low, "r_high": high, "m2": 1 - middle * middle}
    split_rows = rows_of(pd.DataFrame({"split": range(1, splits + 1), "r": correlations}))
    headline = f"Maps of random halves agree with r = {middle:.2f} ({low:.2f} to {high:.2f} over {splits} splits)"
    return (row,), {"splits": split_rows}, headline
