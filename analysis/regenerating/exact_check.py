"""Every analysis of variance computed again in exact fractions: how far the floating-point answer is from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from palpate.analysis.plans.idle import effective
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.regenerating.plan_tests import QuestionResult
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
        """Return one line: the test, the effect, how far it is off."""
        told = self.note if self.difference is None else f"{self.difference:.1e} from exact arithmetic"
        return f"exact: {self.test}: {self.effect}: {told}"


def exact_checks(results: Sequence[QuestionResult]) -> list[ExactCheck]:
    """Return a line for every effect of every analysis of variance that was answered from complete data."""
    return [check for result in results if result.settings.test == "anova" for check in _of(result)]


def _of(result: QuestionResult) -> list[ExactCheck]:
    name = " ".join(filter(None, (result.settings.name, result.outcome)))
    if result.rows is None or result.answer is None:
        return []
    if result.missing.cells and not result.missing.left_out:
        return [ExactCheck(name, "all", None, "not checked: answered by a mixed model")]
    settings = effective(result.settings, TESTS[result.settings.test]).model_dump()
    checks = self_check(
        result.rows,
        "value",
        within=list(settings["within"]) or None,
        between=list(settings["between"]) or None,
        subject="participant",
        sum_of_squares=settings["sum_of_squares"],
        missing="listwise" if result.missing.policy == "listwise" else "raise",
        aggregate="mean",
    )
    return [
        ExactCheck(name, str(row["Source"]), nan_to_none(row["difference"]), row["note"])
        for row in checks.to_dict("records")
    ]
