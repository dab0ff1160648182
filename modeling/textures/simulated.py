"""Six simulated textures, captured by the twins of a rig's sensors, which every model is tested on by default."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from palpate.modeling.files.result_store import ResultStore, content_key
from palpate.modeling.textures.preparing import Touched, prepared
from palpate.modeling.textures.rates import Sampled, evenly
from palpate.modeling.textures.recording import Joined, Recording, TextureDataError
from palpate.modeling.textures.simulator import TextureSimulator, simulation_digest
from palpate.protocols.code_digest import code_digest
from palpate.signals.arrays import Array

SIX = ("textured_rubber", "artificial_grass", "steel_mesh", "cloth", "cardboard", "plastic_mesh")
"""The textures that are rendered (thesis 4.3.2)."""
SECONDS = 20.0
SEEN = 3
"""The column of a tracker's positions that is 0 where the marker was hidden."""
STREAMS = ("tool_acceleration", "tool_force", "tool_position")


def simulated(
    simulator: TextureSimulator, textures: Sequence[str] = SIX, seconds: float = SECONDS, seed: int = 1,
    cache: Path | None = None, report: Callable[[str], None] = lambda _line: None,
    clock: Callable[[], float] = time.perf_counter,
) -> tuple[Recording, ...]:  # fmt: skip
    """Return a recording of each texture: a free exploration of a simulated surface, captured as in a session.

    The same texture, seconds and seed give the same recording. In a folder `cache` it is saved under the SHA-256 of all
    that determines it, including the program's own files, and verified when it is read; `report` gets the seconds of
    each. Raises TextureDataError, and the errors of `simulator` for an unknown texture.
    """
    recordings = []
    for texture in textures:
        began = clock()
        recording, cached = _recording_of(simulator, texture, seconds, seed, cache)
        how = "read from the cache" if cached else "captured"
        report(f"{texture}: {recording.seconds:.1f} s {how} in {clock() - began:.2f} s")
        recordings.append(recording)
    return tuple(recordings)


def captured(simulator: TextureSimulator, texture: str, seconds: float = SECONDS, seed: int = 1) -> Recording:
    """Return the recording of one texture as `simulated` does, without a cache."""
    streams, where = simulator.captured(texture, seconds, seed), f"simulated {texture}"
    if missing := [name for name in STREAMS if name not in streams]:
        raise TextureDataError(f"{where}: no stream {missing[0]!r}; {', '.join(STREAMS)} are expected")
    touched = Touched(
        where, _stream(where, "acceleration", streams), _stream(where, "force", streams),
        position=_stream(where, "position", streams), notes=("simulated",),
        made_from=(f"simulated {texture}, {seconds:g} s, seed {seed} {_digest(streams)}",),
    )  # fmt: skip
    return prepared(texture, texture.replace("_", " "), [touched])


def _recording_of(
    simulator: TextureSimulator, texture: str, seconds: float, seed: int, cache: Path | None
) -> tuple[Recording, bool]:
    """Return the recording, and whether it was in the cache."""
    kind = type(simulator)
    key = content_key(
        simulated=[texture, seconds, seed],
        simulator=[f"{kind.__module__}.{kind.__qualname__}", simulation_digest(simulator.captured)],
        code=code_digest(__name__),
    )
    store, name = ResultStore(cache), f"texture-{texture}-{key[:16]}"
    if (stored := store.load(name)) is not None:
        fields: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value for name, value in stored.metadata.items()
        }
        return (Joined if "borders" in fields else Recording)(**fields, signals=stored.arrays["signals"]), True
    recording = captured(simulator, texture, seconds, seed)
    metadata = {name: value for name, value in asdict(recording).items() if name != "signals"}
    store.save(name, {"signals": recording.signals}, metadata)
    return recording, False


def _stream(where: str, what: str, streams: Mapping[str, tuple[float, Array]]) -> Sampled:
    rate_hz, values = streams[f"tool_{what}"]
    rows = np.array(values[:, :3], dtype=np.float64)
    if what == "position" and values.shape[1] > SEEN:
        rows[values[:, SEEN] == 0] = np.nan
    return evenly(what, rows, rate_hz, where)


def _digest(streams: Mapping[str, tuple[float, Array]]) -> str:
    digest = hashlib.sha256()
    for name in sorted(streams):
        rate_hz, values = streams[name]
        digest.update(f"{name} {rate_hz:.17g} {values.shape}".encode())
        digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return digest.hexdigest()
