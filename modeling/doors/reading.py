"""Door profiles and ratings from a lab or from simulated people, and door profiles from files.

A lab's ratings are those that `palpate regenerate` analyses, joined with the doors' profiles. Simulated people rate in
memory and through the real runner, so that models can be tried before people rate."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.modeling.doors.data import DoorData
from palpate.modeling.doors.rated import Questions, Rated, StimulusProfile, rated_of
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.signals.arrays import Array
from palpate.signals.doors import profile_file

if TYPE_CHECKING:
    from palpate.analysis.ratings.dataset import Ratings
    from palpate.analysis.ratings.reading import Material


PROFILE = profile_file.ProfileFormat(
    error=ModelDataError,
    counted=lambda _cells: True,
    unreadable=lambda wrong: f"{wrong.path}: no door profile can be read ({wrong.reason})",
    encoding=lambda wrong: f"{wrong.path}: not a UTF-8 text file ({wrong.reason})",
    width=lambda wrong: f"{wrong.where}: {wrong.cells} values found, 2 expected",
    end="",
    advice="; a raw recording becomes a profile with `palpate doors normalise`",
)
FILE, VARIANT = "file", "variant"
DOOR = ("door", "car")
"""The columns of a stimulus table that may name its door; the first one present counts."""
LEAST_PEOPLE = 2
"""The least number of people: in a study of two groups everybody rates only the group's doors."""


def read_profile(path: Path, sha256: str | None = None) -> Array:
    """Return the 621 forces, in newtons over 0 to 62 degrees, of a file with the columns angle_deg and force_N.

    Raises ModelDataError, naming file and line, on a file that is missing or not a text, on another header, angle or
    number of points, on a value that is no finite number, and where the file does not have this `sha256`.
    """
    return np.array(profile_file.read_profile(path, PROFILE, sha256), dtype=np.float64)


def read_lab(
    lab: Path, study: str = "door_ratings", simulated: bool | None = None, *, digest: str | None = None,
    url: str | None = None, rated_only: bool = False,
) -> DoorData:  # fmt: skip
    """Return the mean ratings of a lab's study, or imported data set, with their profiles.

    It reads the sessions that `palpate regenerate` analyses: of one version of the study (`digest`), all real or all
    `simulated`, complete, of people who did not withdraw, without the exclusions of the study's analysis plan. They
    come from the lab's session files, else from its collected database, or from `url`. A profile is the file in the
    column `file` and must be the very file that people felt. `rated_only` leaves out stimuli without ratings, which are
    otherwise refused. Raises ModelDataError on profiles and ratings that no model can learn from, and the errors of
    reading (DataRefused, StudyError, PlanError: all ValueErrors).
    """
    return rated_in_lab(lab, study, simulated, digest=digest, url=url, rated_only=rated_only).data


def rated_in_lab(
    lab: Path, study: str = "door_ratings", simulated: bool | None = None, *, digest: str | None = None,
    url: str | None = None, rated_only: bool = False,
) -> Rated:  # fmt: skip
    """Return the data of `read_lab`, with each person's own ratings beside the means."""
    from palpate.modeling.lab_answers import lab_answers

    material, folder = lab_answers(lab, study, digest=digest, url=url, simulated=simulated)
    return rated_material(material, folder, rated_only=rated_only)


def rated_material(
    material: Material, folder: Path, *, made_from: Sequence[str] | None = None, rated_only: bool = False
) -> Rated:
    """Return the ratings in a study's material with the profiles in `folder`. Raises ModelDataError as `read_lab`."""
    from palpate.modeling.lab_answers import demand_scale, left_out_lines

    ratings = material.ratings
    if ratings is None:
        raise ModelDataError(f"{material.name!r}: holds no ratings; a study that rates doors is expected")
    shown = (
        [_profile_of(stimulus.id, stimulus.columns, folder, stimulus.sha256) for stimulus in material.study.stimuli]
        if material.study
        else _stimuli_of_table(ratings, folder)
    )
    table = ratings.table if "group" in ratings.table.columns else ratings.table.assign(group="")
    if made_from is None:
        left_out = (f"left out: {line}" for line in left_out_lines(material))
        made_from = (*(f"{source.name} {source.sha256}" for source in material.inputs), *left_out)
    digest = hashlib.sha256()
    for profile in shown:
        digest.update(profile.id.encode() + b"\0" + profile.force_N.astype("<f8").tobytes())
    made_from = (*made_from, f"{len(shown)} door profiles {digest.hexdigest()}")
    scale = demand_scale(ratings)
    antonyms = tuple(ratings.antonyms.get(name, f"not {name}") for name in ratings.attributes)
    return rated_of(
        shown, Questions(ratings.attributes, antonyms, (scale.low, scale.high)), table, simulated=material.simulated,
        made_from=made_from, rated_only=rated_only,
    )  # fmt: skip


def _stimuli_of_table(ratings: Ratings, folder: Path) -> list[StimulusProfile]:
    """Return the stimuli of an imported data set: its rows name each one and its file."""
    for column in ("stimulus", FILE):
        if column not in ratings.table.columns:
            raise ModelDataError(
                f"{ratings.name!r}: an imported data set without a column {column!r} carries no door profiles; models"
                f" need one, with a file name in {folder}"
            )
    names = [name for name in ("stimulus", FILE, VARIANT, *DOOR) if name in ratings.table.columns]
    rows = ratings.table[names].astype(str).drop_duplicates()
    twice = rows.loc[rows["stimulus"].duplicated(), "stimulus"]
    if len(twice):
        raise ModelDataError(f"{ratings.name!r}: {twice.iloc[0]!r} has more than one file, door or variant")
    records: list[dict[str, str]] = [dict(zip(names, row, strict=True)) for row in rows.itertuples(index=False)]
    return [_profile_of(row["stimulus"], row, folder, None) for row in records]


def _profile_of(name: str, columns: Mapping[str, str], folder: Path, sha256: str | None) -> StimulusProfile:
    file = columns.get(FILE)
    if not file:
        raise ModelDataError(f"stimulus {name!r}: no door profile (the column {FILE!r} of its table is empty)")
    if not (folder / file).is_file():
        raise ModelDataError(f"stimulus {name!r}: no door profile {folder / file} (the column {FILE!r} of its table)")
    door = next((columns[column] for column in DOOR if columns.get(column)), name)
    return StimulusProfile(name, door, columns.get(VARIANT) or name, read_profile(folder / file, sha256))


def simulated_data(people: int = 40, seed: int = 1, study: Path | None = None) -> DoorData:
    """Return mean ratings by `people` simulated persons P001, P002, ... of door_ratings, or of a study file.

    Each has a session of the real runner and a perceiver of the study's `simulation`; the same people and seed give
    the ratings that `palpate run --simulate` records. Raises ModelDataError where a stimulus is left without ratings.
    """
    return simulated_ratings(people, seed, study).data


def simulated_ratings(people: int = 40, seed: int = 1, study: Path | None = None) -> Rated:
    """Return the data of `simulated_data`, with each person's own ratings beside the means."""
    from palpate.analysis.power.simulated_studies import people as pseudonyms
    from palpate.analysis.power.simulated_studies import simulated_material
    from palpate.studies.catalogue import SHIPPED, STUDY_FILE, read_study

    if people < LEAST_PEOPLE:
        raise ModelDataError(f"{people} simulated people: at least {LEAST_PEOPLE} are needed, one for each group")
    study_files = read_study(study or SHIPPED / "door_ratings" / STUDY_FILE)
    material = simulated_material(study_files.study, study_files.folder, pseudonyms(people), seed)
    text = f"{people} simulated people, seed {seed}: {material.inputs[0].name} {material.inputs[0].sha256}"
    return rated_material(material, study_files.folder, made_from=(text,))
