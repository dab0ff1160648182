"""After a fault: somebody puts the device right and says so, before it goes on."""

from __future__ import annotations

from dataclasses import dataclass

from palpate.devices.desk import Desk, Pages, Prompt
from palpate.devices.signals import DeviceFault
from palpate.protocols.requests import Aside, Fault


@dataclass
class Mending:
    """The last fault that nobody has confirmed to be put right; "" where there is none."""

    wanted: str = ""

    def fault(self, fault: DeviceFault) -> Fault:
        """The fault as it is put on record; from now on it is to be put right first."""
        self.wanted = str(fault)
        return Fault({"device": fault.device, "what": fault.what, "message": str(fault)})

    def asked(self, page: str, window: Pages, desk: Desk) -> Aside | None:
        """Ask for what is wanted and wait for the confirmation; None at once where nothing is."""
        if not self.wanted:
            return None
        desk.demand(Prompt(f"{self.wanted.rstrip('.')}. Put it right, then confirm."))
        aside = window.wait_for(page, desk, lambda: desk.answer() is not None)
        if aside is None:
            desk.demand(None)
            self.wanted = ""
        return aside
