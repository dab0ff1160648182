"""Only what a study needs is imported and opened; what was opened is closed where the next cannot be had."""

import subprocess
import sys

import pytest

from palpate.devices.device import DeviceError
from palpate.devices.rig.file import read_rig
from palpate.devices.rig.opened import OpenRig, open_rig
from palpate.devices.sound.device import MaskingNoise

LIBRARIES = ("serial", "pylsl", "nidaqmx", "sounddevice", "psychopy", "pyglet", "scipy", "pandas", "sqlalchemy", "PIL")
RIG = """rig: many
devices:
  door: {kind: door, driver: twin}
  vibration: {kind: accelerometer, driver: twin}
  force: {kind: force_torque, driver: twin}
  tracker: {kind: tracker, driver: twin}
  noise: {kind: masking_noise, driver: twin}
  lost: {kind: door, driver: serial, port: /dev/there-is-none}
"""
PROGRAM = """
import sys
from pathlib import Path
from palpate.devices.rig.file import read_rig
from palpate.devices.rig.opened import open_rig
rig = open_rig(read_rig(Path(sys.argv[1])), sys.argv[2].split(","))
rig.close()
print(",".join(name for name in sys.argv[3].split(",") if name in sys.modules))
"""


@pytest.fixture
def rig(tmp_path):
    path = tmp_path / "rig.yaml"
    path.write_text(RIG, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("names", "imported"),
    [
        pytest.param("door", {"serial"}, marks=pytest.mark.needs("serial")),
        ("vibration,force", set()),
        ("tracker", set()),
        ("noise", set()),
    ],
)
def test_a_device_brings_its_own_library_and_no_other(rig, names, imported):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(rig), names, ",".join(LIBRARIES)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert set(filter(None, done.stdout.strip().split(","))) == imported


@pytest.mark.needs("serial")
def test_where_one_cannot_be_had_the_others_are_closed(rig, monkeypatch):
    file, closed = read_rig(rig), []
    monkeypatch.setattr(MaskingNoise, "close", lambda self: closed.append(self.name))
    with pytest.raises(DeviceError, match=r"lost: .*/dev/there-is-none"):
        open_rig(file, ["noise", "lost"])
    assert closed == ["noise"]


class Part:
    """A device that notes what is done to it."""

    def __init__(self, name, done, fails=False):
        self.name, self.done, self.fails = name, done, fails

    def safe(self):
        self.done.append(f"{self.name} safe")
        if self.fails:
            raise DeviceError(f"{self.name} is gone")


@pytest.mark.parametrize("fails", ["door", "noise"])
def test_closing_makes_every_device_safe_first_also_where_one_is_gone(rig, fails):
    done = []
    parts = {name: Part(name, done, name == fails) for name in ("door", "noise")}
    with pytest.raises(DeviceError, match=f"{fails} is gone"):
        OpenRig(read_rig(rig), parts, lambda: done.append("let go")).close()
    assert sorted(done[:2]) == ["door safe", "noise safe"] and done[2:] == ["let go"]
