"""The voice coil on the stylus: accelerations at 1 kHz become vibrations in the hand (thesis 4.5.2)."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.devices.actuator.settings import MEANINGS, Settings
from palpate.devices.device import DeviceFault, Health, Signal
from palpate.devices.kinds import CalibrationMethod, DeviceKind
from palpate.protocols.registry import lazy_function

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from palpate.devices.actuator.calibration import Calibration
    from palpate.devices.actuator.compensation import Compensation, Limiter
    from palpate.devices.actuator.queue import Queue
    from palpate.devices.sound.output import Output
    from palpate.signals.arrays import Array

RATE_HZ = 1000


@dataclass
class VoiceCoil:
    """A voice coil that is played ahead through a queue. After a fault or `safe` it is silent until `start`.

    One thread writes; `safe` may be called from any thread.
    """

    name: str
    settings: Settings
    output: Output
    queue: Queue
    limiter: Limiter
    calibration_file: Path | None = None
    calibration: Calibration | None = None
    compensation: Compensation | None = None
    began: bool = False
    faults: list[str] = field(default_factory=list)

    @property
    def signals(self) -> Sequence[Signal]:
        """Return an empty sequence: a voice coil records nothing."""
        return ()

    @property
    def unit(self) -> str:
        """Return the unit of the samples: m/s^2 with a calibration, else V."""
        return "V" if self.compensation is None else "m/s^2"

    @property
    def room(self) -> int:
        """Return how many samples may be written now."""
        return self.queue.room

    def open(self) -> None:
        """Read the calibration and find the output; nothing is played. Raises DeviceError."""
        from palpate.devices.actuator.calibration import load
        from palpate.devices.actuator.compensation import Compensation

        if self.calibration_file is not None:
            self.calibration = load(self.calibration_file)
            self.compensation = Compensation.of(self.calibration, self.settings.peak_m_s2)
        self.output.open()

    def start(self) -> None:
        """Begin with silence, ready for `write`. Raises DeviceError."""
        self.output.stop()
        self.queue.resume()
        if self.compensation is not None:
            self.compensation.begin()
        self.output.start(self.queue.take)
        self.began = True

    def write(self, samples: ArrayLike) -> int:
        """Play samples at 1 kHz after those in the queue, and return how many more fit.

        Samples beyond the coil's limits are limited and counted. Raises DeviceFault, and goes silent, for a value that
        is not finite, more samples than fit, a failed output, or an actuator that is not started.
        """
        wished = self._finite(samples)
        return self.drive(wished if self.compensation is None else self.compensation.volts(wished))

    def drive(self, volts: ArrayLike) -> int:
        """Write samples in volts without compensation, and return the room left."""
        self.check()
        given = self._finite(volts)
        if not self.began:
            raise DeviceFault(self.name, "refused", f"{self.name}: nothing is played before start")
        if len(given) > self.room:
            message = f"{self.name}: {len(given)} samples were written where {self.room} fit"
            raise self._failed(DeviceFault(self.name, "overrun", message))
        return self.queue.write(self.limiter.limit(given))

    def _finite(self, samples: ArrayLike) -> Array:
        import numpy as np

        given = np.atleast_1d(np.asarray(samples, dtype=np.float64))
        if not np.all(np.isfinite(given)):
            bad = int(np.flatnonzero(~np.isfinite(given))[0])
            message = f"{self.name}: sample {bad} of {len(given)} is {given[bad]}: the output was silenced"
            raise self._failed(DeviceFault(self.name, "not_a_number", message))
        return given

    def check(self) -> None:
        """Raise DeviceFault if the output has failed."""
        if fault := self.output.fault():
            raise self._failed(fault)

    def _failed(self, fault: DeviceFault) -> DeviceFault:
        self.safe()
        if str(fault) not in self.faults:
            self.faults.append(str(fault))
        return fault

    def rest(self) -> None:
        """Play the samples in the queue, and do not count silence as an underrun until the next `write`."""
        self.queue.rest()

    def safe(self) -> None:
        """Drop the samples in the queue and be silent after a ramp of 4 ms."""
        self.began = False
        try:
            self.output.cut()
        finally:
            self.queue.halt()

    def close(self) -> None:
        """Go silent, then release the output."""
        self.safe()
        self.output.drain(self.queue.silent)
        self.output.stop()

    def record(self) -> Mapping[str, Any]:
        """Return the problems so far: underruns and their missing samples, limited samples, faults."""
        held = 0 if self.compensation is None else self.compensation.limited
        return {
            "underruns": self.queue.underruns, "missing": self.queue.missing,
            "limited": self.limiter.limited + held, "faults": list(self.faults),
        }  # fmt: skip

    def describe(self) -> Mapping[str, Any]:
        """Return the settings, and the calibration in one line."""
        settings = self.settings.model_dump(mode="json", exclude_none=True)
        return {**settings, "unit": self.unit, **({"response": self.calibration.summary} if self.calibration else {})}

    def health(self, seconds: float) -> Health:
        """Play silence for some seconds, and return the output's state; nothing is felt."""
        self.start()
        time.sleep(0.0 if self.settings.driver == "twin" else seconds)
        fault = self.output.fault()
        facts = {**self.output.facts(), "samples in": self.unit}
        self.close()
        dated = self.settings.calibrated if self.calibration is None else self.calibration.date
        message = (
            str(fault) if fault else (self.calibration.summary if self.calibration else "plays volts: not identified")
        )
        return Health(fault is None, message, calibrated=dated, facts=facts)


def make(name: str, settings: Settings, folder: Path, elapsed_s: Callable[[], float] = time.monotonic) -> VoiceCoil:
    """Return the voice coil of that name without opening it; a calibration names a file in `folder`."""
    from palpate.devices.actuator.compensation import Limiter
    from palpate.devices.actuator.outputs import output_of
    from palpate.devices.actuator.queue import Queue

    ahead = settings.ahead_ms * RATE_HZ // 1000
    limiter = Limiter(settings.peak_V, settings.rms_V, settings.thermal_s)
    file = None if settings.calibration is None else folder / settings.calibration
    return VoiceCoil(name, settings, output_of(name, settings, elapsed_s), Queue(ahead), limiter, file)


def exceed(coil: VoiceCoil) -> tuple[float, float]:
    """Write ten times the limit; return the greatest voltage that came out, and the limit."""
    import numpy as np

    coil.start()
    coil.write(np.full(coil.room, 10 * coil.settings.peak_V))
    time.sleep(0.05)
    coil.check()
    volts, _ = coil.output.whole()  # type: ignore[attr-defined]  # the twin has it
    return float(np.abs(volts).max(initial=0.0)), coil.settings.peak_V


KIND = DeviceKind(
    Settings,
    make,
    MEANINGS,
    calibration=CalibrationMethod(
        "palpate.devices.rig.vibration_calibration:calibrate_coil",
        ("sensor", "level_V", "seconds", "yes", "force"),
    ),
    unplug=lazy_function("palpate.devices.sound.output:unplug"),
    exceed=exceed,
)
