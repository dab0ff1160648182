"""How long each number took, measured once in a lab: a run that makes the same number again leaves its time as it is.

Otherwise no two runs would give the same bytes.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from analysis.regenerating.running import Answered

FILE = "seconds.json"


def remembered(found: Iterable[Answered], software: Mapping[str, str], file: Path) -> dict[int, float]:
    """The seconds of each answer by its place: as measured first in this lab, else as measured now (and kept)."""
    known = _read(file)
    seconds, fresh = {}, False
    for place, each in enumerate(found):
        key = _key(each, software)
        if key not in known:
            known[key], fresh = float(f"{each.seconds:.2g}"), True
        seconds[place] = known[key]
    if fresh:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(known, indent=0, sort_keys=True) + "\n", encoding="utf-8", newline="\n")
    return seconds


def _read(file: Path) -> dict[str, float]:
    """What is on file; a file that is no such record is begun anew, for it holds nothing but times."""
    try:
        found: Any = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    if not isinstance(found, dict):
        return {}
    return {str(key): float(value) for key, value in found.items() if isinstance(value, int | float)}


def _key(each: Answered, software: Mapping[str, str]) -> str:
    """What the time is the time of: the question, its inputs and the software."""
    asked = {"asked": each.asked.model_dump(mode="json"), "outcome": each.outcome, "inputs": each.inputs}
    text = json.dumps(asked | {"software": dict(software)}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:24]
