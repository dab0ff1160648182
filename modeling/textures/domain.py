"""The jobs of an evaluation of textures: another exploration of a surface, a fit of a method, a free run of a model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.evaluate.engine import Domain, Result, result_of
from palpate.modeling.textures.drive import Drive, explored, from_recording
from palpate.modeling.textures.free_run import free_run_scores
from palpate.modeling.textures.methods import Method
from palpate.modeling.textures.metrics import density, envelope
from palpate.modeling.textures.one_step import fit_and_score, learning_for
from palpate.modeling.textures.recording import Parts, Recording, TextureDataError, recording_digest
from palpate.modeling.textures.registry import METHODS
from palpate.modeling.textures.simulator import TextureSimulator, simulation_digest
from palpate.protocols.code_digest import code_digest, module_of
from palpate.signals.textures.voice import play

MODELS = "models"
"""The folder of models, below that of finished jobs."""
PLAYER = "palpate.signals.textures.voice"
"""The module that plays a model in a free run, and for the start of a touch."""
DRIVING = ("speed", "force", "truth", "again")
"""The names of the arrays of another exploration."""
SECONDS, QUICK_SECONDS = 60.0, 10.0
"""The duration of a free run in seconds."""


@dataclass(frozen=True)
class Explore:
    """Another exploration of a simulated surface, to drive the models and to compare them with."""

    texture: str

    @property
    def name(self) -> str:
        """The name of the job in progress and errors."""
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
        """The name of the job in progress and errors."""
        own = "" if self.loss is None else f", window {self.window}, {self.loss}"
        return f"{self.texture}: {self.method}{own}"

    @property
    def of_the_grid(self) -> bool:
        """Whether it only compares a window and a loss; such a fit writes no file and does not run freely."""
        return self.loss is not None


@dataclass(frozen=True)
class Play:
    """A free run of a fitted model, with its noise (`sampled`) or by its mean alone."""

    fit: Fit
    sampled: bool = True

    @property
    def name(self) -> str:
        """The name of the job in progress and errors."""
        return f"{self.fit.name}, running free{'' if self.sampled else ', its mean alone'}"


Job = Explore | Fit | Play


TextureResult = Result[Job]


@dataclass(frozen=True, kw_only=True)
class TextureDomain(Domain[Job]):
    """The recordings, their parts and the methods.

    With `explore` the surfaces are simulated, and another exploration of `seconds` drives the models. `left_out` holds
    the recordings that could not be split, each with the reason.
    """

    work: Path
    recordings: Mapping[str, Recording]
    parts: Mapping[str, Parts]
    simulator: TextureSimulator
    seconds: float = SECONDS
    explore: bool = False
    left_out: Mapping[str, str] = field(default_factory=dict)
    methods: Mapping[str, Method] = field(default_factory=lambda: METHODS)

    def compute(self, job: Job) -> TextureResult:
        """Return the job's result. Raises TextureDataError, or the errors of the method or the simulator."""
        if isinstance(job, Explore):
            drive = explored(self.simulator, job.texture, self.seconds, self.seed)
            return Result(job, {"cycle": drive.cycle}, {name: getattr(drive, name) for name in DRIVING})
        if isinstance(job, Play):
            model = result_of(job.fit, self)
            if model.refused or not model.files:
                raise TextureDataError(model.refused or f"{job.fit.name}: there is no file of it.")
            drive = drive_for(job.fit.texture, self)
            start = self.clock()
            generated = np.asarray(play(model.files[0], drive.speed, drive.force, self.seed, job.sampled))
            scores = {"played_s": self.clock() - start, **free_run_scores(generated, drive)}
            signals: dict[str, NDArray[Any]] = {
                "density": density(generated)[1],
                "envelope": envelope(generated),
                "made": generated.astype(np.float32),
            }
            return Result(job, scores, signals)
        settings = {**self.settings, "checkpoint": self.checkpoint(job)}
        recording, parts = self.recordings[job.texture], self.parts[job.texture]
        given = learning_for(recording, parts, job.window, job.loss, self.seed, settings)
        folder = None if job.of_the_grid else self.work / MODELS / self.key(job)
        numbers, arrays, files = fit_and_score(self.methods[job.method], given, folder, self.clock)
        return Result(job, numbers, arrays, files=files)

    def decides(self, job: Job) -> dict[str, Any]:
        """Return all values that determine the job's result, including those of the jobs that it builds on."""
        if isinstance(job, Explore):
            kind = type(self.simulator)
            return {
                "explore": [job.texture, self.seconds, f"{kind.__module__}.{kind.__qualname__}"],
                "seed": self.seed,
                "code": [
                    code_digest("palpate.modeling.textures.drive"),
                    simulation_digest(self.simulator.scene, self.simulator.again),
                ],
            }
        if isinstance(job, Fit):
            method = self.methods[job.method]
            return {
                "fit": [job.texture, job.method, job.window, job.loss, method.name],
                "data": recording_digest(self.recordings[job.texture]),
                "parts": repr(self.parts[job.texture]),
                "seed": self.seed,
                "settings": self.plain_settings(),
                "code": [code_digest(module_of(method.fit), "palpate.modeling.textures.one_step"), _player_digest()],
            }
        return {
            "play": [self.key(job.fit), job.sampled, self.seconds, self.explore],
            "drive": self.key(Explore(job.fit.texture)) if self.explore else "",
            "seed": self.seed,
            "code": [code_digest("palpate.modeling.textures.free_run"), _player_digest()],
        }


def _player_digest() -> str:
    return code_digest(PLAYER, registries=True)


def drive_for(texture: str, domain: TextureDomain) -> Drive:
    """Return the drive of the models of a texture. Raises TextureDataError, or the simulator's errors."""
    if not domain.explore:
        return from_recording(domain.recordings[texture], domain.parts[texture], domain.seconds)
    exploration = result_of(Explore(texture), domain)
    if exploration.refused:
        raise TextureDataError(exploration.refused)
    speed, force, truth, again = map(exploration.array, DRIVING)
    return Drive(
        texture, "another exploration", speed, force, truth, again, same_hand=True, cycle=exploration.numbers["cycle"]
    )
