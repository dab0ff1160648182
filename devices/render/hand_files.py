"""A recorded hand from a CSV: speed and force, or a stylus' places and pressures, at any rate."""

from __future__ import annotations

import csv
import math
from collections import Counter
from collections.abc import Mapping, Sequence
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
from palpate.protocols.wording import count, some
from palpate.signals.textures.sounds import RenderError

Array = NDArray[np.float64]
FELT = ("t_s", "speed_mm_s", "force_N")
LONGEST_S = 86_400.0


def read_hand(path: Path, shape: Shape | None = None) -> Scripted:
    """The hand that a CSV records, at 1 kHz from its first time on.

    Columns t_s, speed_mm_s, force_N: on straight lines between rows. Columns t_s, x_mm, y_mm, pressure: a stylus'
    reports, through the same causal filters and thresholds as a real one's (thesis 4.5.3).

    Raises:
        RenderError: a file that cannot be read, columns that are missing, times that do not rise, fewer than two rows,
            reports that no tablet gives.
        DeviceError: reports that are no numbers.
    """
    rows = _rows(path)
    heads = [name.strip() for name in rows[0]] if rows else []
    if not set(REPORTED) - set(heads):
        return _stroked(path, shape or Shape())
    if lacking := [name for name in FELT if name not in heads]:
        raise RenderError(
            f"{path}: the column {lacking[0]} is missing; {', '.join(FELT)} or {', '.join(REPORTED)} are expected, "
            f"found {some(sorted(heads)) or 'none'}."
        )
    return _felt(path, [dict(zip(heads, row, strict=False)) for row in rows[1:]])


def _rows(path: Path) -> list[list[str]]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            return [row for row in csv.reader(file) if row]
    except (OSError, UnicodeDecodeError, csv.Error) as problem:
        told = getattr(problem, "strerror", None) or "it is no table in UTF-8"
        raise RenderError(f"{path}: cannot be read as a hand's recording: {told}.") from None


def _felt(path: Path, rows: Sequence[Mapping[str, str]]) -> Scripted:
    try:
        columns = np.array([[float(row[name].strip() or "nan") for row in rows] for name in FELT])
    except (ValueError, KeyError) as problem:
        raise RenderError(f"{path}: a row does not hold three numbers ({problem}).") from None
    times = columns[0] if rows else np.zeros(0)
    _require_rising(path, times)
    at = times[0] + np.arange(math.floor((times[-1] - times[0]) * RATE_HZ + 1e-6) + 1) / RATE_HZ
    speed, force = (np.interp(at, times, column).tolist() for column in columns[1:])
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
