"""Numbers, occlusions, recordings and the twin of a tracker: everything but the network."""

from __future__ import annotations

import math
import random
import subprocess
import sys
import time
from itertools import count, islice
from threading import Thread

import numpy as np
import pytest
from pydantic import ValidationError

from palpate.devices.device import DeviceError, DeviceFault
from palpate.devices.health import samples
from palpate.devices.tracker.device import Settings, make
from palpate.devices.tracker.recorded import read_track
from palpate.devices.tracker.samples import Numbering, OcclusionDetector

MOTIVE = """Format Version,1.23,Take Name,Door,Capture Frame Rate,120.000000,Export Frame Rate,120.000000,\
Rotation Type,Quaternion,Length Units,Meters,Coordinate Space,Global

,Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Marker,Marker,\
Marker,Marker,Marker,Marker
,Name,Door,Door,Door,Door,Door,Door,Door,Door:M1,Door:M1,Door:M1,Hand,Hand,Hand
,ID,a,a,a,a,a,a,a,b,b,b,c,c,c
,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Position,Position,Position,Position,Position,Position
Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,X,Y,Z,X,Y,Z
0,0.000000,0,0,0,1,0.5,0.6,0.7,1.1,1.2,1.3,2.1,2.2,2.3
1,0.008333,0,0,0,1,0.5,0.6,0.7,,,,2.2,2.3,2.4
2,0.016667,0,0,0,1,0.5,0.6,0.7,1.4,1.5,1.6,2.3,2.4,2.5
"""


class Line:
    """A scene whose marker goes along x at 100 mm/s."""

    def position_mm(self, rate_hz):
        for first in count(0, 30):
            t = np.arange(first, first + 30) / rate_hz
            yield np.column_stack([100 * t, 0 * t + 5, 0 * t + 9])


def device(tmp_path, elapsed=None, **settings):
    tracker = make("tracker", Settings(kind="tracker", **settings), tmp_path)
    tracker.elapsed_s = elapsed
    return tracker


def all_of(tracker, scene, seconds):
    """Everything that `seconds` give, had at once."""
    tracker.elapsed_s = lambda: seconds
    tracker.open()
    tracker.expect(scene)
    tracker.start(lambda: 0)
    blocks = [block for _ in range(100) for block in tracker.read(0)["position"]]
    tracker.stop()
    return samples(tracker.signals[0], blocks), blocks


def test_jitter_and_a_rate_two_per_cent_off_are_no_loss():
    chance = random.Random(2)
    for off in (0.98, 1.0, 1.02):
        times = [k / 120 / off + chance.gauss(0, 0.08 / 120) for k in range(5000)]
        numbering = Numbering(120)
        numbers = [n for first in range(0, 5000, 7) for n in numbering.number(times[first : first + 7])]
        assert numbers == list(range(5000))


def test_every_lost_sample_is_counted_whatever_else_happens():
    chance = random.Random(3)
    received = sorted(chance.sample(range(20_000), 19_000))
    numbering = Numbering(120)
    times = [k / 120 * (1 + 50e-6) + chance.gauss(0, 0.05 / 120) for k in received]
    numbers = [numbering.number([t])[0] for t in times]
    # What is lost before the first one cannot be known.
    assert numbers == [k - received[0] for k in received]


def test_samples_that_were_stamped_late_together_are_not_taken_for_lost():
    on_time = [k / 120 for k in range(40)]
    late = [*on_time[:20], *[on_time[25]] * 5, *on_time[25:]]
    numbering = Numbering(120)
    numbers = [*numbering.number(late[:20]), *numbering.number(late[20:26]), *numbering.number(late[26:])]
    assert numbers[-1] in range(39, 41)
    assert numbers == sorted(set(numbers))


def test_a_rounded_recording_may_repeat_itself():
    rows = [(1.0, 2.0, 3.0, True)] * 3
    assert [OcclusionDetector().see(row)[3] for row in rows[:1]] == [1]
    strict, lenient = OcclusionDetector(), OcclusionDetector(repeats=True)
    assert [strict.see(row)[3] for row in rows] == [1, 0, 0]
    assert [lenient.see(row)[3] for row in rows] == [1, 1, 1]


def test_the_twin_sees_the_scene_with_its_noise_and_the_same_again(tmp_path):
    got, blocks = all_of(device(tmp_path, driver="twin", noise_mm=0.1), Line(), 10.0)
    assert len(got) == 1201
    wrong = got[:, 0] - 100 * np.arange(1201) / 120
    assert wrong.std() == pytest.approx(0.1, rel=0.1)
    assert blocks[-1].device_s == pytest.approx(10.0)
    again, _ = all_of(device(tmp_path, driver="twin", noise_mm=0.1), Line(), 10.0)
    np.testing.assert_array_equal(got, again)
    other, _ = all_of(device(tmp_path, driver="twin", noise_mm=0.1, seed=1), Line(), 10.0)
    assert not np.array_equal(got, other)


@pytest.mark.parametrize("hides", ["nan", "zeros", "frozen"])
def test_the_twins_occlusions_are_flagged_however_they_show(tmp_path, hides):
    tracker = device(tmp_path, driver="twin", occlusions_per_s=1.0, occlusion_s=0.25, hides=hides)
    got, _ = all_of(tracker, None, 40.0)
    hidden = got[:, 3] == 0
    assert 0.1 < hidden.mean() < 0.3
    assert np.isnan(got[hidden, :3]).all()
    assert np.isfinite(got[~hidden]).all()


def test_the_twins_clock_may_go_fast(tmp_path):
    got, blocks = all_of(device(tmp_path, driver="twin", drift_ppm=5000), Line(), 20.0)
    assert len(got) == pytest.approx(20 * 120 * 1.005 + 1, abs=1)
    assert blocks[-1].device_s == pytest.approx(20 * 1.005, abs=1 / 120)
    assert got[-1, 0] == pytest.approx(2000, abs=1.5)


def test_a_drill_makes_the_twin_silent(tmp_path):
    tracker = device(tmp_path, driver="twin", silent_after_s=0.5)
    with pytest.raises(DeviceFault, match="as its drill asks") as fault:
        all_of(tracker, None, 1.0)
    assert fault.value.what == "silent"


def test_a_twin_at_rest_is_healthy_and_says_its_noise(tmp_path):
    tracker = device(tmp_path, lambda: 2.0, driver="twin", calibrated="2026-11-01")
    clock = count(0, 10_000_000)
    tracker.now_ns = lambda: next(clock)
    tracker.open()
    health = tracker.health(1.0)
    assert health.ok
    assert health.summary.startswith("120.00 Hz; seen 100.0 %")
    assert health.readings[0].mean[0] == pytest.approx(120, abs=0.05)
    assert health.calibrated == "2026-11-01"
    blind = device(tmp_path, lambda: 2.0, driver="twin", occlusions_per_s=100.0, occlusion_s=60.0)
    blind.now_ns = tracker.now_ns
    blind.open()
    assert "no marker is seen" in blind.health(1.0).summary


def test_a_position_beyond_reach_is_reported_as_a_wrong_unit(tmp_path):
    with pytest.raises(DeviceFault, match="is `unit` right") as fault:
        all_of(device(tmp_path, driver="twin", reach_mm=100), None, 1.0)
    assert fault.value.what == "over_range"


def test_a_recording_is_played_at_its_own_times_with_its_gaps(tmp_path):
    lines = ["t_s,x,y,z,seen"]
    recorded = [k for k in range(60) if k not in (20, 21, 22)]
    lines += [f"{7 + k / 120:.6f},{k + 0.5},2,3,{int(k != 40)}" for k in recorded]
    lines[6] = "7.041667,,,,1"
    (tmp_path / "track.csv").write_text("\n".join(lines) + "\n")
    tracker = device(tmp_path, driver="recording", recording="track.csv")
    passed = iter([0.0, 0.1, 0.1, 0.5, *[0.8] * 100])
    tracker.open()
    tracker.elapsed_s = lambda: next(passed)
    tracker.start(lambda: 0)
    reads = [tracker.read(0)["position"] for _ in range(4)]
    got = [samples(tracker.signals[0], blocks) for blocks in reads]
    assert [len(block) for block in got] == [1, 12, 0, 44]
    assert [(b.first, b.lost, b.why) for b in reads[3]] == [(13, 0, ""), (23, 3, "gap")]
    everything = np.vstack(got)
    assert np.flatnonzero(everything[:, 3] == 0).tolist() == [5, 37]
    assert reads[3][-1].device_s == pytest.approx(7 + 59 / 120, abs=1e-5)
    tracker.settings = tracker.settings.model_copy(update={"silent_s": 60.0})
    tracker.source.silent_s = 0.1
    with pytest.raises(DeviceFault, match="recording track.csv is over"):
        tracker.read(0)


def test_motives_export_is_read_by_its_own_header(tmp_path):
    (tmp_path / "take.csv").write_text(MOTIVE, encoding="utf-8-sig")
    track = read_track(tmp_path / "take.csv", marker="Door:M1")
    assert [row[:3] for row in track.rows[::2]] == [(1100, 1200, 1300), (1400, 1500, 1600)]
    assert math.isnan(track.rows[1][0])
    assert track.facts["take"] == "Door"
    assert read_track(tmp_path / "take.csv", marker="Door").rows[0][:3] == (500, 600, 700)
    tracker = device(tmp_path, driver="recording", recording="take.csv", marker="Hand", repeats=True)
    got, _ = all_of(tracker, None, 0.016667)
    np.testing.assert_allclose(got[:, 0], [2100, 2200, 2300])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "column t_s is missing"),
        ("t_s,x,y\n1,2,3\n", "column z is missing"),
        ("t_s,x,y,z\n0,1,2,3\n", "1 sample;"),
        ("t_s,x,y,z\n0,1,2,3\n0,1,2,3\n", "time does not rise at sample 2"),
        ("t_s,x,y,z\n0,1,2,3\n1,1,2,three\n", "line 3.*'three'"),
        ("t_s,x,y,z\n0,1,2,3\n,1,2,3\n", "line 3: a time is expected"),
        (MOTIVE.replace("Meters", "Feet"), "Length Units is 'Feet'"),
        (MOTIVE, "several markers; name one as `marker`: Door, Door:M1, Hand"),
        (MOTIVE.replace("\nFrame,", "\nPicture,"), "no row that begins with Frame"),
        (MOTIVE.replace("2,0.016667", "2,soon"), "frame 2"),
    ],
)
def test_a_recording_that_cannot_be_played_is_refused_by_line(tmp_path, content, message):
    (tmp_path / "track.csv").write_text(content)
    with pytest.raises(DeviceError, match=message):
        read_track(tmp_path / "track.csv", marker="Hand" if "soon" in content else None)


def test_settings_are_checked_before_anything_is_opened(tmp_path):
    for wrong in ({"rate_hz": 0}, {"noise_mm": math.nan}, {"port": 3}, {"driver": "usb"}, {"calibrated": "today"}):
        with pytest.raises(ValidationError):
            Settings(**{"kind": "tracker", "driver": "twin"} | wrong)
    with pytest.raises(DeviceError, match="needs the file to play"):
        device(tmp_path, driver="recording")
    with pytest.raises(DeviceError, match="cannot be read"):
        device(tmp_path, driver="recording", recording="none.csv").open()
    with pytest.raises(DeviceError, match="is not open"):
        device(tmp_path, driver="twin").start(lambda: 0)


def test_a_tracker_is_made_without_numpy_or_pylsl():
    code = (
        "import sys, palpate.devices.tracker.device; "
        "print(sorted({'numpy', 'scipy', 'pylsl', 'pandas'} & {*sys.modules}))"
    )
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert loaded.stdout.strip() == "[]"


def test_it_closes_however_far_it_got(tmp_path):
    for driver in ("twin", "lsl"):
        tracker = device(tmp_path, driver=driver)
        tracker.stop()
        tracker.safe()
        tracker.close()
        tracker.close()
    assert not list(islice(iter(tracker.read(0)["position"]), 1))


@pytest.mark.parametrize("driver", ["twin", "recording"])
def test_a_reader_waits_for_something_and_stopping_ends_its_wait(tmp_path, driver):
    (tmp_path / "track.csv").write_text("t_s,x,y,z\n0,1,2,3\n0.008333,2,3,4\n0.016667,3,4,5\n")
    tracker = device(tmp_path, driver=driver, recording="track.csv")
    tracker.open()
    tracker.start(time.monotonic_ns)
    assert [len(tracker.read(20.0)["position"]) for _ in range(3)] == [1, 1, 1]
    tracker.elapsed_s = lambda: 0.0
    tracker.start(time.monotonic_ns)
    tracker.read(0)
    reader = Thread(target=lambda: tracker.read(60.0))
    reader.start()
    tracker.stop()
    reader.join(30)
    assert not reader.is_alive()
