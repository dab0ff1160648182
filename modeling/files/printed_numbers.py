"""Numbers that somebody printed, kept as YAML beside the report that sets them beside ours."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any


@cache
def printed_numbers(file: Path) -> Mapping[str, Any]:
    """The whole file, read once."""
    import yaml

    told: Mapping[str, Any] = yaml.safe_load(file.read_text(encoding="utf-8"))
    return told
