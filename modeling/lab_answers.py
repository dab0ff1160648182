"""The answers of a lab's study that its analysis plan includes, and their ratings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pandas as pd
from sqlalchemy import text

from palpate.analysis.plans.reading import PLAN_FILE, Plan, PlanError, read_plan
from palpate.analysis.plans.selecting import apply_exclusions
from palpate.analysis.ratings.dataset import DataRefused, Ratings, Scale
from palpate.analysis.ratings.reading import Material
from palpate.analysis.ratings.sources import IMPORTED, DataRequest
from palpate.analysis.regenerating.regeneration import whole_material
from palpate.studies.catalogue import find, names
from palpate.studies.collecting.collect import open_database
from palpate.studies.sessions.record import read_header
from palpate.studies.sessions.session_files import ledgers_in
from palpate.studies.sessions.tables import session_name_of

COLLECTED = "lab.sqlite"
"""The database that `palpate collect` gathers a lab's sessions in."""


def lab_answers(
    lab: Path, study: str, *, digest: str | None = None, url: str | None = None, simulated: bool | None = None
) -> tuple[Material, Path]:
    """Return the material that `palpate regenerate` would analyse, and the folder of its stimuli's files.

    That folder is the study's; for an imported data set it is LAB/studies/NAME, which also has its analysis plan.
    Raises DataRefused on a lab that is no folder, and what reading the sessions and the plan raises.
    """
    if not lab.is_dir():
        raise DataRefused(f"{lab}: no such lab; the folder of a lab is expected")
    if study not in names(lab) and (lab / IMPORTED / study).is_dir():
        folder, name = lab / "studies" / study, study
    else:
        folder = find(study, lab).resolve().parent
        name = folder.name
    here = ledgers_in(lab, name) or (lab / IMPORTED / name).is_dir() or not (lab / COLLECTED).is_file()
    source = DataRequest(
        name, lab, url or (None if here else f"sqlite:///{lab / COLLECTED}"), digest, simulated=simulated
    )
    plan = _plan(source, folder)
    material = whole_material(source, name, plan)
    if plan is None:
        return material, folder
    left = apply_exclusions(material, plan.declared)
    return replace(left.material, exclusions=(*material.exclusions, *left.lines)), folder


def _plan(request: DataRequest, folder: Path) -> Plan | None:
    """Return the lab's own plan for the study, else the study's, or None, which excludes nothing."""
    for file in (request.lab / "studies" / request.name / PLAN_FILE, folder / PLAN_FILE):
        if file.is_file():
            plan = read_plan(file)
            if plan.declared.study != request.name:
                raise PlanError(
                    f"{file}: study: found {plan.declared.study!r}, the plan of {request.name!r} is expected"
                )
            return plan
    return None


def has_answers(lab: Path, study: str) -> bool:
    """Return whether a lab has session files of a study, an imported table, or the study in its collected database."""
    if ledgers_in(lab, study) or (lab / IMPORTED / study).is_dir():
        return True
    if not (lab / COLLECTED).is_file():
        return False
    engine = open_database(f"sqlite:///{lab / COLLECTED}", lab=lab)
    try:
        with engine.connect() as connection:
            query = text("SELECT count(*) FROM sessions WHERE study = :study")
            return bool(connection.execute(query, {"study": study}).scalar_one())
    finally:
        engine.dispose()


def answer_files(lab: Path, study: str, simulated: bool | None) -> list[Path]:
    """Return the files that ratings are read from: the sessions with a rating that counts, or the imported files.

    A session that was interrupted, left out or withdrawn is not among them. Raises as `lab_answers` does.
    """
    sessions = ledgers_in(lab, study)
    if not sessions:
        imported = sorted(path for path in (lab / IMPORTED / study).glob("*") if path.is_file())
        return imported or [path for path in (lab / COLLECTED,) if path.is_file()]
    answers, _ = lab_answers(lab, study, simulated=simulated)
    table = answers.ratings.table if answers.ratings is not None else None
    counting = set() if table is None else set(table[table["value"].notna()]["session"])
    headers = {path: read_header(path) for path in sessions}
    return [path for path, header in headers.items() if session_name_of(header) in counting]


def left_out_lines(answers: Material) -> tuple[str, ...]:
    """Return a line for each person and item that was left out, except practice trials."""
    lines = [line for line in answers.exclusions if line.what not in ("practice", "nothing")]
    return tuple(f"{line.who}: {line.why}" for line in lines)


def demand_scale(ratings: Ratings) -> Scale:
    """Return the ends of the rating scale. Raises DataRefused where they are not known."""
    if ratings.scale is None:
        raise DataRefused(f"{ratings.name!r}: its scale is not known; the ends of a rating scale are expected")
    return ratings.scale


def demand_on_scale(ratings: pd.DataFrame, low: float, high: float) -> None:
    """Raise DataRefused on a rating off its scale; `ratings` has participant, stimulus, attribute and value."""
    off = ratings[~ratings["value"].between(low, high)]
    if len(off):
        row = off.iloc[0]
        raise DataRefused(
            f"{row['participant']} rated {row['stimulus']} {row['value']:g} on {row['attribute']}: a number on the"
            f" scale from {low:g} to {high:g} is expected"
        )
