"""The reader of analysis.yaml: returns a plan of known tests and figures, or refuses with file and line."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import BaseModel, Field, ValidationError, model_validator

from palpate.analysis.figures.figure_kind import FigureSettings
from palpate.analysis.plans.answers import Missing, Normalise, StatisticSettings
from palpate.analysis.plans.kinds import FIGURES, TESTS
from palpate.analysis.plans.where import Condition
from palpate.protocols.complaints import Problem, listed, translated
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.registry import Registry
from palpate.protocols.strict import Strict
from palpate.protocols.study import Name, Share, Text, Whole
from palpate.protocols.yaml_text import Document, load

Above = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class Outlying(Strict):
    """A rule for ratings more than `sd` standard deviations from the mean of their cell; `within` defines the cells."""

    sd: Above
    within: tuple[Text, ...] = ("attribute", "stimulus")


class Rule(Strict):
    """One rule for leaving something out, by exactly one of its keys beside `because`.

    `participants` by pseudonym; `faster_than_s`, `slower_than_s`: trials answered in less or more seconds; `where`:
    trials whose columns have these levels, or numbers in a range; `outlying`: single ratings; `flagged`: participants
    on whom this many of the rater diagnostics raise a flag; `fewer_than`: participants who answered less than this
    share of their trials.
    """

    because: Text
    participants: tuple[Text, ...] | None = None
    faster_than_s: Above | None = None
    slower_than_s: Above | None = None
    where: dict[Text, Condition] | None = None
    outlying: Outlying | None = None
    flagged: Annotated[Whole, Field(ge=1)] | None = None
    fewer_than: Share | None = None

    @model_validator(mode="after")
    def _one_reason(self) -> Self:
        if len(self.model_dump(exclude={"because"}, exclude_none=True)) != 1:
            raise ValueError(
                "exactly one of participants, faster_than_s, slower_than_s, where, outlying, flagged, fewer_than is"
                " expected beside because"
            )
        return self


class AnalysisPlan(Strict):
    """A study's analysis plan. `tests` and `figures` are read by the schema of their kind.

    `sessions` says whether interrupted sessions count. `seed` and `draws` are for all resampling. `least_people`: a
    group by answers about oneself (gender, say) of fewer participants is refused. `tables` are CSV files beside the
    plan, by the name that tests and figures use.
    """

    study: Name
    title: Text | None = None
    alpha: Annotated[float, Field(gt=0, lt=0.5)] = 0.05
    seed: Whole = 0
    draws: Annotated[Whole, Field(ge=100, le=1_000_000)] = 2000
    sessions: Literal["complete", "also_interrupted"] = "complete"
    missing: Missing = "refuse"
    normalise: Normalise = "none"
    least_people: Annotated[Whole, Field(ge=1)] = 3
    exclusions: tuple[Rule, ...] = ()
    tables: Mapping[Name, Text] = {}
    tests: tuple[dict[Text, Any], ...] = ()
    figures: tuple[dict[Text, Any], ...] = ()


PLAN_FILE = "analysis.yaml"
SettingsT = TypeVar("SettingsT", bound=BaseModel)


class PlanError(ValueError):
    """The analysis plan is unusable; the message lists the problems, one per line."""


@dataclass(frozen=True)
class Plan:
    """A plan that was read: its file, the file's SHA-256, and each test and figure with its kind's settings."""

    path: Path
    sha256: str
    declared: AnalysisPlan
    tests: tuple[StatisticSettings, ...]
    figures: tuple[FigureSettings, ...]
    document: Document

    def complaint(self, problems: Sequence[Problem]) -> PlanError:
        """Return the problems as one error that names the file and the lines."""
        return PlanError(listed(problems, self.document, str(self.path)))

    def table_path(self, name: str) -> Path:
        """Return the path of the plan's own table with that name."""
        return self.path.parent / self.declared.tables[name]


def read_plan(path: Path) -> Plan:
    """Return the plan in the file. Raises PlanError (or YamlError) with all problems, at most eight shown."""
    try:
        text = path.read_bytes()
    except OSError as error:
        raise PlanError(f"{path}: cannot be read ({error.strerror})") from None
    document = load(text, str(path))
    if not isinstance(document.data, dict):
        raise PlanError(f"{path}: keys and values are expected at the top, e.g. study: NAME")
    try:
        declared = AnalysisPlan.model_validate(document.data)
    except ValidationError as error:
        raise PlanError(listed(list(translated(error, AnalysisPlan)), document, str(path))) from None
    problems: list[Problem] = []
    tests = list(_settings_of(declared.tests, "tests", "test", TESTS, problems))
    figures = list(_settings_of(declared.figures, "figures", "figure", FIGURES, problems))
    problems += [*_names(tests, "tests"), *_names(figures, "figures"), *_links(declared, tests, figures)]
    for name, file in declared.tables.items():
        target = path.parent / file
        if not target.resolve().is_relative_to(path.parent.resolve()):
            message = f"{file!r} leads out of the plan's folder; put the file into that folder"
            problems.append(Problem(("tables", name), message))
        elif not target.is_file():
            files = sorted(file.name for file in path.parent.glob("*.csv"))
            problems.append(Problem(("tables", name), f"no file {file!r} beside the plan; {nearest(file, files)}"))
    if problems:
        raise PlanError(listed(problems, document, str(path)))
    return Plan(path, hashlib.sha256(text).hexdigest(), declared, tuple(tests), tuple(figures), document)


def _settings_of(
    entries: Sequence[Mapping[str, Any]], section: str, key: str, kinds: Registry[Any], problems: list[Problem]
) -> Iterator[Any]:
    """Yield the settings of each entry by the schema of its kind, and add errors to `problems`."""
    for place, entry in enumerate(entries):
        name = entry.get(key)
        if key not in entry:
            problems.append(Problem((section, place), f"no key {key!r}"))
            continue
        if (missing := kinds.why_not(name, f"kind of {key}")) is not None:
            problems.append(Problem((section, place, key), missing))
            continue
        model = kinds[str(name)].settings
        try:
            yield model.model_validate(entry)
        except ValidationError as error:
            problems += [Problem((section, place, *p.path), p.message) for p in translated(error, model)]


def _names(settings: Sequence[StatisticSettings | FigureSettings], section: str) -> Iterator[Problem]:
    seen: set[str] = set()
    for place, test in enumerate(settings):
        if not test.name.replace("_", "").replace("-", "").isalnum() or not test.name.isascii():
            yield Problem((section, place, "name"), f"{test.name!r}: letters, digits, _ and - are expected")
        if test.name.casefold() in seen:
            yield Problem((section, place, "name"), f"the name {test.name!r} appears twice")
        seen.add(test.name.casefold())


def _links(
    declared: AnalysisPlan, tests: Sequence[StatisticSettings], figures: Sequence[FigureSettings]
) -> Iterator[Problem]:
    """Yield problems of names that refer to other parts of the plan: tests of a figure, tables."""
    names = [test.name for test in tests]
    for place, figure in enumerate(figures):
        for n, test_name in enumerate(figure.tests):
            if test_name not in names:
                yield Problem(("figures", place, "tests", n), f"no test {test_name!r}; {nearest(test_name, names)}")
    both: tuple[tuple[str, Sequence[StatisticSettings | FigureSettings]], ...] = (
        ("tests", tests),
        ("figures", figures),
    )
    for section, settings in both:
        for place, test in enumerate(settings):
            if test.table is not None and test.table not in declared.tables:
                near = nearest(test.table, declared.tables)
                yield Problem((section, place, "table"), f"the plan has no table {test.table!r}; {near}")
