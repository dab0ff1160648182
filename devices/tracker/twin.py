"""A simulated tracker: it sees the marker of a scene, with noise, and loses it at times."""

from __future__ import annotations

import hashlib
import math
import random
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import chain
from typing import TYPE_CHECKING

from palpate.devices.device import DeviceFault, NowNs
from palpate.devices.noise import gaussians
from palpate.devices.source import Elapsed, TimedSource
from palpate.devices.tracker.samples import Batch, MarkerSample, Opened, awaited

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

REST_MM = (120.0, 80.0, 400.0)
"""Position of a marker without a scene."""
NOISY = 64
"""Number of samples whose noise is computed at a time."""
MOST = 64
"""Greatest number of samples of one pull."""
SHORTEST_S = 1e-3


@dataclass
class Twin(TimedSource):
    """A simulated tracker; its samples depend on the seed and the scene only, so an act repeats exactly."""

    name: str
    rate_hz: float
    noise_mm: float
    occlusions_per_s: float
    occlusion_s: float
    hides: str
    drift_ppm: float
    seed: int
    silent_after_s: float | None
    clock: str = "tracker"
    scene: Scene | None = None
    rows: Iterator[MarkerSample] = field(default_factory=lambda: iter(()))
    given: int = 0

    def open(self) -> Opened:
        """Return the declared rate; there is nothing to connect to."""
        return Opened(self.rate_hz, {"twin": f"noise {self.noise_mm:g} mm, seed {self.seed}"})

    def expect(self, scene: Scene | None) -> None:
        """Set the scene that is seen from the next start on."""
        self.scene = scene

    def start(self, elapsed_s: Elapsed) -> None:
        """Begin with the scene's first sample."""
        self.given, self.rows = 0, self._rows()
        super().start(elapsed_s)

    def zero_s(self, now_ns: NowNs) -> float:  # noqa: ARG002
        """Return 0 as this source's clock, which begins with its first sample."""
        return 0.0

    def pull(self, timeout_s: float) -> Batch:
        """Return the samples due by now, at most 64.

        Raises DeviceFault (`silent`) past `silent_after_s`, as a drill.
        """
        return awaited(self._take, self.stopped, timeout_s, 0.25 / self.rate_hz)

    def _take(self) -> Batch:
        elapsed_s = self.elapsed_s
        if elapsed_s is None:
            return Batch()
        now_s, silent, first = elapsed_s(), self.silent_after_s, self.given
        if silent is not None and now_s > silent:
            raise DeviceFault(self.name, "silent", f"{self.name}: silent after {silent:g} s, as its drill asks.")
        due = math.floor(now_s * self._true_hz + 1) - first
        rows = [next(self.rows) for _ in range(min(due, MOST))]
        self.given += len(rows)
        return Batch([number / self.rate_hz for number in range(first, self.given)], rows)

    @property
    def _true_hz(self) -> float:
        """Return the samples per second of true time: the twin's own clock is fast by `drift_ppm`."""
        return self.rate_hz * (1 + 1e-6 * self.drift_ppm)

    def _rows(self) -> Iterator[MarkerSample]:
        """Yield rows endlessly. The noise is keyed by the first piece of the scene, not by the number of starts."""
        key = "rest"
        truth: Iterator[tuple[float, float, float]] = iter(lambda: REST_MM, None)
        if self.scene is not None:
            pieces = self.scene.position_mm(self._true_hz)
            first = next(pieces)
            key = hashlib.sha256(first.astype("<f8").tobytes()).hexdigest()
            truth = ((x, y, z) for piece in chain([first], pieces) for x, y, z in piece.tolist())
        hidden = self._hidden(random.Random(f"{self.seed}/{self.name}/{key}"))
        before = REST_MM
        for place, noise in zip(truth, self._noise(key), strict=False):
            seen = (place[0] + noise[0], place[1] + noise[1], place[2] + noise[2])
            if next(hidden):
                if self.hides == "frozen":
                    yield (*before, True)
                else:
                    yield (0.0, 0.0, 0.0, True) if self.hides == "zeros" else (math.nan, math.nan, math.nan, False)
            else:
                before = seen
                yield (*seen, True)

    def _noise(self, key: str) -> Iterator[tuple[float, float, float]]:
        number = 0
        while True:
            drawn = gaussians(3 * NOISY, "tracker", self.seed, self.name, key, number)
            scaled = [self.noise_mm * value for value in drawn]
            yield from zip(scaled[::3], scaled[1::3], scaled[2::3], strict=True)
            number += 1

    def _hidden(self, chance: random.Random) -> Iterator[bool]:
        """Yield whether the marker is hidden, in runs of exponentially distributed lengths."""
        while True:
            for hidden, per_s in ((False, self.occlusions_per_s), (True, 1 / self.occlusion_s)):
                for_s = chance.expovariate(per_s) if per_s > 0 else math.inf
                if math.isinf(for_s):
                    yield from iter(lambda: False, None)
                yield from (hidden for _ in range(round(max(for_s, SHORTEST_S * hidden) * self.rate_hz)))
