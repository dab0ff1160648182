"""What a scanned code says, and which sample it stands for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from palpate.protocols.study import Stimulus

COLUMN = "barcode"
"""Column of a stimulus table that holds a sample's code; without one, the id is the code."""


def plain(code: str) -> str:
    """A code as it is compared: without blanks around it and control characters, letters as capitals."""
    return "".join(each for each in code if each.isprintable()).strip().upper()


def codes_of(stimulus: Stimulus) -> tuple[str, ...]:
    """What a scan of this sample may say: its code, and its id."""
    given = (plain(stimulus.columns.get(COLUMN, "")), plain(stimulus.id))
    return tuple(dict.fromkeys(code for code in given if code))


def known_codes(stimuli: Iterable[Stimulus]) -> Mapping[str, str]:
    """Ids by code, to say which sample a wrong code belongs to.

    A code that two samples share names neither.
    """
    found: dict[str, set[str]] = {}
    for stimulus in stimuli:
        for code in codes_of(stimulus):
            found.setdefault(code, set()).add(stimulus.id)
    return {code: next(iter(ids)) for code, ids in found.items() if len(ids) == 1}


def refusal(stimulus: Stimulus, code: str, known: Mapping[str, str]) -> str:
    """Why a code does not confirm this sample: T07 is asked for, T12 was scanned."""
    said = known.get(plain(code), plain(code) or "an empty code")
    return f"{stimulus.id} is asked for, {said} was scanned"
