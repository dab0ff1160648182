"""A texture model's step by runtime, its training in two ways, and the shipped models running freely."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.synthesis import free_running as hands
from benchmarks.synthesis import steps, training
from benchmarks.synthesis.runtimes import other_runtimes
from palpate.devices.render.texture_models import SHIPPED, available
from palpate.protocols.bench import Case
from palpate.studies.simulation.texture_simulator import SimulatedTextures


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of a step, beside other programs' runtimes, and of training."""
    yield from steps.cases(quick, other_runtimes)
    yield from training.cases(quick, SimulatedTextures())


def free_running(quick: bool) -> Iterator[Case]:
    """Yield the cases of the shipped texture models under hands that they were not trained with."""
    yield from hands.cases(quick, SimulatedTextures(), available(SHIPPED))
