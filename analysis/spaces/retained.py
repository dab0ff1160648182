"""How many components to keep, and how sure their shares are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd
from numpy.random import Generator

from palpate.analysis.spaces.components import Kind, prepared
from palpate.analysis.spaces.draws import check_draws, check_share, p_of_draws, stream
from palpate.analysis.spaces.matrices import Matrix, in_units, matrix_of
from palpate.analysis.spaces.profiles import Profiles
from palpate.analysis.spaces.resampling import resampled
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadOption, shown

Reference: TypeAlias = Literal["normal", "permuted"]
BATCH = 200


@dataclass(frozen=True)
class Parallel:
    """`table`: component, variance, reference_mean, reference_quantile, p, kept; `kept` counts the leading ones."""

    table: pd.DataFrame
    kept: int


def parallel_analysis(
    table: pd.DataFrame,
    kind: Kind = "correlation",
    reference: Reference = "normal",
    draws: int = 1000,
    quantile: float = 0.95,
    seed: int = 0,
) -> Parallel:
    """Components whose variance exceeds that of unrelated attributes: Horn's parallel analysis.

    "normal" draws independent normal attributes with the data's standard deviations, "permuted" shuffles each attribute
    over the objects. A component is kept while it and all before it exceed the quantile.
    Raises what `pca` raises. Sources: Horn 1965; Glorfeld 1995 (quantile); Buja & Eyuboglu 1992 (permutation).
    """
    check_draws(draws)
    check_share(quantile, "quantile")
    if reference not in ("normal", "permuted"):
        raise BadOption(f"reference={shown(reference)} is unknown: 'normal' or 'permuted'")
    small, exponent = prepared(matrix_of(table), kind)
    observed = _variances(small[None], kind)[0]
    rng = stream(seed, f"parallel analysis {reference}")
    parts = [min(BATCH, draws - done) for done in range(0, draws, BATCH)]
    random = np.concatenate([_variances(_unrelated(small, size, reference, rng), kind) for size in parts])
    level = np.quantile(random, quantile, axis=0)
    exceeding = observed > level * (1 + 1e-12)
    kept = len(observed) if exceeding.all() else int(np.argmin(exceeding))
    rows = pd.DataFrame(
        {
            "component": [f"PC{i + 1}" for i in range(len(observed))],
            "variance": in_units(observed, exponent),
            "reference_mean": in_units(random.mean(axis=0), exponent),
            "reference_quantile": in_units(level, exponent),
            "p": [p_of_draws(int(n), draws) for n in (random >= observed * (1 - 1e-12)).sum(axis=0)],
            "kept": np.arange(len(observed)) < kept,
        }
    )
    return Parallel(rows, kept)


def _unrelated(small: Floats, size: int, reference: Reference, rng: Generator) -> Floats:
    shape = (size, *small.shape)
    if reference == "permuted":
        return rng.permuted(np.broadcast_to(small, shape), axis=1)
    drawn: Floats = rng.standard_normal(shape) * np.sqrt((small * small).sum(axis=0) / (len(small) - 1))
    return drawn


def _variances(tables: Floats, kind: Kind) -> Floats:
    """The components' variances of each table of a stack, at most (objects - 1) of them."""
    about = tables - tables.mean(axis=1, keepdims=True)
    freedom = tables.shape[1] - 1
    if kind == "correlation":
        spread = np.sqrt((about * about).sum(axis=1, keepdims=True) / freedom)
        about = np.divide(about, spread, out=np.zeros_like(about), where=spread > 0)
    sizes = np.linalg.svd(about, compute_uv=False)
    result: Floats = sizes[:, : min(freedom, tables.shape[2])] ** 2 / freedom
    return result


def share_intervals(
    profiles: Profiles, kind: Kind = "covariance", draws: int = 2000, confidence: float = 0.95, seed: int = 0
) -> pd.DataFrame:
    """Percentile intervals of each component's share of the variance, over participants drawn with replacement.

    Columns: component, share, ci_low, ci_high. Means of few participants are noisier than their truth, so the first
    share's interval may lie off its estimate: it tells the spread, not a bias.
    Raises TooFew for one participant, IncompleteCells where resamples leave cells empty.
    Source: Efron & Tibshirani 1993, 7.2 and 13.3.
    """
    check_draws(draws)
    check_share(confidence, "confidence")
    means = Matrix(profiles.small_means(), profiles.stimuli, profiles.attributes)
    observed = _shares(_variances(prepared(means, kind)[0][None], kind))[0]
    counts = resampled(profiles.given, draws, stream(seed, "bootstrap of shares"))
    shape = (-1, len(profiles.stimuli), len(profiles.attributes))
    shares = np.concatenate(
        [
            _shares(_variances(profiles.given.means(counts[start : start + BATCH]).reshape(shape), kind))
            for start in range(0, draws, BATCH)
        ]
    )
    low, high = np.quantile(shares, [(1 - confidence) / 2, (1 + confidence) / 2], axis=0)
    names = [f"PC{i + 1}" for i in range(len(observed))]
    return pd.DataFrame({"component": names, "share": observed, "ci_low": low, "ci_high": high})


def _shares(variances: Floats) -> Floats:
    total = variances.sum(axis=1, keepdims=True)
    result: Floats = np.divide(variances, total, out=np.zeros_like(variances), where=total > 0)
    return result
