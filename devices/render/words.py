"""How a rendering went, for people."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from palpate.protocols.wording import count

WORDS = {
    "held": "sensor values that none could be: the last good ones stood in",
    "restarts": "times the model left its bounds and was begun anew",
    "quiet": "steps at under 1 % of the texture's level",
    "muted": "steps of silence, since the model would not stay within its bounds",
}
TOLD_S = 0.001
"""Less is not told of."""


def in_words(record: Mapping[str, Any], seconds: float, level_m_s2: float) -> Iterator[str]:
    """Line by line."""
    voice = record.get("voice") or {}
    yield f"{seconds:g} s at 1 kHz by {voice.get('runtime', 'nothing')}, level {level_m_s2:.3g} m/s^2"
    if "took" in record:
        took = record["took"]
        yield f"a step took {_times(took)}; {took['late']} of {took['steps']} took longer than 1 ms"
    else:
        yield from _deadlines(record)
    yield from (f"{voice[name]} {told}" for name, told in WORDS.items() if voice.get(name))
    yield from voice.get("notes", ())


def _deadlines(record: Mapping[str, Any]) -> Iterator[str]:
    ready, output = record["ready"], record["output"]
    yield f"priority {record['priority']}, output buffer {output['ahead_ms']} ms"
    late = f"{ready['late']} of {ready['steps']} steps ({100 * ready['late_share']:.3g} %)"
    yield f"underruns: {output['underruns']} ({count(output['missing'], 'sample')}; the last one dies away meanwhile)"
    yield f"later than 1 ms, as without a buffer: {late}"
    yield f"ready after it was due: {_times(ready)}"
    yield from _outside(record.get("outside") or {})
    if output["limited"]:
        yield f"limited {count(output['limited'], 'sample')} to what the actuator bears"
    if not output["compensated"]:
        yield "played on a twin that is not identified: not compensated"


def _outside(told: Mapping[str, Any]) -> Iterator[str]:
    if (waited := told.get("waited_s") or 0.0) > TOLD_S:
        yield f"{waited:.3g} s kept waiting by other programs"
    if (stolen := told.get("stolen_s") or 0.0) > TOLD_S:
        yield f"{stolen:.3g} s of this machine's processors were taken away by its host: no priority helps against that"


def _times(told: Mapping[str, Any]) -> str:
    return f"median {told['median_us']:g}, 99 % {told['p99_us']:g}, worst {told['worst_us']:g} us"
