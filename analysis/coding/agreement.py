"""How often each code was put to an answer, and how far two coders agree on it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from palpate.analysis.coding.tables import Answer, Coder
from palpate.analysis.reliability.kappa import cohen_kappa

EVERY = "(all)"
"""Stands for all questions, and for all codes where each answer has exactly one."""
Row = dict[str, Any]


def code_counts(coders: Sequence[Coder], answers: Sequence[Answer]) -> list[Row]:
    """Return one row for each question, code and coder: in how many answers, of how many people, of how many coded."""
    return [
        {
            "item": item, "code": code, "coder": coder.name, "answers": len(having), "coded": len(coded),
            "share": len(having) / len(coded) if coded else math.nan,
            "people": len({answer.participant for answer in having}),
        }
        for item, asked in _questions(answers)
        for code in _codes(coders, asked)
        for coder in coders
        for coded in [[answer for answer in asked if answer in coder.codes]]
        for having in [[answer for answer in coded if code in coder.codes[answer]]]
    ]  # fmt: skip


def agreement(coders: Sequence[Coder], answers: Sequence[Answer]) -> list[Row]:
    """Return one row for each pair of coders, question and code: Cohen's kappa of the code put or not, with a 95 % CI.

    Only answers that both have coded count. Where both put exactly one code to each answer of a question, a row
    `(all)` gives the kappa over all codes.
    """
    rows = []
    for first, second in combinations(coders, 2):
        for item, asked in _questions(answers):
            both = [answer for answer in asked if answer in first.codes and answer in second.codes]
            for code in _codes((first, second), both):
                pairs = [(code in first.codes[answer], code in second.codes[answer]) for answer in both]
                rows.append(_row(first, second, item, code, pairs))
            if both and all(len(coder.codes[answer]) == 1 for coder in (first, second) for answer in both):
                single = [(min(first.codes[answer]), min(second.codes[answer])) for answer in both]
                rows.append(_row(first, second, item, EVERY, single))
    return rows


def notes_on(coders: Sequence[Coder], answers: Sequence[Answer]) -> Iterator[str]:
    """Say what of the answers was not coded, and by whom."""
    if len(coders) == 1:
        yield "one coder: how far coders agree takes a second table (--codes)"
    for coder in coders:
        if missing := [answer for answer in answers if answer not in coder.codes]:
            names = ", ".join(f"{each.participant} {each.item}" for each in missing[:3])
            more = ", ..." if len(missing) > 3 else ""
            yield f"{coder.name}: {len(missing)} of {len(answers)} answers were not coded ({names}{more})"


def _row(first: Coder, second: Coder, item: str, code: str, pairs: Sequence[tuple[Any, Any]]) -> Row:
    levels = sorted({level for pair in pairs for level in pair} | ({False, True} if code != EVERY else set()))
    counts = np.array([[pairs.count((one, other)) for other in levels] for one in levels])
    found = cohen_kappa(counts)
    return {
        "item": item, "code": code, "coder_a": first.name, "coder_b": second.name, "answers": found.units,
        "agreed": int(np.trace(counts)), "agreement": found.agreement, "kappa": found.kappa, "se": found.se,
        "ci95_low": found.low, "ci95_high": found.high, "note": found.note,
    }  # fmt: skip


def _questions(answers: Sequence[Answer]) -> list[tuple[str, list[Answer]]]:
    """Each question with its answers; all together last, where there are several questions."""
    items = list(dict.fromkeys(answer.item for answer in answers))
    each = [(item, [answer for answer in answers if answer.item == item]) for item in items]
    return [*each, (EVERY, list(answers))] if len(items) > 1 else each


def _codes(coders: Sequence[Coder], answers: Sequence[Answer]) -> list[str]:
    return sorted({code for coder in coders for answer in answers for code in coder.codes.get(answer, ())})
