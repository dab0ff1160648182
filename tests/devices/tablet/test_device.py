"""A tablet as a sensor: every driver gives the same signal, and a report that cannot be believed is counted by name."""

from __future__ import annotations

import inspect
import math
import os
import subprocess
import sys
import time
from itertools import count
from threading import Thread

import numpy as np
import pytest
from pydantic import ValidationError

from palpate.devices.device import DeviceError, DeviceFault
from palpate.devices.health import samples
from palpate.devices.tablet.device import Settings, make
from palpate.devices.tablet.force import Force
from palpate.devices.tablet.reports import Guard, Report
from tests.devices.tablet.test_evdev import LATER, LIFTED, PRESSED, SYN, record, report

AXES = {
    "x": {"least": 0, "most": 20000, "per_mm": 100}, "y": {"least": 100, "most": 15100, "per_mm": 100},
    "pressure": {"least": 0, "most": 1023},
}  # fmt: skip


class Circle:
    """A hand that goes round in circles of 25 mm radius at 100 mm/s and presses with 0.8 N."""

    def __init__(self, force_N=0.8, speed=100.0):
        self.force_N, self.omega = force_N, speed / 25

    def position_mm(self, rate_hz):
        for first in count(0, 250):
            turned = self.omega * np.arange(first, first + 250) / rate_hz
            yield np.column_stack([25 * np.cos(turned), 25 * np.sin(turned), 0 * turned])

    def wrench(self, rate_hz):
        for _ in count():
            yield np.tile([0.0, 0.0, -self.force_N, 0.0, 0.0, 0.0], (250, 1))


def tablet(tmp_path, **settings):
    return make("tablet", Settings(kind="tablet", **settings), tmp_path)


def all_of(device, seconds, scene=None):
    device.elapsed_s = lambda: seconds
    device.open()
    device.expect(scene)
    device.start(lambda: 0)
    blocks = [block for _ in range(math.ceil(seconds) + 3) for block in device.read(0)["stylus"]]
    assert [block.first for block in blocks] == [0, *np.cumsum([len(b.data) // 24 for b in blocks])[:-1]]
    return samples(device.signals[0], blocks), blocks


def test_the_twin_gives_the_speed_and_the_force_of_the_scene(tmp_path):
    got, _ = all_of(tablet(tmp_path, driver="twin"), 4.0, Circle())
    assert len(got) == 4000
    later = got[300:]
    assert later[:, 4].mean() == pytest.approx(100, rel=0.005)
    assert later[:, 4].std() < 2
    np.testing.assert_allclose(later[:, 5], 0.8, rtol=0.005)
    assert later[:, 3].min() == 1
    again, _ = all_of(tablet(tmp_path, driver="twin"), 4.0, Circle())
    np.testing.assert_array_equal(got, again)


@pytest.mark.parametrize("scene", [None, Circle(force_N=0.1), Circle(speed=0.0), Circle(speed=5.0)])
def test_a_stylus_that_does_not_stroke_gives_nothing(tmp_path, scene):
    got, _ = all_of(tablet(tmp_path, driver="twin"), 2.0, scene)
    assert len(got) == 2000
    assert (got[:, 4:] == 0).all()


def test_time_that_never_ends_is_given_a_second_at_a_time(tmp_path):
    device = tablet(tmp_path, driver="twin")
    device.elapsed_s = lambda: math.inf
    for scene in (Circle(), Circle(speed=0.0)):
        device.open()
        device.expect(scene)
        device.start(lambda: 0)
        assert [len(block.data) // 24 for _ in range(5) for block in device.read(0)["stylus"]] == [1000] * 5
        assert len(device.waiting) < 300


def test_recorded_bytes_of_a_tablet_are_its_signal(tmp_path):
    os.mkfifo(tmp_path / "event0")
    device = tablet(tmp_path, driver="evdev", path="event0", axes=AXES)
    device.open()
    end = os.open(tmp_path / "event0", os.O_WRONLY)
    passed = [0.0]
    device.elapsed_s = lambda: passed[0]
    device.start(lambda: 0)
    os.write(end, PRESSED + LATER)
    passed[0] = 0.02
    (block,) = device.read(0)["stylus"]
    # Its clock is not ours: the first report counts from when it came.
    rows = samples(device.signals[0], [block])
    assert len(rows) == 20
    assert np.isnan(rows[:, 0]).all()
    passed[0] = 0.03
    rows = samples(device.signals[0], device.read(0)["stylus"])
    np.testing.assert_allclose(rows[0, :4], [50, 10, 512 / 1023, 1], rtol=1e-6)
    assert rows[-1, 4] == pytest.approx(0.5 / 0.007, rel=1e-6)
    os.write(end, LIFTED + record(SYN, 3, 0) + report(33, (3, 0, 1)))
    passed[0] = 0.06
    (block,) = device.read(0)["stylus"]
    rows = samples(device.signals[0], [block])
    assert block.why == "reports_dropped"
    assert np.isnan(rows[-1, 0])
    assert rows[-1, 1:].tolist()[2:] == [0, 0, 0]
    os.close(end)
    with pytest.raises(DeviceFault, match="ended"):
        device.read(0)
    device.close()


def test_a_recording_is_played_and_its_bad_reports_are_named(tmp_path):
    lines = ["t_s,x_mm,y_mm,pressure", *(f"{3 + k * 0.0075},{0.75 * k},1,0.5" for k in range(60))]
    lines[20], lines[30], lines[40] = f"{3 + 19 * 0.0075},,1,0.5", "2.9,5,1,0.5", "3.2925,29.25,1,7.5"
    (tmp_path / "strokes.csv").write_text("\n".join(lines) + "\n")
    device = tablet(tmp_path, driver="recording", recording="strokes.csv")
    got, blocks = all_of(device, 0.44)
    assert device.guard.refused == {"time_backwards": 1, "pressure_out_of_range": 1}
    assert "pressure_out_of_range" in blocks[0].why
    assert np.isnan(got[145:149, 0]).any()
    assert got[-1, 4] == pytest.approx(100, rel=0.05)
    assert device.came == 60 - 1


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("t_s,x_mm,y_mm\n", "pressure is missing"),
        ("t_s,x_mm,y_mm,pressure\n", "no report"),
        ("t_s,x_mm,y_mm,pressure\n0,1,2,0.5\n1,1,two,0.5\n", "line 3"),
        ("t_s,x_mm,y_mm,pressure\n,1,2,0.5\n", "no report, or none with a time"),
    ],
)
def test_a_recording_that_cannot_be_played_is_refused(tmp_path, content, message):
    (tmp_path / "strokes.csv").write_text(content)
    with pytest.raises(DeviceError, match=message):
        tablet(tmp_path, driver="recording", recording="strokes.csv").open()


GOOD = Report(1.0, 10, 10, 0.5, True)


@pytest.mark.parametrize(
    ("bad", "why"),
    [
        (GOOD._replace(x_mm=math.nan), "not_a_number"),
        (GOOD._replace(y_mm=math.inf), "not_a_number"),
        (GOOD._replace(pressure=math.nan), "not_a_number"),
        (GOOD._replace(t_s=math.nan), "not_a_number"),
        (GOOD._replace(pressure=1.2), "pressure_out_of_range"),
        (GOOD._replace(pressure=-0.2), "pressure_out_of_range"),
        (GOOD._replace(t_s=0.5), "time_backwards"),
        (GOOD._replace(t_s=9.0), "time_ahead"),
    ],
)
def test_reports_that_cannot_be_are_refused_by_name(bad, why):
    guard = Guard("tablet", aligned=True)
    assert guard.check(GOOD, 1.0) == GOOD
    assert guard.check(bad, 1.0) is None
    assert guard.refused == {why: 1}
    assert guard.check(GOOD._replace(t_s=1.01, pressure=1.03), 1.01).pressure == 1.0
    assert guard.check(GOOD._replace(t_s=1.02, pressure=-0.03), 1.02).pressure == 0.0


def test_an_away_report_needs_no_position():
    gone = GOOD._replace(x_mm=math.nan, y_mm=math.nan, touching=False, away=True)
    assert Guard("tablet", aligned=True).check(gone, 1.0).pressure == 0


def test_a_clock_that_was_set_is_followed_after_three_reports():
    guard = Guard("tablet", aligned=True)
    assert guard.check(GOOD._replace(t_s=100.0), 100.0).t_s == 100
    set_back = [guard.check(GOOD._replace(t_s=5 + 0.01 * k), 100.01 + 0.01 * k) for k in range(4)]
    assert set_back[:2] == [None, None]
    assert [report.t_s for report in set_back[2:]] == pytest.approx([100.03, 100.04])
    assert guard.refused == {"time_backwards": 2, "clock_reset": 1}


def test_a_tablet_with_only_invalid_reports_is_a_fault():
    guard = Guard("tablet", aligned=True)
    for _ in range(49):
        guard.check(GOOD._replace(pressure=512), 1.0)
    with pytest.raises(DeviceFault, match="50 reports in a row with pressures outside 0 to 1") as fault:
        guard.check(GOOD._replace(pressure=512), 1.0)
    assert fault.value.what == "over_range"


def test_health_says_how_many_reports_came_and_what_was_wrong(tmp_path):
    device, clock = tablet(tmp_path, driver="twin", calibrated="2026-10-01"), count(0, 50_000_000)
    device.elapsed_s, device.now_ns = lambda: 1.0, lambda: next(clock)
    device.open()
    device.expect(Circle())
    health = device.health(1.0)
    assert health.ok
    assert health.summary.split()[0] in ("133", "134")
    assert health.readings[0].signal.calibration == "F = 0.13 exp(3.32 y) N, 2026-10-01"
    device.expect(None)
    assert "no report: move the stylus" in device.health(1.0).summary
    assert device.describe()["speed_delay_ms"] == pytest.approx(18.77, abs=0.01)


def test_settings_are_checked_before_anything_is_opened(tmp_path):
    for wrong in (
        {"report_hz": 0},
        {"levels": 1},
        {"port": 3},
        {"driver": "usb"},
        {"px_per_mm": -1},
        {"cutoff_hz": 900},
        {"calibrated": "2026-02-30"},
    ):
        with pytest.raises(ValidationError):
            Settings(**{"kind": "tablet", "driver": "twin"} | wrong)
    for driver, setting in (("evdev", "path"), ("pyglet", "px_per_mm"), ("recording", "recording")):
        with pytest.raises(DeviceError, match=f"needs `{setting}"):
            tablet(tmp_path, driver=driver)
    with pytest.raises(DeviceError, match="speed_mm_s 300 to 10, .*rise from lowest"):
        tablet(tmp_path, driver="twin", speed_mm_s=(300, 10))
    with pytest.raises(DeviceError, match="is not open"):
        tablet(tmp_path, driver="twin").start(lambda: 0)
    own = tablet(tmp_path, driver="twin", force={"a_N": 0.2, "b": 3.0})
    assert own.shape.force == Force(0.2, 3.0)


def test_a_tablet_is_made_without_numpy_or_pyglet():
    code = (
        "import sys, palpate.devices.tablet.device; "
        "print(sorted({'numpy', 'scipy', 'pyglet', 'fcntl'} & {*sys.modules}))"
    )
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert set(eval(loaded.stdout)) <= {"fcntl"}


class Window:
    height = 1000


@pytest.fixture
def pyglets(pyglet_input, monkeypatch):
    """pyglet's own event classes, with a tablet that opens a canvas without any driver behind it."""
    base, canvases = pyglet_input.base, []

    class Canvas(base.TabletCanvas):
        def close(self):
            canvases.remove(self)

    class Stand(base.Tablet):
        name = "Stand-in"

        def open(self, window):
            canvases.append(Canvas(window))
            return canvases[-1]

    monkeypatch.setattr(pyglet_input, "get_tablets", lambda display=None: [Stand()])
    return canvases


@pytest.mark.needs("psychopy")
def test_pyglets_events_are_reports_in_millimetres_from_the_top_left(tmp_path, pyglets):
    device, passed = tablet(tmp_path, driver="pyglet", px_per_mm=10.0), [0.0]
    device.attach(Window())
    device.elapsed_s = lambda: passed[0]
    device.open()
    device.start(lambda: 0)
    (canvas,) = pyglets
    canvas.dispatch_event("on_enter", "pen")
    canvas.dispatch_event("on_motion", "pen", 500, 900, 0.5, 0.0, 0.0)
    passed[0] = 0.0075
    canvas.dispatch_event("on_motion", "pen", 507.5, 900, 0.5, 0.0, 0.0)
    canvas.dispatch_event("on_motion", "pen", math.nan, 900, 0.5, 0.0, 0.0)
    passed[0] = 0.02
    (block,) = device.read(0)["stylus"]
    rows = samples(device.signals[0], [block])
    np.testing.assert_allclose(rows[0, :4], [50, 10, 0.5, 1])
    np.testing.assert_allclose(rows[-1, 4:], [100, 0.13 * math.exp(1.66)], rtol=1e-6)
    assert block.why == "not_a_number"
    canvas.dispatch_event("on_leave", "pen")
    passed[0] = 0.03
    assert np.isnan(samples(device.signals[0], device.read(0)["stylus"])[-1, 0])
    device.close()
    assert pyglets == []
    device.close()


@pytest.mark.needs("psychopy")
def test_the_stand_in_has_the_installed_pyglets_signatures(pyglet_input):
    base, xinput = pyglet_input.base, pyglet_input.x11_xinput_tablet
    assert list(inspect.signature(base.Tablet.open).parameters) == ["self", "window"]
    assert list(inspect.signature(base.TabletCanvas.__init__).parameters) == ["self", "window"]
    assert list(inspect.signature(xinput.XInputTablet.open).parameters) == ["self", "window"]
    assert {"on_enter", "on_leave", "on_motion"} <= set(base.TabletCanvas.event_types)
    source = inspect.getsource(xinput.XInputTabletCanvas._motion)
    assert "self.dispatch_event('on_motion', cursor, x, y, pressure, 0.0, 0.0)" in source
    assert "y = self.window.height - e.y" in source


@pytest.mark.needs("psychopy")
def test_a_reader_that_sleeps_finds_the_newest_reports_and_their_loss(tmp_path, pyglets):
    device = tablet(tmp_path, driver="pyglet", px_per_mm=10.0)
    device.attach(Window())
    device.open()
    device.elapsed_s = lambda: 0.5
    device.start(lambda: 0)
    for k in range(5000):
        pyglets[0].dispatch_event("on_motion", "pen", k, 0, 0.5, 0.0, 0.0)
    (block,) = device.read(0)["stylus"]
    assert (device.came, device.dropped, block.why) == (4096, 904, "reports_dropped")
    device.close()


class OwnWindow(Window):
    handled = 0

    def dispatch_events(self):
        self.handled += 1

    def close(self):
        pass


@pytest.mark.usefixtures("pyglets")
@pytest.mark.needs("psychopy")
def test_a_window_of_its_own_serves_a_check_but_no_recording(tmp_path, monkeypatch):
    """Its events are handled by the thread that opened it; another would record a stylus that is away, for ever."""
    device, seen = tablet(tmp_path, driver="pyglet", px_per_mm=10.0), []
    monkeypatch.setattr(
        device.source, "_own_window", lambda: setattr(device.source, "own", OwnWindow()) or device.source.own
    )
    device.open()
    device.start(time.monotonic_ns)
    device.read(0)
    assert device.source.own.handled

    def record():
        try:
            device.read(0)
        except DeviceFault as fault:
            seen.append((fault.what, str(fault)))

    reader = Thread(target=record)
    reader.start()
    reader.join(30)
    assert seen[0][0] == "refused" and "the participant's window" in seen[0][1]
    device.close()


@pytest.mark.needs("psychopy")
def test_without_a_tablet_pyglet_says_what_it_needs(tmp_path, pyglet_input, monkeypatch):
    monkeypatch.setattr(pyglet_input, "get_tablets", lambda display=None: [])
    with pytest.raises(DeviceError, match="pyglet sees no tablet.*Wintab"):
        tablet(tmp_path, driver="pyglet", px_per_mm=10.0).open()

    def no_display(display=None):
        raise RuntimeError("Cannot connect to display")

    monkeypatch.setattr(pyglet_input, "get_tablets", no_display)
    with pytest.raises(DeviceError, match="Cannot connect to display"):
        tablet(tmp_path, driver="pyglet", px_per_mm=10.0).open()


def test_a_reader_that_waits_is_given_ten_milliseconds_at_least_and_stopping_ends_its_wait(tmp_path):
    device = tablet(tmp_path, driver="twin")
    device.open()
    device.start(time.monotonic_ns)
    for _ in range(3):
        (block,) = device.read(20.0)["stylus"]
        assert len(block.data) >= 10 * 24
    device.elapsed_s = lambda: 0.0
    device.start(time.monotonic_ns)
    reader = Thread(target=lambda: device.read(60.0))
    reader.start()
    device.stop()
    reader.join(30)
    assert not reader.is_alive()
