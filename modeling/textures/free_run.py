"""Scores of a model that runs on its own output, beside the truth and another realisation of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from palpate.modeling.textures.drive import Drive
from palpate.modeling.textures.metrics import (
    GREATEST,
    SMOOTHED,
    correlation,
    cycle,
    envelope,
    felt_distance,
    greatest_ratio,
    level_ratio,
    raw_gfc,
    slow,
    smoothed_gfc,
)
from palpate.modeling.textures.recording import TextureDataError
from palpate.signals.arrays import Array

Numbers = dict[str, float | None]
LEVEL, GFC, ENVELOPE, CYCLE = (0.85, 1.15), 0.98, 0.9, 0.1
"""What the project set out to reach, of every texture."""
NEAR = 0.95
"""Of what another realisation of the truth reaches: more cannot be asked of a model where that is below a limit."""
SILENT = {"smoothed_gfc": 0.0, "envelope": 0.0}
"""What silence counts as where the truth sounds: it breaks more limits than a model that lives."""
MANY = 2
"""More windows than this have a correlation."""
LIMITS: Mapping[str, str] = {
    "level": f"level {LEVEL[0]:g} to {LEVEL[1]:g}",
    "smoothed_gfc": f"smoothed GFC at least {GFC:g}",
    "envelope": f"envelope correlation at least {ENVELOPE:g} (or {NEAR:.0%} of another realisation's, as for the GFC)",
    "cycle_excess": f"autocorrelation at most {CYCLE:g} above the truth's",
    "greatest": f"at most {GREATEST:g} times as great as the truth at its greatest",
}
"""The limits by what they are of, in words."""


def free_run_scores(made: Array, drive: Drive) -> Numbers:
    """Return all scores of one minute (n,) in m/s^2 that a model made for this drive.

    `level`, `smoothed_gfc`, `raw_gfc`, `envelope` (with the truth's), `with_speed`, `with_force`, `cycle`,
    `cycle_excess` (over the truth's), `felt_dB`, `greatest`; None where it cannot be said. Raises TextureDataError
    where what was made is not finite or of another length.
    """
    if made.shape != drive.truth.shape or not np.isfinite(made).all():
        raise TextureDataError(
            f"{drive.texture}: {made.shape} samples were generated for {drive.truth.shape}, or some are not finite."
        )
    slowly = envelope(made)
    scores: Numbers = {
        **_by_spectrum(made, drive.truth),
        "raw_gfc": raw_gfc(drive.truth, made),
        "envelope": _follows(slowly, envelope(drive.truth)),
        "with_speed": correlation(slowly, slow(drive.speed)),
        "with_force": correlation(slowly, slow(drive.force)),
        "cycle": cycle(made, drive.cycle_window),
        "greatest": greatest_ratio(made, drive.truth),
    }
    return scores | {"cycle_excess": _excess(scores["cycle"], drive.cycle)}


def ceiling(drive: Drive) -> Numbers:
    """Return the scores of another realisation of the truth; what needs the same hand is None where it had another."""
    if drive.again is None:
        return {}
    if drive.same_hand:
        return free_run_scores(drive.again, drive)
    truth = drive.truth[len(drive.again) : 2 * len(drive.again)] if drive.seen else drive.truth
    truth = truth if len(truth) >= SMOOTHED else drive.truth
    scores: Numbers = {**_by_spectrum(drive.again, truth), "cycle": cycle(drive.again, drive.cycle_window)}
    return scores | {
        "greatest": greatest_ratio(drive.again, truth),
        "cycle_excess": _excess(scores["cycle"], drive.cycle),
    }


def truth_of(drive: Drive) -> Numbers:
    """Return what the truth itself is like: how its envelope goes with the hand, how far it repeats itself."""
    slowly = envelope(drive.truth)
    return {
        "with_speed": correlation(slowly, slow(drive.speed)),
        "with_force": correlation(slowly, slow(drive.force)),
        "cycle": drive.cycle,
        "rms_m_s2": float(np.sqrt(np.mean(drive.truth**2))),
    }


def beyond(
    numbers: Mapping[str, float | None], again: Mapping[str, float | None] = MappingProxyType({})
) -> tuple[str, ...]:
    """Return the names of the broken limits: an undefined number breaks none, silence is unlike the truth.

    `again` is what another realisation of the truth has (`ceiling`): where that misses a limit itself, `NEAR` of it is
    enough.
    """
    low, high = LEVEL
    limits: dict[str, Callable[[float], bool]] = {
        "level": lambda value: low <= value <= high,
        "smoothed_gfc": lambda value: value >= at_least(GFC, again.get("smoothed_gfc")),
        "envelope": lambda value: value >= at_least(ENVELOPE, again.get("envelope")),
        "cycle_excess": lambda value: value <= CYCLE,
        "greatest": lambda value: value <= GREATEST,
    }
    silent = SILENT if numbers.get("level") == 0 else {}
    known = {**silent, **{name: value for name, value in numbers.items() if value is not None}}
    return tuple(name for name, within in limits.items() if name in known and not within(known[name]))


def at_least(limit: float, again: float | None) -> float:
    """Return what a correlation or a GFC has to reach, given what another realisation of the truth does."""
    return limit if again is None or again >= limit else NEAR * again


def _follows(made: Array, truth: Array) -> float | None:
    """Return the correlation of two envelopes; one that does not vary where the truth's does follows it not at all."""
    likeness = correlation(made, truth)
    return 0.0 if likeness is None and len(truth) > MANY and np.ptp(truth) > 0 else likeness


def _by_spectrum(made: Array, truth: Array) -> Numbers:
    short = min(len(made), len(truth)) < SMOOTHED
    return {
        "level": level_ratio(made, truth),
        "smoothed_gfc": None if short else smoothed_gfc(truth, made),
        "felt_dB": None if short else felt_distance(truth, made),
    }


def _excess(own: float | None, truth: float | None) -> float | None:
    return None if own is None or truth is None else own - truth
