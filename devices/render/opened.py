"""The devices of a job, opened and connected to a loop."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from palpate.devices.actuator.device import VoiceCoil, make
from palpate.devices.actuator.settings import Settings
from palpate.devices.render.hands import Hand, OnTablet, Pushed, Scripted
from palpate.devices.render.job import Job
from palpate.devices.render.loop import AtOnce, Loop, Pace, Wall
from palpate.devices.render.renderer import Renderer
from palpate.devices.render.sinks import MOST_AHEAD, Coil, on_coil
from palpate.devices.render.trace import Trace
from palpate.devices.rig.file import read_rig
from palpate.devices.rig.opened import open_rig
from palpate.devices.tablet.device import Tablet
from palpate.signals.textures.sounds import RenderError, Sounds
from palpate.signals.textures.voice import Voice, opened_voice

NEED = "texture_renderer"
WARM_MS = 50


@dataclass
class Playing:
    """A running job: its loop, and the records of its parts."""

    renderer: Renderer
    hand: Hand
    sink: Coil
    loop: Loop
    facts: dict[str, Any] = field(default_factory=dict)

    def record(self) -> dict[str, Any]:
        """Return all records as JSON data."""
        voice = self.renderer.voice
        return {
            "ready": self.loop.ready.record(), "woken": self.loop.woken.record(), "output": dict(self.sink.record()),
            "made": self.loop.made, "switches": self.renderer.switches,
            "voice": None if voice is None else describe_voice(voice), **self.facts,
        }  # fmt: skip


def describe_voice(voice: Voice) -> dict[str, Any]:
    """Return the record of a voice: its model's file by digest, its runtime, its tally."""
    card = voice.card
    return {
        "model": card.name, "method": card.method, "weights_sha256": card.weights.sha256,
        "runtime": voice.runs.runtime, "notes": list(voice.notes), **vars(voice.tally),
    }  # fmt: skip


def sounding(sounds: Sounds | None) -> Voice | None:
    """Open the voice of a texture, or none for silence. Raises ModelFileError, RenderError."""
    return None if sounds is None else opened_voice(sounds)


def warm(voice: Voice | None) -> None:
    """Play silence and strokes into a twin as fast as possible, so that nothing in the loop happens for the first time.

    That concerns imports, first uses of libraries, memory. The voice is at rest afterwards; use a separate one for
    playing.
    """
    pace = AtOnce()
    coil = twin_coil(MOST_AHEAD, lambda: pace.now_ns() * 1e-9)
    coil.start()
    hand = Scripted([0.0] * WARM_MS + [100.0] * WARM_MS, [0.0] * WARM_MS + [1.0] * WARM_MS)
    Loop(Renderer(voice), hand, on_coil(coil), pace, Trace.own()).run(2 * WARM_MS)
    coil.close()


@contextmanager
def playing(job: Job, trace: Trace, pace: Pace | None = None) -> Iterator[Playing]:
    """Open the devices of a job, ready to run; afterwards make everything silent and release it.

    Raises ModelFileError, RenderError, DeviceError if anything is not available.
    """
    warm(sounding(job.sounds))
    renderer = Renderer(sounding(job.sounds))
    with _devices(job) as (coil, tablet):
        hand = _hand(job, tablet)
        sink = on_coil(coil, job.ahead)
        coil.start()
        if tablet is not None:
            tablet.start(time.monotonic_ns)
        work = Playing(renderer, hand, sink, Loop(renderer, hand, sink, pace or Wall(), trace))
        devices = [device for device in (coil, tablet) if device is not None]
        work.facts["devices"] = {device.name: dict(device.describe()) for device in devices}
        try:
            yield work
        finally:
            coil.rest()
            coil.safe()


def twin_coil(ahead: int, elapsed_s: Any = time.monotonic) -> VoiceCoil:
    """Return an open twin of a voice coil."""
    coil = make("actuator", Settings(kind="voice_coil", driver="twin", ahead_ms=max(5, ahead)), Path(), elapsed_s)
    coil.open()
    return coil


@contextmanager
def _devices(job: Job) -> Iterator[tuple[VoiceCoil, Tablet | None]]:
    if job.rig is None:
        coil = twin_coil(job.ahead)
        try:
            yield coil, None
        finally:
            coil.close()
        return
    file = read_rig(job.rig)
    names = [name for name in file.names_for(NEED) if job.hand is None or file.kind(name) != "tablet"]
    rig = open_rig(file, names)
    try:
        yield _of(rig.of(NEED) if job.hand is None else {file.kind(name): rig.devices[name] for name in names})
    finally:
        rig.close()


def _of(kinds: Mapping[str, Any]) -> tuple[VoiceCoil, Tablet | None]:
    coil, tablet = kinds["voice_coil"], kinds.get("tablet")
    if not isinstance(coil, VoiceCoil) or not (tablet is None or isinstance(tablet, Tablet)):
        raise RenderError("the rig's texture_renderer is not a tablet and voice coil")
    return coil, tablet


def _hand(job: Job, tablet: Tablet | None) -> Hand:
    if isinstance(job.hand, Scripted):
        return job.hand
    if job.hand is not None:
        return Pushed(lambda: time.monotonic() - job.epoch_s, job.hand)
    if tablet is None:
        raise RenderError("no hand: a rig with a tablet, a recording or a simulated hand is needed")
    return OnTablet(tablet)
