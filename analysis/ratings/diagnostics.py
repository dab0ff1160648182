"""Diagnostics of a rater: straight-lining, extreme, hurried, inconsistent or missing answers.

Every diagnostic is a number with a threshold for a flag. A flag asks an experimenter to look; it excludes nobody. The
diagnostics and their pitfalls are reviewed by Curran (2016, J. Exp. Soc. Psychol. 66, 4-19) and compared by Meade &
Craig (2012, Psychol. Methods 17, 437-455); for words see `palpate.analysis.ratings.word_diagnostics`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import groupby, pairwise
from statistics import median, pstdev

from palpate.protocols.wording import count


class DiagnosticsError(ValueError):
    """The answers are not those of a rating study."""


@dataclass(frozen=True)
class Limits:
    """The thresholds of the diagnostics.

    From the literature: `retest_r`, the reliability of a single person under which answers count as careless (.30:
    Jackson, in Johnson 2005, J. Res. Pers. 39, 103-129); `run_share`, the same answer for half of the items (Curran
    2016); `fast_share`, more than a tenth of the answers too fast (a response time effort below .90: Wise & Kong 2005,
    Appl. Meas. Educ. 18, 163-183). All others are our choice. `seconds_per_item` is far below the 2 s of questionnaires
    (Huang et al. 2012, J. Bus. Psychol. 27, 99-114): a slider can hardly be found, dragged and let go in less.
    """

    same_share: float = 0.5
    run: int = 5
    run_share: float = 0.5
    variability: float = 0.05
    ends_share: float = 0.5
    fast_share: float = 0.1
    seconds_per_item: float = 0.4
    seconds_per_trial: float = 2.0
    retest_r: float = 0.3
    retest_difference: float = 0.25
    least_trials: int = 5
    least_pairs: int = 10


@dataclass(frozen=True)
class Answered:
    """The answers of one trial that count, in scale units by item, and the seconds from question to answer."""

    trial: int
    stimulus: str
    values: Mapping[str, float]
    seconds: float | None = None
    practice: bool = False


@dataclass(frozen=True)
class Diagnostic:
    """One diagnostic: its number (None if undefined, with the reason in the sentence), the n of what, and the flag.

    `unit` is share, trials, s, r or range (a share of the scale's range).
    """

    name: str
    value: float | None
    unit: str
    n: int
    threshold: float | None
    flagged: bool
    sentence: str


@dataclass(frozen=True)
class Rater:
    """One session's answers that count, as input of the diagnostics."""

    trials: tuple[Answered, ...]
    low: float
    high: float
    expected: int
    items: int
    limits: Limits = field(default_factory=Limits)

    @property
    def enough(self) -> bool:
        """Whether there are enough trials to flag anything."""
        return len(self.trials) >= self.limits.least_trials


def diagnose(
    trials: Iterable[Answered], low: float, high: float, expected: int | None = None, limits: Limits | None = None
) -> tuple[Diagnostic, ...]:
    """Return all diagnostics of one session's ratings on a scale from `low` to `high`; practice does not count.

    `expected` is how many counted trials should have been answered by now; the default is those that were.
    Raises DiagnosticsError on a scale without extent, or a value that is not finite or off the scale.
    """
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise DiagnosticsError(f"a scale from {low} to {high}: two finite ends are expected, the lower first")
    counted = tuple(sorted((trial for trial in trials if not trial.practice), key=lambda trial: trial.trial))
    for trial in counted:
        for item, value in trial.values.items():
            if not low <= value <= high:
                raise DiagnosticsError(
                    f"trial {trial.trial}: {item} = {value!r}; a finite number from {low:g} to {high:g} is expected"
                )
    items = max((len(trial.values) for trial in counted), default=0)
    rater = Rater(counted, low, high, len(counted) if expected is None else expected, items, limits or Limits())
    signs = (same_value, longest_run, variability, at_the_ends, too_fast, seconds_per_item)
    return (*(sign(rater) for sign in signs), *retest(rater), missing(rater))


def same_value(rater: Rater) -> Diagnostic:
    """Return straight-lining within a trial: the share of trials in which every item got the same value."""
    name, limit = "same value on all items", rater.limits.same_share
    if rater.items < 2 or not rater.trials:
        return none(name, "share", "a trial has fewer than two items" if rater.trials else "no trial is answered yet")
    straight = sum(len(set(trial.values.values())) == 1 for trial in rater.trials)
    return of_share(name, straight, len(rater.trials), limit, rater.enough, "trials have one value on all items")


def longest_run(rater: Rater) -> Diagnostic:
    """Return straight-lining across trials: most trials in a row with the same answers (long string, Johnson 2005)."""
    n = len(rater.trials)
    lengths = [len(list(same)) for _, same in groupby(rater.trials, key=lambda trial: sorted(trial.values.items()))]
    limit = rater.limits.run
    if rater.items == 1:  # One value alike now and then says little: the rule for single items.
        limit = max(limit, math.ceil(rater.limits.run_share * n))
    return of_run("same answers in a row", max(lengths, default=0), n, limit, "the same answers")


def variability(rater: Rater) -> Diagnostic:
    """Return intra-individual response variability: the median over trials of the SD of a trial's values.

    It is a share of the scale's range; too little is flagged (Dunn et al. 2018, J. Bus. Psychol. 33, 105-121; the
    threshold is our choice).
    """
    name, limit = "spread within a trial", rater.limits.variability
    spreads = [_spread(tuple(sorted(trial.values.values()))) for trial in rater.trials if len(trial.values) > 1]
    if not spreads:
        return none(name, "range", "a trial has fewer than two items" if rater.trials else "no trial is answered yet")
    value = median(spreads) / (rater.high - rater.low)
    flagged = rater.enough and value < limit
    sentence = f"The values of a trial spread over {value:.1%} of the scale (median SD); flagged below {limit:.0%}."
    return Diagnostic(name, value, "range", len(spreads), limit, flagged, sentence)


@lru_cache(maxsize=10_000)
def _spread(values: tuple[float, ...]) -> float:
    """Return the SD of a trial's sorted values: exact, hence slow, and cached, as values often repeat."""
    return pstdev(values)


def at_the_ends(rater: Rater) -> Diagnostic:
    """Return endpoint pile-up: the share of ratings at either end of the scale (our threshold)."""
    values = [value for trial in rater.trials for value in trial.values.values()]
    if not values:
        return none("at the ends", "share", "no trial is answered yet")
    ends = sum(value in (rater.low, rater.high) for value in values)
    return of_share("at the ends", ends, len(values), rater.limits.ends_share, rater.enough, "ratings lie at an end")


def too_fast(rater: Rater) -> Diagnostic:
    """Return the share of trials answered in less than `seconds_per_item` for each item."""
    per_item = _per_item(rater)
    limits = rater.limits
    if not per_item:
        return none("too fast", "share", "no response time is recorded")
    fast = sum(seconds < limits.seconds_per_item for seconds in per_item)
    what = f"trials took less than {limits.seconds_per_item:g} s an item"
    return of_share("too fast", fast, len(per_item), limits.fast_share, rater.enough, what, above=True)


def seconds_per_item(rater: Rater) -> Diagnostic:
    """Return the median over trials of the seconds per item."""
    per_item, limit = _per_item(rater), rater.limits.seconds_per_item
    if not per_item:
        return none("time per item", "s", "no response time is recorded")
    return of_seconds("time per item", per_item, limit, rater.enough, "an item")


def retest(rater: Rater) -> tuple[Diagnostic, Diagnostic]:
    """Return the test-retest agreement of a stimulus' ratings with those at its next presentation, over items and
    pairs.

    It is Pearson's r, and the mean absolute difference as a share of the scale's range.
    """
    by_stimulus: dict[str, list[Answered]] = {}
    for trial in rater.trials:
        by_stimulus.setdefault(trial.stimulus, []).append(trial)
    pairs = [
        (first.values[item], again.values[item])
        for meetings in by_stimulus.values()
        for first, again in pairwise(meetings)
        for item in first.values
        if item in again.values
    ]
    names = "retest r", "retest difference"
    if not pairs:
        why = "no stimulus was rated twice"
        return none(names[0], "r", why), none(names[1], "range", why)
    n, limit = len(pairs), rater.limits.retest_difference
    difference = math.fsum(abs(a - b) for a, b in pairs) / n / (rater.high - rater.low)
    flagged = n >= rater.limits.least_pairs and difference > limit
    sentence = (
        f"They differ by {difference:.1%} of the scale on average ({count(n, 'pair')}); flagged above {limit:.0%}."
    )
    by_difference = Diagnostic(names[1], difference, "range", n, limit, flagged, sentence)
    r, n = _pearson(pairs), len(pairs)
    if r is None:
        why = "fewer than three pairs" if n < 3 else "all first or all second ratings are equal"
        correlation = none(names[0], "r", f"{count(n, 'pair')} of ratings: {why}", n)
    else:
        few = n < rater.limits.least_pairs
        rule = (
            f"too few to judge (from {rater.limits.least_pairs})" if few else f"flagged below {rater.limits.retest_r:g}"
        )
        sentence = f"Ratings of repeated stimuli correlate with r = {r:.2f} over {count(n, 'pair')}; {rule}."
        correlation = Diagnostic(
            names[0], r, "r", n, rater.limits.retest_r, not few and r < rater.limits.retest_r, sentence
        )
    return correlation, by_difference


def missing(rater: Rater) -> Diagnostic:
    """Return the share of the expected ratings that are missing."""
    expected, items = max(rater.expected, len(rater.trials)), max(rater.items, 1)
    given = sum(len(trial.values) for trial in rater.trials)
    if not expected:
        return none("missing", "share", "no trial is due yet")
    share = 1 - given / (expected * items)
    sentence = (
        f"{expected * items - given} of {count(expected * items, 'rating')} owed are missing; flagged from the first."
    )
    return Diagnostic("missing", share, "share", expected * items, 0.0, share > 0, sentence)


def _per_item(rater: Rater) -> list[float]:
    """Return the seconds per item, to the recorded nanosecond: 1.2 s for three items is 0.4 s per item."""
    return [
        round(trial.seconds / len(trial.values), 9)
        for trial in rater.trials
        if trial.seconds is not None and trial.values
    ]


def _pearson(pairs: Sequence[tuple[float, float]]) -> float | None:
    """Return r, or None if undefined.

    Equal values are detected directly, since their mean may be off in the last bit.
    """
    columns = list(zip(*pairs, strict=True))
    if len(pairs) < 3 or any(min(column) == max(column) for column in columns):
        return None
    x, y = ([value - math.fsum(column) / len(column) for value in column] for column in columns)
    x, y = ([value / max(map(abs, column)) for value in column] for column in (x, y))
    r = math.fsum(a * b for a, b in zip(x, y, strict=True))
    r /= math.sqrt(math.fsum(a * a for a in x)) * math.sqrt(math.fsum(b * b for b in y))
    return min(max(r, -1.0), 1.0)


def none(name: str, unit: str, why: str, n: int = 0) -> Diagnostic:
    """Return a diagnostic without a number, with the reason."""
    return Diagnostic(name, None, unit, n, None, False, f"No number: {why}.")


def of_share(name: str, part: int, n: int, limit: float, enough: bool, what: str, *, above: bool = False) -> Diagnostic:
    """Return a share that is flagged at its limit and beyond, or only above it."""
    value, rule = part / n, f"flagged {'above' if above else 'from'} {limit:.0%}"
    flagged = enough and (value > limit if above else value >= limit)
    return Diagnostic(name, value, "share", n, limit, flagged, f"{part} of {n} {what} ({value:.0%}); {rule}.")


def of_run(name: str, run: int, n: int, limit: int, what: str) -> Diagnostic:
    """Return a run of trials that is flagged from its limit on."""
    if not n:
        return none(name, "trials", "no trial is answered yet")
    sentence = f"At most {count(run, 'trial')} in a row with {what}, of {n}; flagged from {limit}."
    return Diagnostic(name, float(run), "trials", n, float(limit), run >= limit, sentence)


def of_seconds(name: str, seconds: Sequence[float], limit: float, enough: bool, unit: str) -> Diagnostic:
    """Return a median time that is flagged below its limit."""
    value = median(seconds)
    sentence = f"{value:.2f} s {unit} (median of {count(len(seconds), 'trial')}); flagged below {limit:g} s."
    return Diagnostic(name, value, "s", len(seconds), limit, enough and value < limit, sentence)
