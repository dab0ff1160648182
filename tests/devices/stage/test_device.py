"""Mounting a sample: confirmed by a scan or a key, the wrong one refused by name, a scanner that goes is put right."""

import os
import pty
import tty
from contextlib import contextmanager, suppress

import pytest
from pydantic import ValidationError

from palpate.devices.device import DeviceError
from palpate.devices.stage.device import Settings, Stage, make
from palpate.devices.stage.scanner import Lines, Scanner, known_codes
from palpate.protocols.events import Aside, Fault, Part, Present, Reply
from tests.devices.stage.seats import Clock, Desk, Window, trial_of

STIMULI = [trial_of("T07").stimulus, trial_of("T12").stimulus]


def settings(**changes):
    return Settings(**{"kind": "stage", "driver": "barcode", **changes})


@contextmanager
def scanner_port():
    """The scanner's end of a serial line, and the port's name."""
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    try:
        yield ours, os.ttyname(theirs)
    finally:
        for handle in (ours, theirs):
            with suppress(OSError):
                os.close(handle)


@contextmanager
def stage_at(port, **changes):
    stage = make("stage", settings(port=port, **changes), None)
    stage.known = known_codes(STIMULI)
    stage.open()
    try:
        yield stage
    finally:
        stage.close()


def sends(ours, parts):
    """A scanner that sends one part at each turn of the window."""
    parts = list(parts)

    def turn():
        if parts:
            os.write(ours, parts.pop(0))

    return turn


@pytest.mark.needs("serial")
@pytest.mark.parametrize("end", [b"\r", b"\n", b"\r\n"])
def test_the_right_code_confirms_however_its_line_ends_and_in_however_many_parts_it_comes(end):
    with scanner_port() as (ours, port), stage_at(port) as stage:
        clock, desk = Clock(), Desk()
        window = Window(clock, sends(ours, [b"", b"T0", b"7" + end]))
        outcome = stage.perform(Present(trial_of("T07")), window, desk, clock)
    assert outcome == Reply({"presented": True, "by": "barcode", "seconds": outcome.value["seconds"], "code": "T07"})
    assert outcome.value["seconds"] > 0
    assert desk.demands == ["Put in place: T07 (sandpaper P60, box 3)"] and desk.standing is None
    assert window.pages == ["changing_sample"]


@pytest.mark.needs("serial")
def test_a_wrong_sample_is_refused_by_name_and_the_right_one_is_taken_then():
    with scanner_port() as (ours, port), stage_at(port) as stage:
        clock, desk = Clock(), Desk()
        window = Window(clock, sends(ours, [b"8801234567893\r", b"", b"nonsense\r\n", b"t07\r"]))
        outcome = stage.perform(Present(trial_of("T07")), window, desk, clock)
    assert outcome.value["wrong"] == ["8801234567893", "NONSENSE"] and outcome.value["by"] == "barcode"
    assert desk.demands == [
        "Put in place: T07 (sandpaper P60, box 3)",
        "Put in place: T07 (sandpaper P60, box 3). T07 is requested, T12 was scanned.",
        "Put in place: T07 (sandpaper P60, box 3). T07 is requested, NONSENSE was scanned.",
    ]


@pytest.mark.needs("serial")
def test_a_column_of_codes_names_the_sample_and_its_id_does_too():
    for code in (b"8801234567893\n", b"T12\n"):
        with scanner_port() as (ours, port), stage_at(port) as stage:
            clock = Clock()
            outcome = stage.perform(Present(trial_of("T12")), Window(clock, sends(ours, [code])), Desk(), clock)
        assert outcome.value["by"] == "barcode"


@pytest.mark.needs("serial")
def test_a_code_scanned_before_the_request_confirms_nothing():
    with scanner_port() as (ours, port), stage_at(port) as stage:
        os.write(ours, b"T07\r")
        clock, desk = Clock(), Desk(confirms=[1.0])
        outcome = stage.perform(Present(trial_of("T07")), Window(clock), desk, clock)
    assert outcome.value["by"] == "experimenter" and "code" not in outcome.value


@pytest.mark.needs("serial")
def test_a_key_alone_is_not_enough_where_the_rig_says_so():
    with scanner_port() as (ours, port), stage_at(port, key_confirms=False) as stage:
        clock, desk = Clock(), Desk(confirms=[0.1])
        window = Window(clock, sends(ours, [b""] * 20 + [b"T07\r"]))
        outcome = stage.perform(Present(trial_of("T07")), window, desk, clock)
    assert outcome.value["by"] == "barcode" and outcome.value["seconds"] > 0.9


@pytest.mark.needs("serial")
def test_an_aside_leaves_the_demand_and_the_refusal_standing_and_the_pause_out_of_the_time():
    with scanner_port() as (ours, port), stage_at(port) as stage:
        clock, desk, request = Clock(), Desk(), Present(trial_of("T07"))
        desk.asides = [None, None, Aside({"do": "pause"})]
        outcome = stage.perform(request, Window(clock, sends(ours, [b"T12\r"])), desk, clock)
        assert outcome == Aside({"do": "pause"})
        clock.t_ns += 60 * 10**9
        desk.asides = [Aside({"do": "go_on"})]
        assert stage.perform(request, Window(clock), desk, clock) == Aside({"do": "go_on"})
        outcome = stage.perform(request, Window(clock, sends(ours, [b"T07\r"])), desk, clock)
    assert outcome.value["wrong"] == ["T12"] and outcome.value["seconds"] < 1.0
    assert len(desk.demands) == 2 and desk.demands[1].endswith("T07 is requested, T12 was scanned.")


@pytest.mark.needs("serial")
def test_a_scanner_that_is_pulled_is_a_fault_and_the_next_trial_asks_for_it_first():
    with scanner_port() as (ours, port), stage_at(port) as stage:
        clock = Clock()
        pulled = Window(clock, lambda: os.close(ours))
        outcome = stage.perform(Present(trial_of("T07")), pulled, Desk(), clock)
        assert isinstance(outcome, Fault) and outcome.value["what"] == "link_lost"
        assert outcome.value["message"].startswith(f"stage: the scanner at {port} is gone")
    with scanner_port() as (ours, port):
        stage.scanner.port = port
        desk = Desk(confirms=[0.2])
        window = Window(clock, sends(ours, [b"", b"", b"", b"", b"", b"", b"T07\r"]))
        outcome = stage.perform(Present(trial_of("T07")), window, desk, clock)
        stage.close()
    assert outcome.value["by"] == "barcode"
    assert desk.demands[0].endswith("Put it right, then confirm.") and "is gone" in desk.demands[0]


@pytest.mark.needs("serial")
def test_a_scanner_that_is_still_gone_is_a_fault_again_and_not_a_loop():
    with scanner_port() as (_ours, port), stage_at(port) as stage:
        stage.scanner.close()
        stage.scanner.port = "/dev/no-such-port"
        clock = Clock()
        outcome = stage.perform(Present(trial_of("T07")), Window(clock), Desk(), clock)
        assert outcome.value["message"].startswith("stage: the scanner's port /dev/no-such-port cannot be opened")
        outcome = stage.perform(Present(trial_of("T07")), Window(clock), Desk(confirms=[3.0]), clock)
        assert isinstance(outcome, Fault) and clock.t_ns >= 3 * 10**9


@pytest.mark.needs("serial")
def test_a_port_that_is_not_there_is_refused_when_the_rig_is_opened():
    with pytest.raises(DeviceError, match="stage: the scanner's port /dev/no-such-port cannot be opened: No such file"):
        Scanner("stage", "/dev/no-such-port", 9600).open()


def test_a_typed_code_counts_as_a_scan_even_where_the_same_wrong_one_comes_twice():
    stage, clock, desk = Stage("stage", settings()), Clock(), Desk()
    typed = ["T12", "T12", "T07"]

    def turn():
        if typed:
            desk.typed = typed.pop(0)

    outcome = stage.perform(Present(trial_of("T07")), Window(clock, turn), desk, clock)
    assert outcome.value == {**outcome.value, "by": "barcode", "code": "T07", "wrong": ["T12", "T12"]}


def test_lines_are_whole_codes_whatever_the_bytes():
    lines = Lines()
    assert lines.feed(b"\r\n\n") == []
    assert lines.feed(b"AB") + lines.feed(b"C\rD\n\rE") == ["ABC", "D"]
    assert lines.feed(b"x" * 10_000) == [] and len(lines.part) <= 256
    assert lines.feed(b"\nT07\n") == ["T07"]
    assert lines.feed(b"\xff\xfe\r") == ["\ufffd\ufffd"]


def test_a_code_that_two_samples_share_names_neither():
    both = [stimulus.model_copy(update={"columns": {"barcode": "1"}}) for stimulus in STIMULI]
    assert known_codes(both) == {"T07": "T07", "T12": "T12"}


def test_by_hand_it_is_as_ever_and_the_twin_takes_its_time():
    clock, desk = Clock(), Desk(confirms=[0.5])
    outcome = make("stage", settings(driver="hand"), None).perform(Present(trial_of("T07")), Window(clock), desk, clock)
    assert outcome.value["by"] == "experimenter" and outcome.value["seconds"] == pytest.approx(0.5, abs=0.051)
    began = clock.t_ns
    outcome = make("stage", settings(driver="twin", mount_s=4.0), None).perform(
        Present(trial_of("T07")), Window(clock), desk, clock
    )
    assert outcome.value["by"] == "twin" and clock.t_ns - began >= 4 * 10**9


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"driver": "hand", "key_confirms": False}, "else nothing confirms a sample"),
        ({"driver": "hand", "port": "/dev/ttyUSB0"}, "port needs driver: barcode"),
        ({"baud": 1}, "greater than or equal to 300"),
    ],
)
def test_settings_that_make_no_sense_are_refused(given, message):
    with pytest.raises(ValidationError, match=message):
        settings(**given)


@pytest.mark.parametrize(
    ("part", "says"),
    [
        (Part(1, 2, blank=True), "Interval 1 of 2: put nothing in place"),
        (Part(2, 2, sides=("", "T07")), "Put in place left: nothing, right: T07 (sandpaper P60, box 3)"),
    ],
)
def test_nothing_and_several_at_once_are_confirmed_by_the_key_without_a_code(part, says):
    stage, clock, desk = Stage("stage", settings(key_confirms=False)), Clock(), Desk(confirms=[2.0])
    reply = stage.perform(Present(trial_of("T07"), part=part), Window(clock), desk, clock)
    assert reply.value == {"presented": True, "by": "experimenter", "seconds": 2.0} and desk.demands == [says]
