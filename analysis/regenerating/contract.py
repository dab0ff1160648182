"""The contracts of tests and figures of plans: tried on a simulated sample of a study whose plan names them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from pydantic import ValidationError

from palpate.analysis.figures.figure_kind import FigureInput, FigureKind, FigureSettings
from palpate.analysis.figures.style import drawing, svg_text
from palpate.analysis.plans.answers import Answer, Kind, StatisticSettings
from palpate.analysis.plans.reading import PLAN_FILE, Plan, read_plan
from palpate.analysis.plans.selecting import Selector, apply_exclusions
from palpate.analysis.ratings.sources import DataRequest
from palpate.analysis.regenerating.plan_figures import figure_data
from palpate.analysis.regenerating.regeneration import by_name, read_table, run_tests, whole_material
from palpate.protocols.canonical import canonical
from palpate.protocols.contract import Demand, Verdict, demand, verdicts
from palpate.studies.catalogue import StudyFiles

PEOPLE = 8
"""The number of simulated participants."""


WriteSample = Callable[[StudyFiles, int, Path], None]


@dataclass(frozen=True)
class Planned:
    """A kind of test or figure under trial; `key` is its key in a plan, `studies` have plans that name it.

    `write_sample` writes the sessions of so many simulated participants of a study into a folder.
    """

    name: str
    kind: Any
    key: str
    studies: Sequence[StudyFiles]
    write_sample: WriteSample

    @cached_property
    def plan(self) -> Plan:
        """Return the plan of the first study. Raises NotKept if there is none."""
        names = f"`{self.key}: {self.name}` in the {PLAN_FILE} of a study"
        demand(self.studies, f"no plan names it: write {names} in LAB/studies, or in the extension")
        return read_plan(self.studies[0].folder / PLAN_FILE)

    @cached_property
    def selector(self) -> Selector:
        """Return the selector of the rows of a simulated sample."""
        plan, files = self.plan, self.studies[0]
        with TemporaryDirectory() as folder:
            self.write_sample(files, PEOPLE, Path(folder))
            request = DataRequest(str(files.folder), Path(folder))
            material = apply_exclusions(whole_material(request, files.study.study, plan), plan.declared).material
        return Selector(material, plan, {name: read_table(plan.table_path(name)) for name in plan.declared.tables})

    def asked(self) -> Iterator[Any]:
        """Yield the settings of each test or figure of the plan that is of this kind."""
        of_kind = self.plan.tests if self.key == "test" else self.plan.figures
        yield from (settings for settings in of_kind if getattr(settings, self.key) == self.name)


def _is_planned(planned: Planned) -> str | None:
    return f"{len(list(planned.asked()))} in the plan of {planned.plan.declared.study}"


def _has_schema(planned: Planned) -> str | None:
    base = StatisticSettings if planned.key == "test" else FigureSettings
    schema = planned.kind.settings
    demand(isinstance(schema, type) and issubclass(schema, base), f"settings are {schema!r:.80}, no {base.__name__}")
    [settings, *_] = planned.asked()
    given = settings.model_dump(exclude_unset=True)
    for wrong in ({planned.key: "another"}, {"no_such_key": 1}):
        try:
            schema.model_validate({**given, **wrong})
        except ValidationError:
            continue
        demand(False, f"the settings {wrong} are taken; `{planned.key}: Literal[{planned.name!r}]` refuses others")
    return None


def _answers(planned: Planned) -> str | None:
    results = [result for result in run_tests(planned.selector) if result.settings.test == planned.name]
    again = [result.answer for result in run_tests(planned.selector) if result.settings.test == planned.name]
    for result, other in zip(results, again, strict=True):
        where = f"{result.settings.name} {result.outcome}".strip()
        demand(result.answer is not None, f"{where}: {result.refused}")
        _demand_plain(where, result.answer)
        demand(result.answer == other, f"{where}: the same rows get another answer")
    return f"{len(results)} answers about {PEOPLE} simulated people"


def _demand_plain(where: str, answer: Answer | None) -> None:
    rows = () if answer is None else answer.rows
    demand(rows, f"{where}: an answer without rows")
    canonical([dict(row) for row in rows])


def _shows(planned: Planned) -> str | None:
    answers = by_name(run_tests(planned.selector))
    planned_figures = [f for f in figure_data(planned.selector, answers) if f.settings.figure == planned.name]
    for figure in planned_figures:
        demand(figure.data is not None, f"{figure.settings.name}: {figure.refused}")
        demand(figure.data is not None and figure.data.rows, f"{figure.settings.name}: a figure without a table")
        if figure.data is not None:
            canonical([dict(row) for row in figure.data.rows])
            with drawing(figure.settings.name):
                drawn = planned.kind.draw(figure.data)
                svg = svg_text(drawn.figure)
            demand("<svg" in svg, f"{figure.settings.name}: nothing is drawn")
    return f"{len(planned_figures)} drawn, of {PEOPLE} simulated people"


def _refuses(planned: Planned) -> str | None:
    said = []
    for settings in planned.asked():
        selected = planned.selector.of(settings, planned.kind)
        empty = replace(selected, table=selected.table.iloc[:0], trials=selected.trials.iloc[:0])
        if isinstance(planned.kind, Kind) and planned.kind.each == "outcome":
            empty = replace(empty, outcomes=selected.outcomes[:1])
        try:
            if planned.key == "test":
                planned.kind.answer(empty, settings)
            else:
                planned.kind.data(FigureInput(empty), settings)
        except ValueError as refusal:
            named = type(refusal) is not ValueError and str(refusal)
            demand(named, f"{settings.name}: {type(refusal).__name__}: {refusal}; an error with a name is expected")
            said.append(f"{type(refusal).__name__}: {refusal}")
            continue
        demand(False, f"{settings.name}: it answers without any data")
    return said[0] if said else None


_SHARED: tuple[Demand[Planned], ...] = (
    Demand("a plan names it", _is_planned, needed=True),
    Demand("its settings are a schema that refuses what it does not know", _has_schema),
)
TEST = (
    *_SHARED,
    Demand("it answers, twice the same", _answers),
    Demand("without data it refuses by a named ValueError", _refuses),
)
FIGURE = (
    *_SHARED,
    Demand("it has a table, and is drawn from it", _shows),
    Demand("without data it refuses by a named ValueError", _refuses),
)


def check_test(name: str, kind: Kind, studies: Sequence[StudyFiles], write_sample: WriteSample) -> list[Verdict]:
    """Return the verdicts of the contract on a kind of test; each of the `studies` has a plan that names it."""
    return list(verdicts(name, TEST, Planned(name, kind, "test", studies, write_sample)))


def check_figure(
    name: str, kind: FigureKind, studies: Sequence[StudyFiles], write_sample: WriteSample
) -> list[Verdict]:
    """Return the verdicts of the contract on a kind of figure; each of the `studies` has a plan that names it."""
    return list(verdicts(name, FIGURE, Planned(name, kind, "figure", studies, write_sample)))
