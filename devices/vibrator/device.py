"""The kind `vibrator`: an actuator at the skin that plays vibrations to the sample, at the card's rate."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.devices.acts import Act, UnconfirmedFault, going_on, page_of
from palpate.devices.desk import Desk, Pages
from palpate.devices.device import DeviceError, DeviceFault, Health, NowNs, Signal
from palpate.devices.kinds import CalibrationMethod, DeviceKind
from palpate.devices.vibrator.settings import MEANINGS, Settings
from palpate.protocols.events import NS, Part, Present, Reply, WorldEvent
from palpate.protocols.registry import lazy_function

if TYPE_CHECKING:
    from palpate.devices.sound.output import Output
    from palpate.devices.vibrator.calibration import Inverse, VibratorCalibration
    from palpate.devices.vibrator.exposure import Exposure
    from palpate.devices.vibrator.player import Player
    from palpate.protocols.study import Stimulus
    from palpate.signals.arrays import Array
    from palpate.signals.vibration import Vibration

MOST_CACHED = 2**24
"""Number of samples of prepared vibrations that are remembered: two arrays of doubles, 256 MB."""


@dataclass(frozen=True)
class Prepared:
    """A vibration ready to be played: acceleration in m/s^2, and its volts."""

    vibration: Vibration
    acceleration: Array
    volts: Array
    sha256: str
    hand_arm_m2_s3: float

    def record(self, rate_hz: float) -> dict[str, Any]:
        """Return what the ledger keeps of it, beside its onset."""
        level = {} if self.vibration.level_db is None else {"level_db": self.vibration.level_db}
        return {
            "waveform": self.vibration.waveform, "reference": self.vibration.reference, **level,
            "seconds": round(len(self.acceleration) / rate_hz, 9), "rate_hz": rate_hz, "sha256": self.sha256,
            "hand_arm_m2_s3": float(f"{self.hand_arm_m2_s3:.6g}"),
        }  # fmt: skip


@dataclass
class Vibrator:
    """An actuator that presents the vibrations of a stimulus table. After `safe` it is silent until the next `play`.

    `folder` is the study's, for stimuli with a file. The limits hold in `play` and in the output's callback.
    """

    name: str
    settings: Settings
    output: Output
    player: Player
    exposure: Exposure
    calibration_file: Path | None = None
    calibration: VibratorCalibration | None = None
    folder: Path | None = None
    act: Act | None = None
    unconfirmed: UnconfirmedFault = field(default_factory=UnconfirmedFault)
    _inverse: Inverse | None = None
    _prepared: dict[tuple[Any, ...], Prepared] = field(default_factory=dict)
    _played: Mapping[str, Any] = field(default_factory=dict)
    _stopped: bool = False

    @property
    def signals(self) -> Sequence[Signal]:
        """Return an empty sequence: it records nothing."""
        return ()

    def open(self) -> None:
        """Read the calibration and begin with silence. Raises DeviceError."""
        from palpate.devices.vibrator.calibration import Inverse, load
        from palpate.devices.vibrator.outputs import twin_calibration

        if self.calibration_file is not None:
            self.calibration = load(self.calibration_file)
        elif self.settings.driver == "twin":
            self.calibration = twin_calibration(self.settings)
        if self.calibration is not None:
            self._inverse = Inverse(self.calibration, self.settings.rate_hz)
        self.output.open()
        self.output.start(self.player.fill)

    def prepare(self, stimulus: Stimulus, seconds: float | None = None) -> Prepared:
        """Return the vibration of a stimulus with its volts; without `seconds` of its own it lasts as its interval.

        Raises VibrationError for a bad parameter, DeviceError where the calibration or a limit does not allow it.
        """
        from palpate.devices.vibrator.exposure import weighted_energy
        from palpate.signals.vibration import read_vibration, waveform, waveform_sha256

        columns = dict(stimulus.columns)
        if seconds is not None and not columns.get("seconds", "").strip() and columns.get("waveform") != "file":
            columns["seconds"] = repr(seconds)
        key = (stimulus.id, *sorted(columns.items()))
        if key not in self._prepared:
            vibration = read_vibration(stimulus.id, columns, self.folder, stimulus.sha256)
            calibration = self._demand_frequencies(vibration)
            acceleration = waveform(vibration, self.settings.rate_hz)
            if (problem := self.exposure.refuse(acceleration)) is not None:
                level = f"{vibration.spoken_level}, {vibration.waveform}"
                raise DeviceError(f"{self.name}: stimulus {stimulus.id!r} ({level}): {problem}")
            volts = self._volts(acceleration)
            self._demand_level(vibration, volts, calibration)
            if sum(len(one.acceleration) for one in self._prepared.values()) + len(acceleration) > MOST_CACHED:
                self._prepared.clear()
            self._prepared[key] = Prepared(
                vibration, acceleration, volts, waveform_sha256(acceleration),
                weighted_energy(acceleration, self.settings.rate_hz),
            )  # fmt: skip
        return self._prepared[key]

    def check(self, stimulus: Stimulus, seconds: float | None = None) -> None:
        """Raise VibrationError or DeviceError, naming stimulus, level and what is covered, unless it can be played.

        `seconds` is how long its interval lasts: a vibration that is longer would give itself away.
        """
        prepared = self.prepare(stimulus, seconds)
        if seconds is not None and prepared.vibration.seconds > seconds + 1e-9:
            found = f"{prepared.vibration.seconds:g} s, longer than its interval of {seconds:g} s"
            raise DeviceError(f"{self.name}: stimulus {stimulus.id!r}: {found}: lower `seconds` in its table")

    def _volts(self, acceleration: Array) -> Array:
        if self._inverse is None:
            raise self._not_calibrated()
        return self._inverse.volts(acceleration)

    def _demand_frequencies(self, vibration: Vibration) -> VibratorCalibration:
        """Return the calibration. Raises DeviceError unless there is one that covers the vibration's frequencies."""
        if self.calibration is None:
            raise self._not_calibrated()
        (low, high), (from_hz, to_hz) = self.calibration.band_Hz, vibration.band_hz
        if not low <= from_hz <= to_hz <= high:
            found = f"{from_hz:g} Hz" if from_hz == to_hz else f"{from_hz:g} to {to_hz:g} Hz"
            raise DeviceError(
                f"{self.name}: stimulus {vibration.stimulus!r}: {found}; its calibration covers {low:g} to {high:g} Hz"
            )
        return self.calibration

    def _not_calibrated(self) -> DeviceError:
        advice = f"palpate rig calibrate {self.name} --sensor NAME --write"
        return DeviceError(f"{self.name}: it is not calibrated, so no level can be played: {advice}")

    def _demand_level(self, vibration: Vibration, volts: Array, calibration: VibratorCalibration) -> None:
        """Raise DeviceError unless the peak voltage lies in the calibrated range, and within the limits."""
        import numpy as np

        from palpate.devices.vibrator.exposure import VoltGuard

        peak = float(np.abs(volts).max())
        low, high = calibration.least_V, min(calibration.most_V, self.settings.limits.peak_V)
        if low <= peak <= high:
            _, problem = VoltGuard(self.settings.limits, self.settings.rate_hz).first_beyond(volts)
            if problem:
                raise DeviceError(f"{self.name}: stimulus {vibration.stimulus!r}: {vibration.spoken_level}: {problem}")
            return
        if vibration.level_db is None or not peak > 0:
            covered = f"{low:.3g} to {high:.3g} V, and this peaks at {peak:.3g} V"
        else:
            ends = [vibration.level_db + 20 * math.log10(end / peak) for end in (low, high)]
            unit = vibration.spoken_level.split(" ", 1)[1]
            covered = f"{math.ceil(10 * ends[0]) / 10:g} to {math.floor(10 * ends[1]) / 10:g} {unit} for it"
        where = "" if vibration.waveform not in ("sine", "burst") else f" at {vibration.frequency_hz:g} Hz"
        raise DeviceError(
            f"{self.name}: stimulus {vibration.stimulus!r}: {vibration.spoken_level}{where}; its calibration covers "
            f"{covered}. Change the level, or calibrate with another --level"
        )

    def play(self, acceleration: Array, gap_s: float = 0.0, now_ns: NowNs = time.monotonic_ns) -> None:
        """Play an acceleration in m/s^2 at the output's rate, at least `gap_s` after the one before.

        Whoever plays calls `feed` until it is over, or it is switched off. Raises DeviceFault (`limit`,
        `not_a_number`, `refused`) where a limit does not allow it, DeviceError where it is not calibrated.
        """
        self.exposure.demand(acceleration)
        self._play(self._volts(acceleration), acceleration, len(acceleration), gap_s, now_ns)

    def _play(self, volts: Array, acceleration: Array, lasts: int, gap_s: float, now_ns: NowNs) -> None:
        """Play volts for `lasts` samples, and what decays after them, as a vibration with this acceleration."""
        self.check_output()
        count = lambda: self.exposure.take(acceleration, self.player.taken / self.player.rate_hz)  # noqa: E731
        self.player.play(volts, gap_s, now_ns, count, len(volts) - lasts)

    def drive(self, volts: Array, now_ns: NowNs = time.monotonic_ns) -> None:
        """Play volts without calibration, to measure one: nobody may touch the actuator. Raises DeviceFault."""
        self.check_output()
        self.player.play(volts, 0.0, now_ns)

    def feed(self) -> None:
        """Say that whoever plays is alive. Raises DeviceFault if the output failed or was switched off."""
        self.player.feed()
        self.check_output()
        if (fault := self.player.fault()) is not None:
            raise fault

    def check_output(self) -> None:
        """Raise DeviceFault if the output has failed."""
        if fault := self.output.fault():
            self.safe()
            raise fault

    def perform(self, request: Present, window: Pages, desk: Desk, now_ns: NowNs) -> WorldEvent:
        """Play the stimulus once, or be silent in an interval without one; after a pause it is played again.

        The reply has the onset (session ns), the seconds, the level and the digest of the waveform.
        """
        if aside := self.unconfirmed.demand_confirmation("changing_sample", window, desk):
            return aside
        fresh = self.act is None or self.act.request is not request
        self.act = act = going_on(self.act, request, now_ns)
        try:
            if fresh or (act.paused_at_ns is None and not self._played):
                self._begin(request, now_ns)
            aside = act.wait(
                page_of(request), window, desk, now_ns, lambda: act.paused_at_ns is None and self._is_over()
            )
        except DeviceFault as fault:
            self.safe()
            self.act, self._played = None, {}
            return self.unconfirmed.record(fault)
        if aside is None:
            self.act = None
            return self._reply()
        if aside.value.get("do") in ("pause", "repeat", "abort"):
            self.safe()
            self._played = {}
        if aside.value.get("do") in ("repeat", "abort"):
            self.act = None
        return aside

    def at_once(self, request: Present, t_ns: int) -> tuple[Reply, float]:
        """Return the reply to a presentation that begins at t_ns, with nothing played, and its seconds."""
        part = request.part
        gap_s = 0.0 if part is None or part.interval == 1 else float(part.gap_s)
        if part is not None and part.blank:
            played: dict[str, Any] = {"blank": True, "seconds": demand_seconds(part)}
        else:
            prepared = self.prepare(request.trial.stimulus, None if part is None else part.seconds)
            played = prepared.record(self.settings.rate_hz)
        lasts_s = max(played["seconds"], 0.0 if part is None or part.seconds is None else part.seconds)
        seconds = round(gap_s + lasts_s, 3)
        vibration = {"onset_ns": t_ns + round(gap_s * NS), **played}
        return Reply({"presented": True, "seconds": seconds, "vibration": vibration}), seconds

    def _begin(self, request: Present, now_ns: NowNs) -> None:
        import numpy as np

        part = request.part
        gap_s = 0.0 if part is None or part.interval == 1 else float(part.gap_s)
        self.safe()
        self._reopen()
        if part is not None and part.blank:
            count = max(1, round(demand_seconds(part) * self.settings.rate_hz))
            self.player.play(np.zeros(count), gap_s, now_ns)
            self._played = {"blank": True, "seconds": round(count / self.settings.rate_hz, 9)}
            return
        try:
            prepared = self.prepare(request.trial.stimulus, None if part is None else part.seconds)
        except ValueError as error:
            raise DeviceFault(self.name, "refused", str(error)) from None
        lasts = len(prepared.acceleration)
        if part is not None and part.seconds is not None:  # a shorter vibration is followed by silence
            lasts = max(lasts, round(part.seconds * self.settings.rate_hz))
        volts = np.pad(prepared.volts, (0, max(0, lasts - len(prepared.volts))))
        self._play(volts, prepared.acceleration, lasts, gap_s, now_ns)
        self._played = prepared.record(self.settings.rate_hz)

    def _reopen(self) -> None:
        """Begin again with an output that failed and was repaired. Raises DeviceFault if it still does not play."""
        if self._stopped or self.output.fault() is not None:
            self.output.stop()
            self._stopped = True
            try:
                self.output.start(self.player.fill)
            except DeviceError as error:
                raise DeviceFault(self.name, "link_lost", str(error)) from None
            self._stopped = False

    def _is_over(self) -> bool:
        self.feed()
        return not self.player.busy

    def _reply(self) -> Reply:
        played, self._played = self._played, {}
        twin = {"by": "twin"} if self.settings.driver == "twin" else {}
        vibration = {"onset_ns": self.player.onset_ns, **played}
        return Reply({"presented": True, "seconds": round(played["seconds"], 3), **twin, "vibration": vibration})

    def safe(self) -> None:
        """Drop what plays, and be silent after a ramp of 4 ms (and what the output has already taken)."""
        self.player.halt()

    def close(self) -> None:
        """Go silent, then release the output."""
        self.act = None
        self.player.halt()
        self.output.drain(self.player.silent)
        self.output.stop()

    def limit_dose(self, hand_arm_m2_s3: float) -> None:
        """Count the weighted energy of the vibrations that the participant has had today.

        Raises DeviceError if the daily exposure is used up.
        """
        self.exposure.total = hand_arm_m2_s3
        if self.exposure.a8_m_s2 >= self.settings.limits.a8_m_s2:
            had = f"the participant has had a daily exposure A(8) of {self.exposure.a8_m_s2:.2f} m/s^2"
            most = f"at most limits.a8_m_s2 = {self.settings.limits.a8_m_s2:g}"
            raise DeviceError(f"{self.name}: {had}; {most}: wait until tomorrow")

    def certified_digest(self) -> str:
        """Return the digest of what a certificate of the open device depends on."""
        return self.settings.certified_digest("" if self.calibration is None else self.calibration.summary)

    def describe(self) -> Mapping[str, Any]:
        """Return the settings with limits and certificate, and the calibration in one line."""
        settings = self.settings.model_dump(mode="json", exclude_none=True)
        return {**settings, **({"response": self.calibration.summary} if self.calibration else {})}

    def health(self, seconds: float) -> Health:
        """Play silence for some seconds, and return the output's state; nothing is felt."""
        time.sleep(0.0 if self.settings.driver == "twin" else seconds)
        fault = self.output.fault()
        certificate = self.settings.certificate
        facts = {**self.output.facts(), "onset": "never certified"}
        if certificate is not None:
            held = "" if certificate.settings == self.certified_digest() else ", of other settings"
            facts["onset"] = f"{certificate.p50_ms:.2f} ms (median), {certificate.p99_ms:.2f} ms (p99){held}"
        summary = str(fault) if fault else self.calibration.summary if self.calibration else "not calibrated"
        dated = self.settings.calibrated if self.calibration is None else self.calibration.date
        return Health(fault is None and self.calibration is not None, summary, calibrated=dated, facts=facts)


def demand_seconds(part: Part) -> float:
    """Return how long a blank interval lasts. Raises DeviceFault where the study does not say so."""
    if part.seconds is None:
        message = "a blank interval has to last as long as the others: give `seconds` in `intervals`"
        raise DeviceFault("vibrator", "refused", message)
    return part.seconds


def make(name: str, settings: Settings, folder: Path, elapsed_s: Callable[[], float] = time.monotonic) -> Vibrator:
    """Return the vibrator of that name without opening it; a calibration names a file in `folder`."""
    from palpate.devices.vibrator.exposure import Exposure, VoltGuard
    from palpate.devices.vibrator.outputs import output_of
    from palpate.devices.vibrator.player import Player

    output = output_of(name, settings, elapsed_s)
    guard = VoltGuard(settings.limits, settings.rate_hz)
    player = Player(name, settings.rate_hz, guard, settings.feed_s, output.wait_s)
    file = None if settings.calibration is None else folder / settings.calibration
    return Vibrator(name, settings, output, player, Exposure(name, settings.limits, settings.rate_hz), file)


def exceed(vibrator: Vibrator) -> tuple[float, float]:
    """Play ten times the limits, as acceleration and volts; return the most volts that came out, and the limit."""
    import numpy as np

    limits = vibrator.settings.limits
    sine = np.sin(2 * np.pi * 100 * np.arange(vibrator.settings.rate_hz // 20) / vibrator.settings.rate_hz)
    for attempt, wish in ((vibrator.play, limits.peak_m_s2 * sine), (vibrator.drive, limits.peak_V * sine)):
        with suppress(DeviceFault):
            attempt(10 * wish)
        time.sleep(0.06)
        with suppress(DeviceFault):
            vibrator.feed()
    volts, _ = vibrator.output.whole()  # type: ignore[attr-defined]  # the twin has it
    return float(np.abs(volts).max(initial=0.0)), limits.peak_V


KIND = DeviceKind(
    Settings,
    make,
    MEANINGS,
    calibration=CalibrationMethod(
        "palpate.devices.rig.vibrator_calibration:calibrate_vibrator",
        ("sensor", "level_V", "seconds", "yes", "force"),
    ),
    unplug=lazy_function("palpate.devices.sound.output:unplug"),
    exceed=exceed,
    # What is played at 48 kHz is the same vibration at 8 kHz, in a sixth of the time.
    simulated={"rate_hz": 8000, "bits": 24},
    at_once=Vibrator.at_once,
)
