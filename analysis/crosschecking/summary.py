"""What the second opinion says: in a file, in a sentence, and of one test in a line."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from palpate.analysis.crosschecking.checks import LIMIT, CrossCheck, difference_text
from palpate.protocols.canonical import json_text
from palpate.protocols.wording import count, phrase

FILE = "crosscheck.json"


def crosscheck_json(checks: Sequence[CrossCheck]) -> str:
    """Every check: test, outcome, package, version, how many numbers, the largest relative difference, or why none."""
    data = {"limit": LIMIT, "disagreements": len(disagreements(checks)), "checks": [_check(each) for each in checks]}
    return json_text(data, indent=1)


def _check(check: CrossCheck) -> dict[str, Any]:
    one_lacks = check.difference is not None and check.difference == float("inf")
    return {
        "test": check.test,
        "outcome": check.outcome or None,
        "package": check.package or None,
        "version": check.version or None,
        "numbers": check.numbers,
        "largest_relative_difference": None if one_lacks else check.difference,
        "of": check.where or None,
        "agrees": None if check.difference is None else not check.disagrees,
        "note": "one of the two has no number" if one_lacks else None,
        "not_checked": check.reason or None,
    }


def disagreements(checks: Sequence[CrossCheck] | None) -> list[CrossCheck]:
    """The answers of which another package gives another number, where it is not known to be wrong."""
    return [check for check in checks or () if check.disagrees]


def sentence(checks: Sequence[CrossCheck] | None) -> str:
    """How many answers were checked with what, how well they agree, and why others were not checked."""
    if checks is None:
        return "No second opinion was asked for."
    if not checks:
        return "No test of the plan has a counterpart in pingouin, statsmodels or SciPy."
    compared = [check for check in checks if check.difference is not None]
    told = [f"{len(compared)} of {count(len(checks), 'answer')} checked with another package"]
    if compared:
        packages = phrase(sorted({f"{check.package} {check.version}" for check in compared}))
        worst = max(compared, key=lambda check: check.difference or 0.0)
        told = [f"{len(compared)} of {count(len(checks), 'answer')} checked with {packages}"]
        if not disagreements(checks):
            told.append(f"the largest relative difference is {difference_text(worst)}")
    reasons = Counter(check.reason for check in checks if check.reason)
    told += [f"not checked: {reason} ({number})" for reason, number in reasons.items()]
    return "; ".join(told) + "."


def line_of(checks: Sequence[CrossCheck]) -> str:
    """The second opinion on one test in a sentence, "" where there is none."""
    return f"Checked with another package: {sentence(checks)}" if checks else ""
