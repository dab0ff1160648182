"""What a study may need: each need by name, what it does in a study, and what it takes of a rig."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from palpate.protocols.registry import Registry

Role = Literal["presents", "records", "beside"]


@dataclass(frozen=True)
class Taken:
    """What a need takes of one kind of device: the name of the stream that the device's first signal becomes, if it is
    recorded, and that stream's rate in a simulated session, in Hz."""

    stream: str = ""
    rate_hz: float = 0.0


@dataclass(frozen=True)
class Need:
    """A need of a study: what its devices do, and one device of each kind that it `takes`, by kind.

    `presents`: they let the participant feel the stimuli, which are checked before a session; a study has at most one
    such need, beside samples put in place by hand. `records`: they record a stimulus while it is explored. `beside`:
    they work beside whatever presents or records; what they measure is kept with each reply. Without a role, nothing
    of a rig has to be there. `makes` says that stimuli are made from wishes, `plays_models` that models play them.
    """

    role: Role | None = None
    takes: Mapping[str, Taken] = field(default_factory=dict)
    makes: bool = False
    plays_models: bool = False


NEEDS: Registry[Need] = Registry(
    parts={
        "door": Need("presents", {"door": Taken()}),
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
        "texture_renderer": Need("presents", {"tablet": Taken(), "voice_coil": Taken()}, plays_models=True),
        "door_generator": Need("presents", {"door": Taken()}, makes=True, plays_models=True),
        "camera": Need("records", {"camera": Taken()}),
        "masking_noise": Need("beside", {"masking_noise": Taken()}),
        "skin_temperature": Need("beside", {"thermometer": Taken("skin_temperature", 1.0)}),
    }
)
"""The rates are those of the thesis' sensors (3.4.1, 4.3.3, 5.3.1.1)."""


def recorded_beside(needs: Iterable[str]) -> tuple[str, ...]:
    """Return those of the needs whose devices are recorded beside everything that is done in trials."""
    return tuple(
        need for need in needs if NEEDS[need].role == "beside" and any(t.stream for t in NEEDS[need].takes.values())
    )


def needs_with(role: Role) -> tuple[str, ...]:
    """Return the needs of this role, in their order."""
    return tuple(name for name, need in NEEDS.items() if need.role == role)
