"""The kinds of devices there are."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

from palpate.devices.device import Device
from palpate.devices.settings import Strict

KINDS: Mapping[str, str] = {
    "door": "palpate.devices.door.link.device",
    "force_torque": "palpate.devices.daq.force_torque",
    "accelerometer": "palpate.devices.daq.accelerometer",
    "tracker": "palpate.devices.tracker.device",
    "tablet": "palpate.devices.tablet.device",
    "voice_coil": "palpate.devices.actuator.device",
    "masking_noise": "palpate.devices.sound.device",
    "camera": "palpate.devices.camera.device",
    "stage": "palpate.devices.stage.device",
}
"""Each kind and its module, which has `Settings` and `make`; only those that a rig names are imported."""


def settings_of(kind: str) -> type[Strict]:
    """The settings that a device of this kind has."""
    model: type[Strict] = import_module(KINDS[kind]).Settings
    return model


def made(kind: str, name: str, settings: Strict, folder: Path) -> Device:
    """The device; nothing is opened. Raises DeviceError where a file that the settings name is not to be had."""
    make: Any = import_module(KINDS[kind]).make
    device: Device = make(name, settings, folder)
    return device
