"""Figures of the library's search: its ranks against an exhaustive search by numerical integration."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from palpate.modeling.library.entries import Entry, Library, Predicted, Rated, belief, value_of
from palpate.modeling.library.search import Match, Near, find, near, wishes_of
from palpate.modeling.library.terms import Soft
from palpate.modeling.library.wishes import Wish, combined
from palpate.protocols.bench import Case
from palpate.signals.arrays import Array

AREA = "library"
PAIRS = (("Rough", "Smooth"), ("Flat", "Bumpy"), ("Sticky", "Slippery"), ("Hard", "Soft"))
WISHES = ("rough, a bit sticky, not bumpy", "neither hard nor soft, very smooth", "bumpy, soft 60-80")
FIRST = 10
NODES = 48
"""Number of Gauss-Legendre nodes between two knots, which is exact to rounding for these smooth pieces."""
FAR_SD = 9.0
SEED = 23


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of libraries of 50, 500 and 5,000 textures (`quick`: 50 and 500), a third only predicted."""
    for count in (50, 500) if quick else (50, 500, 5_000):
        library = random_library(count)
        wishes = [wishes_of(library, [text]) for text in WISHES]
        input_name = f"{count} textures, {len(WISHES)} wishes"
        exact = [exhaustive(library.textures, wish) for wish in wishes]
        methods = {"palpate": partial(search_all, library.textures, wishes),
                   "means taken for sure": partial(search_all, without_uncertainty(library), wishes)}  # fmt: skip
        for case, kind, error in (
            ("library: find", "share of the first ten missed", partial(share_missed, exact)),
            ("library: find, fits", "fit, at most; numerical integration", partial(fit_error, exact)),
        ):
            for method, run in methods.items():
                yield Case(AREA, case, method, input_name, count, kind, run, error, 3)
        yield Case(AREA, "library: nearest", "palpate", f"{count} textures", count, "share of the first ten missed",
                   partial(near, library.textures[0], library.textures, len(PAIRS)),
                   partial(share_of_nearest_missed, library), 3)  # fmt: skip


def random_library(count: int) -> Library:
    """Return textures anywhere on the scales, each rated (SE 1 to 5) or only predicted (90 % within 10 to 35)."""
    chance = np.random.Generator(np.random.PCG64(SEED))
    return Library(attributes=PAIRS, textures=tuple(_entry(f"T{n:05d}", n % 3 == 0, chance) for n in range(count)))


def _entry(name: str, only_predicted: bool, chance: np.random.Generator) -> Entry:
    mean = tuple(float(value) for value in chance.uniform(0, 100, len(PAIRS)))
    if only_predicted:
        half = chance.uniform(10, 35, len(PAIRS))
        low, high = (tuple(float(m + way * h) for m, h in zip(mean, half, strict=True)) for way in (-1, 1))
        return Entry(id=name, label=name, category="made up", predicted=Predicted(value=mean, low=low, high=high))
    se = tuple(float(value) for value in chance.uniform(1, 5, len(PAIRS)))
    sd = tuple(4 * value for value in se)
    return Entry(id=name, label=name, category="made up", rated=Rated(mean=mean, sd=sd, se=se, raters=16))


def without_uncertainty(library: Library) -> tuple[Entry, ...]:
    """Return the same textures as if their values were known exactly."""
    nothing = (0.0,) * len(PAIRS)
    return tuple(
        Entry(id=entry.id, label=entry.label, category=entry.category,
              rated=Rated(mean=_means(entry), sd=nothing, se=nothing, raters=16))
        for entry in library.textures
    )  # fmt: skip


def _means(entry: Entry) -> tuple[float, ...]:
    return tuple(belief(value_of(entry, at))[0] for at in range(len(PAIRS)))


def search_all(entries: Sequence[Entry], wishes: Sequence[tuple[Wish, ...]]) -> list[list[Match]]:
    """Return all textures in the order of `find`, for each wish."""
    return [find(entries, wish) for wish in wishes]


def exhaustive(entries: Sequence[Entry], wishes: Sequence[Wish]) -> dict[str, float]:
    """Return the fit of every texture: membership times the normal density, integrated between knots."""
    rule = np.polynomial.legendre.leggauss(NODES)
    fits = {}
    for entry in entries:
        beliefs = [(soft, *belief(value_of(entry, pair))) for pair, soft in combined(wishes)]
        fits[entry.id] = math.prod(_integral(rule, soft, mean, sd) for soft, mean, sd in beliefs)
    return fits


def _integral(rule: tuple[Array, Array], soft: Soft, mean: float, sd: float) -> float:
    places, shares = zip(*soft.knots, strict=True)
    low, high = mean - FAR_SD * sd, mean + FAR_SD * sd
    cuts = np.array([low, *(place for place in places if low < place < high), high])
    # Pieces of two SDs at most, or the nodes do not follow the density.
    cuts = np.unique(np.concatenate([cuts, np.arange(low, high, 2 * sd)]))
    half = np.diff(cuts)[:, None] / 2
    values = cuts[:-1, None] + half * (1 + rule[0])
    density = np.exp(-(((values - mean) / sd) ** 2) / 2) / (sd * math.sqrt(2 * math.pi))
    return float(np.sum(np.interp(values, places, shares) * density * half * rule[1]))


def share_missed(exact: Sequence[dict[str, float]], results: Sequence[Sequence[Match]]) -> float:
    """Return the share of the exact best ten that are not among the first ten; fits equal to 0.001 are ties."""
    lost = 0
    for fits, order in zip(exact, results, strict=True):
        tenth = sorted(fits.values(), reverse=True)[FIRST - 1]
        lost += sum(fits[match.entry.id] < tenth - 1e-3 for match in order[:FIRST])
    return lost / (FIRST * len(results))


def fit_error(exact: Sequence[dict[str, float]], results: Sequence[Sequence[Match]]) -> float:
    """Return the largest difference of a fit from numerical integration."""
    return max(
        abs(match.fit - fits[match.entry.id])
        for fits, order in zip(exact, results, strict=True)
        for match in order
    )  # fmt: skip


def share_of_nearest_missed(library: Library, neighbours: Sequence[Near]) -> float:
    """Return the share of the ten nearest by plain distance of all means that are not among the first ten results."""
    table = np.array([_means(entry) for entry in library.textures])
    apart = np.sqrt(((table - table[0]) ** 2).mean(axis=1))
    nearest = [library.textures[at].id for at in np.argsort(apart, kind="stable")[1 : FIRST + 1]]
    return len(set(nearest) - {entry.entry.id for entry in neighbours[:FIRST]}) / FIRST
