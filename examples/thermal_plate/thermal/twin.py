"""A simulated plate at the other end of the line: it answers in bytes, warms and cools with a lag, and has noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import exp

from palpate.devices.noise import gaussians

from .line import UNHEARD, FrameError, frame, parse

LAG_S = 0.25
"""Time constant between the element and the surface that touches the skin."""
SILENCE_S, FASTEST_DEGC_S = 1.0, 50.0
"""A plate that hears nothing for so long goes to its neutral level, as fast as it can."""


@dataclass
class Plant:
    """A surface that follows its element with a first-order lag; the element goes to the target at a ramp."""

    degC: float = 32.0
    element_degC: float = 32.0
    target_degC: float = 32.0
    ramp_degC_s: float = 8.0

    def advance(self, seconds: float) -> None:
        """Let time pass. The solution of the lag's equation is exact for steps of any length."""
        away = self.target_degC - self.element_degC
        ramping = min(seconds, abs(away) / self.ramp_degC_s)
        slope = self.ramp_degC_s if away > 0 else -self.ramp_degC_s
        behind = (self.degC - self.element_degC + slope * LAG_S) * exp(-ramping / LAG_S)
        self.element_degC += slope * ramping
        self.degC = self.element_degC - slope * LAG_S + behind
        if seconds > ramping or ramping == abs(away) / self.ramp_degC_s:
            self.element_degC = self.target_degC
        held = exp(-(seconds - ramping) / LAG_S)
        self.degC = self.element_degC + (self.degC - self.element_degC) * held


def peak_degC(neutral_degC: float, target_degC: float, ramp_degC_s: float, seconds: float) -> float:
    """Return the temperature farthest from neutral of a surface that goes to a target for so long, and back."""
    plant = Plant(neutral_degC, neutral_degC, target_degC, ramp_degC_s)
    plant.advance(seconds)
    peak, plant.target_degC = plant.degC, neutral_degC
    while abs(plant.degC - neutral_degC) >= abs(peak - neutral_degC):  # it still goes on, behind its element
        peak = plant.degC
        plant.advance(0.001)
    return peak


@dataclass
class TwinPort:
    """The port of a simulated plate; `elapsed_s` is its clock, `noise_degC` the SD of a reading."""

    elapsed_s: Callable[[], float]
    noise_degC: float = 0.02
    seed: int = 1
    plant: Plant = field(default_factory=Plant)
    neutral_degC: float = 32.0
    status: int = 0
    heard_s: float = 0.0
    at_s: float = 0.0
    readings: int = 0
    answers: bytes = b""

    def __post_init__(self) -> None:
        self.heard_s = self.at_s = self.elapsed_s()

    def pass_time(self) -> None:
        """Bring the plate to the present; it goes to neutral where it heard nothing for too long."""
        now_s, alone_s = self.elapsed_s(), self.heard_s + SILENCE_S
        if now_s > alone_s and self.plant.target_degC != self.neutral_degC:
            self.plant.advance(alone_s - self.at_s)
            self.at_s, self.plant.target_degC, self.plant.ramp_degC_s = alone_s, self.neutral_degC, FASTEST_DEGC_S
            self.status |= UNHEARD
        self.plant.advance(now_s - self.at_s)
        self.at_s = now_s

    def write(self, data: bytes) -> int:
        """Do what a request says, and answer it; a damaged one is ignored."""
        self.pass_time()
        try:
            letter, number = parse(data)
        except FrameError:
            return len(data)
        self.heard_s = self.at_s
        self.answers += self._answer(letter, number)
        return len(data)

    def _answer(self, letter: str, number: int) -> bytes:
        match letter:
            case "N" if 300 <= number <= 340:
                self.neutral_degC = number / 10
            case "T" if 0 <= number <= 500:
                self.plant.target_degC, self.status = number / 10, self.status & ~UNHEARD
            case "R" if 0 < number <= 10 * FASTEST_DEGC_S:
                self.plant.ramp_degC_s = number / 10
            case "M":
                self.readings += 1
                [chance] = gaussians(1, "thermal.plate", self.seed, self.readings)
                return frame("M", round(100 * (self.plant.degC + self.noise_degC * chance)))
            case "S":
                return frame("S", self.status)
            case _:
                return frame("E", ord(letter))
        return frame(letter, number)

    def read(self, size: int) -> bytes:
        """Return so many bytes of the answers, or those that there are."""
        taken, self.answers = self.answers[:size], self.answers[size:]
        return taken

    def reset_input_buffer(self) -> None:
        """Drop the answers."""
        self.answers = b""

    def close(self) -> None:
        """Do nothing: the plate stays on."""


class Unplugged:
    """A port whose cable was pulled."""

    def write(self, _data: bytes, /) -> int:
        """Raise OSError."""
        raise OSError("unplugged")

    def read(self, _size: int, /) -> bytes:
        """Raise OSError."""
        raise OSError("unplugged")

    def reset_input_buffer(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""
