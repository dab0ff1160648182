"""A complaint about a study file."""

from __future__ import annotations

from dataclasses import dataclass

from palpate.protocols.yaml_text import Path


@dataclass(frozen=True)
class Problem:
    """What is wrong at a path of the study file."""

    path: Path
    message: str
