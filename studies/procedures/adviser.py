"""What a procedure gives: the next level of a track, or its end, and an estimate of its threshold."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import exp, fsum, lgamma, log
from typing import Any, Protocol

from palpate.protocols.procedures import Ending
from palpate.protocols.registry import Registry
from palpate.protocols.tracks import Past, Track

DECIMALS = 6
"""Decimals of an estimate on record, so that its last digits do not depend on the machine."""
SURE = 0.95
"""How sure a statement about an extreme observer is."""


@dataclass(frozen=True)
class Estimate:
    """The threshold of a track, in units of its level, with its uncertainty `sd` and the central interval of 95 %.

    `outside` is set where the answers do not place the threshold within the levels: below or above `bound`, with a
    probability of `sure` if that is known, or `unknown`. There is no threshold then.
    """

    threshold: float | None = None
    sd: float | None = None
    interval: tuple[float, float] | None = None
    outside: str | None = None
    bound: float | None = None
    sure: float | None = SURE

    def to_dict(self) -> dict[str, Any]:
        """Return the estimate as JSON data, without what is not known."""
        values = {"threshold": self.threshold, "sd": self.sd, "bound": self.bound}
        rounded: dict[str, Any] = {k: round(v, DECIMALS) for k, v in values.items() if v is not None}
        if self.interval is not None:
            rounded["interval"] = [round(value, DECIMALS) for value in self.interval]
        if self.outside is not None:
            rounded["outside"] = self.outside
            if self.bound is not None and self.sure is not None:
                rounded["sure"] = self.sure
        return rounded

    def __str__(self) -> str:
        """Return the estimate as a sentence without an end."""
        if self.outside in ("above", "below") and self.bound is not None:
            sure = "" if self.sure is None else f", {self.sure:.0%} sure"
            return f"threshold {self.outside} {self.bound:g}{sure}"
        if self.threshold is None:
            return "threshold unknown"
        spread = "" if self.sd is None else f" (SD {self.sd:.2g})"
        return f"threshold {self.threshold:.4g}{spread}"


@dataclass(frozen=True)
class Step:
    """The next level, by its index in the track's grid."""

    index: int


@dataclass(frozen=True)
class End:
    """The end of a track, and why."""

    why: str


class Adviser(Protocol):
    """A procedure for one track. Its state is the past alone; equal pasts get equal advice."""

    def advise(self, past: Past) -> Step | End:
        """Return the next level after these answers, or the end of the track."""

    def estimate(self, past: Past) -> Estimate:
        """Return what is known of the threshold after these answers."""


@dataclass(frozen=True)
class ProcedureKind:
    """A kind of procedure: `make` returns the adviser of a track.

    `settings` is the schema of `procedure:` of a kind that an extension brings; that of the others is in
    `palpate.protocols.procedures`.
    """

    make: Callable[[Track], Adviser]
    settings: type[Ending] | None = None


_ROOM = "palpate.studies.procedures"
KINDS: Registry[ProcedureKind] = Registry(
    {
        "constant": f"{_ROOM}.constant:KIND",
        "limits": f"{_ROOM}.limits:KIND",
        "staircase": f"{_ROOM}.staircase:KIND",
        "questplus": f"{_ROOM}.questplus:KIND",
    },
    kind="procedures",
    of="palpate.studies.procedures.adviser:ProcedureKind",
)
"""The kinds of procedures by name, as `procedure: {kind: NAME}` of a study."""


def adviser_for(track: Track, kinds: Mapping[str, ProcedureKind] = KINDS) -> Adviser:
    """Return the adviser of a track by the kind of its procedure. Raises KeyError if there is no such kind."""
    return kinds[track.procedure.kind].make(track)


def at_the_edge(track: Track, past: Past, target: float) -> Estimate | None:
    """Return a statement about an observer whose share of hits at an end of the levels excludes the target share.

    At the hardest level the share is then above the target (the threshold lies beyond), at the easiest below it, with a
    probability of 95 % (Clopper-Pearson, one-sided). None where neither end says so.
    """
    last = len(track.levels) - 1
    easiest = track.easiest
    for index in (last - easiest, easiest):
        hits = sum(hit for i, hit in past if i == index)
        trials = sum(1 for i, _ in past if i == index)
        if not trials:
            continue
        at_hardest = index != easiest
        tail = _at_least(hits, trials, target) if at_hardest else _at_least(trials - hits, trials, 1 - target)
        if tail <= 1 - SURE:
            level = track.levels[index]
            beyond = "below" if at_hardest == (track.procedure.easier == "higher") else "above"
            return Estimate(outside=beyond, bound=level[0] if isinstance(level, tuple) else level)
    return None


def too_rare(past: Past, target: float) -> bool:
    """Return whether hits are rarer than a staircase would have them, all levels together (one-sided, 95 %)."""
    hits = sum(hit for _, hit in past)
    return _at_least(len(past) - hits, len(past), 1 - target) <= 1 - SURE


def _at_least(hits: int, trials: int, share: float) -> float:
    """Return the probability of so many hits or more."""
    if share in (0.0, 1.0):
        return float(hits == 0 or share == 1.0)
    logs = (log(share), log(1 - share))
    terms = (
        lgamma(trials + 1) - lgamma(k + 1) - lgamma(trials - k + 1) + k * logs[0] + (trials - k) * logs[1]
        for k in range(hits, trials + 1)
    )
    return fsum(map(exp, terms))
