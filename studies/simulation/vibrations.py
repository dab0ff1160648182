"""The simulated vibrator of a simulated session: the driver itself at its twin, on a clock that passes as it plays."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from palpate.devices.device import DeviceError
from palpate.devices.vibrator.device import Vibrator, demand_seconds, make
from palpate.devices.vibrator.settings import Settings
from palpate.protocols.events import NS, Present, Reply, Request
from palpate.protocols.plan import Plan
from palpate.protocols.simulated_world import Done
from palpate.protocols.trial import Trial
from palpate.signals.vibration import VibrationError
from palpate.studies.sessions.rig import RigError, StimulusRefused

RATE_HZ = 8000
"""Rate of the simulated output: what a device plays at 48 kHz is the same vibration, and takes six times as long."""


@dataclass
class VibratorTwin:
    """The twin of a vibrator. What it would play is prepared and checked as by the device at a rig of twins."""

    plan: Plan
    folder: Path
    checked: bool = False
    driver: Vibrator = field(init=False)

    def __post_init__(self) -> None:
        self.driver = make(
            "vibrator", Settings(kind="vibrator", driver="twin", rate_hz=RATE_HZ, bits=24), self.folder, lambda: 0.0
        )
        self.driver.folder = self.folder

    @cached_property
    def opened(self) -> Vibrator:
        """Return the open driver: its twin's response is computed at the first use."""
        self.driver.open()
        return self.driver

    def check(self, trial: Trial) -> None:  # noqa: ARG002 - all stimuli are checked with the first trial
        """Raise StimulusRefused unless every stimulus that may be presented can be played."""
        if self.checked:
            return
        for stimulus in self.plan.possible:
            try:
                self.opened.check(stimulus, self.plan.interval_s)
            except DeviceError as error:
                raise StimulusRefused(str(error), stimulus) from None
            except VibrationError as error:
                raise StimulusRefused(str(error), stimulus, error.column) from None
        self.checked = True

    def __call__(self, request: Request, t_ns: int) -> Done:
        """Play the stimulus; the reply has onset, seconds, level and digest of the waveform as that of a device."""
        if not isinstance(request, Present):
            raise RigError(f"the simulated vibrator cannot do {request.body()['do']!r}")
        part = request.part
        gap_s = 0.0 if part is None or part.interval == 1 else float(part.gap_s)
        settings = self.opened.settings
        if part is not None and part.blank:
            played: dict[str, Any] = {"blank": True, "seconds": demand_seconds(part)}
        else:
            played = self.opened.prepare(request.trial.stimulus, None if part is None else part.seconds).record(
                settings.rate_hz
            )
        record = {"onset_ns": t_ns + round(gap_s * NS), **played}
        lasts_s = max(played["seconds"], 0.0 if part is None or part.seconds is None else part.seconds)
        seconds = round(gap_s + lasts_s, 3)
        return Done(Reply({"presented": True, "seconds": seconds, "vibration": record}), seconds)
