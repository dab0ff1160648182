"""The penalised least-squares problem of a mixed model, and its profiled deviance.

Everything that does not depend on the variances is rotated out once (Pinheiro & Bates 2000, section 2.2). Within a
block with random-effect columns Z = U S V', the rotation U splits every other column a (of the effects outside, of the
fixed effects, and y) into U'a, which sees the block's random effects through R = S V', and the rest a - U U'a, which
does not. The rest enters every block's sum of squares alike and is gathered in one triangle, free of the blocks'
offsets: differences before products.
The profiled deviance at given relative covariance factors is that of Bates, Mächler, Bolker & Walker 2015, section 3.
A term's relative covariance factor Lambda has the covariance of a level's effects as sigma^2 Lambda Lambda'. Blocks
are whitened by the triangle L with L L' = I + R Lambda Lambda' R', the rest is one penalised triangle. No matrix is
ever squared.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.analysis.mixed_models.design import Design, Random, triangle_of
from palpate.analysis.statistics.cells import Codes
from palpate.analysis.statistics.doubles import Floats

WIDEST = 20_000
CHUNK = 3_000_000  # doubles held at once
LOST = 1e-12  # a direction of Z with less than this share of the largest is rounding
NOTHING = 2.0**-1000  # stands for a residual of zero, which has no logarithm


@dataclass(frozen=True)
class Block:
    """A random term within the blocks: a level's slot in its block, and the first column of slot 0."""

    term: int
    slots: Codes
    count: int
    start: int


@dataclass(frozen=True)
class Layout:
    """The division of rows into blocks that share no random effect of `inside`; terms `outside` are eliminated later.

    A block's random effects have `width` columns (unused slots are columns of zeros).
    """

    codes: Codes
    blocks: int
    inside: tuple[Block, ...]
    outside: tuple[int, ...]
    width: int


@dataclass(frozen=True)
class Problem:
    """The outcome y, the fixed effects' design and the random terms.

    y is y + y_low without rounding, the outcome minus one of its values, divided by a power of two.
    """

    y: Floats
    y_low: Floats
    fixed: Design
    random: tuple[Random, ...]
    layout: Layout

    @property
    def columns(self) -> int:
        """The number of fixed effects."""
        return sum(self.fixed.widths)


def best_layout(random: Sequence[Random], fixed: int) -> Layout:
    """Return the cheapest layout: one factor's groups as blocks, with or without those nested in it."""
    options = [_layout(random, i, nested) for i in range(len(random)) for nested in (True, False)]

    def cost(layout: Layout) -> tuple[float, float]:
        late = sum(len(random[i].levels) * random[i].size for i in layout.outside) + fixed + 1
        early, blocks = float(layout.width), float(layout.blocks)
        return blocks * early**2 * (early + late) + (blocks * early + late) * float(late) ** 2, early

    return min(options, key=cost)


def _layout(random: Sequence[Random], outer: int, nested: bool) -> Layout:
    codes, blocks = random[outer].codes, len(random[outer].levels)
    inside = [Block(outer, np.zeros(blocks, dtype=np.intp), 1, 0)]
    width = random[outer].size
    for i, term in enumerate(random):
        if i == outer or not nested:
            continue
        home = np.zeros(len(term.levels), dtype=np.intp)  # each level's block
        home[term.codes] = codes
        if not bool((home[term.codes] == codes).all()):
            continue  # a level has rows in several blocks
        order = np.argsort(home, kind="stable")
        counts = np.bincount(home, minlength=blocks)
        starts = np.cumsum(counts) - counts
        slots = np.empty(len(home), dtype=np.intp)
        slots[order] = np.arange(len(home)) - starts[home[order]]
        inside.append(Block(i, slots, int(counts.max()), width))
        width += int(counts.max()) * term.size
    placed = {block.term for block in inside}
    return Layout(codes, blocks, tuple(inside), tuple(i for i in range(len(random)) if i not in placed), width)


@dataclass(frozen=True)
class Batch:
    """Blocks of one rank r: the different R (unique, r, width), how many blocks share each, and what R sees.

    `seen` has shape (rows, r, columns) and `which` says through which R; `members` are the blocks, for `seen` that is
    not compressed.
    """

    through: Floats
    shared: Codes
    seen: Floats
    which: Codes
    members: Codes


@dataclass(frozen=True)
class Reduced:
    """The batches, original and compressed, and the triangle of the columns that no block's random effects affect."""

    batches: tuple[Batch, ...]
    compressed: tuple[Batch, ...]
    corner: Floats


def reduce_problem(problem: Problem) -> Reduced:
    """Return the rotated problem; its columns are those outside, the fixed effects and y."""
    corner = np.zeros((0, _late(problem)))
    batches: dict[int, list[tuple[Floats, Floats, Codes]]] = {}
    for rows, members in _chunks(problem):
        # The blocks' random-effect columns, (blocks, rows, width).
        flat = rows.ravel()
        z = np.zeros((len(flat), problem.layout.width))
        for block in problem.layout.inside:
            term = problem.random[block.term]
            first = block.start + block.slots[term.codes[flat]] * term.size
            z[np.arange(len(flat))[:, None], first[:, None] + np.arange(term.size)] = term.design.columns(
                flat, len(flat)
            )
        through, seen, rest = _rotated(z.reshape(*rows.shape, -1), _others(problem, rows), problem.y_low[rows])
        batches.setdefault(through.shape[1], []).append((through, seen, members))
        corner = triangle_of(np.concatenate([corner, rest]))
    whole = []
    for rank in sorted(batches):
        through, seen, members = map(np.concatenate, zip(*batches[rank], strict=True))
        as_rows = through.reshape(len(through), -1)
        _, one, which, shared = np.unique(as_rows, axis=0, return_index=True, return_inverse=True, return_counts=True)
        whole.append(Batch(through[one], shared, seen, which.reshape(-1), members))
    return Reduced(tuple(whole), tuple(map(_compressed, whole)), corner)


def outside(problem: Problem) -> Iterator[tuple[Random, int]]:
    """Yield the terms outside the blocks and their first column."""
    start = 0
    for i in problem.layout.outside:
        yield problem.random[i], start
        start += len(problem.random[i].levels) * problem.random[i].size


def outside_width(problem: Problem) -> int:
    """Return the number of columns of the terms outside."""
    return sum(len(term.levels) * term.size for term, _ in outside(problem))


def _late(problem: Problem) -> int:
    return outside_width(problem) + problem.columns + 1


def _chunks(problem: Problem) -> Iterator[tuple[Codes, Codes]]:
    """Yield blocks of equal numbers of rows, a few at a time: their rows (blocks, rows of each) and indices."""
    codes = problem.layout.codes
    order, counts = np.argsort(codes, kind="stable"), np.bincount(codes, minlength=problem.layout.blocks)
    starts = np.cumsum(counts) - counts
    for size in np.unique(counts).tolist():
        blocks = np.flatnonzero(counts == size)
        step = max(1, CHUNK // (size * (_late(problem) + problem.layout.width)))
        for i in range(0, len(blocks), step):
            members = blocks[i : i + step]
            yield order[starts[members][:, None] + np.arange(size)], members


def _others(problem: Problem, rows: Codes) -> Floats:
    """Return all other columns, (blocks, rows, columns)."""
    flat = rows.ravel()
    late, width = _late(problem), outside_width(problem)
    a = np.zeros((len(flat), late))
    for term, start in outside(problem):
        first = start + term.codes[flat] * term.size
        a[np.arange(len(flat))[:, None], first[:, None] + np.arange(term.size)] = term.design.columns(flat, len(flat))
    a[:, width:-1] = problem.fixed.columns(flat, len(flat))
    a[:, -1] = problem.y[flat]
    return a.reshape(*rows.shape, -1)


def _rotated(z: Floats, a: Floats, y_low: Floats) -> tuple[Floats, Floats, Floats]:
    """Return R, U'a and the rows of a - U U'a.

    The first row of a block is subtracted first, so that offsets cost no digit.
    """
    # U (blocks, rows, r) and R = S V' (blocks, r, width); columns of U that Z does not span are zero.
    if z.shape[2] == 1:
        through = np.sqrt((z * z).sum(axis=1, keepdims=True))
        u = z / through
    else:
        u, s, v = np.linalg.svd(z, full_matrices=False)
        s = np.where(s > LOST * s[:, :1], s, 0.0)
        u, through = u * (s > 0)[:, None, :], s[:, :, None] * v
    pivot = a[:, :1].copy()
    a -= pivot  # lies in the span of the intercept, which every block has
    a[:, :, -1] += y_low - y_low[:, :1]
    pivot[:, :, -1] += y_low[:, :1]
    turned = u.transpose(0, 2, 1)
    seen = turned @ a
    rest = a - u @ seen
    rest -= u @ (turned @ rest)
    return through, seen + turned.sum(axis=2)[:, :, None] * pivot, rest.reshape(-1, a.shape[2])


def _compressed(batch: Batch) -> Batch:
    """Return fewer rows with the same sums of squares for every R, by rotating blocks that share one R together."""
    _, rank, columns = batch.seen.shape
    crowded = np.flatnonzero(batch.shared > rank * columns).tolist()
    if not crowded:
        return batch
    alone = ~np.isin(batch.which, crowded)
    seen, which = [batch.seen[alone]], [batch.which[alone]]
    for unique in crowded:
        rows = batch.seen[batch.which == unique].reshape(-1, rank * columns)
        seen.append(triangle_of(rows).reshape(-1, rank, columns))
        which.append(np.full(len(seen[-1]), unique, dtype=np.intp))
    return Batch(batch.through, batch.shared, np.concatenate(seen), np.concatenate(which), batch.members)


@dataclass(frozen=True)
class Solved:
    """The solution of the penalised least-squares problem at one point.

    `log_det` is log|L|^2 of the random effects, `triangle` the triangle of the columns outside, fixed and y, `rss` the
    penalised residual sum of squares.
    """

    log_det: float
    triangle: Floats
    width: int
    rss: float

    @property
    def fixed_triangle(self) -> Floats:
        """R_X, with X' V^-1 X = R_X' R_X / sigma^2."""
        return self.triangle[self.width : -1, self.width : -1]

    @property
    def coefficients(self) -> Floats:
        """The internal fixed effects."""
        return np.asarray(np.linalg.solve(self.fixed_triangle, self.triangle[self.width : -1, -1]))

    @property
    def log_det_fixed(self) -> float:
        """log|R_X|^2."""
        return 2 * float(np.log(np.abs(np.diag(self.fixed_triangle))).sum())

    def covariance(self) -> Floats:
        """Return (X' V^-1 X)^-1 / sigma^2."""
        inverse = np.linalg.inv(self.fixed_triangle)
        product: Floats = inverse @ inverse.T
        return product


def solve(problem: Problem, parts: Reduced, factors: Sequence[Floats]) -> Solved:
    """Solve the problem at these relative covariance factors, one per random term."""
    inside = block_factor(problem, factors)
    log_det, rows = 0.0, [parts.corner]
    for batch in parts.compressed:
        lower = whitening(batch, inside)
        log_det += 2 * float(batch.shared @ np.log(np.abs(np.diagonal(lower, axis1=1, axis2=2))).sum(axis=1))
        rows.append(whiten(lower[batch.which], batch.seen).reshape(-1, batch.seen.shape[2]))
    width = outside_width(problem)
    whole = np.concatenate(rows)
    if width:  # the columns outside times their factors, above the rows of their penalty
        scaled = np.zeros((len(whole) + width, whole.shape[1]))
        scaled[: len(whole), width:] = whole[:, width:]
        scaled[len(whole) :, :width] = np.eye(width)
        for i, (term, start) in zip(problem.layout.outside, outside(problem), strict=True):
            stop = start + len(term.levels) * term.size
            levels = whole[:, start:stop].reshape(-1, term.size) @ factors[i]
            scaled[: len(whole), start:stop] = levels.reshape(len(whole), -1)
        whole = scaled
    triangle = triangle_of(whole)
    log_det += 2 * float(np.log(np.abs(np.diag(triangle)[:width])).sum())
    return Solved(log_det, triangle, width, max(float(triangle[-1, -1] ** 2), NOTHING))


def block_factor(problem: Problem, factors: Sequence[Floats]) -> Floats:
    """Return the relative covariance factor of all random effects of a block, (width, width)."""
    whole = np.zeros((problem.layout.width,) * 2)
    for block in problem.layout.inside:
        factor = factors[block.term]
        for start in range(block.start, block.start + block.count * len(factor), len(factor)):
            whole[start : start + len(factor), start : start + len(factor)] = factor
    return whole


def whitening(batch: Batch, inside: Floats) -> Floats:
    """Return the triangles L of the different R of a batch, (unique, r, r)."""
    scaled = batch.through @ inside
    unique, rank, width = scaled.shape
    if rank == 1:
        lower: Floats = np.sqrt(1 + (scaled * scaled).sum(axis=2, keepdims=True))
        return lower
    stacked = np.zeros((unique, width + rank, rank))
    stacked[:, :width] = scaled.transpose(0, 2, 1)
    stacked[:, width:] = np.eye(rank)
    return triangle_of(stacked).transpose(0, 2, 1)


def whiten(lower: Floats, seen: Floats) -> Floats:
    """Return L^-1 times the seen columns, by forward substitution."""
    result = np.empty_like(seen)
    for i in range(seen.shape[1]):
        known = np.einsum("bj,bjc->bc", lower[:, i, :i], result[:, :i])
        result[:, i] = (seen[:, i] - known) / lower[:, i, i, None]
    return result


def deviance(problem: Problem, at: Solved, reml: bool) -> float:
    """Return minus twice the log likelihood (restricted where `reml`) at its best sigma, in internal coordinates."""
    degrees = degrees_of_freedom(problem, reml)
    extra = at.log_det_fixed if reml else 0.0
    return at.log_det + extra + degrees * (1 + math.log(2 * math.pi * at.rss / degrees))


def degrees_of_freedom(problem: Problem, reml: bool) -> int:
    """Return n, or n - p for the restricted likelihood."""
    return len(problem.y) - (problem.columns if reml else 0)
