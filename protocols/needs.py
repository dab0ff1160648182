"""The needs that a study may have: each by name, its role in a study, and the devices that it takes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from palpate.protocols.registry import Registry

Role = Literal["presents", "records", "beside"]


@dataclass(frozen=True)
class Taken:
    """A device of one kind that a need takes.

    `stream` is the name of the stream that the device's first signal becomes, if it is recorded; `rate_hz` is that
    stream's rate in a simulated session.
    """

    stream: str = ""
    rate_hz: float = 0.0


@dataclass(frozen=True)
class Need:
    """A need of a study: the role of its devices, and the device of each kind that it `takes`.

    `presents`: they let the participant feel the stimuli, which are checked before a session; a study has at most one
    such need, apart from samples placed by hand. `records`: they record a stimulus while it is explored. `beside`: they
    run during presenting and recording; what they measure is stored with each reply. Without a role, no device of a rig
    is required. `makes` says that stimuli are made from wishes, `plays_models` that models play them. `prepared`: the
    session prepares what is presented (profiles, models); else the device checks and presents the stimuli by itself.
    `parameters` are the columns of a stimulus that its device takes: it can then present intervals at levels that
    procedures choose.
    """

    role: Role | None = None
    takes: Mapping[str, Taken] = field(default_factory=dict)
    makes: bool = False
    plays_models: bool = False
    prepared: bool = False
    parameters: frozenset[str] = frozenset()


VIBRATION = frozenset({
    "waveform", "level_db", "reference", "seconds", "ramp_s", "frequency_hz", "low_hz", "high_hz", "pulse_hz",
    "pulse_s", "seed", "file",
})  # fmt: skip
"""The columns of a stimulus table that describe a vibration (`palpate.signals.vibration`)."""

NEEDS: Registry[Need] = Registry(
    kind="needs",
    of="palpate.protocols.needs:Need",
    parts={
        "door": Need("presents", {"door": Taken()}, prepared=True),
        "window": Need(),
        "samples": Need(None, {"stage": Taken()}),
        "tool": Need(
            "records",
            {
                "accelerometer": Taken("tool_acceleration", 3000.0),
                "force_torque": Taken("tool_force", 8000.0),
                "tracker": Taken("tool_position", 120.0),
            },
        ),
        "door_sensors": Need(
            "records",
            {"force_torque": Taken("door_force", 1000.0), "tracker": Taken("door_position", 80.0)},
        ),
        "texture_renderer": Need(
            "presents", {"tablet": Taken(), "voice_coil": Taken()}, plays_models=True, prepared=True
        ),
        "door_generator": Need("presents", {"door": Taken()}, makes=True, plays_models=True, prepared=True),
        "vibration": Need("presents", {"vibrator": Taken()}, parameters=VIBRATION),
        "camera": Need("records", {"camera": Taken()}),
        "masking_noise": Need("beside", {"masking_noise": Taken()}),
        "skin_temperature": Need("beside", {"thermometer": Taken("skin_temperature", 1.0)}),
    },
)
"""The needs by name; the rates are those of the thesis' sensors (3.4.1, 4.3.3, 5.3.1.1)."""


def recorded_beside(needs: Iterable[str]) -> tuple[str, ...]:
    """Return the needs whose devices are recorded during everything that is done in trials."""
    return tuple(
        need for need in needs if NEEDS[need].role == "beside" and any(t.stream for t in NEEDS[need].takes.values())
    )


def presented_by_device(needs: Iterable[str]) -> tuple[str, ...]:
    """Return the needs whose devices check and present the stimuli by themselves."""
    return tuple(need for need in needs if NEEDS[need].role == "presents" and not NEEDS[need].prepared)


def needs_with(role: Role) -> tuple[str, ...]:
    """Return the needs with this role, in the order of NEEDS."""
    return tuple(name for name, need in NEEDS.items() if need.role == role)
