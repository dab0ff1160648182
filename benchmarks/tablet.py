"""Error and time of the conversion of a stylus' reports to 1 kHz."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

from benchmarks.tablet_errors import Sample, Stroke, convert_reports, errors
from palpate.devices.tablet.pipeline import Shape, Upsampling
from palpate.protocols.bench import Case

METHODS: tuple[Upsampling, ...] = ("hold", "line")
REPORTS_HZ = (60.0, 133.0, 240.0)
STROKE = Stroke()
ErrorOf = Callable[[Sequence[Sample]], float]
MEASURES: tuple[tuple[str, str, ErrorOf], ...] = (
    ("stylus speed", "RMS mm/s", lambda out: errors(out, 1, STROKE.speed_mm_s).now),
    ("stylus speed, delay off", "RMS mm/s", lambda out: errors(out, 1, STROKE.speed_mm_s).left),
    ("stylus force", "RMS N", lambda out: errors(out, 2, STROKE.pressed_N).now),
    ("stylus force, delay off", "RMS N", lambda out: errors(out, 2, STROKE.pressed_N).left),
)


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of a held and an interpolated signal at common report rates, with and without the delay."""
    seconds = 6.0 if quick else 31.0
    for case, error_kind, error in MEASURES:
        for report_hz in REPORTS_HZ:
            for method in METHODS:
                yield _case(case, error_kind, error, Shape(report_hz=report_hz, upsampling=method), seconds)


def _case(case: str, error_kind: str, error: ErrorOf, shape: Shape, seconds: float) -> Case:
    reports = STROKE.reports(shape, seconds)
    input_name = f"{shape.report_hz:g} Hz"
    ticks = round(seconds * shape.rate_hz)
    run = partial(convert_reports, shape, reports, seconds)
    return Case("tablet", case, shape.upsampling, input_name, ticks, error_kind, run, error, 3)
