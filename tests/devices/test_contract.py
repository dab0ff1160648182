"""Every kind of device keeps the contract of devices, and the contract names what a device does not keep."""

from dataclasses import dataclass, replace

import pytest

from palpate.devices import contract
from palpate.devices.contract import check_device
from palpate.devices.instruments import thermometer
from palpate.devices.kinds import KINDS
from palpate.protocols.strict import Strict

SETTINGS = {"door": {"twin_speed": 0.25}, "accelerometer": {"rate_hz": 1000}, "force_torque": {"rate_hz": 1000}}
"""Settings with which the twins are quick on a busy machine; a slow twin of a door loses no heartbeat."""
FAST = {"rate_hz": 20}


@pytest.mark.parametrize(
    "name", [pytest.param("door", marks=pytest.mark.needs("serial")), *sorted({*KINDS} - {"door"})]
)
def test_every_kind_of_device_keeps_the_contract(name):
    failed = [str(verdict) for verdict in check_device(name, KINDS[name], SETTINGS.get(name)) if not verdict.ok]
    assert failed == []


class Loose(thermometer.Settings):
    kind: str = "thermometer"


class Nothing(Strict):
    place: str = "skin"


class Bad(thermometer.Thermometer):
    """A thermometer that fails in one way, which its name says."""

    fails = ""

    def describe(self):
        return {**super().describe(), "kind": "another"} if self.fails == "describe" else super().describe()

    def read(self, timeout_s):
        blocks = super().read(timeout_s)
        if self.fails == "hole":
            return {name: [replace(block, first=2 * block.first) for block in some] for name, some in blocks.items()}
        return {"temperature": []} if self.fails == "silent" else blocks

    def safe(self):
        if self.fails == "safe" and self.port is None:
            raise OSError("not open")


class Presenting(Bad):
    def perform(self, _request, _window, _desk, _now_ns):
        raise NotImplementedError


def kind_of(fails, cls=Bad, **changes):
    def make(name, settings, _folder):
        made = cls(name, settings, thermometer.connect_twin)
        made.fails = fails
        return made

    return replace(thermometer.KIND, make=make, **changes)


@dataclass(frozen=True)
class Wrong:
    kind: object
    demand: str
    problem: str


@pytest.mark.parametrize(
    "wrong",
    [
        Wrong(kind_of("", settings=Loose), "its settings have", "{'kind': 'another'} are taken"),
        Wrong(kind_of("", meanings={}), "every setting is explained", "says nothing of port, baud"),
        Wrong(kind_of("safe"), "closing it does no harm", "OSError: not open"),
        Wrong(kind_of("describe"), "describes itself", "describe() has kind: 'another'"),
        Wrong(kind_of("hole"), "without a hole", "sample 2 comes where 1 is due"),
        Wrong(kind_of("silent"), "without a hole", "0 samples came"),
        Wrong(kind_of("", unplug=""), "a lost link is named", "has no `unplug`"),
        Wrong(kind_of("", unplug=lambda _device: None), "a lost link is named", "no fault came of reading it"),
        Wrong(kind_of("", Presenting), "obeys its hard limit", "has no `exceed`"),
        Wrong(kind_of("", exceed=lambda _device: (46.0, 45.0)), "hard limit", "46 came out, and its limit is 45"),
    ],
    ids=lambda wrong: f"{wrong.problem}",
)
def test_what_a_device_does_not_keep_is_named(wrong, monkeypatch):
    monkeypatch.setattr(contract, "MOST_S", 0.6)
    monkeypatch.setattr(contract, "FAULT_S", 0.3)
    verdicts = check_device("thermometer", wrong.kind, FAST)
    [failed] = [verdict for verdict in verdicts if wrong.demand in verdict.demand]
    assert wrong.problem in failed.problem and str(failed).startswith("FAILED")


def test_a_kind_without_a_twin_fails_its_first_demand():
    first = check_device("thermometer", replace(thermometer.KIND, settings=Nothing))[0]
    assert first.problem.startswith("ValidationError")


def test_a_limit_beyond_what_comes_out_is_said():
    [last] = check_device("thermometer", kind_of("", exceed=lambda _device: (44.5, 45.0)), FAST)[-1:]
    assert last.ok and last.remark == "44.5 came out at most, the limit is 45"
