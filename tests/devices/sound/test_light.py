"""Checking a rig file is cheap, and a twin that was not read for hours is ready at once."""

import subprocess
import sys

import pytest

from palpate.devices.sound.device import Settings, make

HEAVY = "numpy scipy serial nidaqmx sounddevice PIL pandas psychopy"


@pytest.mark.parametrize(
    ("module", "given"),
    [
        ("palpate.devices.sound.device", {"kind": "masking_noise"}),
        ("palpate.devices.actuator.device", {"kind": "voice_coil"}),
        ("palpate.devices.camera.device", {"kind": "camera"}),
        ("palpate.devices.stage.device", {"kind": "stage"}),
    ],
)
def test_settings_are_read_without_numpy_or_a_driver(module, given):
    script = f"""
import importlib, sys
module = importlib.import_module({module!r})
module.Settings(driver="twin", **{given!r})
print([name for name in {HEAVY.split()!r} if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.strip() == "[]"


def test_hours_that_nobody_listened_to_are_passed_over(tmp_path):
    now, parts = [0.0], []
    noise = make("noise", Settings(kind="masking_noise", driver="twin", rate_hz=8000), tmp_path, lambda: now[0])
    noise.output.heard = lambda part: parts.append(len(part))
    noise.open()
    noise.start()
    now[0] = 4 * 3600.0
    noise.check()
    assert sum(parts) == 8000
    now[0] += 0.5
    noise.check()
    assert sum(parts) == 12_000
