"""Error and time of the conversion of a stylus' reports to 1 kHz."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from benchmarks.tablet_errors import Felt, Stroke, errors, felt
from palpate.devices.tablet.pipeline import Shape, Upsampling
from palpate.protocols.bench import Case

METHODS: tuple[Upsampling, ...] = ("hold", "line")
REPORTS_HZ = (60.0, 133.0, 240.0)
STROKE = Stroke()
Judge = Callable[[Sequence[Felt]], float]
JUDGES: tuple[tuple[str, str, Judge], ...] = (
    ("stylus speed", "RMS mm/s", lambda out: errors(out, 1, STROKE.speed_mm_s).now),
    ("stylus speed, delay off", "RMS mm/s", lambda out: errors(out, 1, STROKE.speed_mm_s).left),
    ("stylus force", "RMS N", lambda out: errors(out, 2, STROKE.pressed_N).now),
    ("stylus force, delay off", "RMS N", lambda out: errors(out, 2, STROKE.pressed_N).left),
)


def cases(quick: bool) -> Iterator[Case]:
    """Yield held and on a line, at common tablets' report rates: the error at once, and with the delay removed."""
    seconds = 6.0 if quick else 31.0
    for case, error_kind, error in JUDGES:
        for report_hz in REPORTS_HZ:
            for method in METHODS:
                yield _case(case, error_kind, error, Shape(report_hz=report_hz, upsampling=method), seconds)


def _case(case: str, error_kind: str, error: Judge, shape: Shape, seconds: float) -> Case:
    reports = STROKE.reports(shape, seconds)
    told = f"{shape.report_hz:g} Hz"
    ticks = round(seconds * shape.rate_hz)
    upsampling = shape.upsampling
    return Case("tablet", case, upsampling, told, ticks, error_kind, lambda: felt(shape, reports, seconds), error, 3)
