"""Everything of the least-squares problem that does not depend on the variances, rotated out once.

Within a block with random-effect columns Z = U S V', the rotation U splits every other column a (of the effects
outside, of the fixed effects, and y) into U'a, which sees the block's random effects through R = S V', and the rest
a - U U'a, which does not. The rest enters every block's sum of squares alike and is gathered in one triangle, free of
the blocks' offsets: differences before products. Pinheiro & Bates 2000, section 2.2.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from palpate.analysis.mixed_models.grouping import Random
from palpate.analysis.mixed_models.linear import triangle_of
from palpate.analysis.mixed_models.problem import Problem
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.labels import Codes

CHUNK = 3_000_000  # doubles held at once
LOST = 1e-12  # a direction of Z with less than this share of the largest is rounding


@dataclass(frozen=True)
class Batch:
    """Blocks of one rank r: R (unique, r, width), how many blocks share each, and what is seen through R.

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
    """The batches, as they are and compressed, and the triangle of what sees no block's random effects."""

    batches: tuple[Batch, ...]
    compressed: tuple[Batch, ...]
    corner: Floats


def reduced(problem: Problem) -> Reduced:
    """Rotate a problem; columns are those outside, the fixed ones and y."""
    corner = np.zeros((0, _late(problem)))
    found: dict[int, list[tuple[Floats, Floats, Codes]]] = {}
    for rows, members in _chunks(problem):
        through, seen, rest = _rotated(_inside(problem, rows), _others(problem, rows), problem.y_low[rows])
        found.setdefault(through.shape[1], []).append((through, seen, members))
        corner = triangle_of(np.concatenate([corner, rest]))
    whole = tuple(_batch(*map(np.concatenate, zip(*found[rank], strict=True))) for rank in sorted(found))
    return Reduced(whole, tuple(map(_compressed, whole)), corner)


def outside(problem: Problem) -> Iterator[tuple[Random, int]]:
    """The terms outside the blocks and their first column."""
    start = 0
    for i in problem.layout.outside:
        yield problem.random[i], start
        start += len(problem.random[i].levels) * problem.random[i].size


def outside_width(problem: Problem) -> int:
    """The number of columns of the terms outside."""
    return sum(len(term.levels) * term.size for term, _ in outside(problem))


def _late(problem: Problem) -> int:
    return outside_width(problem) + problem.columns + 1


def _chunks(problem: Problem) -> Iterator[tuple[Codes, Codes]]:
    """Blocks of the same number of rows, a few at a time: their rows (blocks, rows of each) and who they are."""
    codes = problem.layout.codes
    order, counts = np.argsort(codes, kind="stable"), np.bincount(codes, minlength=problem.layout.blocks)
    starts = np.cumsum(counts) - counts
    for size in np.unique(counts).tolist():
        blocks = np.flatnonzero(counts == size)
        step = max(1, CHUNK // (size * (_late(problem) + problem.layout.width)))
        for i in range(0, len(blocks), step):
            members = blocks[i : i + step]
            yield order[starts[members][:, None] + np.arange(size)], members


def _inside(problem: Problem, rows: Codes) -> Floats:
    """The blocks' random-effect columns, (blocks, rows, width)."""
    flat = rows.ravel()
    z = np.zeros((len(flat), problem.layout.width))
    for block in problem.layout.inside:
        term = problem.random[block.term]
        first = block.start + block.slots[term.codes[flat]] * term.size
        z[np.arange(len(flat))[:, None], first[:, None] + np.arange(term.size)] = term.design.columns(flat, len(flat))
    return z.reshape(*rows.shape, -1)


def _others(problem: Problem, rows: Codes) -> Floats:
    """All other columns, (blocks, rows, columns)."""
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
    """R, U'a and the rows of a - U U'a; the first row of a block is taken off first, so that offsets cost no digit."""
    u, through = _factored(z)
    pivot = a[:, :1].copy()
    a -= pivot  # lies in the span of the intercept, which every block has
    a[:, :, -1] += y_low - y_low[:, :1]
    pivot[:, :, -1] += y_low[:, :1]
    turned = u.transpose(0, 2, 1)
    seen = turned @ a
    rest = a - u @ seen
    rest -= u @ (turned @ rest)
    return through, seen + turned.sum(axis=2)[:, :, None] * pivot, rest.reshape(-1, a.shape[2])


def _factored(z: Floats) -> tuple[Floats, Floats]:
    """U (blocks, rows, r) and R = S V' (blocks, r, width); columns of U that Z does not span are zero."""
    if z.shape[2] == 1:
        norms = np.sqrt((z * z).sum(axis=1, keepdims=True))
        return z / norms, norms
    u, s, v = np.linalg.svd(z, full_matrices=False)
    s = np.where(s > LOST * s[:, :1], s, 0.0)
    return u * (s > 0)[:, None, :], s[:, :, None] * v


def _batch(through: Floats, seen: Floats, members: Codes) -> Batch:
    flat = through.reshape(len(through), -1)
    _, first, which, shared = np.unique(flat, axis=0, return_index=True, return_inverse=True, return_counts=True)
    return Batch(through[first], shared, seen, which.reshape(-1), members)


def _compressed(batch: Batch) -> Batch:
    """Fewer rows with the same sums of squares for every R: blocks that share one are rotated among themselves."""
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
