"""Ratings of a lab's textures: mean and SD between raters, on 0 to 100 (thesis 3.3.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.modeling.attributes.material import MaterialError, Pair, Rated

if TYPE_CHECKING:
    import pandas as pd

    from palpate.analysis.ratings.dataset import Ratings
    from palpate.analysis.ratings.reading import Material as Answers

STUDY = "texture_ratings"
TOP = 100.0


@dataclass(frozen=True)
class RatedTextures:
    """Ratings by texture. `incomplete` has a note for each texture with unrated attributes, which is not in `rated`.

    `columns` are each texture's columns in the study's stimulus table.
    """

    attributes: tuple[Pair, ...]
    rated: Mapping[str, Rated] = field(default_factory=dict)
    incomplete: Mapping[str, str] = field(default_factory=dict)
    columns: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    simulated: bool = False
    notes: tuple[str, ...] = ()


def read_ratings(lab: Path, study: str = STUDY, simulated: bool | None = None) -> RatedTextures:
    """Return the ratings that `palpate regenerate` would analyse: of complete sessions of people who did not withdraw.

    They are of one version of the study, all real or all simulated, without the exclusions of its analysis plan. A
    person who rated a texture more than once counts once, with the mean. The SD between raters (n - 1) of a single
    rater is NaN. Without such a session the attributes are the study's, and nothing is rated. Raises MaterialError for
    a study without ratings, and the errors of reading (DataRefused, also for ratings off their scale, PlanError,
    StudyError, LedgerError: all ValueErrors).
    """
    from palpate.modeling.lab_answers import has_answers, lab_answers, left_out_lines

    if not has_answers(lab, study):
        return RatedTextures(attributes_of(lab, study), notes=(f"{lab}: no session of {study}: no texture is rated",))
    answers, _folder = lab_answers(lab, study, simulated=simulated)
    if answers.ratings is None:
        raise MaterialError(f"{study}: holds no ratings; a study that rates textures is expected")
    notes = tuple(f"ratings left out: {line}" for line in left_out_lines(answers))
    return _rated(answers, answers.ratings, notes)


def attributes_of(lab: Path | None, study: str = STUDY) -> tuple[Pair, ...]:
    """Return the attributes of a study, in its order; without a lab, of a shipped study. Raises StudyError."""
    from palpate.studies.catalogue import SHIPPED, STUDY_FILE, find, read_study

    file = SHIPPED / study / STUDY_FILE if lab is None else find(study, lab)
    return tuple(Pair(attribute.low, attribute.high) for attribute in read_study(file).study.attributes)


def _rated(answers: Answers, ratings: Ratings, notes: tuple[str, ...]) -> RatedTextures:
    from palpate.modeling.lab_answers import demand_on_scale, demand_scale

    scale = demand_scale(ratings)
    if "stimulus" not in ratings.table.columns:
        raise MaterialError(f"{ratings.name!r}: no column 'stimulus' says which texture a rating is of")
    table = ratings.table[ratings.table["value"].notna()]
    demand_on_scale(table, scale.low, scale.high)
    people = table.groupby(["stimulus", "attribute", "participant"], observed=True)["value"].mean().reset_index()
    people["value"] = (people["value"] - scale.low) * (TOP / (scale.high - scale.low))
    rated, incomplete = _by_texture(people, ratings.attributes)
    pairs = tuple(Pair(name, ratings.antonyms.get(name, f"not {name}")) for name in ratings.attributes)
    stimuli = answers.study.stimuli if answers.study is not None else ()
    columns = {stimulus.id: dict(stimulus.columns) for stimulus in stimuli}
    return RatedTextures(pairs, rated, incomplete, columns, answers.simulated, notes)


def _by_texture(people: pd.DataFrame, attributes: Sequence[str]) -> tuple[dict[str, Rated], dict[str, str]]:
    """Return the textures that were rated on every attribute, and notes on the others.

    `people` has one value per person, texture and attribute. The number of raters is that of the attribute with fewest.
    """
    values: dict[tuple[str, str], list[float]] = {}
    for row in people.itertuples(index=False):
        values.setdefault((str(row.stimulus), str(row.attribute)), []).append(float(row.value))  # type: ignore[arg-type]
    rated, incomplete = {}, {}
    for texture in dict.fromkeys(texture for texture, _ in values):
        missing = [name for name in attributes if (texture, name) not in values]
        if missing:
            incomplete[texture] = f"nobody rated it on {', '.join(missing)}: it counts as not rated"
        else:
            by_attribute = [values[texture, name] for name in attributes]
            mean = np.array([np.mean(value) for value in by_attribute])
            sd = np.array([np.std(value, ddof=1) if len(value) > 1 else np.nan for value in by_attribute])
            rated[texture] = Rated(mean, sd, min(len(value) for value in by_attribute))
    return rated, incomplete
