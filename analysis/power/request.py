"""The request for a simulation of a plan's test, and its mistakes."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

from palpate.analysis.plans.answers import StatisticSettings
from palpate.analysis.plans.families.choices import PsychometricFunction
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.plans.reading import Plan, read_plan
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.extensions import is_own
from palpate.protocols.study import Study
from palpate.studies.catalogue import read_study

MOST_RUNS = 100_000
"""The number of studies with seeds of their own, before those of the next --seed begin."""
FEWEST_DRAWS = 19
"""The draws of a deviance's p value where nobody asks for it: they take most of the time of a fit."""


class PowerError(ValueError):
    """The power of this test cannot be simulated as requested."""


@dataclass(frozen=True)
class PowerRequest:
    """A request for a power curve: a study file, a plan, one of its tests, and the row of the answer with the effect.

    `row` and `column` are as for `p_of`. Different seeds give different people. `effect` multiplies what the study's
    simulated people feel.
    """

    study_file: Path
    plan_file: Path
    lab: Path
    test: str
    outcome: str = ""
    row: str = ""
    column: str = ""
    effect: float = 1.0
    alpha: float = 0.05
    seed: int = 0


def check_request(request: PowerRequest) -> StatisticSettings:
    """Return the requested test of the plan.

    Raises PowerError if the test or its outcome does not exist, or the study simulates nobody.
    """
    plan, study = read_plan(request.plan_file), read_study(request.study_file).study
    names = [test.name for test in plan.tests]
    if request.test not in names:
        raise PowerError(f"{plan.path}: no test {request.test!r}; {nearest(request.test, names)}")
    observer = None if study.simulation is None or not study.procedure else study.simulation.observer
    felt = study.simulation is not None and (bool(study.simulation.latents) or observer is not None)
    if not felt and not is_own(study.task):
        raise PowerError(f"{request.study_file}: the study does not say how simulated people perceive (simulation:)")
    if not felt and request.effect != 1:
        raise PowerError(
            f"{request.study_file}: the task {study.task} simulates its answers by itself, and the study has no "
            "differences that --effect could change (simulation: {latents: ...}); leave --effect out"
        )
    test = plan.tests[names.index(request.test)]
    if test.table is not None:
        raise PowerError(f"{request.test}: asks about the plan's table {test.table!r}, which nobody simulates")
    if observer is not None and request.effect != 1 and not isinstance(observer.threshold, dict):
        raise PowerError(
            f"{request.study_file}: simulated people have one threshold for all tracks, so there is no difference that "
            "--effect could change; give one for each track, simulation: {observer: {threshold: {TRACK: LEVEL}}}"
        )
    if request.outcome and (source := test.source or TESTS[test.test].takes) != "ratings":
        raise PowerError(
            f"{request.test}: --outcome {request.outcome}: it is about {source}, not ratings; leave it out"
        )
    known = [attribute.name for attribute in study.attributes]
    if request.outcome and known and request.outcome not in known:
        raise PowerError(f"{request.test}: no outcome {request.outcome!r}; {nearest(request.outcome, known)}")
    return test


def only(plan: Plan, request: PowerRequest, study: Study) -> Plan:
    """Return the plan with the requested test only, for one outcome if outcomes are answered separately."""
    test = next(item for item in plan.tests if item.name == request.test)
    kind = TESTS[test.test]
    first = next((item.name for item in study.attributes), "") if kind.each == "outcome" else ""
    if (outcome := request.outcome or first) and (test.source or kind.takes) == "ratings":
        test = test.model_copy(update={"outcomes": (outcome,)})
    if isinstance(test, PsychometricFunction) and test.interval != "bootstrap" and request.column != "p_deviance":
        test = test.model_copy(update={"draws": FEWEST_DRAWS})
    return replace(plan, tests=(test,), figures=())


def file_name(*parts: str) -> str:
    """Return the parts of a request as one part of a file name."""
    return re.sub(r"[^\w.]+", "-", "_".join(filter(None, parts)))
