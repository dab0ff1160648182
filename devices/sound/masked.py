"""Presenting while noise masks what could be heard of it."""

from __future__ import annotations

from dataclasses import dataclass, field

from palpate.devices.desk import Desk, Pages
from palpate.devices.mending import Mending
from palpate.devices.signals import DeviceError, DeviceFault, NowNs, Presents
from palpate.devices.sound.device import MaskingNoise
from palpate.protocols.requests import Aside, Came, Present, Reply


@dataclass
class Masked:
    """The noise comes on with the first presentation and stays: people rate while they still feel. A pause is silent.

    A presentation without noise does not count: where the headphones are gone, the trial is marked and met again.
    """

    presents: Presents
    noise: MaskingNoise
    mending: Mending = field(default_factory=Mending)
    begun: Present | None = None
    paused: bool = False
    on: bool = False

    def perform(self, request: Present, window: Pages, desk: Desk, now_ns: NowNs) -> Came:
        """What the device that presents says, or the noise's fault: before a presentation begins, or where it ended."""
        if aside := self.mending.asked("changing_sample", window, desk):
            return aside
        try:
            self._sound(request)
            came = self.presents.perform(request, window, desk, now_ns)
            if isinstance(came, Reply):
                self.begun = None
                self.noise.check()
        except DeviceFault as fault:
            if fault.device != self.noise.name:
                raise
            self.noise.close()
            return self.mending.fault(fault)
        if isinstance(came, Aside):
            self.heed(came)
        return came

    def _sound(self, request: Present) -> None:
        if request is not self.begun:
            self._there()
            self.begun = request
        if not self.paused:
            self.noise.start()
            self.on = True

    def _there(self) -> None:
        """Make sure that it plays; headphones that were put right are opened anew."""
        if self.noise.player is not None:
            self.noise.check()
            return
        try:
            self.noise.open()
        except DeviceError as error:
            raise DeviceFault(self.noise.name, "link_lost", str(error)) from None

    def heed(self, aside: Aside) -> None:
        """Be silent in a pause, and sound again after it, also where one falls into the time for an answer."""
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
