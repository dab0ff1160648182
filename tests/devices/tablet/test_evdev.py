"""Dialogues with an event device, byte by byte; requests and layouts as linux/input.h gives them (gcc 12, x86-64)."""

from __future__ import annotations

import errno
import math
import os
import random
import struct
from pathlib import Path

import pytest

from palpate.devices.device import DeviceError, DeviceFault
from palpate.devices.tablet.evdev import (
    Assembler,
    Axis,
    EventFile,
    Raw,
    State,
    asks,
    axis_of,
    input_devices,
    sets,
    state_of,
)

SYN, KEY, ABS = 0, 1, 3
X, Y, PRESSURE, PEN, TOUCH = 0, 1, 0x18, 0x140, 0x14A
AXES = {"x": Axis(0, 20_000, 100), "y": Axis(100, 15_100, 100), "pressure": Axis(0, 1023)}


def record(kind, code, value, ms=0):
    return struct.pack("=qqHHi", ms // 1000, ms % 1000 * 1000, kind, code, value)


def report(ms, *changes):
    return b"".join(record(*change, ms) for change in changes) + record(SYN, 0, 0, ms)


PRESSED = report(5, (KEY, PEN, 1), (ABS, X, 5000), (ABS, Y, 1100), (ABS, PRESSURE, 512), (KEY, TOUCH, 1))
LATER = report(12, (ABS, X, 5050))
LIFTED = report(19, (ABS, PRESSURE, 0), (KEY, TOUCH, 0))
GONE = report(26, (KEY, PEN, 0))


@pytest.fixture
def pipe(tmp_path):
    """An opened event file that is a pipe, and a function that writes to it."""
    path = tmp_path / "event0"
    os.mkfifo(path)
    tablet = EventFile("tablet", path, AXES)
    tablet.open()
    end = os.open(path, os.O_WRONLY)
    tablet.start(lambda: 0.0)
    yield tablet, lambda data: os.write(end, data), lambda: os.close(end)
    tablet.close()


def test_the_requests_are_the_kernels():
    assert (asks(0x40 + X, 24), asks(0x40 + PRESSURE, 24)) == (0x80184540, 0x80184558)
    assert (asks(0x06, 256), asks(0x18, 96), asks(0x23, 8)) == (0x81004506, 0x80604518, 0x80084523)
    assert sets(0xA0, 4) == 0x400445A0


@pytest.mark.needs("psychopy")
def test_they_are_pyglets_too(pyglet_input):
    evdev = pyglet_input.evdev
    assert asks(0x06, 256) == evdev._IOC(evdev._IOC_READ, ord("E"), 0x06, 256)
    assert struct.calcsize("=qqHHi") == __import__("ctypes").sizeof(evdev.input_event) == 24


def test_only_what_changed_is_reported_and_the_rest_stands():
    reports = list(Assembler().feed(PRESSED + LATER + LIFTED + GONE))
    assert reports == [
        Raw(0.005, 5000, 1100, 512, True, True),
        Raw(0.012, 5050, 1100, 512, True, True),
        Raw(0.019, 5050, 1100, 0, False, True),
        Raw(0.026, 5050, 1100, 0, False, False),
    ]


def test_bytes_may_be_cut_anywhere():
    whole = PRESSED + LATER + LIFTED
    expected = list(Assembler().feed(whole))
    for cut in range(len(whole)):
        assembler = Assembler()
        assert [*assembler.feed(whole[:cut]), *assembler.feed(whole[cut:])] == expected
        assert assembler.cut_off == 0


def test_what_the_kernel_dropped_is_asked_for_again():
    state = State(7000, 1200, 800, True, True)
    dropped = (
        record(ABS, X, 1) + record(SYN, 3, 0) + record(ABS, X, 2) + record(ABS, PRESSURE, 3) + report(30, (ABS, Y, 4))
    )
    assembler = Assembler(lambda: State(*vars(state).values()))
    reports = list(assembler.feed(dropped + report(37, (ABS, X, 7010))))
    assert reports == [Raw(0.030, 7000, 1200, 800, True, True), Raw(0.037, 7010, 1200, 800, True, True)]
    assert assembler.dropped == 1


def test_where_the_kernel_cannot_be_asked_the_stylus_is_away_until_its_next_report():
    assembler = Assembler()
    list(assembler.feed(PRESSED))
    reports = list(assembler.feed(record(SYN, 3, 0) + report(30, (ABS, X, 1)) + report(31, (ABS, X, 6000))))
    assert [(reported.touching, reported.known) for reported in reports] == [(False, False)] * 2
    (back,) = assembler.feed(report(40, (ABS, Y, 1300), (ABS, PRESSURE, 100)))
    assert back == Raw(0.040, 6000, 1300, 100, True, True)


def test_other_events_of_a_tablet_pass_by():
    noise = record(4, 4, 99) + record(ABS, 0x1A, -30) + record(KEY, 0x14B, 1) + record(2, 8, 1)
    assert len(list(Assembler().feed(PRESSED[:48] + noise + PRESSED[48:]))) == 1


def test_any_bytes_are_borne():
    chance = random.Random(9)
    for _ in range(200):
        assembler, data = Assembler(), bytearray(chance.randbytes(chance.randrange(2000)))
        for start in range(0, len(data) - 24, 24):
            data[start + 16 : start + 20] = struct.pack(
                "=HH", chance.choice([0, 1, 3]), chance.choice([0, 1, 3, 24, 330])
            )
        reports = list(assembler.feed(bytes(data)))
        assert all(math.isfinite(reported.t_s) and (reported.known or not reported.touching) for reported in reports)
        assert assembler.cut_off == len(data) % 24


def test_a_report_in_millimetres_and_parts_of_the_pressure(pipe):
    tablet, write, _ = pipe
    write(PRESSED)
    (one,) = tablet.pull(1.0).reports
    assert (one.x_mm, one.y_mm, one.touching) == (50, 10, True)
    assert one.pressure == pytest.approx(512 / 1023)
    assert one.t_s == 0.005
    assert not tablet.aligned
    assert not tablet.pull(0).reports
    write(PRESSED[:30])
    assert not tablet.pull(0).reports
    write(PRESSED[30:])
    assert len(tablet.pull(0).reports) == 1


def test_a_source_that_ends_is_a_lost_link(pipe):
    tablet, write, unplug = pipe
    write(PRESSED)
    unplug()
    assert len(tablet.pull(0).reports) == 1
    with pytest.raises(DeviceFault, match=r"event0 ended\.") as fault:
        tablet.pull(0)
    assert fault.value.what == "link_lost"


def test_a_record_that_was_cut_off_is_reported(pipe):
    tablet, write, unplug = pipe
    write(PRESSED[:-5])
    unplug()
    assert not tablet.pull(0).reports
    with pytest.raises(DeviceFault, match=r"in the middle of a record \(19 of 24 bytes\)"):
        tablet.pull(0)


def test_a_tablet_that_is_unplugged_is_a_lost_link(pipe, monkeypatch):
    tablet, write, _ = pipe
    write(PRESSED)

    def gone(file, size):
        raise OSError(errno.ENODEV, "No such device")

    monkeypatch.setattr(os, "read", gone)
    with pytest.raises(DeviceFault, match="was unplugged") as fault:
        tablet.pull(0)
    assert fault.value.what == "link_lost"


class Kernel:
    """Stands in for the kernel's answers to requests; a request that it does not know fails as ENOTTY does."""

    def __init__(self, axes=True, pressure=True, per_mm=100):
        bits = (1 << X | 1 << Y | pressure << PRESSURE) * axes
        keys = bytearray(96)
        for key in (PEN, TOUCH):
            keys[key // 8] |= 1 << key % 8
        self.answers = {
            asks(0x06, 256): b"Wacom Intuos Pen\0".ljust(256, b"\0"),
            asks(0x23, 8): bits.to_bytes(8, "little"),
            asks(0x40 + X, 24): struct.pack("=6i", 5000, 0, 21600, 4, 0, per_mm),
            asks(0x40 + Y, 24): struct.pack("=6i", 1100, 0, 13500, 4, 0, per_mm),
            asks(0x40 + PRESSURE, 24): struct.pack("=6i", 512, 0, 4095, 0, 0, 0),
            asks(0x18, 96): bytes(keys),
            sets(0xA0, 4): struct.pack("=i", 1),
        }
        self.calls = []

    def __call__(self, file, request, buffer):
        self.calls.append(request)
        if request not in self.answers:
            raise OSError(errno.ENOTTY, "Inappropriate ioctl for device")
        return self.answers[request]


def test_a_real_tablet_reports_its_axes_and_is_timed_by_the_monotonic_clock(tmp_path):
    (tmp_path / "event0").write_bytes(LATER)
    tablet = EventFile("tablet", tmp_path / "event0", {}, Kernel(), monotonic_s=lambda: 1000.0)
    facts = tablet.open()
    assert facts == {"tablet": "Wacom Intuos Pen", "size": "216 x 135 mm", "pressures": "4096"}
    assert tablet.aligned
    tablet.start(lambda: 3.0)
    (one,) = tablet.pull(0).reports
    assert one.t_s == pytest.approx(0.012 - 997)
    assert (one.x_mm, one.y_mm, one.touching) == (50.5, 11, True)
    tablet.close()


def test_the_state_that_the_kernel_has_is_read():
    kernel = Kernel()
    assert state_of(kernel, 0) == State(5000, 1100, 512, True, True)
    assert axis_of(kernel, 0, X) == Axis(0, 21600, 100)
    assert axis_of(kernel, 0, 5) is None
    del kernel.answers[asks(0x18, 96)]
    assert state_of(kernel, 0) is None


@pytest.mark.parametrize(
    ("kernel", "message"),
    [
        (Kernel(axes=False), r"Wacom Intuos Pen\) has no x axis: not a stylus tablet"),
        (Kernel(pressure=False), "no pressure axis.*a touch screen for fingers"),
        (Kernel(per_mm=0), "does not say how long its x axis is"),
    ],
)
def test_another_device_is_refused(tmp_path, kernel, message):
    (tmp_path / "event0").write_bytes(b"")
    tablet = EventFile("tablet", tmp_path / "event0", {}, kernel)
    with pytest.raises(DeviceError, match=message):
        tablet.open()
    assert tablet.file == -1


def test_a_device_that_is_no_input_device_is_refused():
    with pytest.raises(DeviceError, match="/dev/null.*has no x axis.*Input devices that there are"):
        EventFile("tablet", Path("/dev/null"), {}).open()


def test_a_file_that_is_not_there_or_not_ours_is_refused(tmp_path, monkeypatch):
    tablet = EventFile("tablet", tmp_path / "event9", {})
    with pytest.raises(DeviceError, match="No such file.*Input devices that there are"):
        tablet.open()

    def denied(path, flags):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(os, "open", denied)
    with pytest.raises(DeviceError, match="into the group that owns it"):
        tablet.open()
    with pytest.raises(DeviceError, match="is not open"):
        tablet.start(lambda: 0.0)


def test_input_devices_are_listed_by_name(tmp_path):
    for number, name in ((10, "Keyboard"), (2, "Wacom Intuos Pen")):
        place = tmp_path / f"event{number}" / "device"
        place.mkdir(parents=True)
        (place / "name").write_text(name + "\n")
    (tmp_path / "event11").mkdir()
    assert input_devices(tmp_path) == [
        "/dev/input/event2 (Wacom Intuos Pen)", "/dev/input/event10 (Keyboard)", "/dev/input/event11 (no name)",
    ]  # fmt: skip
