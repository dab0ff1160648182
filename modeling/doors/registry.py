"""All methods that predict ratings or make profiles, by name; a method's libraries are imported with its first use."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from palpate.modeling.doors.methods import Method
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.protocols.registry import Registry

Direction = Literal["forward", "inverse"]


FORWARD: Mapping[str, Method] = Registry(
    {
        "mean": "palpate.modeling.doors.linear:MEAN",
        "ridge": "palpate.modeling.doors.linear:RIDGE",
        "forest": "palpate.modeling.doors.forest:FOREST",
        "pca_ridge": "palpate.modeling.doors.linear:PCA_RIDGE",
        "gaussian_process": "palpate.modeling.doors.gaussian_process:GAUSSIAN_PROCESS",
        "mlp": "palpate.modeling.doors.forward_network:MLP",
        "network": "palpate.modeling.doors.forward_network:NETWORK",
        "network_thesis": "palpate.modeling.doors.forward_network:NETWORK_THESIS",
    },
)
INVERSE: Mapping[str, Method] = Registry(
    {
        "nearest": "palpate.modeling.doors.nearest:NEAREST",
        "pca_regression": "palpate.modeling.doors.linear:PCA_REGRESSION",
        "search": "palpate.modeling.doors.gradient_search:SEARCH",
        "network": "palpate.modeling.doors.inverse_network:INVERSE_NETWORK",
        "generator": "palpate.modeling.doors.generator:GENERATOR",
    },
)
THESIS = "network"
"""The method of either direction that the thesis proposes (5.4, 5.6)."""
DEFAULT: Mapping[Direction, str] = {"forward": "gaussian_process", "inverse": "generator"}
"""The methods to train without an evaluation of the lab's own data: the best in docs/reference/door-evaluation.md. The
forward one also rates made profiles.
"""
ON_REQUEST = frozenset({("forward", "network_thesis")})
"""Methods that are evaluated only by request: beside `network` they cost several times as much."""
SLOW = frozenset(
    {
        ("forward", "network"),
        ("forward", "network_thesis"),
        ("inverse", "network"),
        ("inverse", "search"),
        ("inverse", "generator"),
    }
)
"""Methods that take half a minute or more per fold, which are evaluated on the requested split only."""
NO_FILE = frozenset({("inverse", "search")})
"""Methods that search with torch for every answer, so that no file of them can be written for a rig."""


def methods_of(direction: Direction) -> Mapping[str, Method]:
    """Return all methods of one direction."""
    return FORWARD if direction == "forward" else INVERSE


def method_named(direction: Direction, name: str) -> Method:
    """Return the method of this name. Raises ModelDataError with the nearest known name."""
    known = methods_of(direction)
    if name not in known:
        from palpate.protocols.did_you_mean import nearest

        raise ModelDataError(f"no {direction} method {name!r}; {nearest(name, known)}")
    return known[name]


def demand_file(direction: Direction, name: str) -> None:
    """Raise ModelDataError where there is no method of this name, or where it cannot be written as a file for a rig."""
    method_named(direction, name)
    if (direction, name) in NO_FILE:
        others = ", ".join(method for method in methods_of(direction) if (direction, method) not in NO_FILE)
        raise ModelDataError(f"{direction} method {name!r} searches with torch and cannot be a file; one of {others}")
