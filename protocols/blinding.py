"""What a blind console and the monitor hide in texts that name a stimulus: device faults, prompts, states."""

from __future__ import annotations

import re
from collections.abc import Callable

from palpate.protocols.keyed import shuffled
from palpate.protocols.study import Study

HIDDEN = "\N{HORIZONTAL ELLIPSIS}"


def hider(study: Study, seen: tuple[str, ...] = ()) -> Callable[[str], str]:
    """Return a function that hides the ids of a study's stimuli, and the levels of its blind columns, in a text.

    Words of the columns `seen`, which the console shows anyway, are kept. If the study has no blind columns, texts are
    unchanged.
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
    """Return a neutral name for each stimulus of a study with blind columns; {} for other studies.

    The numbers are assigned by a key of the study, so they do not follow the order of the stimulus table.
    """
    if not study.blind:
        return {}
    dealt = shuffled([stimulus.id for stimulus in study.stimuli], "blind", study.study)
    return {name: f"stimulus {number}" for number, name in enumerate(dealt, start=1)}
