"""Running one job of an evaluation of textures, or taking it from those that are finished."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.textures.judging_drive import Drive, explored, from_recording
from palpate.modeling.textures.judging_fit import fitted
from palpate.modeling.textures.judging_jobs import Context, Done, Explore, Fit, Job, Play
from palpate.modeling.textures.judging_kept import forget_checkpoints, keep, load
from palpate.modeling.textures.recording import TextureDataError
from palpate.signals.textures.voice import play

Arrays = dict[str, NDArray[Any]]
HEARD = ("speed", "force", "truth", "again")
"""What is kept of another exploration."""


def run(job: Job, context: Context) -> Done:
    """The job's result: the kept one of an equal job, else computed and kept.

    What refuses its data (a ValueError) is a result too: it says why, and the other jobs go on.
    """
    if (found := load(job, context)) is not None:
        return found
    try:
        done = _computed(job, context)
    except ValueError as refusal:
        return Done(job, refused=str(refusal))
    keep(done, context)
    if isinstance(job, Fit):
        forget_checkpoints(job, context)
    return done


def _computed(job: Job, context: Context) -> Done:
    if isinstance(job, Explore):
        return _explored(job, context)
    return fitted(job, context) if isinstance(job, Fit) else _played(job, context)


def _explored(job: Explore, context: Context) -> Done:
    drive = explored(context.simulator, job.texture, context.seconds, context.seed)
    arrays = {name: getattr(drive, name) for name in HEARD}
    return Done(job, {"cycle": drive.cycle}, arrays)


def drive_for(texture: str, context: Context) -> Drive:
    """What the models of a texture are driven by. Raises TextureDataError, or what the simulator raises."""
    if not context.explore:
        return from_recording(context.recordings[texture], context.parts[texture], context.seconds)
    done = run(Explore(texture), context)
    if done.refused:
        raise TextureDataError(done.refused)
    speed, force, truth, again = map(done.array, HEARD)
    return Drive(
        texture, "another exploration", speed, force, truth, again, same_hand=True, cycle=done.numbers["cycle"]
    )


def _played(job: Play, context: Context) -> Done:
    from palpate.modeling.textures.judging import judged
    from palpate.modeling.textures.metrics import density
    from palpate.modeling.textures.metrics_running import envelope

    model = run(job.fit, context)
    if model.refused or model.card is None:
        raise TextureDataError(model.refused or f"{job.fit.name}: there is no file of it.")
    drive = drive_for(job.fit.texture, context)
    start = context.clock()
    made = np.asarray(play(model.card, drive.speed, drive.force, context.seed, job.sampled))
    numbers: Mapping[str, float | None] = {"played_s": context.clock() - start, **judged(made, drive)}
    arrays: Arrays = {"density": density(made)[1], "envelope": envelope(made), "made": made.astype(np.float32)}
    return Done(job, numbers, arrays)
