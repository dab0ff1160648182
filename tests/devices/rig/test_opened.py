"""Devices are opened as one and closed as one, whatever fails on the way."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from palpate.devices.device import DeviceError
from palpate.devices.kinds import DeviceKind
from palpate.devices.rig import opened as opening
from palpate.devices.rig.file import RigFile
from palpate.devices.rig.opened import open_rig
from palpate.devices.sound.device import Settings


@dataclass
class Thing:
    """A device that says what was done to it, and may fail at it."""

    name: str
    log: list
    fails: tuple

    def _did(self, what):
        self.log.append(f"{self.name} {what}")
        if f"{self.name} {what}" in self.fails:
            raise DeviceError(f"{self.name} fails to {what}")

    def open(self):
        self._did("open")

    def safe(self):
        self._did("safe")

    def close(self):
        self._did("close")


@pytest.fixture
def opened(monkeypatch):
    log = []

    def call(*fails):
        kind = DeviceKind(Settings, lambda name, _settings, _folder: Thing(name, log, fails), {}, "")
        monkeypatch.setattr(opening, "KINDS", {"masking_noise": kind})
        settings = Settings(kind="masking_noise", driver="twin")
        return open_rig(RigFile(Path("rig.yaml"), "booth", dict.fromkeys("abc", settings), {}), ["a", "b", "c"])

    return call, log


def test_all_are_made_safe_before_the_first_is_let_go_of(opened):
    call, log = opened
    call().close()
    assert log[:3] == ["a open", "b open", "c open"]
    assert {*log[3:6]} == {"a safe", "b safe", "c safe"} and {*log[6:]} == {"a close", "b close", "c close"}


def test_what_fails_to_open_is_let_go_of_with_those_before_it(opened):
    call, log = opened
    with pytest.raises(DeviceError, match="b fails to open"):
        call("b open")
    assert log == ["a open", "b open", "b close", "a close"]


def test_one_that_fails_to_be_safe_keeps_no_other_from_it(opened):
    call, log = opened
    rig = call("b safe", "c close")
    with pytest.raises(DeviceError, match="c fails to close"):
        rig.close()
    assert {*log[3:]} == {f"{name} {what}" for name in "abc" for what in ("safe", "close")}
