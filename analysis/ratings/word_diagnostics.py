"""Diagnostics of a participant's choice of words: the same words throughout, none, or in a hurry."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby
from statistics import median

from palpate.analysis.ratings.diagnostics import Diagnostic, Limits, none, of_run, of_seconds, of_share


@dataclass(frozen=True)
class Worded:
    """The words of one trial that count: ticked of those offered, or written freely (offered is 0)."""

    trial: int
    stimulus: str
    words: tuple[str, ...]
    offered: int = 0
    seconds: float | None = None
    practice: bool = False


def diagnose_words(
    trials: Iterable[Worded], expected: int | None = None, limits: Limits | None = None
) -> tuple[Diagnostic, ...]:
    """Return all diagnostics of one session's words; practice does not count. All thresholds are our choice.

    `expected` is how many counted trials should have been answered by now; the default is those that were.
    """
    counted = sorted((trial for trial in trials if not trial.practice), key=lambda trial: trial.trial)
    limits = limits or Limits()
    enough, n = len(counted) >= limits.least_trials, len(counted)
    lengths = [len(list(same)) for _, same in groupby(counted, key=lambda trial: frozenset(trial.words))]
    no_word = none("no word at all", "share", "no trial is answered yet")
    if n:
        empty = sum(not trial.words for trial in counted)
        no_word = of_share("no word at all", empty, n, limits.same_share, enough, "trials have no word")
    if not counted:
        amount = none("words per trial", "words", "no trial is answered yet")
    elif any(trial.offered for trial in counted):
        shares = [len(trial.words) / trial.offered for trial in counted if trial.offered]
        value = median(shares)
        amount = Diagnostic(
            "words ticked",
            value,
            "share",
            len(shares),
            None,
            False,
            f"{value:.0%} of the words are ticked (median).",
        )
    else:
        number = float(median([len(trial.words) for trial in counted]))
        amount = Diagnostic(
            "words per trial", number, "words", len(counted), None, False, f"{number:g} words (median)."
        )
    return (
        amount,
        of_run("same words in a row", max(lengths, default=0), n, limits.run, "the same words"),
        _always_the_same(counted, limits),
        no_word,
        *_times(counted, enough, limits),
        _missing(n, n if expected is None else expected),
    )


def _always_the_same(trials: list[Worded], limits: Limits) -> Diagnostic:
    """Return how many different sets of words there are, as a share of the trials; a single set is flagged."""
    name, n = "different sets of words", len(trials)
    if not n:
        return none(name, "share", "no trial is answered yet")
    sets = len({frozenset(trial.words) for trial in trials})
    sentence = f"{sets} different sets of words in {n} trials; flagged where there is one throughout."
    return Diagnostic(name, sets / n, "share", n, 1 / n, n >= limits.least_trials and sets == 1, sentence)


def _times(trials: list[Worded], enough: bool, limits: Limits) -> Iterator[Diagnostic]:
    seconds = [trial.seconds for trial in trials if trial.seconds is not None]
    if not seconds:
        yield none("too fast", "share", "no response time is recorded")
        yield none("time per trial", "s", "no response time is recorded")
        return
    fast, what = (
        sum(second < limits.seconds_per_trial for second in seconds),
        f"less than {limits.seconds_per_trial:g} s",
    )
    yield of_share("too fast", fast, len(seconds), limits.fast_share, enough, f"trials took {what}", above=True)
    yield of_seconds("time per trial", seconds, limits.seconds_per_trial, enough, "a trial")


def _missing(given: int, expected: int) -> Diagnostic:
    expected = max(expected, given)
    if not expected:
        return none("missing", "share", "no trial is due yet")
    share = 1 - given / expected
    sentence = f"{expected - given} of {expected} trials due are missing; flagged from the first."
    return Diagnostic("missing", share, "share", expected, 0.0, share > 0, sentence)
