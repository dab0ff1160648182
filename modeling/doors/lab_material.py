"""The answers of a lab's study, exactly those that its analysis plan would be asked about."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from palpate.analysis.plans.exclusions import apply_exclusions
from palpate.analysis.plans.material import Material
from palpate.analysis.plans.reading import PLAN_FILE, Plan, PlanError, read_plan
from palpate.analysis.ratings.sources import IMPORTED, Wanted
from palpate.analysis.regenerating.regenerated import whole_material
from palpate.modeling.doors.data import ModelDataError
from palpate.studies.catalogue import find, names
from palpate.studies.collect import ledgers_in

COLLECTED = "lab.sqlite"
"""Where `palpate collect` gathers a lab's sessions."""


def lab_material(
    lab: Path, study: str, *, digest: str | None, url: str | None, simulated: bool | None
) -> tuple[Material, Path]:
    """The material that `palpate regenerate` would analyse, and the folder that the profiles' file names start from.

    That folder is the study's; for an imported data set it is LAB/studies/NAME, where its analysis plan lies too.
    Raises ModelDataError on a lab that is no folder, and what reading the sessions and the plan raises.
    """
    if not lab.is_dir():
        raise ModelDataError(f"{lab}: no such lab; the folder of a lab is expected")
    folder, name = _folder(lab, study)
    wanted = Wanted(name, lab, url or _collected(lab, name), digest, simulated=simulated)
    plan = _plan(wanted, folder)
    material = whole_material(wanted, name, plan)
    if plan is None:
        return material, folder
    left = apply_exclusions(material, plan.declared)
    return replace(left.material, exclusions=(*material.exclusions, *left.lines)), folder


def _folder(lab: Path, study: str) -> tuple[Path, str]:
    if study not in names(lab) and (lab / IMPORTED / study).is_dir():
        return lab / "studies" / study, study
    folder = find(study, lab).resolve().parent
    return folder, folder.name


def _collected(lab: Path, name: str) -> str | None:
    """The collected database, where the session files themselves are not here."""
    here = ledgers_in(lab, name) or (lab / IMPORTED / name).is_dir() or not (lab / COLLECTED).is_file()
    return None if here else f"sqlite:///{lab / COLLECTED}"


def _plan(wanted: Wanted, folder: Path) -> Plan | None:
    """The lab's own plan for the study, else the study's, or None: a study without a plan excludes nothing."""
    for file in (wanted.lab / "studies" / wanted.name / PLAN_FILE, folder / PLAN_FILE):
        if file.is_file():
            plan = read_plan(file)
            if plan.declared.study != wanted.name:
                raise PlanError(
                    f"{file}: study: found {plan.declared.study!r}, the plan of {wanted.name!r} is expected"
                )
            return plan
    return None
