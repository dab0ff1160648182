"""Figures to reach for one step of a model: every runtime in one run, its time and its error in one row.

The runtimes alternate in short blocks, so that other work on the machine affects all of them equally.
"""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.synthesis.rates import Work, rates, work_of
from benchmarks.synthesis.specimens import SPREAD, foten, windows
from palpate.devices.render.texture_models import SHIPPED
from palpate.protocols.bench import Case
from palpate.protocols.progress import Clock
from palpate.signals.arrays import Array
from palpate.signals.models.card import Card
from palpate.signals.models.fastest import fastest
from palpate.signals.models.native.library import KernelMissing, library
from palpate.signals.models.native.opened import Native
from palpate.signals.models.runtime import Model

Step = Callable[[Array], Array]
Others = Callable[[Card, Mapping[str, NDArray[np.generic]]], tuple[Mapping[str, Step], tuple[str, ...]]]
"""Returns runtimes of other programs (torch, LiteRT): a step for each that is installed, and the names of the rest."""

AREA = "synthesis"
STEPS, QUICK_STEPS, BLOCK = 20_000, 1000, 250
WINDOWS = 1000
"""Number of different windows that each runtime runs on, one after another."""
ERROR = "largest |error| against float64, in SDs of the acceleration"


@dataclass
class Measured:
    """All runtimes on one model, measured together when the first result is read."""

    model: Model
    runtimes: Mapping[str, Step]
    inputs: Array
    scale: float
    steps: int
    clock: Clock = time.perf_counter
    _seconds: dict[str, Array] = field(default_factory=dict)

    def seconds(self, name: str) -> Array:
        """Return the seconds (steps,) of one runtime."""
        if not self._seconds:
            self._seconds.update(time_by_turns(self.runtimes, self.inputs, self.steps, self.clock))
        return self._seconds[name]

    def error(self, name: str) -> float:
        """Return the error against the same numbers run in double precision by NumPy."""
        expected = in_double_precision(self.model).run(self.inputs)
        answers = np.array([self.runtimes[name](row) for row in self.inputs])
        return float(np.abs(answers[:, 0] - expected[:, 0]).max() / self.scale)


def cases(quick: bool, others: Others | None = None) -> Iterator[Case]:
    """Yield the cases of FoTEN's shape on every runtime, then of every shipped model on Palpate's."""
    steps = QUICK_STEPS if quick else STEPS
    model = foten()
    installed, missing = others(model.card, model.tensors) if others is not None else ({}, ())
    load = f"load {os.getloadavg()[0]:.1f} of {os.cpu_count()} cores" if hasattr(os, "getloadavg") else "load unknown"
    absent = f"; not installed: {', '.join(missing)}" if missing else ""
    inputs = windows(WINDOWS)
    measured = Measured(model, {**_ours(model), **installed}, inputs, float(SPREAD[0]), steps)
    yield from _rows(measured, f"FoTEN, window 20, {steps} steps, {load}{absent}", steps)
    for shipped in _shipped():
        yield from _rows(_shipped_measured(shipped, min(steps, 2000)), shipped.card.name, min(steps, 2000))


def time_by_turns(runtimes: Mapping[str, Step], inputs: Array, steps: int, clock: Clock) -> dict[str, Array]:
    """Return the seconds of every step of every runtime, in alternating blocks after one warm-up block each."""
    seconds = {name: np.empty(steps) for name in runtimes}
    for step in runtimes.values():
        _block(step, inputs, np.empty(min(BLOCK, steps)), clock)
    gc.collect()
    gc.disable()
    try:
        for start in range(0, steps, BLOCK):
            for name, step in runtimes.items():
                _block(step, np.roll(inputs, -start, axis=0), seconds[name][start : start + BLOCK], clock)
    finally:
        gc.enable()
    return seconds


def _block(step: Step, inputs: Array, into: Array, clock: Clock) -> None:
    for place in range(len(into)):
        row = inputs[place % len(inputs)]
        start = clock()
        step(row)
        into[place] = clock() - start


def in_double_precision(model: Model) -> Model:
    """Return the model with the same numbers in double precision."""
    real = {name: tensor.astype(np.float64) for name, tensor in model.tensors.items() if tensor.dtype.kind == "f"}
    return Model(model.card, {**model.tensors, **real})


def _ours(model: Model) -> dict[str, Step]:
    """Return Palpate's runtimes: the default, the kernel's other instruction sets, NumPy and the reference."""
    default = fastest(model)
    ours = {f"palpate, {default.runtime}": default.run}
    try:
        others = library().sets[1:] if isinstance(default, Native) else ()
    except KernelMissing:
        others = ()
    for instructions in others:
        ours[f"palpate, native ({instructions.name})"] = fastest(model, instructions.name).run
    return {**ours, "palpate, NumPy": model.run, "NumPy, float64 (the reference)": in_double_precision(model).run}


def _rows(measured: Measured, input_name: str, steps: int) -> Iterator[Case]:
    for case, share in (("one step, median", 50.0), ("one step, 99th percentile", 99.0)):
        for name in measured.runtimes:
            seconds = partial(_percentile, measured, name, share)
            yield Case(AREA, case, name, input_name, steps, ERROR, partial(measured.error, name), float, 1, seconds)
        if case == "one step, median":
            yield from _limits(measured.model, input_name, steps, measured.clock)


def _percentile(measured: Measured, name: str, share: float, _error: float) -> float:
    return float(np.percentile(measured.seconds(name), share))


def _limits(model: Model, input_name: str, steps: int, clock: Clock) -> Iterator[Case]:
    """Yield the cases of a step's least time for its products, and for its numbers, by rates measured here."""
    native = fastest(model)
    if not isinstance(native, Native):
        return
    work = work_of(native)
    names = (f"limit: {work.flop / 1e6:.2f} MFLOP at the measured peak", f"limit: {work.bytes / 1e6:.2f} MB read")
    for place, name in enumerate(names):
        seconds = partial(_limit, native, work, place, clock)
        yield Case(AREA, "one step, median", name, input_name, steps, ERROR, lambda: 0.0, float, 1, seconds)


def _limit(native: Native, work: Work, place: int, clock: Clock, _error: float) -> float:
    return rates(library(), native.instructions, work.bytes, clock).seconds(work)[place]


def _shipped() -> Iterator[Model]:
    """Yield one shipped model of each method."""
    from palpate.signals.models.file import read_model

    seen: set[str] = set()
    for path in sorted(SHIPPED.glob("texture-*.json")):
        model = read_model(path)
        if model.card.takes.kind == "texture_window" and model.card.method not in seen:
            seen.add(model.card.method)
            yield model


def _shipped_measured(model: Model, steps: int) -> Measured:
    texture, count = model.card.texture, min(WINDOWS, 200)
    level = 1.0 if texture is None else texture.rms_m_s2
    speed, force = ((0.0, 150.0), (0.0, 2.0)) if texture is None else (texture.speed_mm_s, texture.force_N)
    chance = np.random.Generator(np.random.PCG64(1))
    inputs = np.empty((count, 3, model.card.takes.size // 3))
    inputs[:, 0] = level * chance.standard_normal(inputs[:, 0].shape)
    inputs[:, 1], inputs[:, 2] = chance.uniform(*speed, (count, 1)), chance.uniform(*force, (count, 1))
    ours = {name: step for name, step in _ours(model).items() if name.startswith("palpate")}
    return Measured(model, ours, inputs.reshape(count, -1), level, steps)
