"""A world in which procedures choose levels: in time, from the grid, and never at the cost of a device's safety."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from palpate.protocols.events import Choose, Fault, Reply, ReplyError, Request, World, WorldEvent
from palpate.protocols.plan import Plan
from palpate.protocols.tracks import Past, Track
from palpate.studies.procedures.adviser import Adviser, End, Estimate, Step, adviser_for
from palpate.studies.sessions.rig import RigError

PATIENCE_S = 2.0
"""How long a procedure may take for one level."""


class ProcedureFailed(RigError):
    """A procedure that failed twice in a row: the session ends, and can be resumed."""


def _do_nothing() -> None:
    """Do nothing: nothing moves."""


@dataclass
class Advised:
    """A world that answers `Choose` by the adviser of the trial's track, and passes on every other request.

    An adviser that raises, returns anything but a level of the grid, or takes longer than `patience_s` gives a fault by
    name, and `safe` brings the devices to rest. A second fault in a row raises ProcedureFailed.
    """

    world: World
    advisers: Mapping[str, Adviser]
    safe: Callable[[], None] = _do_nothing
    patience_s: float = PATIENCE_S
    failed: bool = False

    def now(self) -> int:
        """Return the time of the world."""
        return self.world.now()

    def perform(self, request: Request) -> WorldEvent:
        """Perform the request. Raises ProcedureFailed."""
        if not isinstance(request, Choose):
            return self.world.perform(request)
        track = request.trial.track
        if track is None or track.name not in self.advisers:
            raise RigError(f"trial {request.trial.number}: no procedure chooses its level")
        try:
            reply = self._advice(track, request.trial.past)
            request.demand_answer(reply)
        except (ReplyError, _Refused) as error:
            if len(request.trial.past) >= track.trials:  # its last answer counts: only the estimate is missing
                return Reply({"stop": True, "why": f"{track.trials} trials; no estimate: {error}"})
            self.safe()
            message = f"procedure {track.procedure.kind} of {track.name}: {error}"
            if self.failed:
                raise ProcedureFailed(
                    f"{message}. It failed twice; nothing is lost: correct the procedure, then resume the session"
                ) from error
            self.failed = True
            return Fault({"device": "procedure", "what": "refused", "message": message})
        self.failed = False
        return reply

    def _advice(self, track: Track, past: Past) -> Reply:
        """Return what the adviser says. Raises _Refused."""
        adviser = self.advisers[track.name]
        advice = self._in_time(lambda: _checked(track, adviser.advise(past)))
        if len(past) >= track.trials and not isinstance(advice, End):
            advice = End(f"{len(past)} trials")
        value: dict[str, Any] = (
            {"stop": True, "why": advice.why}
            if isinstance(advice, End)
            else {"index": advice.index, "level": track.levels[advice.index]}
        )
        if isinstance(advice, End):
            estimate = self._in_time(lambda: _finite(adviser.estimate(past)))
            value["estimate"] = estimate.to_dict() | {"text": str(estimate)}
        return Reply(value)

    def _in_time(self, call: Callable[[], Any]) -> Any:
        """Return what the call returns, in a thread that is left behind if it hangs. Raises _Refused."""
        result: list[Any] = []
        thread = threading.Thread(target=_into(result, call), name="procedure", daemon=True)
        thread.start()
        thread.join(self.patience_s)
        if not result:
            raise _Refused(f"no answer within {self.patience_s:g} s")
        ok, value = result[0]
        if not ok:
            raise value if isinstance(value, _Refused) else _Refused(f"{type(value).__name__}: {value}") from value
        return value


class _Refused(Exception):
    """What a procedure did is no advice."""


def _into(result: list[Any], call: Callable[[], Any]) -> Callable[[], None]:
    def run() -> None:
        try:
            result.append((True, call()))
        except Exception as error:
            result.append((False, error))

    return run


def _checked(track: Track, advice: Any) -> Step | End:
    if isinstance(advice, End):
        return advice
    index = getattr(advice, "index", advice)
    if type(index) is not int or not 0 <= index < len(track.levels):
        raise _Refused(f"level number {index!r:.60} is not on the grid, which has 0 to {len(track.levels) - 1}")
    return Step(index)


def _finite(estimate: Estimate) -> Estimate:
    for name in ("threshold", "sd", "bound"):
        value = getattr(estimate, name)
        if value is not None and value - value != 0:
            raise _Refused(f"{name} {value!r} is not a finite number")
    return estimate


def advised(plan: Plan, world: World, safe: Callable[[], None] = _do_nothing) -> World:
    """Return the world with the advisers of the plan's tracks; the world itself if no level is to be chosen."""
    tracks = {trial.track.name: trial.track for trial in plan.trials if trial.track is not None and trial.index is None}
    return Advised(world, {name: adviser_for(track) for name, track in tracks.items()}, safe) if tracks else world
