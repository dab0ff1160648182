"""A scanner that types: a burst of keys faster than any hand, with Enter at its end, is one code."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from palpate.studies.console.entry import ENTER
from palpate.studies.console.listening import Heard

BURST_S = 0.05
"""Longest pause between two keys of a burst; hands take 80 ms and more."""
SHORTEST, LONGEST = 2, 80
"""Characters of a code."""


def burst(heard: Sequence[Heard], now_s: float) -> tuple[str | None, bool]:
    """The code that the first keys are, else None; and whether more are to be waited for before any is heeded."""
    keys = list(heard[: LONGEST + 1])
    end = next((place for place, key in enumerate(keys) if key.text in ENTER), None)
    run = keys if end is None else keys[: end + 1]
    if not run or run[0].text in ENTER or any(later.t_s - key.t_s > BURST_S for key, later in pairwise(run)):
        return None, False
    if not all(key.text.isprintable() for key in run if key.text not in ENTER):
        return None, False
    if end is None:
        return None, len(keys) <= LONGEST and now_s - run[-1].t_s <= BURST_S
    return ("".join(key.text for key in run[:-1]), False) if len(run) > SHORTEST else (None, False)
