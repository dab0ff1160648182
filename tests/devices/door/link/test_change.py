"""A door that changes while it is felt: by the firmware, by the plant, over the line, and where it cannot."""

from itertools import pairwise

import pytest

from palpate.devices.door.firmware.ailments import Ailing
from palpate.devices.door.firmware.twin_plant import TwinPlant
from palpate.devices.door.link import dialogue
from palpate.devices.door.link import messages as says
from palpate.devices.door.link.codes import Reason, State
from palpate.devices.door.link.limits import Limits, change_for_door, profile_for_door
from palpate.devices.door.link.messages import Profile
from palpate.devices.door.live import PERIOD_NS, LiveDoor
from palpate.devices.door.plant.rendering import FASTEST_NM_S, PASSAGE_TICKS, STEP_RAD, Passage, Rendered
from palpate.protocols.events import NS, Aside, Fault, Reply
from tests.devices.door.firmware.plants import TinyPlant, out_and_back
from tests.devices.door.link.lines_for_tests import Bench, Lab, request

LIGHT, HEAVY = (10.0,) * 621, (40.0,) * 621
END = 620 * STEP_RAD


def test_a_passage_ends_at_the_new_profile_and_no_torque_changes_faster_than_it_may():
    rendered = Rendered([-50.0] * 621, END, 500.0)
    passage = Passage(rendered, [50.0] * 621)
    torques = [passage.at(0.5)]
    while isinstance(passage, Passage):
        passage = passage.after_tick()
        torques.append(passage.at(0.5))
    assert torques[0] == -50 and torques[-1] == 50
    assert len(torques) - 1 == 500  # 100 N m at 200 N m/s
    assert max(abs(b - a) for a, b in pairwise(torques)) <= FASTEST_NM_S / 1000 + 1e-9


def test_a_small_change_takes_one_tick_and_a_change_during_a_passage_does_not_step():
    passage = Passage(Rendered([0.0] * 621, END, 500.0), [1.0] * 621)
    for _ in range(PASSAGE_TICKS // 2):
        passage = passage.after_tick()
    assert passage.at(0.5) == pytest.approx(0.5)
    again = Passage(passage, [-3.0] * 621)
    assert again.at(0.5) == pytest.approx(0.5) and again.at(END + 0.1) == pytest.approx(0.5 + 50.0)


def test_every_mixture_is_within_the_slope_of_the_two():
    up = [min(60.0, 0.5 * n) for n in range(621)]
    passage = Passage(Rendered(up, END, 500.0), [-one for one in up])
    for _ in range(123):
        passage = passage.after_tick()
    assert max(abs(b - a) for a, b in pairwise(passage.mixed().torques())) <= 0.5 + 1e-9


def playing(plant=None):
    bench = Bench(plant or Ailing(TinyPlant(out_and_back(ms=3000)), "silent"))
    link = bench.connect().link
    dialogue.greet(link)
    profile = profile_for_door(LIGHT, 0.9, Limits())
    dialogue.upload(link, profile)
    dialogue.play(link, profile)
    return bench, link, profile


def test_the_device_passes_over_to_what_it_was_sent_while_it_plays():
    bench, link, _ = playing()
    heavy = change_for_door(HEAVY, 0.9, Limits(), 62.0)
    assert dialogue.change(link, heavy) == ""
    assert bench.plant.plant.changed == [heavy.torque_Nm] and bench.firmware.memory.profile == heavy
    assert bench.firmware.state is State.playing


def test_heartbeats_go_between_the_parts_of_a_profile_and_not_behind_them():
    bench, link, _ = playing()
    firmware, beat, late = bench.firmware, bench.line.every_ms, []

    def every_ms(t_ms):
        late.append(firmware.t_ms - firmware.beat_ms)
        beat(t_ms)

    bench.line.every_ms = every_ms
    assert dialogue.change(link, change_for_door(HEAVY, 0.9, Limits(), 62.0)) == ""
    assert len(late) > 25  # so many ms does the line take for a profile, and 40 ms without a heartbeat are a fault
    assert max(late) <= 15


def test_what_does_not_fit_is_refused_and_the_door_plays_on():
    bench, link, light = playing()
    for profile, reason in [
        (Profile((36.0,) * 621, 40.0), "bad_value"),
        (Profile((61.0,) * 621, 62.0), "over_limit"),
    ]:
        assert reason in dialogue.change(link, profile)
    assert not bench.plant.plant.changed and bench.firmware.memory.profile == light
    with pytest.raises(dialogue.Refused) as refused:
        link.ask(says.Change(1))
    assert refused.value.nak.reason == Reason.incomplete and bench.firmware.state is State.playing


def test_a_change_at_rest_is_refused():
    bench, link, _ = playing()
    dialogue.rest(link)
    with pytest.raises(dialogue.Refused):
        link.ask(says.Change(1))
    assert not bench.plant.plant.changed


def test_the_torque_in_the_hand_follows_without_a_step():
    bench, link, _ = playing(TwinPlant(3))
    machine = bench.plant.machine
    for _ in range(120):
        link.keep_alive()
        bench.line.run(10)
    assert dialogue.change(link, change_for_door(HEAVY, 0.9, Limits(), 62.0)) == ""
    torques = []
    for _ in range(300):
        link.keep_alive()
        bench.line.run(1)
        torques.append(machine.rendered.at(0.5))
    assert torques[-1] == pytest.approx(36.0, abs=1e-5)
    assert max(b - a for a, b in pairwise(torques)) <= FASTEST_NM_S / 1000 + 1e-9


def felt_on(bench, changes, at):
    """What a presentation comes to while things happen at these milliseconds, and the lab."""
    lab = Lab(bench, LIGHT).opened()
    lab.door.changes = changes
    start_ms = bench.line.t_ms
    lab.desk.at |= {start_ms + ms: what for ms, what in at.items()}
    return lab.until((Reply, Fault), request())[0], lab


@pytest.fixture
def wishes():
    return {"Soft": 10.0}


def live(wishes):
    return LiveDoor(lambda: dict(wishes), lambda wish: (wish["Soft"],) * 621, {"Soft": 10.0}, count_ns=lambda: 0)


def test_a_presentation_takes_the_changes_along(wishes):
    bench, changes = Bench(), live(wishes)
    outcome, lab = felt_on(bench, changes, {300: lambda: wishes.update(Soft=30.0)})
    assert isinstance(outcome, Reply) and outcome.value["ended"] == "brought_back"
    (change,) = changes.changes
    assert change.wish == {"Soft": 30.0} and 0 < change.taken_ns - change.seen_ns < 0.1 * NS
    assert bench.plant.plant.changed[0][0] == pytest.approx(27.0)
    assert outcome.value["profile"] == f"{lab.door.change_for((30.0,) * 621, 62.0).crc:08x}"
    assert changes.ticks >= 20 and changes.missed == 0


def test_a_change_beyond_the_limits_leaves_the_door_as_it_is_and_says_why_again_after_a_pause(wishes):
    bench, changes = Bench(Ailing(TinyPlant(out_and_back(waits_ms=1500)), "silent")), live(wishes)
    too_much, the_same_door = (lambda: wishes.update(Soft=99.0)), (lambda: wishes.update(Hard=1.0))
    pause, go_on = Aside({"do": "pause"}), Aside({"do": "go_on"})
    outcome, lab = felt_on(bench, changes, {300: too_much, 400: pause, 600: go_on, 900: the_same_door})
    change, again = changes.changes
    assert isinstance(outcome, Reply) and change.taken_ns is None and "at most 60 N m are allowed" in change.why
    assert not bench.plant.plant.changed
    assert again.why == change.why
    stays = f"playing, does not change: {change.why}"
    states = [state["door"] for state in lab.desk.statuses if "door" in state]
    assert [state for state in states if state.startswith("playing")] == ["playing", stays, "playing", stays]


def test_a_door_that_is_unplugged_in_mid_play_is_a_fault_and_keeps_what_was_taken(wishes):
    bench, changes = Bench(), live(wishes)

    def unplugged():
        bench.link.lose(OSError("unplugged"))

    outcome, _ = felt_on(bench, changes, {300: lambda: wishes.update(Soft=30.0), 700: unplugged})
    assert isinstance(outcome, Fault) and outcome.value["what"] == "link_lost" and len(changes.changes) == 1


def test_ticks_that_pass_unseen_are_counted_and_not_repeated(wishes):
    changes = live(wishes)
    for at in (0, 1, 4.5, 5, 6):
        wishes["Soft"] += 1
        if changes.newer(round(at * PERIOD_NS)) is not None:
            changes.took(round(at * PERIOD_NS), "")
    assert (changes.ticks, changes.missed, len(changes.changes)) == (5, 2, 5)
    changes.rests()
    assert changes.newer(100 * PERIOD_NS) is None and changes.missed == 2
