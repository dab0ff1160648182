"""An output of a sound card, through PortAudio (sounddevice)."""

from __future__ import annotations

import importlib
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from palpate.devices.device import DeviceError, DeviceFault
from palpate.devices.sound.output import DRAIN_S, Fill
from palpate.signals.arrays import Array

SILENT_S = 1.0
"""A card that has requested no samples for this long has stopped without notice."""


def portaudio() -> Any:
    """Return the sounddevice module. Raises DeviceError if it or the PortAudio library is not installed."""
    try:
        return importlib.import_module("sounddevice")
    except ImportError:
        raise DeviceError("sound needs the package sounddevice: pip install 'palpate[rig]'") from None
    except OSError as error:
        raise DeviceError(f"sound needs the PortAudio library ({error}): apt-get install libportaudio2") from None


@dataclass
class Card:
    """An output whose channels all get the same samples. `device` is a name, part of one, a number, or None:
    default.
    """

    name: str
    device: str | int | None
    rate_hz: float
    channels: int = 1
    requested_latency: str | float = "low"
    library: Callable[[], Any] = portaudio
    clock_s: Callable[[], float] = time.monotonic
    latency_s: float = 0.0
    late: int = 0
    output_name: str = ""
    _stream: Any = None
    _fill: Fill | None = None
    _failed: str = ""
    _called_s: float = 0.0
    _ending: bool = False
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def wait_s(self) -> float:
        """Return the card's latency, in seconds."""
        return self.latency_s

    def open(self) -> None:
        """Find the output and check that it supports the rate. Raises DeviceError that lists the available ones."""
        sound = self.library()
        try:
            output = sound.query_devices(self.device, "output")
            sound.check_output_settings(device=self.device, channels=self.channels, samplerate=self.rate_hz)
        except (ValueError, sound.PortAudioError) as error:
            known = [
                f"{n}: {one['name']}" for n, one in enumerate(sound.query_devices()) if one["max_output_channels"] > 0
            ]
            there = f"Outputs here: {'; '.join(known)}" if known else "This machine has no sound output"
            raise DeviceError(f"{self.name}: no such sound output: {error}. {there}") from None
        self.output_name = str(output["name"])

    def start(self, fill: Fill) -> None:
        """Begin to play. Raises DeviceError if the card is in use or gone."""
        sound = self.library()
        self._fill, self._failed, self._ending, self._called_s = fill, "", False, self.clock_s()
        try:
            self._stream = sound.OutputStream(
                samplerate=self.rate_hz, device=self.device, channels=self.channels, dtype="float32",
                latency=self.requested_latency, callback=self._deliver, finished_callback=self._finished,
            )  # fmt: skip
            self.latency_s = float(self._stream.latency)
            self._stream.start()
        except (ValueError, sound.PortAudioError) as error:
            self.stop()
            raise DeviceError(f"{self.name}: the sound output {self.output_name!r} does not start: {error}") from None

    def _deliver(self, out: Any, frames: int, _times: Any, status: Any) -> None:
        """Fill PortAudio's buffer on its thread; raise nothing, because the card would repeat its last buffer."""
        self._called_s = self.clock_s()
        self.late += bool(status.output_underflow)
        fill = self._fill
        try:
            part: Array | None = None if fill is None else fill(frames)
        except Exception as error:
            self._failed, part = f"its samples could not be read: {error}", None
            self._fill = None
        out[:] = 0.0 if part is None else part[:, None]

    def _finished(self) -> None:
        if not self._ending:
            self._failed = self._failed or "it ended by itself (unplugged?)"

    def cut(self) -> None:
        """Do nothing: a card's buffer cannot be dropped without a click, and plays on for its latency."""

    def drain(self, silent: threading.Event) -> None:
        """Play on until the event, then as long as the card's own buffer lasts."""
        if self._stream is not None and self._stream.active and silent.wait(DRAIN_S):
            self._ending = True
            self._stream.stop(ignore_errors=True)

    def stop(self) -> None:
        """Play the rest of the buffer, then release the card."""
        with self._lock:
            stream, self._stream, self._ending = self._stream, None, True
        if stream is not None:
            stream.stop(ignore_errors=True)
            stream.close(ignore_errors=True)
        self._fill = None

    def fault(self) -> DeviceFault | None:
        """Return a fault if the card has stopped, or has requested no samples for a second, else None."""
        if self._failed:
            return DeviceFault(
                self.name, "link_lost", f"{self.name}: the sound output {self.output_name!r} failed: {self._failed}"
            )
        if self._stream is not None and self.clock_s() - self._called_s > SILENT_S:
            message = f"the sound output {self.output_name!r} has requested no samples for {SILENT_S:g} s"
            return DeviceFault(self.name, "silent", f"{self.name}: {message}")
        return None

    def facts(self) -> Mapping[str, str]:
        """Return the output's name, rate and latency, and how many buffers came late."""
        late = f"{1000 * self.latency_s:.1f} ms" if self.latency_s else "not started"
        return {
            "output": self.output_name,
            "rate": f"{self.rate_hz:g} Hz",
            "latency": late,
            "late buffers": str(self.late),
        }
