"""A study whose door follows the sliders: simulated, on the record, replayed, exported, and at a rig."""

import struct
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pytest

from palpate.devices.door.making import Doors, maker_for
from palpate.devices.rig.file import rig_path
from palpate.devices.window.calibration import Calibration, write_calibration
from palpate.protocols.events import Aside, Fault, Present, Reply
from palpate.protocols.plan import compile_plan
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import read_study
from palpate.studies.live.opening import live_plan
from palpate.studies.live.options import LiveOptions
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import replay
from palpate.studies.sessions.rig import RigError
from palpate.studies.sessions.session import start
from palpate.studies.simulation.rig import simulated
from palpate.studies.stimuli.made_doors import FORCES, SETTINGS, MadeDoorPresenter, made_doors
from tests.devices.door.link.lines_for_tests import Bench, Lab
from tests.studies.live.rig_rooms import TWINS, live_doors
from tests.studies.shipped import read_shipped

STUDY = read_shipped("door_authoring")


@pytest.fixture(scope="module")
def live_study(tmp_path_factory):
    """The shipped study with a live door."""
    return live_doors(tmp_path_factory.mktemp("live"))


@pytest.fixture(scope="module")
def session(live_study, tmp_path_factory):
    """A simulated session."""
    lab = tmp_path_factory.mktemp("lab")
    plan = compile_plan(live_study.study, ParticipantRow("P001"))
    return start(lab, plan, simulated(live_study.study, live_study.folder), 1).path


def presented(record):
    return [event for event in record.events if event.kind == "reply" and event.value.get("presented")]


def stream(event, name):
    (block,) = [block for block in event.samples if block.stream == name]
    return np.frombuffer(block.data, "<f4").reshape(-1, len(block.channels)), block


def test_a_study_without_live_has_the_form_and_the_digest_that_it_had():
    plan = compile_plan(STUDY.study, ParticipantRow("P001"))
    assert "live" not in STUDY.study.definition() and not plan.trials[0].form.live
    assert "live" not in Present(plan.trials[0], {"a": 1.0}).body()


def test_what_was_set_and_the_designed_door_are_on_record(session):
    doors, moved = Doors(maker_for(None)), 0
    for event in presented(read(session)):
        settings, block = stream(event, SETTINGS)
        forces, _ = stream(event, FORCES)
        assert block.channels[:4] == ("time", "made", "taken", "refused") and len(settings) == len(forces)
        assert event.value["live"]["changes"] == len(settings) - 1 and event.value["live"]["missed"] == 0
        assert (settings[:, 3] == 0).all() and (settings[:, 0] == forces[:, 0]).all()
        assert min([0.05, *(b - a for a, b in pairwise(settings[:, 0].tolist()))]) >= 0.0499  # 20 Hz at most
        wish = dict(zip(block.channels[4:], map(float, settings[-1, 4:]), strict=True))
        assert wish == pytest.approx(event.value["left_at"], abs=1e-4)
        assert forces[-1, 1:] == pytest.approx(np.array(doors.force_N(event.value["left_at"])), abs=1e-3)
        assert forces[0, 1:] == pytest.approx(np.array(event.value["made"]["force_N"]), abs=1e-3)
        moved += len(settings) > 1
    assert moved  # somebody moved a slider while the door was felt


def test_the_next_form_starts_from_where_the_sliders_were_left(session):
    record = read(session)
    previous = [
        e.value["previous"] for e in record.events if e.kind == "request" and e.value.get("form") == "authoring"
    ]
    left = [event.value["left_at"] for event in presented(record)]
    assert [answers for answers in previous if answers is not None] == left


def test_the_hand_meets_the_changed_force_without_a_step(session):
    event = next(e for e in presented(read(session)) if e.value["live"]["changes"] > 5)
    (door,) = [block for block in event.samples if block.stream == "door"]
    felt = np.frombuffer(door.data, "<f4").reshape(-1, 2)
    end = np.interp(felt[-1, 0], np.arange(621) / 10, stream(event, FORCES)[0][-1, 1:])
    assert felt[-1, 1] == pytest.approx(end, abs=0.01)
    start_N = np.interp(felt[:, 0], np.arange(621) / 10, event.value["made"]["force_N"])
    assert np.abs(felt[:, 1] - start_N).max() > 1.0  # it is another door by then


def test_the_session_replays_byte_for_byte_and_its_streams_are_read(session):
    from palpate.analysis.streams.recorded_streams import streams_of

    replay(session)
    record = read(session)
    names = [stream.name for stream in streams_of(record, 1)]
    assert names.count(SETTINGS) == names.count(FORCES) == names.count("door") >= 1


def test_live_goes_with_task_authoring_and_a_window(live_study, tmp_path):
    for change, message in [
        (("needs: [door_generator, window]", "needs: [door_generator]"), "goes together with it"),
        (("live: {show_force: true}", "live: {rate: 40}"), "rate"),
    ]:
        text = (live_study.folder / "study.yaml").read_text(encoding="utf-8")
        (tmp_path / "study.yaml").write_text(text.replace(*change), encoding="utf-8")
        (tmp_path / "stimuli.csv").write_bytes((live_study.folder / "stimuli.csv").read_bytes())
        with pytest.raises(ValueError, match=message):
            read_study(tmp_path / "study.yaml")


@dataclass
class LivePages:
    """A window whose lines are moved at the n-th look; the participant stops at a look."""

    pages: object
    moves: dict = field(default_factory=dict)
    stops_at: int = 10**9
    looks: int = 0

    def wait_for(self, key, desk, ready):
        return self.pages.wait_for(key, desk, ready)

    def show_live(self, request, desk, ready, moved):
        def looked():
            self.looks += 1
            move = self.moves.get(self.looks, {})
            moved(move() if callable(move) else move, self.looks >= self.stops_at)
            return ready()

        return self.pages.wait_for("live", desk, looked)


def at_the_rig(live_study, bench=None, **window):
    lab = Lab(bench or Bench()).opened()
    doors, plan = made_doors(None), compile_plan(live_study.study, ParticipantRow("P001"))
    lab.door.profile_for = doors.force_N
    presents = MadeDoorPresenter(lab.door, doors, lambda changes: setattr(lab.door, "changes", changes))
    wish = {attribute.name: 50.0 for attribute in plan.study.attributes}
    request, pages = Present(plan.trials[0], wish), LivePages(lab.window, **window)
    outcomes = []
    while not outcomes or not isinstance(outcomes[-1], Reply | Fault):
        outcomes.append(presents.perform(request, pages, lab.desk, lab.bench.line.now_ns))
    return lab, outcomes


def rows_of(outcomes, name):
    blocks = [block for outcome in outcomes for block in getattr(outcome, "samples", ()) if block.stream == name]
    assert [block.first for block in blocks] == np.cumsum([0, *(block.count for block in blocks)]).tolist()[:-1]
    data = b"".join(block.data for block in blocks)
    return [struct.unpack_from(f"<{len(blocks[0].channels)}f", data, at) for at in
            range(0, len(data), 4 * len(blocks[0].channels))]  # fmt: skip


def test_a_rig_s_door_follows_until_the_participant_stops_it(live_study):
    moves = {30: {"Easy-to-pull": 60.0}, 60: {"Easy-to-pull": 90.0}}
    lab, outcomes = at_the_rig(live_study, moves=moves, stops_at=400)
    reply = outcomes[-1].value
    assert reply["ended"] == "participant" and reply["left_at"]["Easy-to-pull"] == 90.0
    assert reply["live"]["changes"] == 2 and reply["live"]["refused"] == 0
    rows = rows_of(outcomes, SETTINGS)
    assert [row[4] for row in rows] == [50.0, 60.0, 90.0] and all(row[2] - row[0] < 0.2 for row in rows)
    assert len(lab.bench.plant.plant.changed) == 2 and lab.at_rest and lab.door.changes is None
    assert "live" in lab.window.shown and "feel_now" not in lab.window.shown


def test_what_was_set_before_the_door_was_unplugged_is_on_record(live_study):
    bench = Bench()

    def unplugged():
        bench.link.lose(OSError("unplugged"))
        return {}

    lab, outcomes = at_the_rig(live_study, bench, moves={30: {"Damped": 80.0}, 200: unplugged})
    assert outcomes[-1].value["what"] == "link_lost" and lab.door.changes is None
    assert [row[5] for row in rows_of(outcomes, SETTINGS)] == [50.0, 80.0]


def test_a_window_that_cannot_show_the_form_is_refused(live_study):
    lab, doors = Lab().opened(), made_doors(None)
    plan = compile_plan(live_study.study, ParticipantRow("P001"))
    request = Present(plan.trials[0], {attribute.name: 50.0 for attribute in plan.study.attributes})
    with pytest.raises(RigError, match="no window to show it in"):
        MadeDoorPresenter(lab.door, doors).perform(request, lab.window, lab.desk, lab.bench.line.now_ns)


def test_a_pause_goes_on_with_the_same_door_and_a_repeat_begins_anew(live_study):
    lab, doors = Lab().opened(), made_doors(None)
    lab.door.profile_for = doors.force_N
    plan = compile_plan(live_study.study, ParticipantRow("P001"))
    presents = MadeDoorPresenter(lab.door, doors, lambda changes: setattr(lab.door, "changes", changes))
    request = Present(plan.trials[0], {attribute.name: 50.0 for attribute in plan.study.attributes})
    pages, now = LivePages(lab.window), lab.bench.line.now_ns
    lab.desk.at[lab.bench.line.t_ms + 300] = Aside({"do": "repeat", "which": "this"})
    while not isinstance(outcome := presents.perform(request, pages, lab.desk, now), Aside):
        assert lab.door.changes is not None
    assert outcome.value["do"] == "repeat" and lab.door.changes is None


def test_a_stand_in_for_the_door_is_refused_because_it_cannot_follow_and_a_rig_s_twin_is_not(live_study, tmp_path):
    with pytest.raises(RigError, match="palpate rig simulate"):
        live_plan(live_study, tmp_path, LiveOptions(twins=True, no_window=True))
    (path := rig_path(tmp_path)).parent.mkdir(parents=True)
    path.write_text(TWINS, encoding="utf-8")
    write_calibration(tmp_path, Calibration((1280, 720), 3.6, 0, "2026-01-01"))
    description = live_plan(live_study, tmp_path, LiveOptions()).description
    assert description["twins"] == ["door_generator"] and description["settings"]["door"]["driver"] == "twin"
