"""The thresholds of simulated people in tracks of several lengths, beside the values that they estimate.

Each person runs tracks with the largest number of trials; a smaller number has the choices that came first, which are
those of a track that ends there. So the people and their answers are the same for every number of trials.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from palpate.analysis.choices.evidence import RATIO
from palpate.analysis.choices.shapes import JndKind, jnd_ends
from palpate.analysis.plans.families.collected_answers import BY, function_row
from palpate.analysis.plans.families.function_summaries import PARTICIPANT
from palpate.analysis.plans.families.rows import parts_of
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.plans.reading import read_plan
from palpate.analysis.plans.selecting import Selector
from palpate.analysis.power.request import MOST_RUNS, PowerError, PowerRequest, only
from palpate.analysis.power.simulated_studies import person, simulated_material
from palpate.analysis.ratings.collected_choices import TABLE as CHOICES
from palpate.analysis.ratings.collected_choices import catch_exclusions, study_tracks, track_design
from palpate.analysis.ratings.dataset import NoRows
from palpate.protocols.keyed import normal
from palpate.protocols.tracks import ABSENT, EASY, NO_CATCH, Slot
from palpate.studies.catalogue import read_study
from palpate.studies.participants.row_assignment import allocate
from palpate.studies.procedures.model_grid import level_at

if TYPE_CHECKING:
    import pandas as pd

    from palpate.analysis.plans.answers import Selected
    from palpate.analysis.plans.families.choices import PsychometricFunction
    from palpate.protocols.study import Observer, Study
    from palpate.protocols.tracks import Track

THRESHOLD, JND = QUANTITIES = ("threshold", "jnd")


class Measurement(NamedTuple):
    """A simulated person's number of one track, `value`, and the one that it estimates, `truth`; None for no number.

    `label` has the track and the further columns of the plan's `by`. `between` is the SD of the truth over people,
    `stimulus` what a person's own deviation belongs to: tracks of one stimulus share it. `used` trials count. `without`
    says why there is no number: "guessing", "outside", "refused" or "left out".
    """

    label: str
    track: str
    stimulus: str
    used: int
    value: float | None = None
    low: float = math.nan
    high: float = math.nan
    truth: float = math.nan
    between: float = math.nan
    without: str = ""

    @property
    def error(self) -> float:
        """The estimate minus the value that it estimates, NaN without an estimate."""
        return math.nan if self.value is None else self.value - self.truth

    @property
    def width(self) -> float:
        """The width of the interval, infinite where an end is not bounded."""
        return math.inf if math.isnan(self.high - self.low) else self.high - self.low

    @property
    def is_held(self) -> bool:
        """Whether the interval holds the value; an end that is not bounded excludes nothing."""
        return not (self.truth < self.low or self.truth > self.high)


def with_trials(study: Study, trials: int) -> Study:
    """Return the study with this number in every procedure."""
    procedures = tuple(procedure.with_trials(trials) for procedure in study.procedure)
    return study.model_copy(update={"procedure": procedures})


def first_choices(choices: pd.DataFrame, study: Study, group: str | None = None) -> pd.DataFrame:
    """Return the choices of a longer study that this one would have: the first trials and catch trials of each track.

    `choices` are of people of one group, in the order of the trials. A track that ends earlier has all of its own.
    """
    limits = {name: track.trials for name, track in study_tracks(study, group).items()}
    absent, easy = study.intervals.catch_every
    every = {NO_CATCH: 1, ABSENT: absent or 1, EASY: easy or 1}
    nth = choices.groupby(["participant", "session", "track", "catch"]).cumcount()
    shorter: pd.DataFrame = choices[nth < choices["track"].map(limits) // choices["catch"].map(every)]
    return shorter.reset_index(drop=True)


def measure(todo: tuple[PowerRequest, tuple[int, ...], int]) -> dict[int, list[Measurement]]:
    """Simulate one person and return what is measured of each track, for each number of trials.

    It is nothing of people whose choices the test does not ask about.
    """
    request, trials, number = todo
    study = read_study(request.study_file).study
    plan = only(read_plan(request.plan_file), request, study)
    settings: Any = plan.tests[0]
    longest = _without_catch_rule(with_trials(study, trials[-1]))
    who = allocate(study, person(number))
    material = simulated_material(longest, request.lab, [who.participant], request.seed * MOST_RUNS)
    measured: dict[int, list[Measurement]] = {}
    for cap in trials:
        shorter = with_trials(study, cap)
        left = replace(material, own={CHOICES: first_choices(material.choices, shorter, who.group)})
        try:
            selected = Selector(left, plan, {}).of(settings, TESTS[settings.test])
        except NoRows:  # the test's `where` keeps nothing of this person, such as another group
            measured[cap] = []
            continue
        failed = bool(catch_exclusions(shorter, left.choices))
        measured[cap] = [
            measurement._replace(value=None, without="left out") if failed else measurement
            for measurement in _measurements(request, settings, selected, study, study_tracks(study, who.group))
        ]
    return measured


def _without_catch_rule(study: Study) -> Study:
    """Return the study without `exclude_above`, which depends on the number of trials and is applied to each."""
    intervals = study.intervals
    if intervals.catch is None:
        return study
    catch = intervals.catch.model_copy(update={"exclude_above": None})
    return study.model_copy(update={"intervals": intervals.model_copy(update={"catch": catch})})


def observer_of(study: Study, request: PowerRequest) -> Observer:
    """Return the psychometric function of simulated people. Raises PowerError where the study has none."""
    if study.simulation is None or study.simulation.observer is None:
        raise PowerError(f"{request.study_file}: simulation: no observer: says where simulated people's thresholds are")
    return study.simulation.observer


def _measurements(
    request: PowerRequest, settings: PsychometricFunction, selected: Selected, study: Study, tracks: Mapping[str, Track]
) -> Iterator[Measurement]:
    """Yield what is measured of each track of a person; `tracks` are those of the person's group."""
    quantity, observer = request.row or THRESHOLD, observer_of(study, request)
    for where, part in parts_of(selected.table, BY if settings.by is None else settings.by):
        label = ", ".join(text for name, text in where.items() if name != PARTICIPANT)
        track = tracks[where["track"]]
        stimulus = Slot(track.name, track).stimulus.id
        row, _ = function_row(selected, settings, part)
        measurement = Measurement(label, track.name, stimulus, int(row["trials"] or 0))
        if row[quantity] is None:
            guesses = (row["likelihood_ratio"] or 0) < RATIO
            yield measurement._replace(
                without="refused" if row["outside"] is None else "guessing" if guesses else "outside"
            )
            continue
        distance = quantity == JND and track_design(part)[0].task == "forced_choice" and row["standard"] is not None
        expected = _Expected(observer, track, quantity, settings.jnd, row["threshold_at"], distance)
        mean = observer.threshold_of(track.name, stimulus)
        # As the simulated participant draws it (palpate.protocols.tasks.intervals).
        own = normal("threshold", study.study, request.seed * MOST_RUNS, where[PARTICIPANT], stimulus)
        low, high = row[f"{quantity}_low"], row[f"{quantity}_high"]
        yield measurement._replace(
            value=row[quantity],
            low=math.nan if low is None else low,
            high=math.nan if high is None else high,
            truth=expected.value(mean + observer.threshold_sd * own),
            between=abs(expected.value(mean + observer.threshold_sd) - expected.value(mean)),
        )


@dataclass(frozen=True)
class _Expected:
    """The number that an estimate is of: the level where F is `at`, or the JND of the observer's function."""

    observer: Observer
    track: Track
    quantity: str
    jnd: JndKind
    at: float
    distance: bool

    def value(self, threshold: float) -> float:
        """Return the number of a person with this threshold of the observer's function."""
        if self.distance:
            return abs(self._level(self.at, threshold) - (self.track.standard_level or 0.0))
        if self.quantity == THRESHOLD:
            return self._level(self.at, threshold)
        factor, upper, lower = jnd_ends(self.jnd)
        return factor * abs(self._level(upper, threshold) - self._level(lower, threshold))

    def _level(self, share: float, threshold: float) -> float:
        observer, falling = self.observer, self.track.procedure.easier == "lower"
        place, slope = np.array(float(threshold)), np.array(float(observer.slope))
        return float(level_at(observer.shape, observer.scale, share, place, slope, falling))
