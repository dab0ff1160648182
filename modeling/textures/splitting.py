"""The split of a recording into three parts that share its speeds and forces (thesis 4.6, its reference [90]).

Parts of a recording that differ in speed and force test extrapolation, not the model. So `split` minimises the energy
distance (Szekely and Rizzo 2013) between each part's speeds and forces and the whole recording's.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.textures.recording import Parts, Recording, TextureDataError, pieces_of
from palpate.signals.arrays import Array

Labels = NDArray[np.int64]

FRAMES = 20
SHARES = (0.7, 0.2, 0.1)
NAMES = ("train", "validation", "test")
WINDOW = 30
"""The longest window that is compared; frames are long enough for it."""
LEAST_WINDOWS = 5
"""The least length of a frame in windows: the windows across its start are lost."""
SAMPLED = 25
"""Number of a frame's samples that represent its speeds and forces."""
STARTS = 12
"""Random assignments that the search starts from, beside one that spreads each part over time."""
TOLERATED = 0.015
"""The deviation of shares above which a note names it."""
SAME = 1e-12
"""A gain below this is rounding."""


@dataclass(frozen=True)
class Fit:
    """The similarity of parts: the energy distance of each to the whole in SDs of speed and force, at least 0."""

    frames: int
    shares: tuple[float, float, float]
    distance: tuple[float, float, float]


def split(
    recording: Recording, frames: int = FRAMES, shares: Sequence[float] = SHARES, seed: int = 0, window: int = WINDOW
) -> Parts:
    """Return training, validation and test parts of a recording that share speed-force regions.

    `frames` of equal length, none across a border of a joined recording; fewer where one would be shorter than five
    windows (`frames_of`, `split_notes`). Each part has its share of the frames, at least one. The same recording,
    shares and seed give the same parts. Raises TextureDataError where there are not three such frames.
    """
    cut = frames_of(recording, frames, window)
    counts = _frame_counts(len(cut), shares)
    # the best assignment that swaps of two frames reach from several starts
    apart = _frame_distances(recording, cut)
    chance = np.random.Generator(np.random.PCG64(seed))
    starts = [_spread(counts), *(chance.permutation(_spread(counts)) for _ in range(STARTS))]
    candidates = [_swap_frames(apart, start) for start in starts]
    labels = min(candidates, key=lambda labels: sum(_distances(apart, labels)))
    return Parts(*(tuple(cut[place] for place in np.flatnonzero(labels == part)) for part in range(len(NAMES))))


def frames_of(recording: Recording, frames: int = FRAMES, window: int = WINDOW) -> tuple[tuple[int, int], ...]:
    """Return the frames [start, stop) that `split` assigns, in order. Raises TextureDataError for fewer than three."""
    if frames < len(NAMES) or window < 1:
        raise TextureDataError(f"{frames} frames for windows of {window} samples: at least 3 and 1 are expected")
    least = LEAST_WINDOWS * window
    whole = sum(stop - start for start, stop in pieces_of(recording))
    for number in (frames, *((frames // 2,) if frames >= 2 * len(NAMES) else ()), *range(frames // 2 - 1, 2, -1)):
        length = whole // number
        result = tuple(_frames_within(recording, number, length))
        if length >= least and len(result) >= len(NAMES):
            return result
    raise TextureDataError(
        f"{recording.texture}: {recording.seconds:.3g} s do not hold three frames of {least} samples, five windows of "
        f"{window} each; record longer, or choose a shorter window"
    )


def split_notes(recording: Recording, parts: Parts, frames: int = FRAMES) -> tuple[str, ...]:
    """Return notes on the parts: fewer frames than requested, shares that whole frames cannot reach."""
    fit = fit_of(recording, parts)
    notes = [f"{fit.frames} frames instead of {frames}: the recording is short"] if fit.frames < frames else []
    if any(abs(reached - share) > TOLERATED for reached, share in zip(fit.shares, SHARES, strict=True)):
        notes.append("parts of {:.0%} / {:.0%} / {:.0%}: whole frames give no nearer ones".format(*fit.shares))
    return tuple(notes)


def fit_of(recording: Recording, parts: Parts) -> Fit:
    """Return the sizes of the parts, and the similarity of their speeds and forces."""
    every = (parts.train, parts.validation, parts.test)
    cut = tuple(sorted(stretch for part in every for stretch in part))
    where = {stretch: number for number, part in enumerate(every) for stretch in part}
    labels = np.array([where[stretch] for stretch in cut])
    distance = _distances(_frame_distances(recording, cut), labels)
    sizes = [sum(stop - start for start, stop in part) for part in every]
    train, validation, test = (size / sum(sizes) for size in sizes)
    return Fit(len(cut), (train, validation, test), (distance[0], distance[1], distance[2]))


def _frames_within(recording: Recording, frames: int, length: int) -> Iterator[tuple[int, int]]:
    """Yield frames of at least that length within each piece of the recording, as equal as possible."""
    pieces = pieces_of(recording)
    for start, stop in pieces:
        count = frames if len(pieces) == 1 else (stop - start) // max(1, length)
        borders = [start + (stop - start) * number // count for number in range(count + 1)] if count else []
        yield from pairwise(borders)


def _frame_counts(frames: int, shares: Sequence[float]) -> tuple[int, ...]:
    """Return the number of frames of each part, by its share (largest remainder), at least one."""
    if len(shares) != len(NAMES) or min(shares) <= 0 or abs(sum(shares) - 1) > 1e-9:
        raise TextureDataError(f"shares {tuple(shares)}: three above 0 that sum to 1 are expected")
    exact = [share * frames for share in shares]
    counts = [max(1, int(share + 1e-9)) for share in exact]
    while sum(counts) != frames:
        way = 1 if sum(counts) < frames else -1
        gains = [way * (want - have) if have + way >= 1 else -np.inf for want, have in zip(exact, counts, strict=True)]
        counts[int(np.argmax(gains))] += way
    return tuple(counts)


def _frame_distances(recording: Recording, cut: Sequence[tuple[int, int]]) -> Array:
    """Return the mean distance (frames, frames) between speeds and forces of two frames, in SDs."""
    hand = recording.signals[1:]
    first = hand[:, :1]
    sd = (hand - first).std(axis=1)
    scaled = (hand - first) / np.where(sd > 0, sd, 1.0)[:, None]
    points = [scaled[:, np.linspace(start, stop - 1, SAMPLED).astype(int)].T for start, stop in cut]
    result = np.empty((len(cut), len(cut)))
    for row, one in enumerate(points):
        for column in range(row, len(points)):
            apart = np.linalg.norm(one[:, None] - points[column][None], axis=2).mean()
            result[row, column] = result[column, row] = apart
    return result


def _distances(apart: Array, labels: Labels) -> list[float]:
    """Return the energy distance of each part to the whole: 2 E|X-Y| - E|X-X'| - E|Y-Y'|, the square of a metric."""
    whole = np.full(len(labels), 1 / len(labels))
    off = [(labels == part) / max(1, (labels == part).sum()) - whole for part in range(len(NAMES))]
    return [float(max(0.0, -difference @ apart @ difference)) for difference in off]


def _spread(counts: Sequence[int]) -> Labels:
    """Return an assignment that spreads each part evenly over time."""
    places = [((number + 0.5) / count, part) for part, count in enumerate(counts) for number in range(count)]
    return np.array([part for _, part in sorted(places)], dtype=np.int64)


def _swap_frames(apart: Array, labels: Labels) -> Labels:
    """Swap the two frames that reduce the distance most, until none do."""
    while True:
        # gain (frames, frames): by how much the sum of the distances falls when two frames change places
        sizes = np.bincount(labels, minlength=len(NAMES)).astype(float)
        off = [(labels == part) / size - 1 / len(labels) for part, size in enumerate(sizes)]
        pull = np.stack([difference @ apart for difference in off])[labels] / sizes[labels][:, None]
        own = np.diag(apart)
        bend = (own[:, None] + own[None] - 2 * apart) / (sizes**2)[labels][:, None]
        leaves = 2 * (pull - np.diag(pull)[:, None]) + bend  # frame `row` makes room in its part for `column`
        gain = np.where(labels[:, None] == labels[None], 0.0, leaves + leaves.T)
        one, other = np.unravel_index(int(np.argmax(gain)), gain.shape)
        if gain[one, other] <= SAME:
            return labels
        labels = labels.copy()
        labels[[one, other]] = labels[[other, one]]
