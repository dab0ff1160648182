"""Alignment of the streams of one act on a grid of session time, their speeds, and a description of the methods."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.analysis.streams.recorded_streams import Stream, StreamError
from palpate.protocols.undefined import finite_or_none
from palpate.signals.aligning.aligned import LONGEST_GAP_S, Aligned, align, grid_points
from palpate.signals.aligning.hinge import Hinge, fit_hinge
from palpate.signals.aligning.methods import METHODS, Method
from palpate.signals.aligning.refusals import AlignError
from palpate.signals.aligning.sine_errors import HAND_HZ, leak, sine_error
from palpate.signals.aligning.speed import Slope, floor_mm_s, slope, velocity
from palpate.signals.arrays import Array

AXES = ("x", "y", "z")
MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0}
WINDOW, DEGREE = 7, 2
"""The window of a parabola over seven samples, about the best for a hand's stroke at 120 Hz (docs/reference)."""
SINES_HZ = (1.5, 5.0, 25.0)
FOURTH = 70.0
"""The sum of the squares of 1, 4, 6, 4, 1: the variance of the fourth difference of white noise with variance 1."""
ANGLE = "angle_deg"
MANY_HOLES = 200
"""The most gaps that are listed individually; of more only the number is given."""


@dataclass(frozen=True)
class SpeedOptions:
    """Options of speed: the streams, the number of samples, and whether future samples may not be used."""

    streams: tuple[str, ...] = ()
    window: int = WINDOW
    causal: bool = False


NO_SPEEDS = SpeedOptions()


@dataclass(frozen=True)
class StreamSpeed:
    """Velocities (m, axes) of a stream on the grid in mm/s, NaN where unknown, and their method."""

    stream: Stream
    axes: tuple[str, ...]
    velocities: Array
    estimate: Slope
    method: Method
    grid_hz: float
    noise_mm: float | None

    def columns(self) -> dict[str, Array]:
        """Return STREAM_vx and so on, then STREAM_speed, the magnitude."""
        columns = {f"{self.stream.name}_v{axis}": self.velocities[:, place] for place, axis in enumerate(self.axes)}
        return {**columns, f"{self.stream.name}_speed": np.linalg.norm(self.velocities, axis=1)}

    def account(self) -> dict[str, Any]:
        """Return method, window, delay, noise and bias as JSON data."""
        one, rates = self.estimate, (self.stream.timing.rate_hz, self.grid_hz)
        ahead_s = one.wait_s + self.method.ahead_s(*rates)
        # What the recording's own noise does to the speed; nulls where it is too short to tell.
        noise: dict[str, float | None] = dict.fromkeys(("noise_mm", "noise_mm_s", "at_rest_mm_s"))
        if self.noise_mm is not None:
            noise = {
                "noise_mm": self.noise_mm, "noise_mm_s": self.noise_mm * one.noise_gain_per_s,
                "at_rest_mm_s": floor_mm_s(self.noise_mm, one, len(self.axes)),
            }  # fmt: skip
        return {
            "columns": list(self.columns()), "unit": "mm/s", "causal": ahead_s == 0.0,
            "method": "slope at the {} of a parabola fitted to the window (Savitzky and Golay 1964)".format(
                "newest sample" if one.place == "end" else "middle"
            ),
            "degree": one.degree, "window": one.window, "window_s": (one.window - 1) / one.rate_hz,
            "rate_hz": one.rate_hz, "aligned_by": self.method.name,
            "delay_s": round(one.lag_s + self.method.delay_s(*rates), 12),
            "known_after_s": one.wait_s, "ahead_s": ahead_s if np.isfinite(ahead_s) else None,
            "noise_gain_per_s": one.noise_gain_per_s,
            "bias": {"of_derivative": one.bias_order, "times": one.bias, "unit": f"s^{one.bias_order - 1}"},
            "relative_error_of_a_sine": {f"{hz:g} Hz": abs(one.response(hz) - 1) for hz in self._sines_hz()},
            "relative_error_of_aligning_it": {
                f"{hz:g} Hz": sine_error(self.method.name, self.stream.rate_hz, self.grid_hz, hz)
                for hz in self._sines_hz()
            },
            **noise,
            "empty_rows": int(np.isnan(self.velocities[:, 0]).sum()),
        }  # fmt: skip

    def _sines_hz(self) -> Iterator[float]:
        return (hz for hz in SINES_HZ if hz < self.estimate.rate_hz / 2)


def speed_of(
    stream: Stream, times_s: Array, grid_s: Array, grid_hz: float, method: Method, options: SpeedOptions
) -> StreamSpeed:
    """Return the stream's velocity at its own sample times and measured rate, then aligned; no gap is bridged.

    If no future samples may be used, the last estimate is held until the next one. Raises StreamError without lengths
    x, y, z, for an impossible window, and if no stretch is as long as the window.
    """
    units = dict(zip(stream.channels, stream.units, strict=True))
    axes = tuple(axis for axis in AXES if axis in units)
    units_text = ", ".join(f"{channel} in {unit}" for channel, unit in units.items())
    if len(axes) < 2 or len({units[axis] for axis in axes}) > 1 or units[axes[0]] not in MM:
        raise StreamError(
            f"{stream.where}: a speed needs two or three of x, y, z in one unit of mm, cm, m; it has {units_text}"
        )
    if "speed" in units:
        raise StreamError(f"{stream.where}: it has a channel `speed` already, as its device measured it")
    values = stream.values()
    positions = MM[units[axes[0]]] * values[:, [stream.channels.index(axis) for axis in axes]]
    used = METHODS["hold"] if options.causal else method
    rate_hz = stream.timing.rate_hz
    try:
        estimate = slope(options.window, DEGREE, rate_hz, "end" if options.causal else "middle")
        stretches = np.split(positions, np.flatnonzero(np.diff(stream.numbers()) > 1) + 1)  # between lost samples
        velocities = np.concatenate([velocity(stretch, estimate) for stretch in stretches])
        aligned = align(times_s, velocities, grid_s, used, rate_hz=rate_hz, grid_hz=grid_hz, longest_gap_s=0.0)
    except AlignError as error:
        raise StreamError(f"{stream.where}: speed over {options.window} samples: {error}") from error
    # An SD of an axis at least as large as the noise, from fourth differences: movement is smooth, noise is not.
    fourth = np.concatenate(
        [np.diff(stretch, 4, axis=0) for stretch in stretches if len(stretch) > 4] or [np.empty((0, 2))]
    )
    finite = fourth[np.isfinite(fourth).all(axis=1)]
    if not len(finite):
        noise_mm = None
    else:
        robust = 1.4826 * np.median(np.abs(finite), axis=0)  # of a normal distribution: a few jerks do not count
        noise_mm = float(np.sqrt((robust**2).mean() / FOURTH))
    return StreamSpeed(stream, axes, aligned.values, estimate, used, grid_hz, noise_mm)


@dataclass(frozen=True)
class AlignmentOptions:
    """Options of alignment: the grid's rate, methods by stream and by default, latencies.

    `latency_s` is the delay of a stream's earliest arrivals, which is subtracted from its times.
    """

    grid_hz: float
    method: Method
    methods: Mapping[str, Method]
    latency_s: Mapping[str, float]
    longest_gap_s: float = LONGEST_GAP_S
    everything: bool = False
    """Whether the grid covers the time of any stream, instead of the common time of all."""
    marks: bool = False
    """Whether a column for each stream marks rows within bridged gaps."""
    speed: SpeedOptions = NO_SPEEDS

    def method_of(self, stream: str) -> Method:
        """Return the method by which the stream is aligned."""
        return self.methods.get(stream, self.method)


@dataclass(frozen=True)
class DoorAngle:
    """The angle of a door on the grid, from a stream of positions and the hinge that was fitted to them."""

    stream: str
    hinge: Hinge
    angle_deg: Array

    def account(self) -> dict[str, Any]:
        """Return the fitted hinge as JSON data, with lengths in the stream's unit."""
        return {
            "column": ANGLE, "of": self.stream, "unit": "deg", "radius": self.hinge.radius,
            "misfit_rms": self.hinge.misfit, "centre": self.hinge.centre.tolist(),
        }  # fmt: skip


@dataclass(frozen=True)
class AlignedStreams:
    """Streams of one act on one grid."""

    streams: tuple[Stream, ...]
    grid_s: Array
    aligned: tuple[Aligned, ...]
    options: AlignmentOptions
    hinge: DoorAngle | None = None
    speeds: tuple[StreamSpeed, ...] = ()

    def columns(self) -> dict[str, Array]:
        """Return time_s, a column STREAM_CHANNEL for each channel, requested speeds, and angle_deg with a hinge."""
        columns = {"time_s": self.grid_s}
        for stream, aligned in zip(self.streams, self.aligned, strict=True):
            for place, channel in enumerate(stream.channels):
                columns[f"{stream.name}_{channel}"] = aligned.values[:, place]
            if self.options.marks:
                columns[f"{stream.name}_bridged"] = aligned.bridged.astype(np.float64)
        for speed in self.speeds:
            columns |= speed.columns()
        return columns if self.hinge is None else columns | {ANGLE: self.hinge.angle_deg}

    def account(self) -> dict[str, Any]:
        """Return a full description of the columns as JSON data."""
        pairs = zip(self.streams, self.aligned, strict=True)
        accounts = {stream.name: _stream_account(stream, aligned, self.options) for stream, aligned in pairs}
        for speed in self.speeds:
            accounts[speed.stream.name]["speed"] = speed.account()
        return accounts


def align_streams(streams: Sequence[Stream], options: AlignmentOptions, hinge: str | None = None) -> AlignedStreams:
    """Align the streams of one act on a grid, without streams that have no rate (events).

    `hinge` names a stream of positions on a door, whose angle is a further column.

    Raises StreamError if nothing is left, or the streams have no common time; the message names a refused stream.
    """
    regular = tuple(stream for stream in streams if not stream.noted)
    if not regular:
        raise StreamError("no stream with a rate: things that were noted as they happened can be exported raw only")
    known = [stream.name for stream in regular]
    for name in sorted({*options.methods, *options.latency_s, *options.speed.streams}.difference(known)):
        raise StreamError(f"{regular[0].where}: there is no stream {name!r} beside it; there are: {', '.join(known)}")
    starts, ends = [], []
    for stream in regular:
        first, last = stream.blocks[0].first, stream.blocks[-1].first + stream.blocks[-1].count - 1
        late_s = options.latency_s.get(stream.name, 0.0)
        starts.append(stream.timing.time_s(first) - late_s)
        ends.append(stream.timing.time_s(last) - late_s)
    start, end = (min(starts), max(ends)) if options.everything else (max(starts), min(ends))
    if end <= start:
        spans = zip(regular, starts, ends, strict=True)
        spans_text = "; ".join(f"{stream.name} {first_s:.3f} to {last_s:.3f} s" for stream, first_s, last_s in spans)
        raise StreamError(f"{regular[0].where} shares no time with the others: {spans_text}")
    grid_s = grid_points(start, end, options.grid_hz)
    aligned = tuple(_align(stream, grid_s, options) for stream in regular)
    turned = _door_angle(hinge, regular, aligned) if hinge is not None else None
    speeds = tuple(
        speed_of(
            stream, _times_s(stream, options), grid_s, options.grid_hz, options.method_of(stream.name), options.speed
        )
        for stream in regular
        if stream.name in options.speed.streams
    )
    return AlignedStreams(regular, grid_s, aligned, options, turned, speeds)


def _door_angle(name: str, streams: Sequence[Stream], aligned: Sequence[Aligned]) -> DoorAngle:
    place = next((place for place, stream in enumerate(streams) if stream.name == name), None)
    if place is None or not set(AXES) <= set(streams[place].channels):
        known = "; ".join(f"{stream.name} ({', '.join(stream.channels)})" for stream in streams)
        raise StreamError(f"{streams[0].where}: --hinge {name}: a stream of x, y, z is needed; there are: {known}")
    positions = aligned[place].values[:, [streams[place].channels.index(axis) for axis in AXES]]
    try:
        hinge = fit_hinge(positions)
    except AlignError as error:
        raise StreamError(f"{streams[place].where}: {error}") from error
    return DoorAngle(name, hinge, hinge.angle_deg(positions))


def _times_s(stream: Stream, options: AlignmentOptions) -> Array:
    clock = stream.timing
    return clock.t0_s - options.latency_s.get(stream.name, 0.0) + stream.numbers() / clock.rate_hz


def _align(stream: Stream, grid_s: Array, options: AlignmentOptions) -> Aligned:
    try:
        return align(
            _times_s(stream, options), stream.values(), grid_s, options.method_of(stream.name),
            rate_hz=stream.timing.rate_hz, grid_hz=options.grid_hz, longest_gap_s=options.longest_gap_s,
        )  # fmt: skip
    except AlignError as error:
        raise StreamError(f"{stream.where}: {error}") from error


def _stream_account(stream: Stream, aligned: Aligned, options: AlignmentOptions) -> dict[str, Any]:
    method = options.method_of(stream.name)
    rates = stream.timing.rate_hz, options.grid_hz
    return {
        **describe_stream(stream),
        "latency_s": options.latency_s.get(stream.name, 0.0),
        "method": {
            "name": method.name, "told": method.description, "causal": method.causal, "delay_s": method.delay_s(*rates),
            "ahead_s": finite_or_none(float(method.ahead_s(*rates))), "bound": method.bound,
            "rms_error_of_a_sine": sine_error(method.name, stream.rate_hz, options.grid_hz), "sine_hz": HAND_HZ,
            "leak_from_above_the_grid": leak(method.name, stream.rate_hz, options.grid_hz),
        },
        "not_finite": aligned.not_finite,
        "empty_rows": aligned.empty,
        "bridged_rows": int(aligned.bridged.sum()),
        "holes": len(aligned.holes),
        "holes_listed": [
            {"after_s": hole.after_s, "before_s": hole.before_s, "seconds": hole.seconds, "bridged": hole.bridged}
            for hole in aligned.holes[:MANY_HOLES]
        ],
        "longest_gap_s": options.longest_gap_s,
    }  # fmt: skip


def describe_stream(stream: Stream) -> dict[str, Any]:
    """Return a description of a stream as JSON data, without reading samples; a stream of events has no clock."""
    about = {
        "channels": list(stream.channels), "units": list(stream.units), "rate_hz": stream.rate_hz,
        "clock": stream.clock, "calibration": stream.calibration, "samples": stream.count, "lost": stream.lost,
        "gap_count": len(stream.gaps),
        "gaps": [{"first": gap.first, "lost": gap.lost, "why": gap.why} for gap in stream.gaps[:MANY_HOLES]],
    }  # fmt: skip
    if stream.noted:
        return {**about, "seconds": None, "timing": None, "stamps": None}
    clock, last = stream.timing, stream.blocks[-1]
    arrivals = "arrivals" if stream.arrived else "the block's declared time and rate"
    return {
        **about,
        "seconds": (last.first + last.count - stream.blocks[0].first) / clock.rate_hz,
        "timing": {
            "from": "its own stamps" if stream.by_stamps else arrivals,
            "rate_is": "measured" if clock.measured else "nominal",
            "rate_hz": clock.rate_hz, "t0_s": clock.t0_s, "drift_ppm": clock.drift_ppm if clock.measured else None,
            "drift_error_ppm": clock.drift_error_ppm, "offset_error_s": clock.offset_error_s,
            "delay_median_s": clock.delay_s, "delay_p95_s": clock.jitter_s, "wander_s": clock.wander_s,
            "arrivals": clock.arrivals,
        },
        "stamps": stream.stamps.account() if stream.stamps else None,
    }  # fmt: skip
