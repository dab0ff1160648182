"""What a rig's twins of sensors are shown while a stimulus is recorded: the hand at the very stimulus of the trial."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from protocols.keyed import Key
from protocols.plan import Plan, Trial
from protocols.requests import Sense
from studies.catalogue import Found
from studies.twins import Profiles, profile_of

if TYPE_CHECKING:
    from devices.scene import Scene


def drawn(plan: Plan, trial: Trial) -> tuple[Key, ...]:
    """What decides a simulated recording; the study's name keeps two studies of one seed apart."""
    return (plan.study.study, plan.seed, plan.who.participant, trial.number, trial.attempt)


def scene_for(need: str, found: Found, plan: Plan) -> Callable[[Sense], Scene]:
    """The scene of each request to record: a texture being stroked, or a door being opened."""
    return _strokes(plan) if need == "tool" else _openings(found, plan)


def _strokes(plan: Plan) -> Callable[[Sense], Scene]:
    def scene(request: Sense) -> Scene:
        from devices.surfaces.scene import SurfaceScene

        from devices.surfaces.table import surface_of

        stimulus = request.trial.stimulus
        texture = surface_of(stimulus.columns, stimulus.id)
        return SurfaceScene(texture, request.seconds, drawn(plan, request.trial))

    return scene


def _openings(found: Found, plan: Plan) -> Callable[[Sense], Scene]:
    profiles = Profiles(found.folder)

    def scene(request: Sense) -> Scene:
        from devices.door.opening_scene import OpeningScene

        profile_N = profile_of(request.trial.stimulus, profiles)
        return OpeningScene(profile_N, request.seconds, drawn(plan, request.trial))

    return scene
