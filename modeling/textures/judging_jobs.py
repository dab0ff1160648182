"""The jobs of an evaluation of textures: to explore a surface once more, to fit a method, to let a model run."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from palpate.modeling.textures.methods import Method
from palpate.modeling.textures.recording import Parts, Recording
from palpate.modeling.textures.registry import METHODS
from palpate.modeling.textures.simulator import TextureSimulator
from palpate.protocols.progress import Clock
from palpate.signals.arrays import Array

SECONDS, QUICK_SECONDS = 60.0, 10.0
"""How long a model runs free."""


@dataclass(frozen=True)
class Explore:
    """Another exploration of a simulated surface, to drive the models and to compare them with."""

    texture: str

    @property
    def name(self) -> str:
        """As progress and errors name it."""
        return f"{self.texture}: another exploration"


@dataclass(frozen=True)
class Fit:
    """One method fitted to one texture; with a window and a loss of their own for Figure 4.5 and Table 4.2."""

    texture: str
    method: str
    window: int | None = None
    loss: str | None = None

    @property
    def name(self) -> str:
        """As progress and errors name it."""
        own = "" if self.loss is None else f", window {self.window}, {self.loss}"
        return f"{self.texture}: {self.method}{own}"

    @property
    def of_the_grid(self) -> bool:
        """Whether its window and loss are only compared with others: it gets no file and does not run free."""
        return self.loss is not None


@dataclass(frozen=True)
class Play:
    """A fitted model that runs free; `sampled` or by its mean alone."""

    fit: Fit
    sampled: bool = True

    @property
    def name(self) -> str:
        """As progress and errors name it."""
        return f"{self.fit.name}, running free{'' if self.sampled else ', its mean alone'}"


Job = Explore | Fit | Play


@dataclass(frozen=True)
class Context:
    """What all jobs share.

    `settings` go to the methods as they are; `work` is the folder where finished jobs and models are kept; `explore`
    says that the surfaces are simulated, so that more of them can be explored, for `seconds`; `left_out` are
    recordings that could not be split, and why.
    """

    recordings: Mapping[str, Recording]
    parts: Mapping[str, Parts]
    simulator: TextureSimulator
    work: Path
    seed: int = 0
    seconds: float = SECONDS
    explore: bool = False
    settings: Mapping[str, Any] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)
    methods: Mapping[str, Method] = field(default_factory=lambda: METHODS)
    clock: Clock = time.perf_counter


@dataclass(frozen=True)
class Done:
    """A finished job: what was measured, and why where it was refused; of a fit also its file."""

    job: Job
    numbers: Mapping[str, float | None] = field(default_factory=dict)
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    card: Path | None = None
    refused: str = ""

    def array(self, name: str) -> Array:
        """One of its arrays."""
        found: Array = self.arrays[name]
        return found
