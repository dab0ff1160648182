"""The rig of a simulated session: a simulated participant at the twins of the devices that the study needs."""

from __future__ import annotations

from pathlib import Path

from palpate.protocols.events import World
from palpate.protocols.needs import recorded_beside
from palpate.protocols.plan import Plan
from palpate.protocols.simulated_participants import simulated_participant
from palpate.protocols.simulated_world import Simulated, VirtualClock
from palpate.protocols.study import Study
from palpate.studies.sessions.rig import Rig, RigPlan


def simulated(study: Study, folder: Path, lab: Path | None = None, pictures: int | None = None) -> RigPlan:
    """Return the rig of a simulated participant at twins of the study's devices; `folder` has its stimulus files.

    A `lab` provides its own models if it has any; a camera saves so many `pictures` of each stimulus there, none if it
    is None.
    """
    from palpate.studies.simulation.twins import renderings_of, twin_for
    from palpate.studies.stimuli.profiles import Profiles

    profiles = Profiles(folder)
    renderings = renderings_of(folder, lab) if "texture_renderer" in study.needs else None

    def check(plan: Plan) -> None:
        twin_for(study, plan, folder, profiles, lab, renderings, pictures).check(plan)

    def opened(plan: Plan, t_ns: int) -> Rig:
        device = twin_for(study, plan, folder, profiles, lab, renderings, pictures)
        world: World = Simulated(simulated_participant(plan, device.feels), device, VirtualClock(t_ns))
        if study.procedure:
            from palpate.studies.procedures.advised import advised

            world = advised(plan, world)
        if not (needs := recorded_beside(study.needs)):
            return Rig(world)
        from palpate.studies.sessions.rig import RecordedBeside
        from palpate.studies.simulation.virtual_recording import VirtualRecorder

        recorder = VirtualRecorder.of(needs, world.now, plan)
        return Rig(RecordedBeside(world, lambda: None, recorder.take), recorder.close)

    saved = {} if pictures is None else {"pictures": pictures}
    return RigPlan({"kind": "simulated", "twins": list(study.needs), **saved}, check, opened)
