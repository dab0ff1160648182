"""Regeneration of a study: from its raw ledgers to every answer and figure of its analysis plan.

Each answer has its inputs' hash, what was missing, and the seconds it took. Missing cells of a question are counted,
and treated as the plan declares, never ignored.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from textwrap import shorten
from typing import Any

import pandas as pd

from palpate.analysis.crosschecking.checks import CrossCheck, cross_check
from palpate.analysis.first_look.analysis import software
from palpate.analysis.plans.answers import (
    COLUMNS,
    Answer,
    Kind,
    Missing,
    MissingSummary,
    QuestionResult,
    Selected,
    StatisticSettings,
    columns_named,
)
from palpate.analysis.plans.idle import effective, idle_notes
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.plans.reading import PLAN_FILE, Plan, PlanError, read_plan
from palpate.analysis.plans.selecting import Selector, apply_exclusions
from palpate.analysis.plans.sources import is_plain, source_of
from palpate.analysis.plans.where import Where, keeps, matching_rows
from palpate.analysis.ratings.dataset import Exclusion, Input
from palpate.analysis.ratings.design import CellFaults, CellsRefused
from palpate.analysis.ratings.design_report import Place, ProblemKind, data_notes
from palpate.analysis.ratings.rating_files import load_ratings
from palpate.analysis.ratings.reading import Material, imported_material, read_material
from palpate.analysis.ratings.session_choice import collected_sample
from palpate.analysis.ratings.sources import IMPORTED, DataRequest, both_of, gathered, nothing_of
from palpate.analysis.regenerating.plan_figures import PlannedFigure, figure_data
from palpate.analysis.statistics.one_thread import one_thread
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.extensions import extensions_in, finder
from palpate.protocols.files import file_sha256
from palpate.protocols.progress import Clock, Progress
from palpate.protocols.study import Study
from palpate.protocols.wording import count
from palpate.studies.catalogue import STUDY_FILE, names
from palpate.studies.collecting.collect import open_database
from palpate.studies.participants.registry import withdrawn
from palpate.studies.sessions.session_files import ledgers_in

MOST_LETTERS = 300
"""The most letters of notes on the data beside a refusal."""
OUTCOME = "attribute"
IDENTITY = ("participant", "session", "trial", "stimulus", "attribute", "value", "text", "form", "kind", "word")
ALL = ""
"""The outcome of a question about all outcomes together."""
ADVICE = "find the ratings, leave such participants out with `missing: listwise`, or choose `missing: mixed_model`"
WHOLE_CELLS = "name columns of the stimulus or of the participant, which keep or leave a cell for everyone"
FORBIDDEN: tuple[ProblemKind, ...] = ("duplicate", "undeclared")
"""Faults that no policy allows: a cell filled more often than planned, or not in the design."""


class NoModel(ValueError):
    """Cells are missing and the plan requests a model that this kind of test does not have."""


@dataclass(frozen=True)
class RegeneratedStudy:
    """The data that a plan's outputs are written from.

    `material` is what remains after the plan's exclusions; `exclusions` are their lines, after those of reading.
    `inputs` are the session files, the plan and its own tables. `checks` are the cross-checks with other packages, None
    if not requested. `notes` qualify every number.
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
        """The planned and the achieved sample of the study, before the plan's exclusions."""
        study = self.material.study
        return {} if study is None else collected_sample(study, self.material.sessions)

    @property
    def title(self) -> str:
        """The plan's title, else the study's."""
        return self.plan.declared.title or self.material.title


def regenerate(
    request: DataRequest, plan_file: Path | None = None, progress: Progress = lambda *_: None
) -> RegeneratedStudy:
    """Read the plan, gather the sessions, apply the plan's exclusions, and answer all its questions.

    Raises PlanError (or YamlError) on an unusable plan, DataRefused on unreadable data.
    """
    return regenerate_by(request, *find_plan(request, plan_file), progress)


def regenerate_by(
    request: DataRequest, name: str, plan: Plan, progress: Progress = lambda *_: None, crosscheck: bool = False
) -> RegeneratedStudy:
    """Regenerate by a plan that was read already; with `crosscheck` answers are compared with other packages.

    Each refusal has the notes on the data, which may contain its reason.
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
        software={**software(), **_extensions_used(plan, whole.study)},
        checks=cross_check(answered, progress) if crosscheck else None,
        notes=notes,
    )


def find_plan(request: DataRequest, plan_file: Path | None) -> tuple[str, Plan]:
    """Return the study's name and plan: the given file, else the lab's own plan for it, else the one in its folder.

    The lab's own is LAB/studies/NAME/analysis.yaml, also for a shipped study or an imported data set. Raises PlanError
    if there is none, and if the plan is that of another study.
    """
    given, known = Path(request.name), names(request.lab)
    if (given / STUDY_FILE).is_file():
        folder, name = given, given.resolve().name
    elif request.name in known:
        folder, name = known[request.name].parent, request.name
    elif (request.lab / IMPORTED / request.name).is_dir():
        folder, name = request.lab / "studies" / request.name, request.name
    else:
        raise PlanError(f"no study and no imported data set is called {request.name!r}; {nearest(request.name, known)}")
    own = request.lab / "studies" / name / PLAN_FILE
    file = plan_file or (own if own.is_file() else folder / PLAN_FILE)
    if not file.is_file():
        raise PlanError(f"{file}: no analysis plan; write one (docs/reference/analysis-plan.md) or name it with --plan")
    plan = read_plan(file)
    if plan.declared.study != name:
        raise PlanError(f"{file}: study: found {plan.declared.study!r}, the plan of {name!r} is expected")
    return name, plan


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
    """Return a plan's own table: text stays text (also "None", "NA"), a column of numbers becomes numbers."""
    try:
        table = pd.read_csv(path, keep_default_na=False, na_values=[""], dtype=str, encoding="utf-8-sig")
    except (ValueError, OSError) as error:
        raise PlanError(f"{path}: cannot be read as CSV ({error})") from None
    for column in table.columns:
        numbers = pd.to_numeric(table[column], errors="coerce")
        if numbers.notna().equals(table[column].notna()):
            table[column] = numbers
    return table


@dataclass(frozen=True)
class Question:
    """One test of the plan for one outcome (ALL: for all of them together), and its rows or why it has none."""

    settings: StatisticSettings
    kind: Kind
    outcome: str
    selected: Selected | ValueError


def _extensions_used(plan: Plan, study: Study | None) -> dict[str, str]:
    """Return the extensions that the plan and the study's task are of, each with its version and digest."""
    named = (*(test.test for test in plan.tests), *(figure.figure for figure in plan.figures))
    names = extensions_in((*named, *(() if study is None else (study.task,))))
    return {f"extension {name}": str(finder().load(name)).removeprefix(f"{name} ") for name in names}


def run_tests(
    selector: Selector, progress: Progress = lambda *_: None, clock: Clock = time.perf_counter
) -> tuple[QuestionResult, ...]:
    """Return every test of the plan for every outcome, in the plan's order, or the reason why it has no answer."""
    tests, results, digests = selector.plan.tests, [], _Digests()
    with one_thread():
        for done, settings in enumerate(tests):
            for question in _questions(selector, settings):  # one by one: the rows of all would not fit into memory
                progress(done, len(tests), " ".join((settings.name, question.outcome)))
                results.append(_answer(selector, question, clock, digests))
    progress(len(tests), len(tests), "")
    return tuple(results)


def _questions(selector: Selector, settings: StatisticSettings) -> Iterator[Question]:
    kind = TESTS[settings.test]
    try:
        selected = selector.of(settings, kind)
    except ValueError as refusal:
        yield Question(settings, kind, ALL, refusal)
        return
    # The outcomes themselves may be a factor of the test, as the items of a questionnaire are.
    compares_outcomes = OUTCOME in columns_named(settings, COLUMNS)
    if kind.each == "all" or is_plain(source_of(settings, kind)) or compares_outcomes:
        yield Question(settings, kind, ALL, selected)
        return
    for selection in selector.by_outcome(selected):
        yield Question(settings, kind, selection.outcome, selection)


@dataclass
class _Digests:
    """Digests of tables, each computed once, since many tests use the same table."""

    known: dict[int, tuple[pd.DataFrame, str]] = field(default_factory=dict)

    def of(self, table: pd.DataFrame, own: bool) -> str:
        if id(table) not in self.known:
            self.known[id(table)] = table, digest(table, own)  # the table too, so that no other one gets its id
        return self.known[id(table)][1]


def _answer(selector: Selector, question: Question, clock: Clock, digests: _Digests) -> QuestionResult:
    """Return the answer to a question, or the reason why there is none."""
    settings, kind, selected = question.settings, question.kind, question.selected
    policy = settings.missing or selector.plan.declared.missing
    if isinstance(selected, ValueError):
        refused = (str(selected), "", MissingSummary(policy), 0.0)
        return QuestionResult(settings, question.outcome, None, *refused, reason=type(selected))
    missing = MissingSummary(policy, unanswered=selected.unanswered)
    source = source_of(settings, kind)
    own = is_plain(source)
    start = clock()
    try:
        if kind.complete is not None and source == "ratings":
            trials, faults = selector.trials(settings.where), selector.faults(settings)
            selected, gaps = handle_missing(selected, faults, settings.where, policy, trials)
            missing = replace(gaps, unanswered=missing.unanswered)
        start = clock()
        answer_of = kind.answer
        if missing.cells and policy == "mixed_model":
            if kind.with_gaps is None:
                raise NoModel(
                    f"{missing.describe_cells()}, and {settings.test!r} has no form that takes gaps; give this test"
                    " `missing: listwise`, or ask a test of kind mixed_model instead"
                )
            answer_of = kind.with_gaps
        answer = answer_of(selected, effective(settings, kind).model_copy(update={"missing": policy}))
        answer = replace(answer, notes=(*answer.notes, *idle_notes(settings, kind)))
    except ValueError as refusal:
        inputs = digests.of(selected.table, own)
        refused = (str(refusal), inputs, missing, clock() - start)
        return QuestionResult(settings, question.outcome, None, *refused, reason=type(refusal))
    seconds, inputs = clock() - start, digests.of(selected.table, own)
    return QuestionResult(settings, question.outcome, answer, "", inputs, missing, seconds, selected.table)


def digest(table: pd.DataFrame, own: bool = False) -> str:
    """Return the SHA-256 of a table's rows as CSV, with sorted columns and rows, so that order does not matter.

    Of a study's answers it covers participant, answer and stimulus; the stimulus' other columns are in the study, whose
    digest is among the inputs. Of a plan's `own` table, and of a form's own, it covers every column.
    """
    columns = sorted(map(str, table.columns))
    if "session" in columns and not own:
        columns = [name for name in columns if name in IDENTITY]
    lines = table[columns].to_csv(index=False, header=False, lineterminator="\n", float_format="%.17g").splitlines()
    return hashlib.sha256("\n".join((",".join(columns), *sorted(lines))).encode()).hexdigest()


def by_name(results: Sequence[QuestionResult]) -> Mapping[str, Mapping[str, Answer]]:
    """Return the answers of each test by outcome, for figures."""
    answers: dict[str, dict[str, Answer]] = {}
    for result in results:
        if result.answer is not None:
            answers.setdefault(result.settings.name, {})[result.outcome] = result.answer
    return answers


def handle_missing(
    selected: Selected, faults: CellFaults, where: Where, policy: Missing, trials: pd.DataFrame
) -> tuple[Selected, MissingSummary]:
    """Return the selection without incomplete participants (listwise) or unchanged (mixed model), and what was missing.

    A cell counts if it is in the test's `where`, also for somebody who has none of them; `trials` are those of the
    whole study, so that nobody is overlooked. Raises CellsRefused under `refuse`, on cells that are filled more often
    than planned or are not in the design, and if nobody is left.
    """
    # The test is about those whom `where` keeps by what is the same in all of their trials.
    chosen = pd.Series(True, index=trials.index)
    for column, condition in where.items():
        if column in trials.columns and trials.groupby("participant")[column].nunique().max() == 1:
            chosen &= matching_rows(trials[column], condition)
    people = set(trials.loc[chosen, "participant"])
    gaps: dict[str, int] = {}
    for outcome in selected.outcomes:
        own = _places(outcome, people, faults, where, "missing")
        bad = {who for kind in FORBIDDEN for who in _places(outcome, people, faults, where, kind)}
        if bad or (own and policy == "refuse"):
            faults.demand_none(outcome, sorted(bad or own), ADVICE)
        for who, places in own.items():
            gaps[who] = gaps.get(who, 0) + len(places)
    for who, lost in cells_cut(selected.table, where, trials, people).items():
        if policy == "refuse":
            raise CellsRefused(f"`where` leaves {who} without {count(lost, 'cell')} that others keep; {WHOLE_CELLS}")
        gaps[who] = max(gaps.get(who, 0), lost)
    cells = sum(gaps.values())
    if not gaps or policy == "mixed_model":
        return selected, MissingSummary(policy, len(gaps), cells)
    complete = selected.table[~selected.table["participant"].isin(list(gaps))]
    if not len(complete):
        raise CellsRefused(f"each of {count(len(gaps), 'participant')} lacks a cell; nobody is left listwise")
    rest = replace(selected, table=complete.reset_index(drop=True))
    return rest, MissingSummary(policy, len(gaps), cells, tuple(sorted(gaps)))


def cells_cut(table: pd.DataFrame, where: Where, trials: pd.DataFrame, people: Iterable[str]) -> dict[str, int]:
    """Return the cells that `where` removes for somebody and keeps for others of the same group, by a range of trials.

    Columns of the stimulus and of the participant do not do this: they keep or remove a cell for everyone.
    """

    def is_of_a_trial(column: str) -> bool:
        """Return whether a column varies within a participant and within a stimulus, such as trial and block."""
        if column not in trials.columns:
            return column != "attribute"
        return all(trials.groupby(by)[column].nunique().max() > 1 for by in ("participant", "stimulus"))

    if "stimulus" not in trials.columns or not any(is_of_a_trial(column) for column in where):
        return {}
    named = trials.assign(group="") if "group" not in trials.columns else trials
    group = named.drop_duplicates("participant").set_index("participant")["group"]
    cells = table.groupby(["participant", "attribute", "stimulus"]).size().unstack([1, 2], fill_value=0)
    cells = cells.reindex(sorted(people), fill_value=0)
    most = cells.groupby(group.reindex(cells.index)).transform("max")
    lacking = (most - cells).sum(axis=1)
    return {str(who): int(number) for who, number in lacking.items() if number}


def _places(
    outcome: str, people: Iterable[str], faults: CellFaults, where: Where, kind: ProblemKind
) -> dict[str, list[Place]]:
    """Return the cells of this outcome with one kind of fault, by participant, that are in the test's `where`."""

    def is_inside(place: Place) -> bool:
        levels = {column: place.cell.get(column) for column in where} | {"participant": place.participant}
        return all(
            levels[column] is None or keeps(condition, str(levels[column])) for column, condition in where.items()
        )

    places = {who: faults.places.get((outcome, who), {}).get(kind, ()) for who in people}
    inside = {who: [place for place in own if is_inside(place)] for who, own in places.items()}
    return {who: own for who, own in inside.items() if own}
