"""A study regenerated: from its raw ledgers to every answer and figure that its analysis plan asks for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import shorten
from typing import Any

import pandas as pd

from palpate.analysis.crosschecking.checks import CrossCheck, cross_check
from palpate.analysis.first_look.analysis import software
from palpate.analysis.plans.material import Material, imported_material, read_material
from palpate.analysis.plans.reading import PLAN_FILE, Plan, PlanError, read_plan
from palpate.analysis.plans.selecting import Selector, apply_exclusions
from palpate.analysis.ratings.dataset import Exclusion, Input
from palpate.analysis.ratings.design_report import data_notes
from palpate.analysis.ratings.rating_files import load_ratings
from palpate.analysis.ratings.reading import collected_sample
from palpate.analysis.ratings.sources import IMPORTED, DataRequest, both_of, gathered, nothing_of
from palpate.analysis.regenerating.plan_figures import PlannedFigure, figure_data
from palpate.analysis.regenerating.plan_tests import QuestionResult, by_name, run_tests
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.files import file_sha256
from palpate.protocols.progress import Progress
from palpate.studies.catalogue import STUDY_FILE, names
from palpate.studies.collecting.collect import open_database
from palpate.studies.participants.registry import withdrawn
from palpate.studies.sessions.session_files import ledgers_in

MOST_LETTERS = 300
"""Of what qualifies the data, beside a refusal."""


@dataclass(frozen=True)
class RegeneratedStudy:
    """Everything that a plan's outputs are written from.

    `material` is what was left after the plan's exclusions; `exclusions` are their lines, after those of reading.
    `inputs` are the session files, the plan and its own tables. `checks` are the second opinions of other packages,
    None where none were asked for. `notes` qualify every number.
    """

    plan: Plan
    material: Material
    exclusions: tuple[Exclusion, ...]
    inputs: tuple[Input, ...]
    answered: tuple[QuestionResult, ...]
    figures: tuple[PlannedFigure, ...]
    tables: Mapping[str, pd.DataFrame]
    software: Mapping[str, str]
    checks: tuple[CrossCheck, ...] | None = None
    notes: tuple[str, ...] = ()

    @property
    def sample(self) -> dict[str, Any]:
        """What the study planned of its sample and what came of it, before the plan's exclusions."""
        study = self.material.study
        return {} if study is None else collected_sample(study, self.material.sessions)

    @property
    def title(self) -> str:
        """The plan's title, else the study's."""
        return self.plan.declared.title or self.material.title


def regenerate(
    request: DataRequest, plan_file: Path | None = None, progress: Progress = lambda *_: None
) -> RegeneratedStudy:
    """Read the plan, gather the sessions, leave out what the plan leaves out, and answer all its questions.

    Raises PlanError (or YamlError) on a plan that cannot be used, DataRefused on data that cannot be read.
    """
    return regenerate_by(request, *find_plan(request, plan_file), progress)


def regenerate_by(
    request: DataRequest, name: str, plan: Plan, progress: Progress = lambda *_: None, crosscheck: bool = False
) -> RegeneratedStudy:
    """Do as `regenerate`, by a plan that is read already; with `crosscheck` answers are compared with other packages.

    Each refusal has with it what qualifies the data, which may be its reason.
    """
    whole = whole_material(request, name, plan, progress)
    left = apply_exclusions(whole, plan.declared)
    tables = {table: read_table(plan.table_path(table)) for table in plan.declared.tables}
    selector = Selector(left.material, plan, tables)
    exclusions = (*whole.exclusions, *left.lines)
    ratings = left.material.ratings
    sessions = None if ratings is None else ratings.sessions
    notes = data_notes(selector.faults().notes, exclusions, sessions)
    qualified = f" (of the data: {shorten('; '.join(notes), MOST_LETTERS)})" if notes else ""
    answered = tuple(
        result if result.answer is not None else replace(result, refused=f"{result.refused}{qualified}")
        for result in run_tests(selector, progress)
    )
    files = [(table, plan.table_path(table)) for table in plan.declared.tables]
    plan_inputs = (
        Input(plan.path.name, plan.sha256, "the analysis plan"),
        *(Input(path.name, file_sha256(path), f"table {table}") for table, path in files),
    )
    return RegeneratedStudy(
        plan=plan,
        material=left.material,
        exclusions=exclusions,
        inputs=(*whole.inputs, *plan_inputs),
        answered=answered,
        figures=figure_data(selector, by_name(answered)),
        tables=tables,
        software=software(),
        checks=cross_check(answered, progress) if crosscheck else None,
        notes=notes,
    )


def find_plan(request: DataRequest, plan_file: Path | None) -> tuple[str, Plan]:
    """Return the study's name and plan: the file given, else the lab's own for it, else the one in its folder.

    The lab's own lies in LAB/studies/NAME/analysis.yaml, also for a shipped study or an imported data set.
    Raises PlanError where there is none, and where the plan is that of another study.
    """
    folder, name = _folder(request)
    own = request.lab / "studies" / name / PLAN_FILE
    file = plan_file or (own if own.is_file() else folder / PLAN_FILE)
    if not file.is_file():
        raise PlanError(f"{file}: no analysis plan; write one (docs/reference/analysis-plan.md) or name it with --plan")
    plan = read_plan(file)
    if plan.declared.study != name:
        raise PlanError(f"{file}: study: found {plan.declared.study!r}, the plan of {name!r} is expected")
    return name, plan


def _folder(request: DataRequest) -> tuple[Path, str]:
    path = Path(request.name)
    if (path / STUDY_FILE).is_file():
        return path, path.resolve().name
    known = names(request.lab)
    if request.name in known:
        return known[request.name].parent, request.name
    if (request.lab / IMPORTED / request.name).is_dir():
        return request.lab / "studies" / request.name, request.name
    raise PlanError(f"no study and no imported data set is called {request.name!r}; {nearest(request.name, known)}")


def whole_material(
    request: DataRequest, name: str, plan: Plan | None = None, progress: Progress = lambda *_: None
) -> Material:
    """Return a study's answers before its plan's exclusions: from a database, session files or an imported table.

    Without a plan only complete sessions count. Raises DataRefused on data that cannot be read.
    """
    paths = [] if request.url is not None else ledgers_in(request.lab, name)
    imported = request.lab / IMPORTED / name
    if paths and imported.exists():
        raise both_of(name, imported)
    if request.url is None and not paths:
        if not imported.is_dir():
            raise nothing_of(name, request.lab)
        return imported_material(load_ratings(imported), (plan.declared.title if plan else None) or "")
    if request.url is not None:
        engine = open_database(request.url, lab=request.lab)
    else:
        engine = gathered(paths, request.lab, progress)
    try:
        return read_material(
            engine,
            name,
            digest=request.digest,
            include_incomplete=plan is not None and plan.declared.sessions == "also_interrupted",
            simulated=request.simulated,
            withdrawn=withdrawn(request.lab),
        )
    finally:
        engine.dispose()


def read_table(path: Path) -> pd.DataFrame:
    """Return a table of the plan's own: text stays text ("None", "NA" too), a column of numbers is one of numbers."""
    try:
        table = pd.read_csv(path, keep_default_na=False, na_values=[""], dtype=str, encoding="utf-8-sig")
    except (ValueError, OSError) as error:
        raise PlanError(f"{path}: cannot be read as CSV ({error})") from None
    for column in table.columns:
        numbers = pd.to_numeric(table[column], errors="coerce")
        if numbers.notna().equals(table[column].notna()):
            table[column] = numbers
    return table
