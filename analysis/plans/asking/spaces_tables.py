"""What the answers about spaces share: profiles of the selected ratings, the configuration asked for, plain rows."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from palpate.analysis.plans.asking.describing_rows import plain_rows, require_columns
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.spaces.classical import classical_mds
from palpate.analysis.spaces.components import pca
from palpate.analysis.spaces.dissimilarities import profile_distances
from palpate.analysis.spaces.nonmetric import nonmetric_mds
from palpate.analysis.spaces.profiles import Profiles, gather_profiles
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import Row, Selected
    from palpate.analysis.plans.asking.spaces import Mds, Pca, Procrustes, Vectors


def profiles_of(selected: Selected, asked: Pca | Mds | Procrustes | Vectors) -> Profiles:
    """Each participant's ratings of each stimulus on each attribute, gaps treated as the test's `missing` says.

    Without it, a mean is over those who rated a stimulus: a study's groups may each have stimuli of their own.
    """
    require_columns(selected.table, (asked.over, asked.items))
    if asked.missing == "mixed_model":
        raise DataRefused("a space has no form that takes gaps by a mixed model; choose `missing: listwise`")
    gaps = {"refuse": "raise", "listwise": "listwise"}.get(asked.missing or "", "available")
    return gather_profiles(
        selected.table,
        "value",
        asked.over,
        asked.items,
        "participant",
        missing="listwise" if gaps == "listwise" else ("raise" if gaps == "raise" else "available"),
        aggregate="mean",
    )


def gap_notes(profiles: Profiles, selected: Selected) -> list[str]:
    """What the means rest on: repetitions averaged, participants left out, stimuli that not everyone rated."""
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


def configuration(profiles: Profiles, asked: Procrustes | Vectors, seed: int) -> pd.DataFrame:
    """The points that a test is about, stimuli x dimensions."""
    if asked.on == "attributes":
        return profiles.means()
    if asked.on == "pca":
        scores = pca(profiles.shifted_means(), "correlation" if asked.scaled else "covariance").scores
        if asked.dimensions > scores.shape[1]:
            raise DataRefused(f"dimensions: {asked.dimensions}, but there are {scores.shape[1]} components")
        return scores.iloc[:, : asked.dimensions]
    between = profile_distances(profiles, asked.scaled)
    if asked.on == "classical":
        return classical_mds(between, asked.dimensions).points
    return nonmetric_mds(between, asked.dimensions, asked.ties, asked.starts, seed if asked.starts else 0).points


def points_rows(points: pd.DataFrame, label: str, prefix: str = "dim") -> tuple[Row, ...]:
    """One row per object: its label as text, and its coordinates as `dim1`, `dim2`, ..."""
    named = points.set_axis([f"{prefix}{i + 1}" for i in range(points.shape[1])], axis=1)
    return rows_of(named.assign(**{label: [str(name) for name in points.index]})[[label, *named.columns]])


def numeric(table: pd.DataFrame, names: Iterable[str]) -> pd.DataFrame:
    """The table with these columns as numbers where they are numbers in words, as a plan's own tables hold them."""
    made = table.copy()
    for name in names:
        if _labels(made[name]):
            made[name] = _as_numbers(made[name], name)
    return made


def _as_numbers(column: pd.Series[Any], name: str) -> pd.Series[Any]:
    words = {"true": "1", "false": "0", "yes": "1", "no": "0"}
    texts = [str(value).strip() for value in column.tolist()]
    numbers = pd.to_numeric(pd.Series([words.get(text.lower(), text) for text in texts]), errors="coerce")
    wrong = [i for i, (text, number) in enumerate(zip(texts, numbers, strict=True)) if text and math.isnan(number)]
    if wrong:
        raise DataRefused(f"column {name!r} must hold numbers; found {texts[wrong[0]]!r} in row {wrong[0] + 1}")
    return pd.Series(numbers.to_numpy(dtype="float64"), index=column.index)


def rows_of(table: pd.DataFrame) -> tuple[Row, ...]:
    """A table as plain rows; labels become text."""
    texts = {name: [str(value) for value in table[name]] for name in table.columns if _labels(table[name])}
    return tuple(plain_rows(table.assign(**texts)))


def _labels(column: pd.Series[Any]) -> bool:
    return not (pd.api.types.is_numeric_dtype(column) or pd.api.types.is_bool_dtype(column))


def sentences(notes: Iterable[str]) -> tuple[str, ...]:
    """Notes as sentences, each once."""
    made = (note if note.endswith(".") else f"{note[:1].upper()}{note[1:]}." for note in notes if note)
    return tuple(dict.fromkeys(made))
