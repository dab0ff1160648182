"""What a blind console and the monitor leave out of texts that name a stimulus: faults of devices, demands, states."""

from __future__ import annotations

import re
from collections.abc import Callable

from palpate.protocols.keyed import shuffled
from palpate.protocols.study import Study

HIDDEN = "\N{HORIZONTAL ELLIPSIS}"


def hider(study: Study, seen: tuple[str, ...] = ()) -> Callable[[str], str]:
    """Return what takes the ids of a study's stimuli, and the levels of its blind columns, out of a text.

    Words that stand in the columns `seen`, which the console shows anyway, stay. A study that keeps nothing blind
    changes no text.
    """
    if not study.blind:
        return lambda text: text
    open_columns = [column for column in seen if column not in study.blind]
    shown = {stimulus.columns.get(column, "").casefold() for stimulus in study.stimuli for column in open_columns}
    names = {stimulus.id for stimulus in study.stimuli}
    names |= {stimulus.columns.get(column, "") for stimulus in study.stimuli for column in study.blind}
    hidden = sorted((name for name in names - {""} if name.casefold() not in shown), key=len, reverse=True)
    if not hidden:
        return lambda text: text
    words = "|".join(map(re.escape, hidden))
    pattern = re.compile(rf"(?<![^\W_])(?:{words})(?![^\W_])", re.IGNORECASE)
    return lambda text: pattern.sub(HIDDEN, text)


def aliases(study: Study) -> dict[str, str]:
    """Return a name for each stimulus of a study that keeps something blind, which does not tell the stimulus; else {}.

    The numbers are dealt by a key of the study, so that they are no order of the stimulus table.
    """
    if not study.blind:
        return {}
    dealt = shuffled([stimulus.id for stimulus in study.stimuli], "blind", study.study)
    return {name: f"stimulus {number}" for number, name in enumerate(dealt, start=1)}
