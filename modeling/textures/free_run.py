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
"""The project's targets for every texture."""
NEAR = 0.95
"""The sufficient share of another realisation's score, where that score itself misses a limit."""
SILENT = {"smoothed_gfc": 0.0, "envelope": 0.0}
"""The scores of a silent signal where they are undefined, so that it breaks more limits than others."""
MANY = 2
"""The number of windows that a correlation must exceed."""
LIMITS: Mapping[str, str] = {
    "level": f"level {LEVEL[0]:g} to {LEVEL[1]:g}",
    "smoothed_gfc": f"smoothed GFC at least {GFC:g}",
    "envelope": f"envelope correlation at least {ENVELOPE:g} (or {NEAR:.0%} of another realisation's, as for the GFC)",
    "cycle_excess": f"autocorrelation at most {CYCLE:g} above the truth's",
    "greatest": f"at most {GREATEST:g} times as great as the truth at its greatest",
}
"""The limits in words, by score."""


def free_run_scores(generated: Array, drive: Drive) -> Numbers:
    """Return all scores of a model's free run (n,), in m/s^2, for this drive.

    `level`, `smoothed_gfc`, `raw_gfc`, `envelope` (with the truth's), `with_speed`, `with_force`, `cycle`,
    `cycle_excess` (over the truth's), `felt_dB`, `greatest`; None where undefined. Raises TextureDataError where the
    generated signal is not finite or has another length.
    """
    if generated.shape != drive.truth.shape or not np.isfinite(generated).all():
        raise TextureDataError(
            f"{drive.texture}: {generated.shape} samples were generated for {drive.truth.shape},"
            " or some are not finite."
        )
    slowly, true_envelope = envelope(generated), envelope(drive.truth)
    follows = correlation(slowly, true_envelope)
    if follows is None and len(true_envelope) > MANY and np.ptp(true_envelope) > 0:
        follows = 0.0  # an envelope that does not vary where the truth's does
    scores: Numbers = {
        **_by_spectrum(generated, drive.truth),
        "raw_gfc": raw_gfc(drive.truth, generated),
        "envelope": follows,
        "with_speed": correlation(slowly, slow(drive.speed)),
        "with_force": correlation(slowly, slow(drive.force)),
        "cycle": cycle(generated, drive.cycle_window),
        "greatest": greatest_ratio(generated, drive.truth),
    }
    return scores | {"cycle_excess": _excess(scores["cycle"], drive.cycle)}


def ceiling(drive: Drive) -> Numbers:
    """Return the scores of another realisation of the truth; some are None unless it has the same hand."""
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
    """Return the truth's own scores: correlation of its envelope with the hand, repetition, level."""
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
    """Return the names of the broken limits; an undefined score breaks none, except for a silent signal.

    `again` are the scores of another realisation of the truth (`ceiling`): where these miss a limit, a share `NEAR` of
    them is sufficient.
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
    """Return the limit of a correlation or GFC, given the score of another realisation of the truth."""
    return limit if again is None or again >= limit else NEAR * again


def _by_spectrum(generated: Array, truth: Array) -> Numbers:
    short = min(len(generated), len(truth)) < SMOOTHED
    return {
        "level": level_ratio(generated, truth),
        "smoothed_gfc": None if short else smoothed_gfc(truth, generated),
        "felt_dB": None if short else felt_distance(truth, generated),
    }


def _excess(own: float | None, truth: float | None) -> float | None:
    return None if own is None or truth is None else own - truth
