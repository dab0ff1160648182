"""Masking noise in headphones, so that a participant does not hear the stimuli (thesis 3.3.2, 4.7.1)."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from palpate.devices.acts import UnconfirmedFault
from palpate.devices.desk import Desk, Pages
from palpate.devices.device import DeviceError, DeviceFault, Health, NowNs, Presents, Signal
from palpate.devices.kinds import Date, DeviceKind
from palpate.devices.sound.dose import RULE, seconds_left
from palpate.protocols.events import Aside, Present, Reply, WorldEvent
from palpate.protocols.registry import lazy_function
from palpate.protocols.strict import Strict

if TYPE_CHECKING:
    from palpate.devices.sound.noise import Player
    from palpate.devices.sound.output import Output
    from palpate.signals.arrays import Array

LOUDEST_DBFS, LOUDEST_UNMEASURED_DBFS, LOUDEST_DB_SPL = -12.0, -30.0, 80.0
"""Noise peaks about 15 dB above its level, so -12 dBFS never clips. 80 dB SPL is allowed for 40 hours a week (WHO, ITU
H.870); where nobody has measured what the headphones give, the level stays 18 dB further down."""
FEED_S = 10.0
"""The noise ramps off by itself if the session has not been heard of for so long."""
SAFE_S = 0.02
"""How fast it falls silent when it is made safe: short, but without a click."""


class Settings(Strict):
    """The settings in a rig file. `level_db_spl` needs `db_spl_at_0_dbfs`.

    The latter is the reading of a sound level meter at the ear for a sine at full scale.
    """

    kind: Literal["masking_noise"]
    driver: Literal["sound", "twin"]
    device: str | Annotated[int, Field(ge=0)] | None = None
    rate_hz: Annotated[int, Field(ge=8000, le=192_000)] = 48_000
    channels: Annotated[int, Field(ge=1, le=8)] = 2
    colour: Literal["white", "pink"] = "white"
    level_dbfs: Annotated[float, Field(ge=-90, le=LOUDEST_DBFS)] = -35.0
    level_db_spl: Annotated[float, Field(ge=20, le=LOUDEST_DB_SPL)] | None = None
    db_spl_at_0_dbfs: Annotated[float, Field(ge=40, le=150)] | None = None
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    ramp_s: Annotated[float, Field(ge=0.05, le=5)] = 0.5
    calibrated: Date | None = None

    @model_validator(mode="after")
    def _bearable(self) -> Self:
        if self.db_spl_at_0_dbfs is None:
            if self.level_db_spl is not None:
                raise ValueError("level_db_spl needs db_spl_at_0_dbfs, measured at the headphones; or give level_dbfs")
            if self.level_dbfs > LOUDEST_UNMEASURED_DBFS:
                message = (
                    f"level_dbfs {self.level_dbfs:g}: at most {LOUDEST_UNMEASURED_DBFS:g} without db_spl_at_0_dbfs"
                )
                raise ValueError(f"{message}: nobody has measured how loud it is")
        elif self.spoken_db_spl > LOUDEST_DB_SPL:
            raise ValueError(f"{self.spoken_db_spl:.1f} dB SPL: hearing is protected at {LOUDEST_DB_SPL:g} dB SPL")
        elif self.dbfs > LOUDEST_DBFS:
            raise ValueError(
                f"level_db_spl needs {self.dbfs:.1f} dBFS, more than {LOUDEST_DBFS:g}: turn the amplifier up"
            )
        return self

    @property
    def dbfs(self) -> float:
        """Return the level of the samples, in dBFS."""
        if self.level_db_spl is None or self.db_spl_at_0_dbfs is None:
            return self.level_dbfs
        return self.level_db_spl - self.db_spl_at_0_dbfs

    @property
    def spoken_db_spl(self) -> float:
        """Return the level at the ear in dB SPL, where it was measured; else NaN."""
        return float("nan") if self.db_spl_at_0_dbfs is None else self.dbfs + self.db_spl_at_0_dbfs

    @property
    def db_a(self) -> float:
        """Return the A-weighted level at the ear, where it was measured; else NaN."""
        from palpate.devices.sound.noise import a_weighted_db

        return self.spoken_db_spl + a_weighted_db(self.colour, self.rate_hz)


MEANINGS: Mapping[str, str] = {
    "device": "name, part of a name or number of the sound output, none is the machine's default",
    "rate_hz": "the sound card's rate, Hz",
    "channels": "how many channels get the noise",
    "colour": "white has the same power at every frequency, pink falls by 3 dB an octave",
    "level_dbfs": "level, dB relative to a full-scale sine; at most -30 without db_spl_at_0_dbfs",
    "level_db_spl": "level at the ear, dB SPL, in place of level_dbfs; needs db_spl_at_0_dbfs",
    "db_spl_at_0_dbfs": "what a sound level meter reads at the ear for a full-scale sine, dB SPL",
    "ramp_s": "how long it takes to come and go, s",
    "seed": "of the noise",
}


@dataclass
class MaskingNoise:
    """A player of noise from `start` until it is made safe. `check` raises DeviceFault where it no longer plays."""

    name: str
    settings: Settings
    output: Output
    player: Player | None = None
    share_before: float = 0.0
    """The share of the daily dose that the participant has had today, before this session."""
    sounded_s: float = 0.0
    """How long it sounded before it was opened the last time."""

    @property
    def signals(self) -> Sequence[Signal]:
        """Return an empty sequence: it records nothing."""
        return ()

    def open(self) -> None:
        """Find the output and make the loop, without sound."""
        from palpate.devices.sound.noise import Player, loop, rms_of

        self._demand_limits()
        self.output.open()
        samples = loop(self.settings.colour, self.settings.rate_hz, self.settings.seed)
        self.player = Player(
            samples * rms_of(self.settings.dbfs), rate_hz=self.settings.rate_hz, most_s=self._seconds_left(),
            feed_s=FEED_S,
        )  # fmt: skip
        self.output.start(self.player.fill)

    def start(self) -> None:
        """Ramp the noise on; do nothing if it is already on."""
        if self.player is None:
            raise DeviceError(f"{self.name}: the masking noise is not open")
        self.player.turn_on(round(self.settings.ramp_s * self.settings.rate_hz))

    def feed(self) -> None:
        """Say that the session is alive; without it the noise ramps off after `FEED_S`."""
        if self.player is not None:
            self.player.feed()

    def check(self) -> None:
        """Raise DeviceFault if the output is gone or the noise ended, because stimuli could be heard meanwhile."""
        if fault := self.output.fault():
            raise fault
        if self.player is None or not self.player.ended:
            return
        if self.player.ended == "limit":
            had = f"the participant has had today's dose of noise ({RULE})"
            message = f"{had}, and the noise is off: end the session for today"
            raise DeviceFault(self.name, "limit", f"{self.name}: {message}")
        message = f"the noise was switched off, because the session was not heard of for {FEED_S:g} s"
        raise DeviceFault(self.name, "heartbeat_lost", f"{self.name}: {message}")

    def _demand_limits(self) -> None:
        """Raise DeviceError for a level that settings do not allow, however they were made."""
        measured = self.settings.db_spl_at_0_dbfs is not None
        loudest = LOUDEST_DBFS if measured else LOUDEST_UNMEASURED_DBFS
        if not self.settings.dbfs <= loudest or (measured and not self.settings.db_a <= LOUDEST_DB_SPL):
            found = f"{self.settings.dbfs:.4g} dBFS, {self.settings.db_a:.4g} dB(A)"
            expected = f"at most {loudest:g} dBFS and {LOUDEST_DB_SPL:g} dB(A) are played"
            raise DeviceError(f"{self.name}: {found}; {expected}: lower the level in the rig file")

    def _seconds_left(self) -> float:
        """Return how long the noise may sound today from now on; a level that nobody measured counts as the loudest."""
        measured = self.settings.db_spl_at_0_dbfs is not None
        db_a = self.settings.db_a if measured else LOUDEST_DB_SPL
        return max(0.0, seconds_left(db_a, self.share_before) - self.sounded_s)

    def limit_dose(self, share_before: float, minutes: float | None) -> None:
        """Keep within the rest of the day's dose after this share of it.

        Raises DeviceError if the whole dose is used up, or a session of so many minutes would use up more.
        """
        self.share_before = share_before
        left_s = self._seconds_left()
        if self.player is not None:
            self.player.most_s = left_s
        needed_s = 60 * (minutes or 0.0)
        if left_s <= 0 or left_s < needed_s:
            had = f"the participant has had {100 * share_before:.0f} % of today's dose of noise ({RULE})"
            rest = f"{left_s / 60:.0f} min of this level are left"
            planned = f" and the session takes {minutes:g} min" if minutes else ""
            raise DeviceError(f"{self.name}: {had}; {rest}{planned}: wait until tomorrow, or lower the level")

    def rest(self) -> None:
        """Ramp the noise off as gently as it began, for a pause."""
        self._off(self.settings.ramp_s)

    def safe(self) -> None:
        """Ramp the noise off quickly."""
        self._off(SAFE_S)

    def _off(self, seconds: float) -> None:
        if self.player is not None:
            self.player.fader.to(0.0, round(seconds * self.settings.rate_hz))

    def close(self) -> None:
        """Ramp the noise off and release the output."""
        self.safe()
        if self.player is not None:
            self.output.drain(self.player.fader.silent)
            self.sounded_s += self.player.sounded / self.settings.rate_hz
        self.output.stop()
        self.player = None

    def demand_bearable(self, at_most_db_a: float) -> None:
        """Raise DeviceError unless the level at the ear is known and not above this."""
        if self.settings.db_spl_at_0_dbfs is None:
            raise DeviceError(
                f"{self.name}: the study allows at most {at_most_db_a:g} dB(A), and nobody has measured how loud this "
                "noise is: play a full-scale sine, read a sound level meter at the ear, and write what it reads into "
                "the rig file as db_spl_at_0_dbfs"
            )
        if self.settings.db_a > at_most_db_a:
            raise DeviceError(
                f"{self.name}: {self.settings.db_a:.1f} dB(A) at the ear, and the study allows at most "
                f"{at_most_db_a:g}: lower level_db_spl (or level_dbfs) in the rig file"
            )

    def describe(self) -> Mapping[str, Any]:
        """Return the settings, and the resulting level."""
        settings = self.settings.model_dump(mode="json", exclude_none=True)
        level = {}
        if self.settings.db_spl_at_0_dbfs is not None:
            level = {"db_spl": round(self.settings.spoken_db_spl, 2), "db_a": round(self.settings.db_a, 2)}
        limits = {"dose": RULE, "share_before": round(self.share_before, 6), "feed_s": FEED_S}
        return {**settings, "dbfs": round(self.settings.dbfs, 2), **level, "limits": limits}

    def health(self, seconds: float) -> Health:
        """Let the open output play silence for some seconds; nothing is heard."""
        time.sleep(0.0 if self.settings.driver == "twin" else seconds)
        fault = self.output.fault()
        facts = {**self.output.facts(), "level": f"{self.settings.dbfs:.1f} dBFS"}
        if self.settings.db_spl_at_0_dbfs is not None:
            facts["at the ear"] = f"{self.settings.spoken_db_spl:.1f} dB SPL, {self.settings.db_a:.1f} dB(A)"
        summary = f"{self.settings.colour} noise is ready" if fault is None else str(fault)
        return Health(fault is None, summary, calibrated=self.settings.calibrated, facts=facts)


def make(name: str, settings: Settings, folder: Path, elapsed_s: Callable[[], float] = time.monotonic) -> MaskingNoise:  # noqa: ARG001
    """Return the player of that name without opening it."""
    from palpate.devices.sound.output import Tape

    if settings.driver == "twin":
        heard: Callable[[Array], None] = lambda _samples: None  # noqa: E731
        return MaskingNoise(name, settings, Tape(settings.rate_hz, elapsed_s, heard, most_s=1.0))
    from palpate.devices.sound.card import Card

    return MaskingNoise(name, settings, Card(name, settings.device, settings.rate_hz, settings.channels, "high"))


@dataclass
class Masked:
    """A presenter with masking noise, which begins with the first presentation and stays on, except in pauses.

    It stays on because people rate while they still feel. A presentation without noise does not count: if the
    headphones are gone, the trial is marked and repeated.
    """

    presents: Presents
    noise: MaskingNoise
    unconfirmed: UnconfirmedFault = field(default_factory=UnconfirmedFault)
    playing_request: Present | None = None
    paused: bool = False
    on: bool = False

    def perform(self, request: Present, window: Pages, desk: Desk, now_ns: NowNs) -> WorldEvent:
        """Return the presenting device's reply, or the noise's fault before or at the end of the presentation."""
        if aside := self.unconfirmed.demand_confirmation("changing_sample", window, desk):
            return aside
        try:
            if request is not self.playing_request:
                self._there()
                self.playing_request = request
            if not self.paused:
                self.noise.start()
                self.on = True
            event = self.presents.perform(request, window, desk, now_ns)
            if isinstance(event, Reply):
                self.playing_request = None
                self.noise.check()
        except DeviceFault as fault:
            if fault.device != self.noise.name:
                raise
            self.noise.close()
            return self.unconfirmed.record(fault)
        if isinstance(event, Aside):
            self.handle_aside(event)
        return event

    def _there(self) -> None:
        """Make sure that the noise plays; reopen headphones that were repaired."""
        if self.noise.player is not None:
            self.noise.check()
            return
        try:
            self.noise.open()
        except DeviceError as error:
            raise DeviceFault(self.noise.name, "link_lost", str(error)) from None

    def handle_aside(self, aside: Aside) -> None:
        """Silence the noise in a pause and resume it afterwards, also during an answer."""
        match aside.value.get("do"):
            case "pause":
                self.paused = True
                self.noise.rest()
            case "go_on":
                self.paused = False
                if self.on and self.noise.player is not None:
                    self.noise.start()
            case "repeat":
                self.paused = False


def exceed(noise: MaskingNoise) -> tuple[float, float]:
    """Open it at full scale, past its settings; return the level that it would play (dBFS), and the loudest."""
    measured = noise.settings.db_spl_at_0_dbfs is not None
    noise.close()
    noise.settings = noise.settings.model_copy(update={"level_dbfs": 0.0, "level_db_spl": None})
    with suppress(DeviceError):
        noise.open()
    loudest = LOUDEST_DBFS if measured else LOUDEST_UNMEASURED_DBFS
    return -math.inf if noise.player is None else noise.settings.dbfs, loudest


KIND = DeviceKind(
    Settings,
    make,
    MEANINGS,
    calibration=(
        "is calibrated with a sound level meter at the ear: play a full-scale sine and write what it reads as"
        " `db_spl_at_0_dbfs`"
    ),
    unplug=lazy_function("palpate.devices.sound.output:unplug"),
    exceed=exceed,
)
