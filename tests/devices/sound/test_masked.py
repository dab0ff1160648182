"""The noise around presentations: on with the first, silent in a pause, and no presentation counts without it."""

from dataclasses import dataclass, field

import numpy as np

from palpate.devices.device import DeviceFault
from palpate.devices.samples import HandMounted
from palpate.devices.sound.device import Masked, MaskingNoise, Settings
from palpate.devices.sound.output import Tape
from palpate.protocols.events import Aside, Fault, Present, Reply
from tests.devices.stage.seats import Clock, Desk, Window, trial_of

RATE = 8000


@dataclass
class Headphones(Tape):
    """A tape whose plug can be pulled."""

    unplugged: bool = False
    opened: int = 0

    def open(self):
        self.opened += 1

    def fault(self):
        self.advance()
        return DeviceFault("noise", "link_lost", "noise: the headphones are gone.") if self.unplugged else None


@dataclass
class Room:
    clock: Clock = field(default_factory=Clock)
    played: list = field(default_factory=list)

    def __post_init__(self):
        self.out = Headphones(RATE, lambda: self.clock.t_ns / 1e9, self.played.append)
        chosen = Settings(kind="masking_noise", driver="twin", rate_hz=RATE)
        self.noise = MaskingNoise("noise", chosen, self.out)
        self.noise.open()
        self.masked = Masked(HandMounted(), self.noise)

    def level(self, seconds):
        """RMS of what sounds in the next seconds."""
        self.played.clear()
        self.clock.t_ns += round(seconds * 1e9)
        self.out.advance()
        return float(np.sqrt(np.mean(np.concatenate(self.played) ** 2)))

    def act(self, request, desk):
        return self.masked.perform(request, Window(self.clock), desk, self.clock)


def test_the_noise_is_silent_in_a_rest_while_people_answer_and_comes_back():
    room = Room()
    room.masked.handle_aside(Aside({"do": "go_on"}))
    assert room.level(1.0) == 0.0, "nothing was presented yet"
    room.act(Present(trial_of("T07")), Desk(confirms=[0.5]))
    room.level(1.0)
    room.masked.handle_aside(Aside({"do": "pause", "by": "participant"}))
    room.level(1.0)
    assert room.level(1.0) == 0.0
    room.masked.handle_aside(Aside({"do": "go_on", "by": "participant"}))
    room.level(1.0)
    assert room.level(1.0) > 0.0


def test_the_noise_comes_with_the_first_presentation_and_stays_while_people_rate():
    room = Room()
    assert room.level(1.0) == 0.0
    assert isinstance(room.act(Present(trial_of("T07")), Desk(confirms=[0.5])), Reply)
    room.level(1.0)
    assert room.level(5.0) > 0.01
    room.noise.safe()
    assert room.level(0.05) > 0.0
    assert room.level(1.0) == 0.0


def test_a_pause_is_silent_and_going_on_is_not():
    room, request = Room(), Present(trial_of("T07"))
    desk = Desk(asides=[Aside({"do": "pause"}), Aside({"do": "go_on"})], confirms=[9.0])
    assert room.act(request, desk).value == {"do": "pause"}
    room.level(1.0)
    assert room.level(1.0) == 0.0
    assert room.act(request, desk).value == {"do": "go_on"}
    assert isinstance(room.act(request, desk), Reply)
    assert room.level(1.0) > 0.01


def test_a_presentation_whose_headphones_went_is_marked_and_the_next_one_waits_until_they_are_put_right():
    room = Room()

    class Pulls:
        def perform(self, request, window, desk, now_ns):
            room.out.unplugged = True
            return Reply({"presented": True})

    room.masked.presents = Pulls()
    outcome = room.act(Present(trial_of("T07")), Desk())
    assert outcome == Fault({"device": "noise", "what": "link_lost", "message": "noise: the headphones are gone."})
    room.out.unplugged, room.masked.presents = False, HandMounted()
    desk = Desk(confirms=[0.2, 0.2])
    assert isinstance(room.act(Present(trial_of("T07")), desk), Reply)
    assert desk.demands[0] == "noise: the headphones are gone. Put it right, then confirm."
    assert room.out.opened == 2
    assert room.level(2.0) > 0.01
