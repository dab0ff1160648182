"""Every analysis of variance computed again in exact fractions: how far the floating-point answer is from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from palpate.analysis.plans.idle import effective
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.regenerating.plan_tests import Answered
from palpate.analysis.statistics.exact import self_check
from palpate.protocols.undefined import nan_to_none

RELATIVE = 1e-12


@dataclass(frozen=True)
class ExactCheck:
    """One effect held against exact arithmetic: the largest relative difference, or None and why there is none."""

    test: str
    effect: str
    difference: float | None
    note: str

    def text(self) -> str:
        """One line: the test, the effect, how far it is off."""
        told = self.note if self.difference is None else f"{self.difference:.1e} from exact arithmetic"
        return f"exact: {self.test}: {self.effect}: {told}"


def exact_checks(answered: Sequence[Answered]) -> list[ExactCheck]:
    """A line for every effect of every analysis of variance that was answered from complete data."""
    return [check for each in answered if each.asked.test == "anova" for check in _of(each)]


def _of(each: Answered) -> list[ExactCheck]:
    name = " ".join(filter(None, (each.asked.name, each.outcome)))
    if each.rows is None or each.answer is None:
        return []
    if each.missing.cells and not each.missing.left_out:
        return [ExactCheck(name, "all", None, "not checked: answered by a mixed model")]
    asked = effective(each.asked, TESTS[each.asked.test]).model_dump()
    found = self_check(
        each.rows,
        "value",
        within=list(asked["within"]) or None,
        between=list(asked["between"]) or None,
        subject="participant",
        sum_of_squares=asked["sum_of_squares"],
        missing="listwise" if each.missing.policy == "listwise" else "raise",
        aggregate="mean",
    )
    return [
        ExactCheck(name, str(row["Source"]), nan_to_none(row["difference"]), row["note"])
        for row in found.to_dict("records")
    ]
