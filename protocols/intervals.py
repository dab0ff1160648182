"""The schema of `intervals:` in a study: how many intervals a trial has, what is in them, and what is asked."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from palpate.protocols.strict import KnownKeys, problem_at
from palpate.protocols.study import Number, Share, Text, Whole

MOST_INTERVALS = 8
EQUAL = "equal"
"""The answer that neither of a pair is chosen."""
FEWEST = {"forced_choice": 2, "yes_no": 1, "same_different": 2, "oddity": 3}


class Every(KnownKeys):
    """One catch trial in every so many trials of a track."""

    every: Annotated[Whole, Field(ge=1, le=1000)]


class Catch(KnownKeys):
    """Catch trials: without a stimulus (`absent`; in same/different with two equal ones), or at the easiest level.

    People whose share of wrong answers in them is above `exclude_above` are left out of analyses. Catch trials of one
    in one (`absent: {every: 1}`) are the noise or "same" half of a yes/no or same/different design.
    """

    absent: Every | None = None
    easy: Every | None = None
    exclude_above: Share | None = None

    @model_validator(mode="after")
    def _some(self) -> Self:
        if self.absent is None and self.easy is None:
            raise ValueError("absent: {every: N} or easy: {every: N} is expected")
        return self


class Intervals(KnownKeys):
    """The design of a trial: how many intervals of how many seconds, what is in them, and what is asked.

    forced_choice: one of `count` intervals has the stimulus (2AFC, 2IFC, nAFC). yes_no: one interval, "was it there?".
    same_different: two, "are they the same?". oddity: one of three or more differs. The other intervals hold the
    `standard`: the id of a stimulus, or a level of the grid's column; without one they are blank. `at_once`: all are
    presented together, as left and right. `equal`: a pair may also be called equal. `names` are the words on the
    buttons, in the order of the answers.
    """

    design: Literal["forced_choice", "yes_no", "same_different", "oddity"] = "forced_choice"
    count: Annotated[Whole, Field(ge=1, le=MOST_INTERVALS)] | None = None
    names: Annotated[tuple[Text, ...], Field(max_length=MOST_INTERVALS + 1)] = ()
    seconds: Annotated[float, Field(gt=0, le=60, allow_inf_nan=False)] | None = None
    gap_s: Annotated[float, Field(ge=0, le=60, allow_inf_nan=False)] = 0.5
    standard: Number | Text | None = None
    at_once: bool = False
    equal: bool = False
    catch: Catch | None = None

    @model_validator(mode="after")
    def _counted(self) -> Self:
        fewest = FEWEST[self.design]
        fixed = self.design in ("yes_no", "same_different")
        if self.count is not None and (self.count < fewest or (fixed and self.count != fewest)):
            raise problem_at(
                ("count",), f"{'' if fixed else 'at least '}{fewest} for design: {self.design}, found {self.count}"
            )
        if self.names and len(self.names) != len(self.answers):
            raise problem_at(("names",), f"{len(self.answers)} names are expected, found {len(self.names)}")
        if len(set(self.names)) < len(self.names):
            raise problem_at(("names",), "different names are expected")
        if self.at_once and self.of == 1:
            raise ValueError("at_once goes with two intervals or more")
        if self.design in ("forced_choice", "oddity") and self.catch is not None and self.catch.absent is not None:
            raise problem_at(
                ("catch", "absent"),
                f"absent has no place in design {self.design}, where one interval has the stimulus; say easy",
            )
        return self

    @property
    def of(self) -> int:
        """Return the number of intervals."""
        return self.count if self.count is not None else FEWEST[self.design]

    @property
    def answers(self) -> tuple[str, ...]:
        """Return the answers as they are stored, in the order of the buttons."""
        if self.design == "yes_no":
            return ("yes", "no")
        if self.design == "same_different":
            return ("same", "different")
        return (*(str(n) for n in range(1, self.of + 1)), *((EQUAL,) if self.equal else ()))

    @property
    def chance(self) -> float | None:
        """Return the share of right answers of who perceives nothing; None where it depends on how people guess.

        So it does in yes/no and same/different, and where a forced choice has a standard, which may be the greater.
        """
        if self.design == "oddity" or (self.design == "forced_choice" and self.standard is None):
            return 1 / len(self.answers)
        return None

    @property
    def catch_every(self) -> tuple[int | None, int | None]:
        """Return in how many trials there is one without a stimulus, and one at the easiest level; None for none."""
        kinds = (None, None) if self.catch is None else (self.catch.absent, self.catch.easy)
        absent, easy = (None if kind is None else kind.every for kind in kinds)
        return absent, easy

    def target(self, place: int, absent: bool) -> str:
        """Return what is right: the number of an interval, signal or noise, same or different."""
        if self.design == "yes_no":
            return "noise" if absent else "signal"
        if self.design == "same_different":
            return "same" if absent else "different"
        return str(place)

    def is_hit(self, chosen: str, target: str) -> bool:
        """Return whether the answer names the interval of the stimulus, or whether there is one, or a difference."""
        return {"yes": "signal", "no": "noise"}.get(chosen, chosen) == target


def intervals_from(value: Any) -> Intervals:
    """Return the intervals in a study file. Raises ValueError."""
    return Intervals.model_validate(value)
