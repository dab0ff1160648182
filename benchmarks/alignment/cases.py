"""Figures of alignment: the error of each method on streams with a known truth, beside its time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.alignment.truth import GRID_HZ, KINDS, STARTS_S, Known
from palpate.protocols.bench import Case
from palpate.protocols.clocks import Clock, fit_clock, nominal_clock
from palpate.signals.aligning.aligned import align
from palpate.signals.aligning.methods import METHODS, Method
from palpate.signals.aligning.stamps import OF_THE_HOST, stamps_of
from palpate.signals.arrays import Array

AREA, CLOCKS_AREA = "alignment", "alignment, by the clock"
ERROR = "percent of the signal below 25 Hz, RMS"
CLOCK_ERROR = "RMS time error, us"
OURS = ("bandlimited", "cubic", "pchip", "linear", "nearest", "hold")

Clocked = Callable[[Known], Clock]


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of clocks from arrivals, then of streams onto 1 kHz: 60 s each, 10 s if `quick`."""
    seconds, repeats = (10.0, 3) if quick else (60.0, 5)
    streams = [Known(kind, seconds) for kind in KINDS]
    for known in streams:
        yield from _clock_cases(known, repeats)
    for known in streams:
        yield from _clocked_cases(known, repeats)
    for known in streams:
        yield from _method_cases(known, repeats)


def figures(out: Path, quick: bool) -> list[Path]:
    """Draw the error of every method against the frequency, as a PNG in `out`."""
    from benchmarks.alignment.error_plot import save_error_plot

    return [save_error_plot(out / "alignment-error-by-frequency.png", 12 if quick else 40)]


def _clock_cases(known: Known, repeats: int) -> Iterator[Case]:
    for name, fit in CLOCKS.items():
        yield Case(
            CLOCKS_AREA, "a clock from arrivals", name, known.kind.name, len(known.arrivals), CLOCK_ERROR,
            partial(fit, known), partial(_time_error_us, known), repeats,
        )  # fmt: skip


def _method_cases(known: Known, repeats: int) -> Iterator[Case]:
    ways: dict[str, Callable[[], Array]] = {
        f"palpate, {name}": partial(_onto_grid, known, METHODS[name], _fitted) for name in OURS
    }
    yield from _onto_cases(AREA, f"{known.kind.name} onto 1 kHz", known, ways, repeats)


def _clocked_cases(known: Known, repeats: int) -> Iterator[Case]:
    band = METHODS["bandlimited"]
    clocked = {name: partial(_onto_grid, known, band, fit) for name, fit in {**CLOCKS, **LATE}.items()}
    clocked["linear, arrivals as times"] = partial(_by_arrivals, known)
    yield from _onto_cases(CLOCKS_AREA, f"bandlimited, {known.kind.name} onto 1 kHz", known, clocked, repeats)


def _onto_cases(
    area: str, case: str, known: Known, ways: Mapping[str, Callable[[], Array]], repeats: int
) -> Iterator[Case]:
    input_name = f"{known.seconds:g} s, {known.kind.drift_ppm:+g} ppm"
    for name, run in ways.items():
        yield Case(area, case, name, input_name, len(known.times_s), ERROR, run, known.percent_wrong, repeats)


def _onto_grid(known: Known, method: Method, clocked: Clocked) -> Array:
    clock = clocked(known)
    times_s = clock.t0_s + np.arange(len(known.times_s)) / clock.rate_hz
    aligned = align(times_s, known.values, known.grid_s, method, rate_hz=clock.rate_hz, grid_hz=GRID_HZ)
    return aligned.values[:, 0]


def _by_arrivals(known: Known) -> Array:
    """Return the values of a program that stamps blocks on arrival and spreads the samples between the stamps."""
    last, arrived = np.array(known.arrivals).T
    arrived = np.maximum.accumulate(arrived + 1e-9 * np.arange(len(arrived)))
    times_s = np.interp(np.arange(len(known.times_s)), last, arrived)
    return np.interp(known.grid_s, times_s, known.values[:, 0])


def _fitted(known: Known) -> Clock:
    return fit_clock(known.arrivals, known.kind.rate_hz)


def _late_by_1_ms(known: Known) -> Clock:
    """Return a clock whose arrivals are all a further millisecond late, which no arrival can reveal."""
    return fit_clock([(n, arrived + 1e-3) for n, arrived in known.arrivals], known.kind.rate_hz)


def _by_stamps(known: Known) -> Clock:
    """Return the clock of the same arrivals for a device that stamps its samples: the line through the stamps."""
    late = _late_by_1_ms(known)
    arrivals = zip(known.arrivals, known.stamps_s.tolist(), strict=True)
    stamped = [(n, arrived + 1e-3, at) for (n, arrived), at in arrivals]
    return stamps_of(stamped, known.kind.rate_hz, OF_THE_HOST[0], late).line or late


def _nominal(known: Known) -> Clock:
    return nominal_clock(known.kind.rate_hz, *known.arrivals[0])


def _least_squares(known: Known) -> Clock:
    n, arrived = np.array(known.arrivals).T
    slope, offset = np.polyfit(n, arrived, 1)
    return Clock(float(offset), float(1 / slope), known.kind.rate_hz, measured=True)


CLOCKS: dict[str, Clocked] = {
    "palpate, line under arrivals": _fitted,
    "least squares": _least_squares,
    "nominal rate, first arrival": _nominal,
}

LATE: dict[str, Clocked] = {"1 ms untold": _late_by_1_ms, "1 ms untold, by its stamps": _by_stamps}


def _time_error_us(known: Known, clock: Clock) -> float:
    numbers = np.arange(len(known.times_s))
    error_s = clock.t0_s + numbers / clock.rate_hz - (STARTS_S + numbers / known.true_hz)
    return float(1e6 * np.sqrt(np.mean(error_s**2)))
