"""Whether a plan speaks of what the study has: its outcomes, factors and columns, checked before there are data."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path

from palpate.analysis.figures.figure_kind import FigureKind, FigureSettings
from palpate.analysis.plans.answers import COLUMNS, Kind, StatisticSettings, Takes, columns_named
from palpate.analysis.plans.idle import idle_settings
from palpate.analysis.plans.kinds import FIGURES, TESTS
from palpate.analysis.plans.reading import Plan, Rule
from palpate.analysis.plans.study_columns import StudyColumns, study_columns
from palpate.analysis.plans.where import Condition, Range, first_word, levels_of
from palpate.analysis.ratings.rating_files import load_ratings
from palpate.analysis.ratings.reading import column_name
from palpate.analysis.ratings.sources import IMPORTED, DataRequest
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.problems import Problem
from palpate.protocols.study import Study
from palpate.studies.catalogue import STUDY_FILE, find, names, read_study
from palpate.studies.participants.lab_forms import lab_forms

WORDS_ONLY = ("word", "kind", "category")
OF_FORMS = ("participant", "session", "group", "attribute")
ALWAYS = ("participant", "session", "group", "stimulus", "attribute", "category", "trial", "block", "word", "kind")


def check_against_study(request: DataRequest, plan: Plan) -> None:
    """Raise PlanError with every outcome, column and level that the study does not have, by line and nearest name.

    An earlier version of the study (`digest`) is known by its data only: there a test says itself what it lacks.
    """
    if request.digest is not None:
        return
    study = _study(request)
    design: StudyColumns | None = None
    if study is None:
        columns, outcomes = _imported(request.lab / IMPORTED / request.name)
    else:
        form = lab_forms(study, request.lab, live=False) if "demographics" in study.opening else None
        design = study_columns(study, form.questions if form is not None else ())
        columns, outcomes = _known(design)
    both: tuple[tuple[str, Sequence[StatisticSettings | FigureSettings]], ...] = (
        ("tests", plan.tests),
        ("figures", plan.figures),
    )
    problems = [
        Problem((section, place, *problem.path), problem.message)
        for section, settings in both
        for place, test in enumerate(settings)
        if test.table is None
        for problem in _problems(test, _takes(test), columns, outcomes, design)
    ]
    problems += _rule_problems(plan.declared.exclusions, columns)
    if problems:
        raise plan.complaint(problems)


def refuse_idle_settings(plan: Plan) -> None:
    """Raise PlanError with every setting that changes nothing: a mistake in a plan that nobody has used yet.

    `regenerate` reads such a plan all the same, with a note beside the answer.
    """
    both: tuple[tuple[str, Sequence[StatisticSettings | FigureSettings]], ...] = (
        ("tests", plan.tests),
        ("figures", plan.figures),
    )
    problems = [
        Problem((section, place, idle.name), f"{idle.name} has no effect {idle.where}; leave it out")
        for section, settings in both
        for place, test in enumerate(settings)
        for idle in idle_settings(test, _kind_of(test))
    ]
    if problems:
        raise plan.complaint(problems)


def problems_of_test(settings: StatisticSettings, design: StudyColumns) -> list[Problem]:
    """Return what is wrong with one test of a study's own answers, before there are data."""
    return list(_problems(settings, _takes(settings), *_known(design), design))


def _study(request: DataRequest) -> Study | None:
    if (Path(request.name) / STUDY_FILE).is_file() or request.name in names(request.lab):
        return read_study(find(request.name, request.lab)).study
    return None


def _known(design: StudyColumns) -> tuple[dict[str, Collection[str]], dict[Takes, Collection[str]]]:
    """Return the study's columns with their levels (empty: any), and its outcomes by the table they stand in.

    What participants are asked about themselves are columns, too, as `answer.NAME` where a column of the stimuli has
    the name.
    """
    study = design.study
    columns: dict[str, Collection[str]] = dict.fromkeys(ALWAYS, ())
    columns |= {name: levels for name, (_, levels) in design.people.items()}
    if study.participants is not None and study.participants.sessions is not None:
        columns["session"] = [str(number) for number in range(1, study.sessions + 1)]
    columns["stimulus"] = [stimulus.id for stimulus in study.stimuli]
    columns["group"] = list(study.groups)
    for name in study.stimuli[0].columns if study.stimuli else ():
        columns[column_name(name)] = {stimulus.columns.get(name, "") for stimulus in study.stimuli}
    items = study.questionnaire.items if study.questionnaire is not None else ()
    return columns, {
        "ratings": [attribute.name for attribute in study.attributes],
        "forms": [item.name for item in items],
    }


def _imported(folder: Path) -> tuple[dict[str, Collection[str]], dict[Takes, Collection[str]]]:
    ratings = load_ratings(folder)
    columns: dict[str, Collection[str]] = dict.fromkeys((*map(str, ratings.table.columns), *ALWAYS), ())
    return columns, {"ratings": ratings.attributes}


def _rule_problems(rules: Sequence[Rule], columns: Mapping[str, Collection[str]]) -> Iterator[Problem]:
    for place, rule in enumerate(rules):
        for column, condition in (rule.where or {}).items():
            for problem in _level_problems(column, condition, columns):
                yield Problem(("exclusions", place, *problem.path), problem.message)
        for n, column in enumerate(rule.outlying.within if rule.outlying is not None else ()):
            if column not in columns:
                at = ("exclusions", place, "outlying", "within", n)
                yield Problem(at, f"the study has no column {column!r}; {nearest(column, columns)}")


def _takes(settings: StatisticSettings | FigureSettings) -> Takes:
    return settings.source or _kind_of(settings).takes


def _kind_of(settings: StatisticSettings | FigureSettings) -> Kind | FigureKind:
    return TESTS[settings.test] if isinstance(settings, StatisticSettings) else FIGURES[settings.figure]


def _problems(
    settings: StatisticSettings | FigureSettings,
    takes: Takes,
    columns: Mapping[str, Collection[str]],
    outcomes: Mapping[Takes, Collection[str]],
    design: StudyColumns | None,
) -> Iterator[Problem]:
    if takes not in outcomes or not outcomes[takes]:
        if takes in ("ratings", "forms"):
            yield Problem(("name",), f"{settings.name!r} asks about {takes}, of which the study has none")
    else:
        for n, name in enumerate(settings.outcomes or ()):
            if name not in outcomes[takes]:
                yield Problem(("outcomes", n), f"no outcome {name!r}; {nearest(name, outcomes[takes])}")
    for column, condition in settings.where.items():
        yield from _level_problems(column, condition, columns)
    if design is not None and isinstance(settings, StatisticSettings) and takes in ("ratings", "forms"):
        of_forms = {*OF_FORMS, *design.people}
        columns = {
            name: levels
            for name, levels in columns.items()
            if (name in of_forms if takes == "forms" else name not in WORDS_ONLY)
        }
    unknown = False
    for key in (*COLUMNS, "random", "interactions"):
        for column in columns_named(settings, (key,)):
            if column not in columns:
                unknown = True
                yield Problem((key,), f"the study has no column {column!r}; {nearest(column, columns)}")
    if design is not None and isinstance(settings, StatisticSettings) and takes in ("ratings", "forms") and not unknown:
        yield from design.problems(settings, outcomes[takes] if settings.outcomes is None else settings.outcomes)


def _level_problems(column: str, condition: Condition, columns: Mapping[str, Collection[str]]) -> Iterator[Problem]:
    if column not in columns:
        yield Problem(("where", column), f"the study has no column {column!r}; {nearest(column, columns)}")
        return
    if isinstance(condition, Range):
        word = "P001" if column == "participant" else first_word(columns[column])
        if word is not None:
            message = f"{column!r} holds words, as {word!r}; a range ({condition}) asks about numbers"
            yield Problem(("where", column), message)
        elif columns[column] and not any(map(condition.holds, columns[column])):
            yield Problem(("where", column), f"no {column} {condition}; there are {', '.join(sorted(columns[column]))}")
    for level in levels_of(condition):
        if columns[column] and level not in columns[column]:
            yield Problem(("where", column), f"no {column} {level!r}; {nearest(level, sorted(columns[column]))}")
