"""A device that presents stimuli by itself, in a simulated session: its driver at its twin, on a clock that leaps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, cast

from palpate.devices.desk import Desk, Prompt
from palpate.devices.device import DeviceFault, PresentsStimuli
from palpate.devices.kinds import KINDS, DeviceKind
from palpate.protocols.events import NS, Aside, Present, Reply, Request
from palpate.protocols.keyed import Key, keyed_bits
from palpate.protocols.needs import NEEDS
from palpate.protocols.plan import Plan
from palpate.protocols.simulated_world import Done
from palpate.protocols.study import Stimulus
from palpate.protocols.trial import Trial
from palpate.studies.sessions.rig import RigError, StimulusRefused

STEP_S = 0.01
"""Seconds that the clock leaps by while a device waits: about a frame of a window."""
LONGEST_S = 600.0
"""A presentation that is not over after so many seconds never is."""


@dataclass
class LeapingPages:
    """A window whose clock leaps while a device waits."""

    name: str
    at_s: float = 0.0

    def elapsed_s(self) -> float:
        """Return the seconds since the beginning."""
        return self.at_s

    def wait_for(self, key: str, desk: Desk, ready: Callable[[], bool]) -> Aside | None:  # noqa: ARG002
        """Let time pass until the device is ready. Raises RigError if it never is."""
        while not ready():
            self.at_s = round(self.at_s + STEP_S, 9)
            if self.at_s > LONGEST_S:
                raise RigError(f"{self.name}: a presentation is not over after {LONGEST_S:g} s")
        return None


class NobodyAtTheDesk:
    """A desk without an experimenter."""

    def poll(self) -> Aside | None:
        """Return no action."""

    def demand(self, prompt: Prompt | None) -> None:
        """Show nothing."""

    def answer(self) -> float | bool | str | None:
        """Return no answer."""

    def tell(self, state: Mapping[str, Any]) -> None:
        """Show nothing."""


@dataclass
class PresentingTwin:
    """The twin of a device that presents stimuli by itself. Equal requests get equal replies."""

    plan: Plan
    folder: Path
    need: str
    checked: bool = field(default=False, init=False)

    @cached_property
    def kind(self) -> tuple[str, DeviceKind]:
        """Return the need's kind of device, with its name. Raises RigError unless it has exactly one."""
        if len(kinds := tuple(NEEDS[self.need].takes)) != 1:
            raise RigError(f"the need {self.need} presents with {len(kinds)} kinds of devices; one is expected")
        return kinds[0], KINDS[kinds[0]]

    @cached_property
    def driver(self) -> PresentsStimuli:
        """Return the driver at its twin, open."""
        driver = self.make(LeapingPages(self.kind[0]), "check")
        driver.open()
        return driver

    def make(self, window: LeapingPages, *moment: Key) -> PresentsStimuli:
        """Return a driver at a twin whose noise depends on the session and the moment alone."""
        name, kind = self.kind
        given = {"kind": name, "driver": "twin", **kind.simulated}
        if "seed" in kind.settings.model_fields and moment != ("check",):
            plan = self.plan
            key = (self.need, plan.study.study, plan.seed, plan.who.participant, *plan.occasion, *moment)
            given["seed"] = keyed_bits("presents", *key) % 2**31
        driver: Any = kind.make(name, kind.settings.model_validate(given), self.folder)
        if hasattr(driver, "folder"):
            driver.folder = self.folder
        if hasattr(driver, "elapsed_s"):
            driver.elapsed_s = window.elapsed_s
        return cast(PresentsStimuli, driver)

    def feels(self, stimulus: Stimulus) -> Mapping[str, float]:
        """Return the columns of a stimulus that simulated people feel from the device instead of from the table."""
        feels = getattr(self.driver, "feels", None)
        return {} if feels is None else cast(Mapping[str, float], feels(stimulus, self.plan.interval_s))

    def check(self, trial: Trial) -> None:  # noqa: ARG002 - all stimuli are checked with the first trial
        """Raise StimulusRefused unless every stimulus that may be presented is within the device's limits."""
        if self.checked:
            return
        for stimulus in self.plan.possible:
            try:
                self.driver.check(stimulus, self.plan.interval_s)
            except ValueError as error:
                raise StimulusRefused(str(error), stimulus, getattr(error, "column", None)) from None
        self.checked = True

    def __call__(self, request: Request, t_ns: int) -> Done:
        """Present the stimulus. Raises RigError where the twin fails."""
        name, kind = self.kind
        if not isinstance(request, Present):
            raise RigError(f"the simulated {name} cannot do {request.body()['do']!r}")
        if kind.at_once is not None:
            return Done(*kind.at_once(self.driver, request, t_ns))
        window = LeapingPages(name)
        interval = 0 if request.part is None else request.part.interval
        driver = self.make(window, request.trial.number, request.trial.attempt, interval)
        driver.open()
        try:
            event = driver.perform(request, window, NobodyAtTheDesk(), lambda: t_ns + round(window.at_s * NS))
        except DeviceFault as fault:
            raise RigError(f"the simulated {name} does not bear this stimulus: {fault}") from fault
        finally:
            driver.close()
        if not isinstance(event, Reply):
            raise RigError(f"the simulated {name} presented nothing: {dict(event.value)}")
        return Done(event, round(window.at_s, 3))
