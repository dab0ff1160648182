import subprocess
import sys
from pathlib import Path

import pytest
from pydantic import ValidationError

from palpate.devices.door.link.device import Settings, make


def test_the_rig_files_example_makes_a_door():
    door = make(
        "door",
        Settings.model_validate(
            {
                "kind": "door", "driver": "serial", "port": "/dev/ttyUSB0", "baud": 1000000, "handle_radius_m": 0.9,
                "limits": {"torque_Nm": 60},
            }
        ),
        Path(),
    )  # fmt: skip
    assert door.by == "door" and door.signals[0].rate_hz == 500.0 and door.signals[0].clock == "door"
    assert make("door", Settings(kind="door", driver="twin"), Path()).by == "twin"


@pytest.mark.parametrize(
    "wrong",
    [
        {"driver": "serial"}, {"driver": "twin", "telemetry_hz": 499}, {"driver": "twin", "handle_radius_m": 0.0},
        {"driver": "twin", "baud": 115_200},
        {"driver": "twin", "limits": {"torque_Nm": -1}}, {"driver": "twin", "limits": {"power": 1}},
        {"driver": "twin", "speed": 1}, {"driver": "twin", "twin_speed": float("nan")}, {"driver": "usb"},
    ],
)  # fmt: skip
def test_a_setting_that_cannot_be_is_refused(wrong):
    with pytest.raises(ValidationError):
        Settings.model_validate({"kind": "door", **wrong})


def test_the_settings_import_neither_numpy_nor_pyserial():
    code = (
        "import sys, palpate.devices.door.link.device; print([name for name in ('numpy', 'serial', 'scipy') "
        "if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
