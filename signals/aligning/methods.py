"""The ways to bring a stream onto a grid, each with its delay and what it may be wrong by."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from palpate.protocols.did_you_mean import nearest as closest
from palpate.signals.aligning.bandlimited import band, bandlimited
from palpate.signals.aligning.interpolating import cubic, hold, linear, nearest, pchip
from palpate.signals.aligning.refusals import AlignError
from palpate.signals.arrays import Array

Run = Callable[[Array, Array, Array, float, float], Array]
"""times (n,), values (n, channels), wanted times (m,), the stream's rate, the grid's rate -> (m, channels)."""
Reach = Callable[[float, float], float]


@dataclass(frozen=True)
class Method:
    """One way to align. T is the stream's step, x' and x'' the signal's derivatives.

    `delay_s` is how late the result is on average (0: zero-phase), `ahead_s` how much of the future it takes, at a
    stream's and a grid's rate. `bound` is its greatest error for a signal that the stream's rate can hold.
    """

    name: str
    description: str
    bound: str
    run: Run
    delay_s: Reach
    ahead_s: Reach
    filters: bool = False

    @property
    def causal(self) -> bool:
        """Return whether it takes nothing from the future, at any rate."""
        return self.ahead_s(1.0, 1.0) == 0.0


def _plain(run: Callable[[Array, Array, Array], Array]) -> Run:
    return lambda times_s, values, wanted_s, _rate_hz, _grid_hz: run(times_s, values, wanted_s)


def _steps(count: float) -> Reach:
    return lambda rate_hz, _grid_hz: count / rate_hz


def _band_reach(rate_hz: float, grid_hz: float) -> float:
    return band(rate_hz, grid_hz).reach / rate_hz


METHODS: dict[str, Method] = {
    each.name: each
    for each in (
        Method("hold", "the last sample", "max|x'| T", _plain(hold), _steps(0.5), _steps(0)),
        Method("nearest", "the sample closest in time", "max|x'| T / 2", _plain(nearest), _steps(0), _steps(0.5)),
        Method("linear", "straight lines", "max|x''| T^2 / 8", _plain(linear), _steps(0), _steps(1)),
        Method("pchip", "monotone cubics, no overshoot", "max|x''| T^2 / 8, at peaks; O(T^3) elsewhere", _plain(pchip),
               _steps(0), _steps(2)),
        Method("cubic", "cubic spline", "5/384 max|x''''| T^4", _plain(cubic), _steps(0), lambda *_: float("inf")),
        Method("bandlimited", "windowed sinc, 80 dB", "1e-4 of the signal in the pass band, away from edges",
               bandlimited, _steps(0), _band_reach, filters=True),
    )
}  # fmt: skip


def method_named(name: str) -> Method:
    """Return the method of that name. Raises AlignError that names the nearest known one."""
    if name not in METHODS:
        raise AlignError(f"there is no method {name!r}; {closest(name, METHODS)}")
    return METHODS[name]
