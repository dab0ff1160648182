"""Numbers of tracks under the model that the study declares for QUEST+."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.analysis.choices.declared_model import DeclaredModel, model_lapse_excess, model_posterior
from palpate.analysis.choices.evidence import EXCESS, RATIO
from palpate.analysis.ratings.collected_choices import no_model_in_common
from palpate.analysis.ratings.dataset import DataRefused
from palpate.protocols.procedures import QuestPlus, values_of

if TYPE_CHECKING:
    import pandas as pd

    from palpate.analysis.choices.declared_model import ModelPosterior
    from palpate.analysis.plans.answers import Selected
    from palpate.analysis.plans.families.choices import PsychometricFunction
    from palpate.analysis.ratings.collected_choices import TrackDesign
    from palpate.analysis.statistics.doubles import Floats

LAPSE_REMEDY = "the levels were chosen by that model, so measure again with higher rates in its `lapse`"
DECLARED, LEVELS = "declared model", "levels presented"
"""The priors of a posterior, as a result's column `prior` names them."""


def declared_model(
    selected: Selected, settings: PsychometricFunction, design: TrackDesign, used: pd.DataFrame
) -> DeclaredModel | None:
    """Return the model that decides the posterior of these choices; None where the prior follows from the levels.

    Raises DataRefused where the plan asks for the declared model and the study has none for these choices.
    """
    if design.procedure != "questplus" or settings.prior == "levels" or settings.interval not in (None, "posterior"):
        return None
    names = sorted(set(used["track"].astype(str)))
    tracks = [selected.tracks.get(name) for name in names]
    chance = None if design.alternatives is None else 1 / design.alternatives
    models = [
        DeclaredModel(track.procedure.model, track.levels, track.procedure.easier == "lower", chance)  # type: ignore[arg-type]
        for track in tracks
        if track is not None and isinstance(track.procedure, QuestPlus) and len(track.procedure.grids) == 1
    ]
    if len(models) == len(names) and all(model == models[0] for model in models):
        return models[0]
    if settings.prior is not None:
        raise DataRefused(no_model_in_common(names))
    return None


def threshold_share(settings: PsychometricFunction, declared: DeclaredModel | None) -> float:
    """Return F at the threshold: the plan's, if it names one; else of a declared model its own."""
    return settings.threshold if declared is None or "threshold" in settings.model_fields_set else declared.share


def track_posterior(declared: DeclaredModel, used: pd.DataFrame) -> ModelPosterior:
    """Return the posterior of one track's choices. Raises NoEstimate."""
    return model_posterior(declared, *_answers(used))


def _answers(used: pd.DataFrame) -> tuple[Floats, Floats]:
    """Return the levels and hits (0 or 1) of the trials in order."""
    return used["level"].to_numpy(dtype=np.float64), used["hit"].to_numpy(dtype=np.float64)


def lapse_notes(excess: float, most: float, remedy: str) -> list[str]:
    """Return a note where the likelihood ratio `excess` shows lapse rates above `most`, the highest of the model."""
    if excess < EXCESS:
        return []
    return [f"more lapses than the model allows (up to {most:g}): the threshold, or its bound, is biased; {remedy}"]


def declared_numbers(
    settings: PsychometricFunction, posterior: ModelPosterior, with_easy: pd.DataFrame
) -> tuple[dict[str, Any], list[str]]:
    """Return the numbers of a row and its notes.

    `with_easy`: the choices with the catch trials at the easiest level, which are looked at for lapses in any case.
    """
    declared = posterior.declared
    at = threshold_share(settings, declared)
    estimate = posterior.estimate(at, settings.confidence)
    numbers: dict[str, Any] = {"likelihood_ratio": math.exp(min(posterior.ratio, 690.0)), "prior": DECLARED}
    notes = []
    guesses = posterior.ratio < math.log(RATIO)
    if guesses and posterior.share not in (0.0, 1.0):
        flat = "a constant share" if posterior.flat is None else f"guessing (a share of {posterior.flat:.3g})"
        notes.append(
            f"there is no threshold: the answers are no better explained by a function of the level than by {flat}; "
            f"the likelihood ratio is {math.exp(posterior.ratio):.2g}, {RATIO:g} is demanded"
        )
    if not guesses:
        excess, most = model_lapse_excess(declared, *_answers(with_easy)), max(values_of(declared.model.lapse))
        notes += lapse_notes(excess, most, LAPSE_REMEDY)
    notes += _unused(settings, declared)
    if estimate.outside is not None:
        if estimate.bound is not None:
            notes.insert(0, f"the threshold is {estimate.outside} {estimate.bound:.4g}, {estimate.sure:.0%} sure")
        sure = None if estimate.bound is None else estimate.sure
        return numbers | {"outside": estimate.outside, "bound": estimate.bound, "sure": sure}, notes
    low, high = estimate.interval or (None, None)
    jnd = posterior.jnd(settings.jnd, settings.confidence)
    return numbers | {
        "threshold": estimate.threshold, "threshold_low": low, "threshold_high": high, "threshold_sd": estimate.sd,
        "threshold_at": at, "jnd": jnd[0], "jnd_low": jnd[1], "jnd_high": jnd[2], "guess": posterior.mean("guess"),
        "lapse": posterior.mean("lapse"),
    }, notes  # fmt: skip


def _unused(settings: PsychometricFunction, declared: DeclaredModel) -> list[str]:
    """Return notes on settings of the plan that differ from the declared model, which they do not change."""
    given, model = settings.model_fields_set, declared.model
    shape, scale = settings.function.removesuffix("_db"), settings.function == "weibull_db" or (
        settings.function == "weibull" and settings.level_unit == "db"
    )  # fmt: skip
    other = []
    if "function" in given and (shape != model.shape or (shape == "weibull" and scale != (model.scale == "db"))):
        other.append(f"`function: {settings.function}`")
    if "lapse" in given and settings.lapse is not None:
        low, high = settings.lapse if isinstance(settings.lapse, tuple) else (settings.lapse, settings.lapse)
        rates = values_of(model.lapse)
        if (low, high) != (min(rates), max(rates)):
            other.append("`lapse`")
    return [f"the declared model decides, not the plan's {' and '.join(other)}"] if other else []
