"""What the twin's accelerometer measures is the waveform of the stimulus, to the sample."""

import numpy as np
import pytest

from palpate.devices.device import DeviceError
from palpate.protocols.events import Aside, Fault, Part, Reply
from palpate.protocols.study import Stimulus
from palpate.signals.vibration import read_vibration, waveform, waveform_sha256
from tests.devices.vibrator.benches import DESK, RATE, SINE, Window, bench, played, present, run

STIMULI = {
    "sine": SINE,
    "noise": {"waveform": "noise", "level_db": "10", "low_hz": "50", "high_hz": "300", "seconds": "0.3"},
    "pulses": {"waveform": "pulses", "level_db": "10", "pulse_hz": "8", "pulse_s": "0.02", "seconds": "0.5"},
    "burst": {**SINE, "waveform": "burst", "pulse_hz": "10", "pulse_s": "0.05", "ramp_s": "0.01"},
}


def part(**changes):
    return Part(**{"interval": 1, "of": 2, "blank": False, "seconds": 0.2, "gap_s": 0.5, **changes})


@pytest.mark.parametrize("name", STIMULI)
def test_what_comes_out_is_the_waveform_with_its_onset_peak_rms_and_duration(name):
    vibrator, clock = bench()
    run(vibrator, clock, 0.1)
    reply = vibrator.perform(present(STIMULI[name]), Window(clock), DESK, clock.ns)
    wished = waveform(read_vibration("a", STIMULI[name]), RATE)
    onset = round(reply.value["vibration"]["onset_ns"] * RATE / 1e9)
    _, felt = played(vibrator)
    assert onset == 800 and not felt[:onset].any()
    part = felt[onset : onset + len(wished)]
    assert part.max() == pytest.approx(wished.max(), rel=0.05)
    assert np.sqrt(np.mean(part**2)) == pytest.approx(np.sqrt(np.mean(wished**2)), rel=0.001)
    assert np.abs(part - wished).max() < 0.05 * np.abs(wished).max()
    assert abs(np.correlate(felt, wished, "valid").argmax() - onset) <= 1
    assert np.abs(felt[onset + len(wished) :]).max(initial=0) < 0.03 * np.abs(wished).max()
    assert reply.value["vibration"]["sha256"] == waveform_sha256(wished)
    assert reply.value["vibration"]["seconds"] == len(wished) / RATE and reply.value["by"] == "twin"
    assert reply.value["vibration"]["level_db"] == float(STIMULI[name]["level_db"])


def test_intervals_keep_their_gap_to_the_sample_and_a_blank_one_is_silent():
    vibrator, clock = bench()
    with pytest.raises(DeviceError, match=r"'a': 0.25 s, longer than its interval of 0.2 s"):
        vibrator.check(present().trial.stimulus, 0.2)
    first = vibrator.perform(present(part=part()), Window(clock), DESK, clock.ns)
    blank = vibrator.perform(present(part=part(interval=2, blank=True)), Window(clock), DESK, clock.ns)
    third = vibrator.perform(present(part=part(interval=3)), Window(clock), DESK, clock.ns)
    onsets = [reply.value["vibration"]["onset_ns"] * RATE / 1e9 for reply in (first, blank, third)]
    assert onsets == pytest.approx([0, 0.75 * RATE, 1.45 * RATE], abs=0.01)
    assert blank.value["vibration"]["blank"] and "sha256" not in blank.value["vibration"]
    volts, _ = played(vibrator)
    assert not volts[round(0.301 * RATE) : round(onsets[2])].any() and volts[round(onsets[2]) + 1]


def test_a_vibration_lasts_as_its_interval_or_is_followed_by_silence():
    vibrator, clock = bench()
    unsaid = {key: value for key, value in SINE.items() if key != "seconds"}
    replies = [
        vibrator.perform(present(columns, part(interval=n, seconds=0.6, blank=n == 2)), Window(clock), DESK, clock.ns)
        for n, columns in enumerate((SINE, SINE, unsaid, SINE), 1)
    ]
    onsets_s = [reply.value["vibration"]["onset_ns"] / 1e9 for reply in replies]
    assert np.diff(onsets_s) == pytest.approx([1.1, 1.1, 1.1], abs=1e-6), "no interval gives itself away"
    assert [reply.value["vibration"]["seconds"] for reply in replies] == [0.25, 0.6, 0.6, 0.25]


def test_what_the_check_allows_is_played_in_a_longer_interval_too():
    """The silence after a vibration is no part of what the limits are about: neither its length nor its drift."""
    vibrator, clock = bench(limits={"longest_s": 0.5})
    vibrator.check(present().trial.stimulus, 0.6)
    reply = vibrator.perform(present(part=part(seconds=0.6)), Window(clock), DESK, clock.ns)
    assert isinstance(reply, Reply) and reply.value["vibration"]["seconds"] == 0.25


def test_a_pause_silences_it_and_afterwards_the_stimulus_is_played_whole():
    vibrator, clock = bench()
    request = present()
    window = Window(clock, {10: Aside({"do": "note", "text": "x"}), 15: Aside({"do": "pause"})})
    assert vibrator.perform(request, window, DESK, clock.ns).value["do"] == "note"
    assert vibrator.player.busy
    assert vibrator.perform(request, window, DESK, clock.ns).value["do"] == "pause"
    window.asides[60] = Aside({"do": "go_on"})
    assert vibrator.perform(request, window, DESK, clock.ns).value["do"] == "go_on"
    volts, _ = played(vibrator)
    assert not volts[round(0.2 * RATE) :].any()
    again_ns = clock.ns()
    reply = vibrator.perform(request, window, DESK, clock.ns)
    assert isinstance(reply, Reply) and reply.value["vibration"]["onset_ns"] >= again_ns


def test_an_output_that_fails_is_a_fault_and_after_its_repair_it_plays_again():
    vibrator, clock = bench()
    working = vibrator.output.fault
    from palpate.devices.device import DeviceFault

    vibrator.output.fault = lambda: DeviceFault("shaker", "link_lost", "shaker: unplugged")
    vibrator.output.start = lambda _fill: (_ for _ in ()).throw(DeviceError("shaker: still not there"))
    event = vibrator.perform(present(), Window(clock), DESK, clock.ns)
    assert isinstance(event, Fault) and event.value["what"] == "link_lost"
    del vibrator.output.start
    vibrator.output.fault = working
    assert isinstance(vibrator.perform(present(), Window(clock), DESK, clock.ns), Reply)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"frequency_hz": "5"}, r"shaker: stimulus 'a': 5 Hz; its calibration covers 10 to 1000 Hz"),
        (
            {"level_db": "60"},
            r"'a': 60 dB re 1 um peak at 200 Hz.*limits.peak_m_s2|'a' \(60 dB re 1 um peak, sine\): a peak of 1579",
        ),
        (
            {"level_db": "38", "seconds": "0.1"},
            r"'a': 38 dB re 1 um peak at 200 Hz; its calibration covers -\d+(.\d)? to 2\d(.\d)? dB re 1 um peak for it",
        ),
        ({"level_db": "-79"}, r"'a': -79 dB re 1 um peak at 200 Hz; its calibration covers"),
        ({"seconds": "30", "reference": "m_s2"}, r"30 s; at most limits.longest_s = 20 s are played"),
    ],
)
def test_a_stimulus_outside_calibration_or_limits_is_refused_by_its_name_and_level(columns, message):
    vibrator, _ = bench({"peak_V": 0.1, "rms_V": 0.1})
    with pytest.raises(DeviceError, match=message):
        vibrator.check(Stimulus(id="a", columns={**SINE, **columns}))


def test_the_covered_levels_are_those_that_are_accepted():
    vibrator, _ = bench({"peak_V": 0.1, "rms_V": 0.1})
    with pytest.raises(DeviceError) as refused:
        vibrator.check(Stimulus(id="a", columns={**SINE, "level_db": "38", "seconds": "0.1"}))
    low, high = (float(word) for word in str(refused.value).split("covers ")[1].split(" dB")[0].split(" to "))
    for level in (low, high):
        vibrator.check(Stimulus(id="a", columns={**SINE, "level_db": f"{level}", "seconds": "0.1"}))
    for level in (low - 0.2, high + 0.2):
        with pytest.raises(DeviceError):
            vibrator.check(Stimulus(id="a", columns={**SINE, "level_db": f"{level}", "seconds": "0.1"}))
