"""How long each number took, measured once in a lab: a run that makes the same number again leaves its time as it is.

Otherwise no two runs would give the same bytes.
"""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path
from typing import Any

from palpate.analysis.regenerating.regenerated import Regenerated
from palpate.analysis.regenerating.running import Answered
from palpate.protocols.canonical import json_text
from palpate.protocols.files import write_text

FILE = "seconds.json"


def remembered(found: Regenerated, file: Path) -> dict[int, float]:
    """The seconds of each answer by its place: as measured first in this lab, else as measured now (and kept)."""
    known = _read(file)
    seconds, fresh = {}, False
    for place, each in enumerate(found.answered):
        key = _key(each, found)
        if key not in known:
            known[key], fresh = float(f"{each.seconds:.2g}"), True
        seconds[place] = known[key]
    if fresh:
        write_text(file, json_text(known, indent=0, sort_keys=True))
    return seconds


def _read(file: Path) -> dict[str, float]:
    """What is on file; a file that is no such record is begun anew, for it holds nothing but times."""
    try:
        found: Any = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    if not isinstance(found, dict):
        return {}
    return {key: value for key, value in found.items() if isinstance(value, float) and 0 <= value < math.inf}


def _key(each: Answered, found: Regenerated) -> str:
    """What the time is the time of: the question with all that the plan says about it, its inputs and the software."""
    declared = found.plan.declared
    asked = {"asked": each.asked.model_dump(mode="json"), "outcome": each.outcome, "inputs": each.inputs}
    plans = {"alpha": declared.alpha, "seed": declared.seed, "draws": declared.draws, "missing": each.missing.policy}
    text = json.dumps(asked | plans | {"software": dict(found.software)}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:24]
