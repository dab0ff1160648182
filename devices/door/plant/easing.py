"""How much of the torque loop is left in use: less, once a hand that is damped too much for it makes the motor buzz."""

from __future__ import annotations

from palpate.devices.door.plant.parameters import TICK_S

BUZZ_NM = 3.0
"""The motor's command turns back between two steps of more than this: one sign of buzzing, far above the noise."""
FADE_S = 0.02
SIGNS = 6.0
"""So many signs, fading with `FADE_S`, are a buzz: a pull or a stop gives a few, an unstable loop hundreds a second."""
KEPT = 0.75
"""The share that each buzz leaves."""


class Easing:
    """Watches the motor's command; `share` only falls, until the next mode begins."""

    __slots__ = ("_motor_Nm", "_signs", "_step_Nm", "share")

    def __init__(self) -> None:
        self.share, self._signs, self._motor_Nm, self._step_Nm = 1.0, 0.0, 0.0, 0.0

    def see(self, motor_Nm: float) -> None:
        """Take the command of this millisecond."""
        step, before = motor_Nm - self._motor_Nm, self._step_Nm
        self._motor_Nm, self._step_Nm = motor_Nm, step
        self._signs *= 1.0 - TICK_S / FADE_S
        if step * before < 0.0 and min(abs(step), abs(before)) > BUZZ_NM:
            self._signs += 1.0
        if self._signs > SIGNS:
            self.share, self._signs = self.share * KEPT, 0.0
