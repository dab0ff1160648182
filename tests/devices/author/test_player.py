"""Playing on the door, in virtual time: opened, stopped, refused, failed, put right, and not to be had."""

from dataclasses import dataclass, field

import pytest

from palpate.devices.author.player import Played, Player
from palpate.devices.device import DeviceError
from palpate.devices.door.firmware.ailments import Ailing
from palpate.devices.door.link.limits import Limits
from palpate.devices.door.link.simulator import DoorSimulator, Setup
from palpate.devices.door.live import LiveDoor
from tests.devices.author.fakes import FakeMaker
from tests.devices.author.windows_for_tests import click, open_author, typed, wish
from tests.devices.door.firmware.plants import TinyPlant
from tests.devices.door.link.lines_for_tests import FRAME_MS, Bench

GENTLE = tuple([10.0] * 621)


@dataclass
class VirtualScreen:
    """A window whose looks take virtual time; `at` are things that are done at a look, counted from 1."""

    bench: Bench
    states: list = field(default_factory=list)
    places: list = field(default_factory=list)
    at: dict = field(default_factory=dict)
    looks: int = 0

    def turn(self):
        self.looks += 1
        assert self.looks < 5000, "nothing ever happens"
        until_ms = self.bench.line.t_ms + FRAME_MS
        link = self.bench.link
        while link is not None and link.broken is None and self.bench.line.t_ms < until_ms:
            link.pump((until_ms - self.bench.line.t_ms) / 1000)
        self.bench.line.run(max(0, until_ms - self.bench.line.t_ms))
        if self.looks in self.at:
            self.at.pop(self.looks)()

    def door_is(self, state, problem=""):
        self.states.append(state if not problem else (state, problem))

    def hand_at(self, place):
        self.places.append(place)


def player_on(bench=None, **limits):
    bench = bench or Bench()
    setup = Setup(0.9, Limits(**limits), 500, 30.0, "serial")
    screen = VirtualScreen(bench)
    player = Player(DoorSimulator("door", setup, bench.connect), screen, bench.line.now_ns)
    player.door.open()
    player.opened = True
    return player, screen


def test_the_door_is_felt_and_the_hand_is_seen_on_the_curve():
    player, screen = player_on()
    assert player.play(GENTLE, "design A") == Played("played")
    angles = [place[0] for place in screen.places if place is not None]
    assert max(angles) > 60 and screen.places[-1] is None
    assert screen.states[0] == "playing" and screen.states[-1] == "rest" and not player.busy


def test_what_changes_meanwhile_is_felt_by_the_hand_that_holds_the_door():
    player, screen = player_on()
    force = {"N": 10.0}
    changes = LiveDoor(lambda: dict(force), lambda setting: (setting["N"],) * 621, dict(force), count_ns=lambda: 0)
    screen.at[60] = lambda: force.update(N=30.0)
    assert player.play(GENTLE, "design A", changes) == Played("played")
    assert [change.why for change in changes.changes] == [""] and changes.missed == 0
    assert screen.bench.plant.plant.changed[0][0] == pytest.approx(27.0)
    assert player.door.changes is None


def test_stop_ends_it_and_closing_the_window_too():
    player, screen = player_on(Bench(Ailing(TinyPlant(), "silent")))
    screen.at[50] = player.press
    assert player.play(GENTLE, "design A") == Played("stopped")
    screen.at[screen.looks + 50] = player.leave
    assert player.play(GENTLE, "design A") == Played("stopped")
    assert screen.bench.firmware.state.name == "safe"


def test_a_second_play_while_it_plays_is_refused_in_words():
    player, screen = player_on()
    messages = []
    screen.at[20] = lambda: messages.append(player.play(GENTLE, "design B"))
    player.play(GENTLE, "design A")
    assert messages == [Played("door_busy", "busy")] and messages[0].wrong


def test_a_profile_beyond_the_limits_is_refused_and_a_milder_one_plays():
    player, _ = player_on(torque_Nm=20.0)
    refused = player.play([40.0] * 621, "design A")
    assert refused.key == "door_refuses" and "36.0 N m at 0 degrees, at most 20 N m" in refused.why
    assert player.play(GENTLE, "design A") == Played("played")


def test_a_failure_is_shown_and_must_be_fixed_before_the_door_plays_again():
    bench = Bench(Ailing(TinyPlant(), "silent"))
    player, screen = player_on(bench)
    screen.at[30] = lambda: setattr(bench, "beats", False)
    failed = player.play(GENTLE, "design A")
    assert failed.key == "door_failed" and "heartbeat" in failed.why
    bench.beats = True
    states = len(screen.states)
    screen.at[screen.looks + 20] = player.press
    screen.at[screen.looks + 200] = player.press
    assert player.play(GENTLE, "design A") == Played("stopped")
    assert screen.states[states][0] == "asking" and "Put it right" in screen.states[states][1]


def test_a_door_that_cannot_be_opened_is_reported_and_tried_again_the_next_time():
    bench, tries = Bench(), []

    def connect():
        tries.append(1)
        if len(tries) == 1:
            raise DeviceError("door: the port /dev/ttyUSB0 cannot be opened")
        return bench.connect()

    screen = VirtualScreen(bench)
    player = Player(
        DoorSimulator("door", Setup(0.9, Limits(), 500, 30.0, "serial"), connect), screen, bench.line.now_ns
    )
    screen.turn = lambda: None
    assert player.play(GENTLE, "design A") == Played("door_none", "door: the port /dev/ttyUSB0 cannot be opened")
    assert screen.states == ["connecting", "rest"]


@dataclass
class HandedPlayer:
    """A player whose end the test sets, and what the designer does meanwhile."""

    played: Played
    meanwhile: object = lambda: None
    simulated: bool = True
    busy: bool = False
    pressed: int = 0
    left: bool = False
    was: tuple = ()

    def play(self, force_N, name, changes=None):
        self.changes = changes
        self.busy, self.was = True, (force_N, name)
        self.meanwhile()
        self.busy = False
        return self.played

    def press(self):
        self.pressed += 1

    def leave(self):
        self.left = True


def words(room):
    return next(element for element in room.main.placed() if element.name == "words").text


@pytest.mark.parametrize(
    ("played", "message"),
    [
        (Played("played"), "opened and brought back"),
        (Played("door_refuses", "60 N m at 3 degrees"), "The door refuses this profile: 60 N m at 3 degrees"),
        (Played("door_failed", "no heartbeat"), "at rest: no heartbeat"),
        (Played("door_none", "not plugged in"), "no door to play on. not plugged in"),
    ],
)
def test_the_window_shows_how_playing_ended(tmp_path, played, message):
    room = open_author(tmp_path, player=HandedPlayer(played))
    wish(room, 0, 80)
    click(room, "play")
    assert message in words(room)
    assert room.player.was == (tuple(FakeMaker().design(room.main.work.setting.wish).force_N), "design A")


def test_while_it_plays_the_sliders_live_and_the_button_stops(tmp_path):
    room = open_author(tmp_path)
    room.player = player = HandedPlayer(Played("stopped"))

    def meanwhile():
        room.door_is("playing")
        assert player.changes.newer(0) is None
        wish(room, 0, 90)
        assert player.changes.newer(50_000_000) == tuple(FakeMaker().design(room.main.work.setting.wish).force_N)
        player.changes.took(60_000_000, "")
        wish(room, 0, 80)
        player.changes.newer(100_000_000)
        player.changes.took(110_000_000, "61 N m at 3 degrees")
        room.turn()
        assert "stays as it was: 61 N m at 3 degrees" in words(room)
        typed(room, "o")
        assert "Stop the door first" in words(room)
        click(room, "play")
        room.door_is("rest")

    player.meanwhile = meanwhile
    click(room, "play")
    assert player.pressed == 1 and room.main.work.setting.wish[0] == 80


def test_the_door_s_wish_to_be_put_right_is_shown(tmp_path):
    room = open_author(tmp_path, player=HandedPlayer(Played("played")))
    room.door_is("asking", "the emergency stop is pressed. Put it right, then confirm.")
    assert "emergency stop" in words(room) and room.main.status.play == "confirm"
