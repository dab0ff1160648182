"""Principal components of a table of objects by attributes, how many to keep, and the precision of their shares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.spaces.matrices import Matrix, centred, frame_of, in_units, matrix_of, signs, varies
from palpate.analysis.spaces.profiles import Profiles
from palpate.analysis.spaces.resampling import resample
from palpate.analysis.statistics.doubles import Floats, rescaled, scaled
from palpate.analysis.statistics.draws import check_draws, check_share, p_of_draws, stream
from palpate.analysis.statistics.refusals import BadOption, BadValue, TooFew, listed, shown

Kind: TypeAlias = Literal["covariance", "correlation"]
EQUAL = 1e-8
Reference: TypeAlias = Literal["normal", "permuted"]
BATCH = 200


@dataclass(frozen=True)
class Components:
    """Principal components in descending order, as many as the table has dimensions (`PC1`, `PC2`, ...).

    `scores` (objects x components) are in units of the data (covariance) or of standard deviations (correlation),
    `directions` (attributes x components) are unit vectors, `loadings` are the correlations of the attributes with the
    components (NaN for a constant attribute), `variances` divide by n - 1, `shares` are of the total.
    """

    scores: pd.DataFrame
    directions: pd.DataFrame
    loadings: pd.DataFrame
    variances: tuple[float, ...]
    shares: tuple[float, ...]
    kind: Kind
    notes: tuple[str, ...] = ()


def pca(table: pd.DataFrame, kind: Kind = "covariance") -> Components:
    """Return the principal components of a wide table (objects x attributes), by SVD of centred data.

    The largest coefficient of each direction is positive (of equal ones the first in label order), which makes the
    result unique if the variances differ; a note says where they do not. Raises BadOption, BadValue (no variation; a
    constant attribute under "correlation"), TooFew, UnknownColumn. Source: Jolliffe 2002, 2nd ed., 3.5 and 2.3.
    """
    matrix = matrix_of(table)
    small, exponent = prepare(matrix, kind)
    left, size, right = np.linalg.svd(small, full_matrices=False)
    rank = int((size > size[0] * max(small.shape) * np.finfo(float).eps).sum())
    turn = signs(right[:rank].T)
    directions = right[:rank].T * turn
    scores = left[:, :rank] * size[:rank] * turn
    names = [f"PC{i + 1}" for i in range(rank)]
    spread = np.sqrt((small * small).sum(axis=0))
    variances = size[:rank] ** 2 / (len(small) - 1)
    unit = rescaled(1.0, exponent)
    weighted = directions * size[:rank]
    with np.errstate(invalid="ignore"):
        result: Floats = weighted / np.where(spread > 0, spread, np.nan)[:, None]
    equal = np.flatnonzero(variances[:-1] - variances[1:] <= EQUAL * variances[:-1]).tolist()
    notes = tuple(
        f"PC{i + 1} and PC{i + 2} have equal variances: their plane is determined, their directions in it are not"
        for i in equal
    )
    return Components(
        frame_of(scores * unit, matrix.rows, names),
        frame_of(directions, matrix.columns, names),
        frame_of(np.clip(result, -1, 1), matrix.columns, names),
        tuple(in_units(variances, exponent).tolist()),
        tuple((size[:rank] ** 2 / (size * size).sum()).tolist()),
        kind,
        notes,
    )


def prepare(matrix: Matrix, kind: Kind) -> tuple[Floats, int]:
    """Return centred columns divided by a power of two (and its exponent), with unit variance under "correlation"."""
    if not isinstance(kind, str) or kind not in ("covariance", "correlation"):
        raise BadOption(f"kind={shown(kind)} is unknown: 'covariance' or 'correlation'")
    rows, columns = matrix.values.shape
    if rows < 2 or columns < 2:
        raise TooFew(f"{rows} objects and {columns} attributes; components need two or more of both")
    varied = varies(matrix.values)
    if not varied.any():
        raise BadValue("no attribute differs between the objects: there are no components")
    constant = [repr(matrix.columns[i]) for i in np.flatnonzero(~varied.astype(bool)).tolist()]
    if constant and kind == "correlation":
        raise BadValue(
            f"the same value for every object: {listed(constant, len(constant))}; a constant has no correlation; "
            "leave it out or use kind='covariance'"
        )
    about = centred(matrix.values) * varied
    if kind == "covariance":
        return scaled(about)
    small = about / np.abs(about).max(axis=0)
    return small / np.sqrt((small * small).sum(axis=0) / (rows - 1)), 0


@dataclass(frozen=True)
class Parallel:
    """The result: `table` (component, variance, reference_mean, reference_quantile, p, kept), and the number `kept`."""

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
    """Return which components' variance exceeds that of unrelated attributes: Horn's parallel analysis.

    "normal" draws independent normal attributes with the data's standard deviations, "permuted" shuffles each attribute
    over the objects. A component is kept while it and all before it exceed the quantile. Raises as `pca` does. Sources:
    Horn 1965; Glorfeld 1995 (quantile); Buja & Eyuboglu 1992 (permutation).
    """
    check_draws(draws)
    check_share(quantile, "quantile")
    if reference not in ("normal", "permuted"):
        raise BadOption(f"reference={shown(reference)} is unknown: 'normal' or 'permuted'")
    small, exponent = prepare(matrix_of(table), kind)
    observed = _variances(small[None], kind)[0]
    rng = stream(seed, f"parallel analysis {reference}")
    parts = [min(BATCH, draws - done) for done in range(0, draws, BATCH)]
    simulated = []
    for size in parts:
        shape = (size, *small.shape)
        if reference == "permuted":
            unrelated: Floats = rng.permuted(np.broadcast_to(small, shape), axis=1)
        else:
            unrelated = rng.standard_normal(shape) * np.sqrt((small * small).sum(axis=0) / (len(small) - 1))
        simulated.append(_variances(unrelated, kind))
    random = np.concatenate(simulated)
    level = np.quantile(random, quantile, axis=0)
    exceeding = observed > level * (1 + 1e-12)
    retained = len(observed) if exceeding.all() else int(np.argmin(exceeding))
    rows = pd.DataFrame(
        {
            "component": [f"PC{i + 1}" for i in range(len(observed))],
            "variance": in_units(observed, exponent),
            "reference_mean": in_units(random.mean(axis=0), exponent),
            "reference_quantile": in_units(level, exponent),
            "p": [p_of_draws(int(n), draws) for n in (random >= observed * (1 - 1e-12)).sum(axis=0)],
            "kept": np.arange(len(observed)) < retained,
        }
    )
    return Parallel(rows, retained)


def _variances(tables: Floats, kind: Kind) -> Floats:
    """Return the components' variances of each table of a stack, at most (objects - 1) of them."""
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
    """Return percentile intervals of each component's share of the variance, over participants drawn with replacement.

    Columns: component, share, ci_low, ci_high. Means of few participants are noisier than the true ones, so the first
    share's interval may not contain its estimate: it shows the spread, not a bias. Raises TooFew for one participant,
    IncompleteCells where resamples leave cells empty. Source: Efron & Tibshirani 1993, 7.2 and 13.3.
    """
    check_draws(draws)
    check_share(confidence, "confidence")
    means = Matrix(profiles.small_means(), profiles.stimuli, profiles.attributes)
    observed = _shares(_variances(prepare(means, kind)[0][None], kind))[0]
    counts = resample(profiles.ratings, draws, stream(seed, "bootstrap of shares"))
    shape = (-1, len(profiles.stimuli), len(profiles.attributes))
    shares = np.concatenate(
        [
            _shares(_variances(profiles.ratings.means(counts[start : start + BATCH]).reshape(shape), kind))
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
