"""Agreement of participants on the words that they tick for a stimulus."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.analysis.adjectives.selections import Selections
from palpate.analysis.reliability.intraclass import demand_confidence
from palpate.analysis.reliability.kappa import fleiss_kappa
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.draws import demand_draws, generator, percentile, refuse_without_draws, weights
from palpate.analysis.statistics.refusals import StatisticsError, TooFew

Ticks: TypeAlias = NDArray[np.bool_]
ALL = "all words"


@dataclass(frozen=True)
class WordAgreement:
    """Agreement by word (`words`, its last row all words together) and by stimulus (`stimuli`).

    `jaccard` is the mean over stimuli of the mean overlap of two participants' sets of words. Intervals draw stimuli,
    those of `stimuli` participants, with replacement. NaN where undefined, and `note` says why.
    """

    words: pd.DataFrame
    stimuli: pd.DataFrame
    jaccard: float
    jaccard_low: float
    jaccard_high: float
    note: str


def word_agreement(
    selections: Selections, *, draws: int = 2000, seed: int = 0, confidence: float = 0.95
) -> WordAgreement:
    """Return the agreement on words: Krippendorff's nominal alpha, Fleiss' kappa of ticked or not, Jaccard's overlap.

    A word counts as ticked by a participant who ticked it for the stimulus in any trial. Kappa needs the same number
    of participants for every stimulus, alpha does not. Raises TooFew where no stimulus was presented to two people.
    """
    demand_draws(draws)
    demand_confidence(confidence)
    refuse_without_draws(draws, seed=(seed, 0), confidence=(confidence, 0.95))
    if not ((selections.presented > 0).sum(axis=0) >= 2).any() or not selections.words:
        raise TooFew("no stimulus was presented to two participants with words to tick: there is nothing to agree on")
    rng = generator(seed, "word_agreement")
    blocks = list(weights(rng, len(selections.stimuli), draws)) if len(selections.stimuli) > 1 else []
    drawn = np.concatenate(blocks) if blocks else np.empty((0, len(selections.stimuli)))
    stimuli = pd.DataFrame(_by_stimulus(selections, draws, rng, confidence))
    overlaps = stimuli["jaccard"].to_numpy()
    there = ~np.isnan(overlaps)
    weight = drawn[:, there]
    total = weight.sum(axis=1)
    overlap_means: Floats = np.divide(weight @ overlaps[there], total, out=np.full(len(drawn), np.nan), where=total > 0)
    low, high = percentile(overlap_means, confidence)
    known = overlaps[~np.isnan(overlaps)]
    mean = math.fsum(known.tolist()) / len(known) if len(known) else math.nan
    note = "" if len(known) else "overlap is undefined: no two participants ticked a word for one stimulus"
    words = pd.DataFrame(_by_word(selections, drawn, confidence))
    return WordAgreement(words, stimuli, mean, low, high, note)


def _by_word(selections: Selections, drawn: Floats, confidence: float) -> Iterator[dict[str, object]]:
    """Yield alpha of each word over the stimuli, then of all words: each stimulus and word together is one unit."""
    raters = (selections.presented > 0).sum(axis=0)
    paired = raters >= 2
    ticks = selections.any_ticked.sum(axis=0)[paired]
    m = raters[paired].astype(np.float64)[:, None]
    of_word = _alphas(ticks, m, np.ones((1, len(m))))[0]
    all_words = _alphas(ticks, m, np.ones((1, len(m))), together=True)[0]
    weights_of_pairs = drawn[:, paired]
    bounds = [percentile(column, confidence) for column in _alphas(ticks, m, weights_of_pairs).T]
    bounds += [percentile(column, confidence) for column in _alphas(ticks, m, weights_of_pairs, together=True).T]
    names, alphas = [*selections.words, ALL], [*of_word.tolist(), *all_words.tolist()]
    for i, (word, alpha, (low, high)) in enumerate(zip(names, alphas, bounds, strict=True)):
        own = ticks[:, [i]] if i < len(selections.words) else ticks.reshape(-1, 1)
        raters_of = m if i < len(selections.words) else np.repeat(m, ticks.shape[1], axis=0)
        kappa, notes = math.nan, []
        if math.isnan(alpha):
            notes.append("undefined: everyone ticked it everywhere, or nobody anywhere")
        elif len(m) < 2:
            notes.append("no interval: it needs two stimuli or more")
        elif math.isnan(low):
            notes.append("no interval: most draws are undefined, or no draws were requested")
        try:
            kappa = fleiss_kappa(np.concatenate((own, raters_of - own), axis=1)).kappa
        except StatisticsError:
            notes.append("kappa is undefined: stimuli differ in participants")
        yield {
            **{"word": word, "share_ticked": float(own.sum() / raters_of.sum()), "alpha": alpha},
            **{"ci_low": low, "ci_high": high, "kappa": kappa, "stimuli": len(m)},
            "note": "; ".join(notes),
        }


def _alphas(ticks: Floats, m: Floats, w: Floats, together: bool = False) -> Floats:
    """Return Krippendorff's nominal alpha of ticks (stimuli, words) by m raters, for weights (draws, stimuli)."""
    apart = w @ (2 * ticks * (m - ticks) / (m - 1))
    yes, n = w @ ticks, w @ np.broadcast_to(m, ticks.shape)
    if together:
        apart, yes, n = (part.sum(axis=1, keepdims=True) for part in (apart, yes, n))
    chance = 2 * yes * (n - yes)
    alphas: Floats = 1 - np.divide((n - 1) * apart, chance, out=np.full_like(chance, np.nan), where=chance > 0)
    return alphas


def _by_stimulus(
    selections: Selections, draws: int, rng: np.random.Generator, confidence: float
) -> Iterator[dict[str, object]]:
    for i, stimulus in enumerate(selections.stimuli):
        there = selections.presented[:, i] > 0
        overlap = jaccard_matrix(selections.any_ticked[there, i] > 0)
        n, value = len(overlap), mean_overlap(overlap, np.ones((1, len(overlap))))[0]
        blocks = [mean_overlap(overlap, w) for w in weights(rng, n, draws)] if n > 1 and draws else []
        low, high = percentile(np.concatenate(blocks) if blocks else np.empty(0), confidence)
        ticked = selections.any_ticked[there, i].sum(axis=1)
        empty, pairs = int(np.isnan(overlap[np.triu_indices(n, 1)]).sum()), n * (n - 1) // 2
        note = f"{empty} of {pairs} pairs ticked nothing, both of them, and have no overlap" if empty else ""
        yield {
            **{"stimulus": stimulus, "participants": n},
            "words_per_participant": float(ticked.mean()) if n else math.nan,
            **{"jaccard": float(value), "ci_low": low, "ci_high": high},
            "note": note if n > 1 else "overlap needs two participants or more",
        }


def jaccard_matrix(ticked: Ticks) -> Floats:
    """Return the overlap of every two sets (participants, words), NaN where both are empty."""
    sets = ticked.astype(np.float64)
    common, size = sets @ sets.T, sets.sum(axis=1)
    either = size[:, None] + size[None, :] - common
    overlap: Floats = np.divide(common, either, out=np.full_like(common, np.nan), where=either > 0)
    return overlap


def mean_overlap(overlap: Floats, w: Floats) -> Floats:
    """Return the mean over pairs of different participants, for weights (draws, participants).

    NaN where no pair has one.
    """
    defined = ~np.isnan(overlap)
    np.fill_diagonal(defined, False)
    pairs = ((w @ defined) * w).sum(axis=1)
    total = ((w @ np.where(defined, overlap, 0)) * w).sum(axis=1)
    means: Floats = np.divide(total, pairs, out=np.full(len(w), np.nan), where=pairs > 0)
    return means
