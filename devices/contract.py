"""The contract of devices: what every kind does with its twin, whatever it measures or presents."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast

from pydantic import ValidationError

from palpate.devices.device import FAULTS, Block, Device, DeviceError, DeviceFault, Sensor, Signal
from palpate.devices.kinds import DeviceKind
from palpate.protocols.canonical import canonical
from palpate.protocols.contract import Demand, Verdict, demand, verdicts
from palpate.protocols.events import NS

READ_S, MOST_S = 0.5, 6.0
"""A sensor is read for at least READ_S, until it gave ENOUGH samples, or for at most MOST_S."""
ENOUGH = 3
TOLERANCE = 0.35
"""The relative error of a rate that is measured so shortly, on a busy machine."""
FAULT_S = 12.0
"""A lost link is named within this time: the twin of the door, which shares its machine with others, has 10 s."""


@dataclass(frozen=True)
class Twin:
    """A kind of device under trial; `settings` are given to its twin beside the kind and the driver."""

    name: str
    kind: DeviceKind
    settings: Mapping[str, Any] = field(default_factory=dict)

    def make(self) -> Device:
        """Return the twin, not opened."""
        given = {"kind": self.name, "driver": "twin", **self.settings}
        return self.kind.make("tried", self.kind.settings.model_validate(given), Path())

    @contextmanager
    def opened(self) -> Iterator[Device]:
        """Open a twin, and close it in any case."""
        device = self.make()
        try:
            device.open()
            yield device
        finally:
            device.close()


def _has_settings(twin: Twin) -> str | None:
    twin.make()
    keys = twin.kind.settings.model_fields
    demand({"kind", "driver"} <= keys.keys(), f"its settings have {', '.join(keys)}; kind and driver are expected")
    given = {"kind": twin.name, "driver": "twin", **twin.settings}
    for wrong in ({"kind": "another"}, {"driver": "no such driver"}, {"no_such_key": 1}):
        try:
            twin.kind.settings.model_validate({**given, **wrong})
        except ValidationError:
            continue
        demand(False, f"the settings {wrong} are taken; a schema that extends Strict, with Literal, refuses them")
    return None


def _explains_settings(twin: Twin) -> str | None:
    from palpate.devices.rig.meanings import settings_of_kind

    silent = [setting.name for setting in settings_of_kind(twin.kind) if not setting.meaning]
    demand(not silent, f"`meanings` says nothing of {', '.join(silent)}")
    demand(twin.kind.calibration, "`calibration` says nothing of how it is calibrated, or that it is not")
    return None


def _closed_is_harmless(twin: Twin) -> str | None:
    device = twin.make()
    for _ in range(2):
        device.safe()
        device.close()
    return None


def _opens_and_describes(twin: Twin) -> str | None:
    with twin.opened() as device:
        described = dict(device.describe())
        canonical(described)
        for key, expected in (("kind", twin.name), ("driver", "twin")):
            demand(described.get(key) == expected, f"describe() has {key}: {described.get(key)!r}, not {expected!r}")
    return None


def _is_well(twin: Twin) -> str | None:
    with twin.opened() as device:
        health = device.health(READ_S)
        demand(health.ok, f"its health is: {health.summary}")
        return health.summary


def _samples(twin: Twin) -> str | None:
    """Demand that samples come at the rate of each signal, finite, numbered without a hole."""
    with twin.opened() as device:
        if not device.signals:
            return "it records nothing"
        sensor, blocks = cast(Sensor, device), dict[str, list[Block]]()
        begin_s = time.monotonic()
        sensor.expect(None)
        sensor.start(time.monotonic_ns)
        while time.monotonic() - begin_s < MOST_S:
            for name, some in sensor.read(0.05).items():
                blocks.setdefault(name, []).extend(some)
            enough = all(_rows(signal, blocks.get(signal.name, [])) >= ENOUGH for signal in device.signals)
            if enough and time.monotonic() - begin_s >= READ_S:
                break
        sensor.stop()
        said = [_demand_sound(twin, signal, blocks.get(signal.name, [])) for signal in device.signals]
        return ", ".join(said)


def _rows(signal: Signal, blocks: list[Block]) -> int:
    return sum(len(block.data) for block in blocks) // (4 * len(signal.channels))


def _demand_sound(twin: Twin, signal: Signal, blocks: list[Block]) -> str:
    from palpate.devices.health import measured_hz, samples

    name, width = signal.name, 4 * len(signal.channels)
    demand(len(signal.units) == len(signal.channels), f"{name}: {len(signal.channels)} channels have other units")
    demand(_rows(signal, blocks) >= ENOUGH, f"{name}: {_rows(signal, blocks)} samples came in {MOST_S:g} s")
    due, at_ns = 0, 0
    for block in blocks:
        demand(len(block.data) % width == 0, f"{name}: {len(block.data)} bytes are no rows of {width} bytes")
        demand(block.first == due + block.lost, f"{name}: sample {block.first} comes where {due} is due")
        demand(not block.lost, f"{name}: its twin lost {block.lost} samples ({block.why})")
        demand(block.at_ns >= at_ns, f"{name}: its times go back")
        due, at_ns = block.first + len(block.data) // width, block.at_ns
    values = samples(signal, blocks)
    demand(twin.kind.may_hide or all(map(math.isfinite, values.ravel())), f"{name}: a sample is not finite")
    if (blocks[-1].at_ns - blocks[0].at_ns) < READ_S / 2 * NS:
        return f"{name}: {len(values)} samples"
    rate_hz = measured_hz(signal, [_by_its_clock(block) for block in blocks])
    off = abs(rate_hz / signal.rate_hz - 1) > TOLERANCE
    demand(not off, f"{name}: {rate_hz:.4g} samples came a second, and its rate is {signal.rate_hz:g} Hz")
    return f"{name}: {len(values)} samples at {rate_hz:.3g} Hz"


def _by_its_clock(block: Block) -> Block:
    """Return the block at the time of the device's own clock, if it has one: a twin may run slower than the host."""
    return block if block.device_s is None else replace(block, at_ns=round(block.device_s * NS))


def _lost_link(twin: Twin) -> str | None:
    """Demand a fault by name from `read`, where it samples, and from `health`; then it can be made safe and closed."""
    unplug = twin.kind.unplug
    if isinstance(unplug, str):
        demand(unplug, "its kind has no `unplug`, which cuts the link of an open twin")
        return unplug
    with twin.opened() as device:
        if device.signals:
            sensor = cast(Sensor, device)
            sensor.start(time.monotonic_ns)
        unplug(device)
        what = _fault_of_reading(cast(Sensor, device)) if device.signals else ""
        try:
            health = device.health(READ_S)
            demand(not health.ok, f"its link is cut, and its health is: {health.summary}")
            said = health.summary
        except (DeviceFault, DeviceError) as error:
            said = str(error)
        device.safe()
        device.safe()
    return f"{what}: {said}" if what else said


def _fault_of_reading(sensor: Sensor) -> str:
    """Return the category of the fault that reading raises. Raises NotKept without one."""
    until_s = time.monotonic() + FAULT_S
    while time.monotonic() < until_s:
        try:
            sensor.read(0.05)
        except DeviceFault as fault:
            demand(fault.device == sensor.name, f"the fault is of {fault.device!r}; the device is {sensor.name!r}")
            demand(fault.what in FAULTS, f"the fault is {fault.what!r}; one of {', '.join(FAULTS)} is expected")
            return fault.what
    demand(False, f"its link is cut, and no fault came of reading it for {FAULT_S:g} s")
    return ""


def _ends_twice(twin: Twin) -> str | None:
    device = twin.make()
    for _ in range(2):
        device.open()
        for end in (device.safe, device.safe, device.close, device.close, device.safe):
            end()
    return None


def _obeys(twin: Twin) -> str | None:
    exceed = twin.kind.exceed
    with twin.opened() as device:
        if isinstance(exceed, str):
            needed = hasattr(device, "perform") and not exceed
            demand(not needed, "it presents stimuli, and its kind has no `exceed`, which tries to get past its limits")
            return exceed or "it presents nothing"
        came, limit = exceed(device)
        demand(math.isfinite(limit), f"its limit is {limit}")
        demand(came <= limit, f"{came:g} came out, and its limit is {limit:g}")
        return f"{came:.4g} came out at most, the limit is {limit:.4g}"


CONTRACT: tuple[Demand[Twin], ...] = (
    Demand(
        "its settings have `kind` and a driver `twin`, and refuse what they do not know", _has_settings, needed=True
    ),
    Demand("every setting is explained", _explains_settings),
    Demand("closing it does no harm before it is opened", _closed_is_harmless),
    Demand("its twin opens and describes itself", _opens_and_describes),
    Demand("its twin is in health", _is_well),
    Demand("samples come at their rate, without a hole", _samples),
    Demand("a lost link is named, and leaves it safe", _lost_link),
    Demand("safe() and close() may be called twice, and it opens again", _ends_twice),
    Demand("it obeys its hard limit", _obeys),
)


def check_device(name: str, kind: DeviceKind, settings: Mapping[str, Any] | None = None) -> list[Verdict]:
    """Return the verdicts of the contract on a kind of device; `settings` are given to its twin beside its driver.

    Its twin is opened, read for some seconds, cut off, and driven beyond its limit.
    """
    return list(verdicts(name, CONTRACT, Twin(name, kind, settings or {})))
