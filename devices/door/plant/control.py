"""The 1 kHz cascade: an outer torque loop asks for speed, the inner velocity loop asks the motor for torque.

Less of the torque loop is used once a hand that is damped too much for it makes the motor buzz.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign

from palpate.devices.door.plant.parameters import TICK_S, Parameters
from palpate.devices.door.plant.rendering import Rendered

SLOW_RAD_S = 0.03
"""Below this speed the brake is let go: at rest its direction is unknown."""
CALM_S = 0.5
"""How fast the damping of a shaken arm fades."""
ONE_TURN = 0.25
"""What a reversal adds to an arm's shaking."""
SWUNG_RAD_S = 0.1
"""A reversal between speeds above this is one."""
GENTLE_S = 0.1
"""How fast what the hand was holding turns into what the profile asks, once playing begins."""
LOOK_RAD = 0.03
"""How far along the profile the brake's torque must be wanted: the way of a pull during the brake's lag."""
BUZZ_NM = 3.0
"""The motor's command turns back between two steps of more than this: one sign of buzzing, far above the noise."""
FADE_S = 0.02
SIGNS = 6.0
"""So many signs, fading with `FADE_S`, are a buzz: a pull or a stop gives a few, an unstable loop hundreds a second."""
KEPT = 0.75
"""The share that each buzz leaves."""


@dataclass(slots=True)
class Asked:
    """What the controller asks of the machine for the next period."""

    motor_Nm: float = 0.0
    brake_A: float = 0.0
    commanded_Nm: float = 0.0


class Cascade:
    """PID on the torque error -> speed; P on the speed error -> torque; the integral stops at the motor's limit."""

    __slots__ = (
        "_anchor", "_brake", "_dry", "_easing", "_error", "_feed", "_gains", "_held", "_lag", "_motor_limit", "_shaken",
        "_speed_limit", "_sum", "_went",
    )  # fmt: skip

    def __init__(self, parameters: Parameters) -> None:
        self._gains, self._brake = parameters.control, parameters.brake
        self._motor_limit = min(parameters.motor.torque_limit_Nm, parameters.limits.torque_Nm)
        self._speed_limit = parameters.limits.speed_rad_s
        self._lag = TICK_S / (parameters.brake.lag_s + TICK_S)
        self._dry = parameters.arm.coulomb_Nm + parameters.brake.drag_Nm
        self._feed = 0.0
        self.reset(0.0)

    def reset(self, angle_rad: float) -> None:
        """Forget all errors, and stand where the arm is."""
        self._error = self._sum = self._shaken = self._went = self._held = 0.0
        self._easing = Easing()
        self._anchor = angle_rad

    @property
    def share(self) -> float:
        """How much of the torque loop is in use."""
        return self._easing.share

    def begin(self, rendered: Rendered, angle_rad: float, felt_Nm: float) -> None:
        """Before playing: the handle goes on with the torque that the hand has on it, and no jerk."""
        self._held = felt_Nm - rendered.at(angle_rad)

    def hold(self, angle_rad: float, speed_rad_s: float) -> Asked:
        """Stay where the machine was armed, with the brake on."""
        wanted = self._clipped_speed(self._gains.hold_1_s * (self._anchor - angle_rad))
        return Asked(self._inner(wanted - speed_rad_s, 0.0), self._brake.current_limit_A, 0.0)

    def play(self, rendered: Rendered, angle_rad: float, speed_rad_s: float, felt_Nm: float) -> Asked:
        """Let the handle feel the profile, read as far ahead as the answer takes."""
        gains = self._gains
        command = rendered.at(angle_rad + gains.error_lookahead_s * speed_rad_s)
        ahead = rendered.at(angle_rad + gains.lookahead_s * speed_rad_s)
        command, ahead, self._held = command + self._held, ahead + self._held, self._held * (1.0 - TICK_S / GENTLE_S)
        damping = self._calming(speed_rad_s)
        if angle_rad > rendered.end_rad or angle_rad < 0.0:
            damping += gains.end_damping_Nm_s_rad
        command += damping * speed_rad_s
        ahead += damping * speed_rad_s
        error = felt_Nm - command
        brake_A = self._braking(rendered, angle_rad, speed_rad_s)
        rate = gains.torque_d * (error - self._error) / TICK_S
        share = self._easing.share
        wanted = self._clipped_speed(share * (gains.torque_p * error + rate) + self._sum)
        motor = self._inner(wanted - speed_rad_s, self._friction(speed_rad_s) - ahead)
        self._easing.see(motor)
        if abs(motor) < self._motor_limit or motor * error < 0.0:
            self._sum = self._clipped_speed(self._sum + TICK_S * share * gains.torque_i * error)
        self._error = error
        return Asked(motor, brake_A, command)

    def _calming(self, speed_rad_s: float) -> float:
        """Damping that answers a shaking arm: it grows with each reversal but the first and fades within a second.

        A pull does not reverse; an arm that is let go on a steep profile does, again and again.
        """
        self._shaken *= 1.0 - TICK_S / CALM_S
        if abs(speed_rad_s) > SWUNG_RAD_S:
            went, self._went = self._went, copysign(1.0, speed_rad_s)
            if went * self._went < 0.0:
                self._shaken = min(self._shaken + ONE_TURN, 1.0)
        return self._gains.calming_Nm_s_rad * max(0.0, self._shaken - ONE_TURN)

    def _inner(self, miss_rad_s: float, feed_Nm: float) -> float:
        asked = feed_Nm + self._gains.velocity_p * miss_rad_s
        return min(max(asked, -self._motor_limit), self._motor_limit)

    def _braking(self, rendered: Rendered, angle_rad: float, speed_rad_s: float) -> float:
        """Current for the brake's share of the resistance to come, in whole steps; none where the profile pulls."""
        torque = 0.0
        if speed_rad_s > SLOW_RAD_S:
            gains = self._gains
            least = gains.brake_share * rendered.least(angle_rad, angle_rad + LOOK_RAD)
            torque = gains.brake_step_Nm * max(0, int(least / gains.brake_step_Nm))
        return min(torque / self._brake.gain_Nm_A, self._brake.current_limit_A) if torque else 0.0

    def follow(self, brake_A: float) -> None:
        """Keep track of what the brake's coil does with its command."""
        self._feed += self._lag * (brake_A - self._feed)

    def _friction(self, speed_rad_s: float) -> float:
        """What bearing and brake are thought to take, in the direction of motion."""
        friction = self._dry + self._brake.gain_Nm_A * self._feed
        return friction * min(max(speed_rad_s / SLOW_RAD_S, -1.0), 1.0)

    def _clipped_speed(self, speed_rad_s: float) -> float:
        return speed_rad_s if abs(speed_rad_s) <= self._speed_limit else copysign(self._speed_limit, speed_rad_s)


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
