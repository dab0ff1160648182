"""Play a texture without a window: as fast as possible, or paced at 1 kHz."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.devices.render.hand_simulated import simulated_hand
from palpate.devices.render.hands import RATE_HZ, Scripted, read_hand
from palpate.devices.render.job import Job
from palpate.devices.render.loop import Deadlines
from palpate.devices.render.opened import describe_voice
from palpate.devices.render.process import Rendering
from palpate.protocols.files import open_bytes
from palpate.protocols.wording import count
from palpate.signals.arrays import Array
from palpate.signals.textures.sounds import RenderError, Sounds
from palpate.signals.textures.voice import opened_voice

SIMULATED = "simulated"
OVERTIME_S = 30.0
OUT = (".csv", ".npz")
WORDS = {
    "held": "impossible sensor values: the last good ones were used",
    "restarts": "times the model left its bounds and was restarted",
    "quiet": "steps at under 1 % of the texture's level",
    "muted": "steps of silence, since the model would not stay within its bounds",
}
TOLD_S = 0.001
"""Shorter times, in seconds, are not reported."""


@dataclass(frozen=True)
class Played:
    """Signals (3, n) at 1 kHz, acceleration in m/s^2, speed in mm/s and force in N, and the record of the timing."""

    signals: Array
    record: Mapping[str, Any]


def hand_of(given: str, seconds: float | None, seed: int) -> Scripted:
    """Return a simulated hand, or one from a file, cut to `seconds`. Raises RenderError, DeviceError."""
    if given == SIMULATED:
        return simulated_hand(10.0 if seconds is None else seconds, seed)
    hand = read_hand(Path(given))
    if seconds is None:
        return hand
    if not 0 < seconds <= hand.seconds:
        raise RenderError(f"{given} holds {hand.seconds:g} s; {seconds:g} s of it cannot be played.")
    count = round(seconds * RATE_HZ)
    return Scripted(hand.speed_mm_s[:count], hand.force_N[:count])


def at_once(sounds: Sounds, hand: Scripted, now_ns: Callable[[], int] = time.perf_counter_ns) -> Played:
    """Play as fast as possible; `record` holds the steps' durations (`took`), against 1000 us.

    Raises as `open_voice`.
    """
    voice = opened_voice(sounds)
    samples, took = np.empty(len(hand)), Deadlines()
    for sample in range(len(hand)):
        started_ns = now_ns()
        samples[sample] = voice.step(*hand.at(sample))
        took.note(now_ns() - started_ns)
    signals = np.vstack([samples, np.asarray(hand.speed_mm_s, np.float64), np.asarray(hand.force_N, np.float64)])
    return Played(signals, {"paced": False, "took": took.record(), "voice": describe_voice(voice)})


def paced(job: Job, hand: Scripted) -> Played:
    """Play at 1 kHz, in a process of its own, into the rig's actuator or a twin.

    Raises RenderError, also if this process was delayed so long that the trace was overwritten.
    """
    with Rendering(job) as running:
        kept, first = [], 0
        until_s = time.monotonic() + hand.seconds + OVERTIME_S
        while running.running and time.monotonic() < until_s:
            time.sleep(0.25)
            first, part = running.trace.since(first)
            kept.append(part)
        record = running.wait(OVERTIME_S)
        kept.append(running.trace.since(first)[1])
    signals = np.hstack(kept)
    if lost := record["made"] - signals.shape[1]:
        raise RenderError(
            f"{count(lost, 'sample')} played and not recorded, since this process was held up: play them again."
        )
    return Played(signals[:, : len(hand)], {"paced": True, **record})


def job_for(sounds: Sounds, hand: Scripted, rig: Path | None, ahead: int, real_time: bool) -> Job:
    """Return the job that plays a whole hand."""
    return Job(sounds, hand, rig, ahead, real_time, hand.seconds)


def require_out(path: Path) -> None:
    """Raise RenderError unless the path is a CSV or npz file in an existing folder."""
    if path.suffix not in OUT:
        raise RenderError(f"{path}: what is played is written as {' or '.join(OUT)}.")
    if not path.parent.is_dir():
        raise RenderError(f"{path}: there is no folder {path.parent}.")


def write(path: Path, played: Played) -> None:
    """Write the signals, as a table (t_s, acceleration_m_s2, speed_mm_s, force_N) or as arrays of these names."""
    times = np.arange(played.signals.shape[1]) / RATE_HZ
    names = ("t_s", "acceleration_m_s2", "speed_mm_s", "force_N")
    with open_bytes(path) as file:
        if path.suffix == ".npz":
            np.savez(file, **dict(zip(names, (times, *played.signals), strict=True)))
            return
        rows, form = np.column_stack([times, *played.signals]), ("%.3f", "%.9g", "%.6g", "%.6g")
        np.savetxt(file, rows, delimiter=",", header=",".join(names), comments="", fmt=form)


def level_m_s2(signals: Array) -> float:
    """Return the RMS of the samples with sound."""
    heard = signals[0][signals[0] != 0.0]
    return float(np.sqrt(np.mean(heard**2))) if heard.size else 0.0


def in_words(record: Mapping[str, Any], seconds: float, level_m_s2: float) -> Iterator[str]:
    """Yield the record as text, line by line."""
    voice = record.get("voice") or {}
    yield f"{seconds:g} s at 1 kHz by {voice.get('runtime', 'nothing')}, level {level_m_s2:.3g} m/s^2"
    if "took" in record:
        took = record["took"]
        yield f"a step took {_times(took)}; {took['late']} of {took['steps']} took longer than 1 ms"
    else:
        ready, output = record["ready"], record["output"]
        yield f"priority {record['priority']}, output buffer {output['ahead_ms']} ms"
        late = f"{ready['late']} of {ready['steps']} steps ({100 * ready['late_share']:.3g} %)"
        missing = count(output["missing"], "sample")
        yield f"underruns: {output['underruns']} ({missing}; the last one dies away meanwhile)"
        yield f"later than 1 ms, as without a buffer: {late}"
        yield f"ready after it was due: {_times(ready)}"
        outside = record.get("outside") or {}
        if (waited := outside.get("waited_s") or 0.0) > TOLD_S:
            yield f"{waited:.3g} s kept waiting by other programs"
        if (stolen := outside.get("stolen_s") or 0.0) > TOLD_S:
            away = f"{stolen:.3g} s of this machine's processors were taken away by its host"
            yield f"{away}: no priority helps against that"
        if output["limited"]:
            yield f"limited {count(output['limited'], 'sample')} to what the actuator bears"
        if not output["compensated"]:
            yield "played on a twin that is not identified: not compensated"
    yield from (f"{voice[name]} {words}" for name, words in WORDS.items() if voice.get(name))
    yield from voice.get("notes", ())


def _times(times: Mapping[str, Any]) -> str:
    return f"median {times['median_us']:g}, 99 % {times['p99_us']:g}, worst {times['worst_us']:g} us"
