"""The door machine: plant, sensors and 1 kHz control together, one millisecond at a time.

Control is a cascade: an outer torque loop commands a speed, the inner velocity loop commands the motor's torque. The
share of the torque loop is reduced when a heavily damped hand makes the motor buzz.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import copysign, pi, tau
from random import Random
from typing import Literal

from palpate.devices.door.plant.dynamics import Dynamics
from palpate.devices.door.plant.hand import Hand, human
from palpate.devices.door.plant.parameters import DEFAULT, TICK_S, Parameters
from palpate.devices.door.plant.rendering import STEP_RAD, Passage, Rendered
from palpate.signals.doors.grid import POINTS

SLOW_RAD_S = 0.03
"""Below this speed the brake is released: at rest its direction is unknown."""
CALM_S = 0.5
"""Time constant with which the damping of a shaken arm fades."""
ONE_TURN = 0.25
"""Increase of an arm's shaking by a reversal."""
SWUNG_RAD_S = 0.1
"""Least speed before and after a reversal."""
GENTLE_S = 0.1
"""Time in which the torque held by the hand turns into the profile's, once playing begins."""
LOOK_RAD = 0.03
"""How far along the profile the brake's torque must be needed: the distance of a pull during the brake's lag."""
BUZZ_NM = 3.0
"""A reversal of the motor's command between two larger steps is one sign of buzzing, far above the noise."""
FADE_S = 0.02
SIGNS = 6.0
"""So many signs, fading with `FADE_S`, are a buzz: a pull or a stop causes a few, an unstable loop hundreds a
second.
"""
KEPT = 0.75
"""Factor of the share at each buzz."""


@dataclass(slots=True)
class Command:
    """The controller's command for the next period."""

    motor_Nm: float = 0.0
    brake_A: float = 0.0
    commanded_Nm: float = 0.0


class Cascade:
    """A cascade of two controllers: PID on the torque error -> speed, P on the speed error -> torque.

    The integral stops at the motor's limit.
    """

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
        """Forget all errors, and use the arm's current angle."""
        self._error = self._sum = self._shaken = self._went = self._held = 0.0
        self._easing = Easing()
        self._anchor = angle_rad

    @property
    def share(self) -> float:
        """Return the share of the torque loop that is in use."""
        return self._easing.share

    def begin(self, rendered: Rendered, angle_rad: float, felt_Nm: float) -> None:
        """Begin with the torque of the hand on the handle, so that playing starts without a jerk."""
        self._held = felt_Nm - rendered.at(angle_rad)

    def hold(self, angle_rad: float, speed_rad_s: float) -> Command:
        """Hold the position at which the machine was armed, with the brake on."""
        target = self._clipped_speed(self._gains.hold_1_s * (self._anchor - angle_rad))
        return Command(self._inner(target - speed_rad_s, 0.0), self._brake.current_limit_A, 0.0)

    def play(self, rendered: Rendered, angle_rad: float, speed_rad_s: float, felt_Nm: float) -> Command:
        """Render the profile at the handle, read ahead by the delay of the response."""
        gains = self._gains
        command = rendered.at(angle_rad + gains.error_lookahead_s * speed_rad_s)
        ahead = rendered.at(angle_rad + gains.lookahead_s * speed_rad_s)
        command, ahead, self._held = command + self._held, ahead + self._held, self._held * (1.0 - TICK_S / GENTLE_S)
        # Damping that answers a shaking arm: it grows with each reversal but the first and fades within a second. A
        # pull does not reverse; an arm that is let go on a steep profile does, again and again.
        self._shaken *= 1.0 - TICK_S / CALM_S
        if abs(speed_rad_s) > SWUNG_RAD_S:
            went, self._went = self._went, copysign(1.0, speed_rad_s)
            if went * self._went < 0.0:
                self._shaken = min(self._shaken + ONE_TURN, 1.0)
        damping = self._gains.calming_Nm_s_rad * max(0.0, self._shaken - ONE_TURN)
        if angle_rad > rendered.end_rad or angle_rad < 0.0:
            damping += gains.end_damping_Nm_s_rad
        command += damping * speed_rad_s
        ahead += damping * speed_rad_s
        error = felt_Nm - command
        brake_A = self._braking(rendered, angle_rad, speed_rad_s)
        rate = gains.torque_d * (error - self._error) / TICK_S
        share = self._easing.share
        target = self._clipped_speed(share * (gains.torque_p * error + rate) + self._sum)
        # What bearing and brake are thought to take, in the direction of motion.
        friction = self._dry + self._brake.gain_Nm_A * self._feed
        friction *= min(max(speed_rad_s / SLOW_RAD_S, -1.0), 1.0)
        motor = self._inner(target - speed_rad_s, friction - ahead)
        self._easing.see(motor)
        if abs(motor) < self._motor_limit or motor * error < 0.0:
            self._sum = self._clipped_speed(self._sum + TICK_S * share * gains.torque_i * error)
        self._error = error
        return Command(motor, brake_A, command)

    def _inner(self, miss_rad_s: float, feed_Nm: float) -> float:
        command = feed_Nm + self._gains.velocity_p * miss_rad_s
        return min(max(command, -self._motor_limit), self._motor_limit)

    def _braking(self, rendered: Rendered, angle_rad: float, speed_rad_s: float) -> float:
        """Return the brake's current for its share of the resistance ahead, in steps; 0 where the profile pulls."""
        torque = 0.0
        if speed_rad_s > SLOW_RAD_S:
            gains = self._gains
            least = gains.brake_share * rendered.least(angle_rad, angle_rad + LOOK_RAD)
            torque = gains.brake_step_Nm * max(0, int(least / gains.brake_step_Nm))
        return min(torque / self._brake.gain_Nm_A, self._brake.current_limit_A) if torque else 0.0

    def follow(self, brake_A: float) -> None:
        """Update the model of the brake's coil with its command."""
        self._feed += self._lag * (brake_A - self._feed)

    def _clipped_speed(self, speed_rad_s: float) -> float:
        return speed_rad_s if abs(speed_rad_s) <= self._speed_limit else copysign(self._speed_limit, speed_rad_s)


class Easing:
    """A monitor of the motor's command; `share` only falls, until the next mode begins."""

    __slots__ = ("_motor_Nm", "_signs", "_step_Nm", "share")

    def __init__(self) -> None:
        self.share, self._signs, self._motor_Nm, self._step_Nm = 1.0, 0.0, 0.0, 0.0

    def see(self, motor_Nm: float) -> None:
        """Use the command of this millisecond."""
        step, before = motor_Nm - self._motor_Nm, self._step_Nm
        self._motor_Nm, self._step_Nm = motor_Nm, step
        self._signs *= 1.0 - TICK_S / FADE_S
        if step * before < 0.0 and min(abs(step), abs(before)) > BUZZ_NM:
            self._signs += 1.0
        if self._signs > SIGNS:
            self.share, self._signs = self.share * KEPT, 0.0


Mode = Literal["off", "hold", "play"]
TICK_US = round(TICK_S * 1e6)


@dataclass(frozen=True, slots=True)
class Tick:
    """The readings of the machine's sensors in a millisecond; `torque_Nm` is the hand's, positive opening."""

    t_us: int
    angle_rad: float
    velocity_rad_s: float
    torque_Nm: float
    brake_A: float
    commanded_Nm: float
    motor_Nm: float


class Machine:
    """A simulated door machine with the interface of a real one.

    `off`: motor without torque, brake fully on. `hold`: motor on, the arm stays in place. `play`: the handle renders
    the loaded profile. The hand's clock starts when `play` begins; before, the hand rests at its start.
    """

    def __init__(self, parameters: Parameters = DEFAULT, hand: Hand | None = None) -> None:
        self.parameters = parameters
        self.hand = human() if hand is None else hand
        self.dynamics = Dynamics(parameters)
        self.sensing = Sensing(parameters, self.dynamics.angle_rad)
        self.cascade = Cascade(parameters)
        self.handle_Nm = 0.0
        self._ticks, self._began = 0, -1
        self._mode: Mode = "off"
        self.load([0.0] * POINTS, (POINTS - 1) * STEP_RAD)

    @property
    def mode(self) -> Mode:
        """Return the mode of the machine."""
        return self._mode

    @mode.setter
    def mode(self, mode: Mode) -> None:
        if mode != self._mode:
            self.cascade.reset(self.sensing.angle_rad)
            if mode == "play":
                self.cascade.begin(self.rendered, self.sensing.angle_rad, self.sensing.torque_Nm)
                self._began = self._ticks
        self._mode = mode

    def load(self, torque_Nm: Sequence[float], end_rad: float) -> None:
        """Load 621 torques against opening, over 0 to 62 degrees; a stop is rendered at `end_rad`.

        Torques behind the end are padding and never rendered: the last value holds.

        Raises:
            PlantError: another number of torques, one that is not finite, or an end outside the profile.
        """
        self.rendered = Rendered(torque_Nm, end_rad, self.parameters.control.end_stiffness_Nm_rad)

    def change(self, torque_Nm: Sequence[float]) -> None:
        """Change to another profile with the same stop, without a step in torque. Raises PlantError as `load`."""
        self.rendered = Passage(self.rendered, torque_Nm)

    def step(self) -> Tick:
        """Advance by 1 ms: read the sensors, command motor and brake, and move the plant."""
        sensing, dynamics = self.sensing, self.dynamics
        if isinstance(self.rendered, Passage):
            self.rendered = self.rendered.after_tick()
        command = self._control()
        hand_s = (self._ticks - self._began) * TICK_S if self._began >= 0 else 0.0
        dynamics.advance(command.motor_Nm, command.brake_A, self.hand, hand_s)
        self.handle_Nm = dynamics.hand_torque()
        self._ticks += 1
        self.cascade.follow(command.brake_A)
        sensing.read(dynamics.angle_rad, self.handle_Nm, command.motor_Nm + sensing.torque_Nm)
        return Tick(
            self._ticks * TICK_US, sensing.angle_rad, sensing.speed_rad_s, sensing.torque_Nm, dynamics.drives.coil_A,
            command.commanded_Nm, dynamics.drives.motor_Nm,
        )  # fmt: skip

    def _control(self) -> Command:
        sensing = self.sensing
        if self._mode == "play":
            return self.cascade.play(self.rendered, sensing.angle_rad, sensing.speed_rad_s, sensing.torque_Nm)
        if self._mode == "hold":
            return self.cascade.hold(sensing.angle_rad, sensing.speed_rad_s)
        return Command(0.0, self.parameters.brake.current_limit_A, 0.0)


class Sensing:
    """An encoder that counts whole steps, a torque sensor with noise and a converter, an observer for the speed."""

    __slots__ = (
        "_bias", "_gains", "_inertia", "_noise", "_random", "_step_Nm", "_turn", "angle_rad", "speed_rad_s",
        "torque_Nm",
    )  # fmt: skip

    def __init__(self, parameters: Parameters, angle_rad: float) -> None:
        sensors = parameters.sensors
        self._turn = tau / sensors.counts_per_turn
        self._noise, self._step_Nm, self._random = sensors.torque_noise_Nm, sensors.torque_step_Nm, Random(sensors.seed)
        rate = 2 * pi * parameters.control.observer_Hz
        self._gains = (3 * rate * TICK_S, 3 * rate**2 * TICK_S, rate**3 * TICK_S)
        self._inertia = parameters.arm.inertia_kg_m2
        self.angle_rad, self.speed_rad_s, self.torque_Nm = self._counted(angle_rad), 0.0, 0.0
        self._bias = 0.0

    def read(self, angle_rad: float, torque_Nm: float, known_Nm: float) -> None:
        """Read the sensors; `known_Nm` is the known torque of motor and hand, for the observer.

        The observer (Luenberger 1964) predicts angle and speed over the period from that torque, and corrects both and
        the unknown torque (friction, a stop) by the encoder's angle: the speed has no filter lag.
        """
        rate = known_Nm / self._inertia + self._bias
        ahead = self.angle_rad + TICK_S * (self.speed_rad_s + 0.5 * TICK_S * rate)
        missed = self._counted(angle_rad) - ahead
        self.angle_rad = ahead + self._gains[0] * missed
        self.speed_rad_s += TICK_S * rate + self._gains[1] * missed
        self._bias += self._gains[2] * missed
        noisy = torque_Nm + (self._random.gauss(0.0, self._noise) if self._noise else 0.0)
        self.torque_Nm = round(noisy / self._step_Nm) * self._step_Nm if self._step_Nm else noisy

    def _counted(self, angle_rad: float) -> float:
        return round(angle_rad / self._turn) * self._turn
