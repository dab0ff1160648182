"""A recorded hand from a CSV: speed and force, or a stylus' places and pressures, at any rate."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.devices.render.hands import RATE_HZ, Scripted
from palpate.devices.signals import DeviceFault
from palpate.devices.tablet.pipeline import Shape, Stylus
from palpate.devices.tablet.recorded import COLUMNS as REPORTED
from palpate.devices.tablet.recorded import read_reports
from palpate.devices.tablet.reports import REFUSED, Guard, Report
from palpate.protocols.tables import Mistake, Table, TableFormat, read_table
from palpate.protocols.wording import count, some
from palpate.signals.textures.sounds import RenderError

Array = NDArray[np.float64]
FELT = ("t_s", "speed_mm_s", "force_N")
LONGEST_S = 86_400.0


def _unreadable(wrong: Mistake) -> str:
    why = getattr(wrong.problem, "strerror", None) or "it is no table in UTF-8"
    return f"{wrong.path}: cannot be read as a hand's recording: {why}."


RECORDING = TableFormat(
    error=RenderError,
    strip=True,
    blank_above=True,
    unreadable=_unreadable,
    encoding=_unreadable,
    quoting=_unreadable,
    missing=lambda wrong: (
        f"{wrong.path}: the column {wrong.column} is missing; {', '.join(FELT)} or {', '.join(REPORTED)} are expected, "
        f"found {some(sorted(wrong.header)) or 'none'}."
    ),
    short=lambda wrong: f"{wrong.path}: a row does not hold three numbers ({wrong.column!r}).",
    number=lambda wrong: f"{wrong.path}: a row does not hold three numbers ({wrong.problem}).",
)


def read_hand(path: Path, shape: Shape | None = None) -> Scripted:
    """The hand that a CSV records, at 1 kHz from its first time on.

    Columns t_s, speed_mm_s, force_N: on straight lines between rows. Columns t_s, x_mm, y_mm, pressure: a stylus'
    reports, through the same causal filters and thresholds as a real one's (thesis 4.5.3).

    Raises:
        RenderError: a file that cannot be read, columns that are missing, times that do not rise, fewer than two rows,
            reports that no tablet gives.
        DeviceError: reports that are no numbers.
    """
    table = read_table(path, (), RECORDING)
    if not set(REPORTED) - set(table.header):
        return _stroked(path, shape or Shape())
    table.demand(FELT)
    return _felt(table)


def _felt(table: Table) -> Scripted:
    times, *felt = map(np.asarray, table.numbers(FELT, gaps=True, finite=False).values())
    _require_rising(table.path, times)
    at = times[0] + np.arange(math.floor((times[-1] - times[0]) * RATE_HZ + 1e-6) + 1) / RATE_HZ
    speed, force = (np.interp(at, times, column).tolist() for column in felt)
    return Scripted(speed, force)


def _require_rising(path: Path, times: Array) -> None:
    if len(times) < 2:
        raise RenderError(f"{path}: {count(len(times), 'row')}; two at least are expected.")
    if not np.isfinite(times).all() or (backwards := np.flatnonzero(np.diff(times) <= 0)).size:
        row = int(np.flatnonzero(~np.isfinite(times))[0]) if not np.isfinite(times).all() else int(backwards[0]) + 1
        raise RenderError(f"{path}, line {row + 2}: t_s is {times[row]:g}; seconds that rise are expected.")
    if times[-1] - times[0] > LONGEST_S:
        raise RenderError(f"{path}: {times[-1] - times[0]:g} s; a day at most. Is t_s in seconds?")


def _stroked(path: Path, shape: Shape) -> Scripted:
    reports = read_reports(path)
    begun, ended = reports[0].t_s, max(each.t_s for each in reports if math.isfinite(each.t_s))
    if not ended - begun <= LONGEST_S:
        raise RenderError(f"{path}: {ended - begun:g} s; a day at most. Is t_s in seconds?")
    felt, refused = _filtered(reports, begun, ended, shape)
    if refused:
        del refused["clock_reset"]
        why, count = refused.most_common(1)[0]
        told = f"{REFUSED[why][1]}, in {count} of {len(reports)} rows"
        raise RenderError(f"{path}: {told}. Mend these rows or leave them out.")
    return Scripted([speed for speed, _ in felt], [force for _, force in felt])


def _filtered(
    reports: Sequence[Report], begun: float, ended: float, shape: Shape
) -> tuple[list[tuple[float, float]], Counter[str]]:
    """Speed and force at every millisecond, and how many reports were not believed, by why."""
    judge, stylus = Guard("hand", aligned=True), Stylus(shape)
    waiting = [each._replace(t_s=each.t_s - begun) for each in reversed(reports)]
    felt = []
    for sample in range(int((ended - begun) * RATE_HZ) + 1):
        t_s = sample / RATE_HZ
        while waiting and not waiting[-1].t_s > t_s:
            with suppress(DeviceFault):  # it counts them
                if (judged := judge.judge(waiting.pop(), t_s)) is not None:
                    stylus.report(judged)
        felt.append(stylus.step(t_s))
    return felt, judge.refused
