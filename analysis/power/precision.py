"""How exactly thresholds are measured, by trials of a track and by participants, from simulated people."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple, TypeAlias

import numpy as np
from scipy.special import chdtri, stdtrit

from palpate.analysis.plans.families.choices import PsychometricFunction
from palpate.analysis.plans.families.collected_answers import BY
from palpate.analysis.plans.reading import read_plan
from palpate.analysis.power.request import PowerError, PowerRequest, check_request
from palpate.analysis.power.simulated_tracks import QUANTITIES, Measurement, measure, observer_of
from palpate.analysis.ratings.collected_choices import study_tracks
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.procedures import MOST_TRIALS, Constant, Ending
from palpate.protocols.progress import Clock, Progress
from palpate.protocols.study import Study
from palpate.studies.catalogue import read_study
from palpate.studies.workers import map_in_order

People: TypeAlias = Mapping[int, Measurement]
"""What is measured of one track, by the number of the simulated person."""
ASSURED = 0.8
"""The share of studies whose interval is at most as wide as the assured width (Kelley & Rausch 2006)."""
MOST_PEOPLE = 999
WITHOUT = ("guessing", "outside", "refused", "left out")
"""Why a person has no number."""


@dataclass(frozen=True)
class TrackPrecision:
    """How exactly tracks of so many trials measure a person, in units of the level.

    `trials` replaces `stop.trials` of the procedure, or `repeats` of constant stimuli; `own`: it is the study's own
    number. `used` is the mean number of trials that count. `bias` (with its standard error) and `sd` are of estimates
    around the person's own value, `sd_low` and `sd_high` the 95 % interval of the SD. `interval` is the median width of
    95 % intervals (None: most are unbounded), `covered` the share that hold the person's value. Of `people`,
    `guessing` + `outside` + `refused` have no number, and `left_out` failed the study's catch trials.
    """

    track: str
    trials: int
    own: bool
    used: float
    people: int
    bias: float | None
    bias_se: float | None
    sd: float | None
    sd_low: float | None
    sd_high: float | None
    interval: float | None
    covered: float | None
    guessing: int
    outside: int
    refused: int
    left_out: int

    @property
    def without(self) -> float:
        """The share of people without a number, those who are left out included."""
        return (self.guessing + self.outside + self.refused + self.left_out) / self.people


@dataclass(frozen=True)
class MeanPrecision:
    """How wide the 95 % interval (Student's t) of a mean over participants is, in units of the level.

    `of` is a track, the difference of two tracks within people, or that of two groups. `sd_between` is the SD of
    people's own values, `sd_error` that of the measurement, `measured` the share of all participants with a number (a
    track may be of one group). `width` is that of the root mean square SD; the share ASSURED of studies are not wider
    than `width_assured`. None where fewer than two participants are expected to have a number.
    """

    of: str
    trials: int
    own: bool
    participants: int
    planned: bool
    sd_between: float
    sd_error: float
    measured: float
    width: float | None
    width_assured: float | None


@dataclass(frozen=True)
class Precision:
    """Both tables; `spreads` has what a mean's interval follows from, by (of, trials).

    `counted` is what numbers of trials count: "trials" of a track, or "repeats" of the levels of constant stimuli.
    `rules` are those by which the study's tracks end before their number of trials.
    """

    tracks: tuple[TrackPrecision, ...]
    means: tuple[MeanPrecision, ...]
    spreads: Mapping[tuple[str, int], Spread]
    counted: str
    rules: tuple[str, ...]


class Spread(NamedTuple):
    """What the interval of a mean follows from: SDs between people and of the error, and the share with a number.

    The mean is one of `groups` groups of equal size and is compared with another one, unless that is 1.
    `is_difference`: it is of differences of two tracks.
    """

    between: float
    error: float
    measured: float
    groups: int = 1
    is_difference: bool = False

    @property
    def sd(self) -> float:
        """The SD over people of what is measured."""
        return math.hypot(self.between, self.error)

    def width(self, participants: int, assured: bool = False) -> float | None:
        """Return the width of the 95 % interval, None if fewer than two are expected to have a number in a group."""
        each = participants / self.groups * self.measured
        df = each - 1 if self.groups == 1 else 2 * each - 2
        if each < 2:
            return None
        sd = self.sd
        if assured:
            sd *= math.sqrt(float(chdtri(df, 1 - ASSURED)) / df)
        return 2 * float(stdtrit(df, 0.975)) * sd * math.sqrt((1 if self.groups == 1 else 2) / each)


def check_precision(request: PowerRequest) -> PsychometricFunction:
    """Return the requested test of thresholds. Raises PowerError where study or test have none, naming the place."""
    study = read_study(request.study_file).study
    if not study.procedure:
        raise PowerError(
            f"{request.study_file}: no procedure: chooses levels, so there are no trials of a track to plan; leave out "
            "--trials, --sd and --width"
        )
    test = check_request(replace(request, effect=1.0))
    observer_of(study, request)
    if not isinstance(test, PsychometricFunction):
        named = [item.name for item in read_plan(request.plan_file).tests if isinstance(item, PsychometricFunction)]
        known = f"its tests of thresholds: {', '.join(named)}" if named else "the plan has no test: psychometric"
        raise PowerError(f"{request.plan_file}: test {request.test!r} ({test.test}) gives no thresholds; {known}")
    by = BY if test.by is None else test.by
    if not set(BY) <= set(by):
        raise PowerError(
            f"{request.plan_file}: test {request.test!r}: by: found {', '.join(by) or 'nothing'}; a person's threshold "
            "in a track needs participant and track"
        )
    if request.row and request.row not in QUANTITIES:
        raise PowerError(
            f"{request.test}: --row {request.row}: precision is of {' or '.join(QUANTITIES)}; "
            f"{nearest(request.row, QUANTITIES)}"
        )
    for procedure in study.procedure:
        if len(procedure.grids) > 1:
            raise PowerError(f"{request.study_file}: procedure: levels of two dimensions have no single threshold")
    return test


def all_trials(study: Study, wanted: Sequence[int]) -> tuple[int, ...]:
    """Return the numbers of trials in order, the study's own among them; without any, half to twice its own."""
    own = {procedure.counted_trials for procedure in study.procedure}
    around = {max(1, round(factor * number)) for number in own for factor in (0.5, 0.75, 1.5, 2)}
    numbers = {*(wanted or around), *own}
    return tuple(sorted(number for number in numbers if number <= MOST_TRIALS))


def precision(
    request: PowerRequest,
    trials: Sequence[int],
    sizes: Sequence[int],
    runs: int,
    jobs: int = 1,
    progress: Progress = lambda *_: None,
    planned: int | None = None,
) -> Precision:
    """Simulate `runs` people and return how exactly they and their means are measured.

    Raises PowerError where study or test have no thresholds. The result does not depend on `jobs`, and the first
    people of more runs are those of fewer.
    """
    check_precision(request)
    study = read_study(request.study_file).study
    trials = all_trials(study, trials)
    title = f"{request.test}, tracks of up to {trials[-1]} trials"
    progress(0, runs, title)
    persons = []
    todo = [(request, trials, run) for run in range(1, runs + 1)]
    with closing(map_in_order(measure, todo, min(jobs, runs))) as measured:
        for done, person in enumerate(measured, start=1):
            persons.append(person)
            progress(done, runs, title)
    if not any(person[cap] for person in persons for cap in trials):
        raise PowerError(f"{request.test}: its `where` keeps no choice of any simulated person")
    own = {track.name: track.procedure.counted_trials for track in study_tracks(study).values()}
    tracks, spreads, own_of = [], dict[tuple[str, int], Spread](), dict[str, int | None]()
    for cap in trials:
        rows: dict[str, dict[int, Measurement]] = {}
        for number, person in enumerate(persons):
            for one in person[cap]:
                rows.setdefault(one.label, {})[number] = one
                own_of[one.label] = own[one.track]
        tracks += [_of_track(label, cap, cap == own_of[label], several) for label, several in rows.items()]
        for of, spread in _spreads(rows, own_of, runs, len(study.groups)):
            spreads[of, cap] = spread
    means = [
        MeanPrecision(
            of, cap, cap == own_of[of], size, size == planned, spread.between, spread.error, spread.measured,
            spread.width(size), spread.width(size, assured=True),
        )
        for (of, cap), spread in spreads.items()
        for size in sizes
    ]  # fmt: skip
    counted = "repeats" if all(isinstance(procedure, Constant) for procedure in study.procedure) else "trials"
    return Precision(tuple(tracks), tuple(means), spreads, counted, tuple(_rules(study)))


def _rules(study: Study) -> Iterator[str]:
    """Yield the rules by which tracks end before their last trial, as the study file has them."""
    for stop in (procedure.stop for procedure in study.procedure if isinstance(procedure, Ending)):
        rules = stop.model_dump(include={"reversals", "series", "threshold_sd"}, exclude_none=True)
        yield from (f"{name}: {value:g}" for name, value in rules.items())


def _of_track(label: str, trials: int, own: bool, several: People) -> TrackPrecision:
    known = [one for one in several.values() if one.value is not None]
    errors = np.array([one.error for one in known])
    n = len(errors)
    bounded = [one.is_held for one in known if math.isfinite(one.low) or math.isfinite(one.high)]
    bias, held = (float(np.mean(values)) if len(values) else None for values in (errors, bounded))
    sd = float(errors.std(ddof=1)) if n > 1 else None
    low, high = (
        None if sd is None else sd * math.sqrt((n - 1) / float(chdtri(n - 1, tail))) for tail in (0.025, 0.975)
    )
    width = float(np.median([one.width for one in known])) if n else math.inf
    counts = [sum(one.without == why for one in several.values()) for why in WITHOUT]
    return TrackPrecision(
        label, trials, own, float(np.mean([one.used for one in several.values()])), len(several), bias,
        None if sd is None else sd / math.sqrt(n), sd, low, high, width if math.isfinite(width) else None, held,
        *counts,
    )  # fmt: skip


def _spreads(
    rows: Mapping[str, People], own: dict[str, int | None], people: int, groups: int
) -> Iterator[tuple[str, Spread]]:
    """Yield what means are of, and their spread: tracks, differences of two within people, and of two groups.

    Those are left out that fewer than two people have a number for; groups are compared in the tracks that all of them
    have. `own` has the study's number of trials for each, `people` were simulated.
    """
    means: dict[str, Spread] = {}
    for label, several in rows.items():
        known = [one for one in several.values() if one.value is not None]
        if len(known) > 1:
            error = float(np.std([one.error for one in known], ddof=1))
            means[label] = Spread(known[0].between, error, len(known) / people)
            yield label, means[label]
    for one, two in combinations(means, 2):
        pairs = [(rows[one][number], rows[two][number]) for number in rows[one] if number in rows[two]]
        both = [(a, b) for a, b in pairs if a.value is not None and b.value is not None]
        if len(both) < 2:
            continue
        of, sds = f"{one} − {two}", (means[one].between, means[two].between)
        own[of] = own[one] if own[one] == own[two] else None
        between = abs(sds[0] - sds[1]) if both[0][0].stimulus == both[0][1].stimulus else math.hypot(*sds)
        error = float(np.std([a.error - b.error for a, b in both], ddof=1))
        yield of, Spread(between, error, len(both) / people, is_difference=True)
    common = [label for label in means if len(rows[label]) == people] if groups > 1 else []
    for label in common:
        own[of := f"{label}: two of {groups} groups"] = own[label]
        yield of, means[label]._replace(groups=groups)


def estimate_precision_s(
    request: PowerRequest, trials: Sequence[int], runs: int, jobs: int, clock: Clock = time.perf_counter
) -> float:
    """Return about how many seconds `precision` takes, from timing one person. Raises as `precision` does."""
    check_precision(request)
    trials = all_trials(read_study(request.study_file).study, trials)
    measure((request, trials[:1], 1))  # what is imported is not timed
    start = clock()
    measure((request, trials, 2))
    return (clock() - start) * runs / min(jobs, runs)


def trials_needed(tracks: Sequence[TrackPrecision], target: float, what: str) -> int | None:
    """Return the smallest number of trials from which on `sd` or `interval` of every track is at most the target."""
    smallest = None
    for cap in sorted({point.trials for point in tracks}, reverse=True):
        values = [getattr(point, what) for point in tracks if point.trials == cap]
        if any(value is None or value > target for value in values):
            break
        smallest = cap
    return smallest


def people_needed(spread: Spread, target: float) -> int | None:
    """Return the smallest number of participants, up to 999, whose mean has an interval of at most the target width.

    The width is the assured one. With several groups it is the number in all of them together.
    """
    for size in range(2 * spread.groups, MOST_PEOPLE + 1, spread.groups):
        width = spread.width(size, assured=True)
        if width is not None and width <= target:
            return size
    return None
