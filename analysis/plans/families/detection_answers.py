"""The answer about d' and c: one row for each combination of `by`, and means over participants."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pandas as pd

from palpate.analysis.choices.detection import Detection, detection_of_pairs, detection_of_share
from palpate.analysis.plans.answers import Answer, plain_row, require_columns
from palpate.analysis.plans.families.choices import DPrime
from palpate.analysis.plans.families.collected_answers import BY
from palpate.analysis.plans.families.function_summaries import PARTICIPANT, difference_rows, summary_rows
from palpate.analysis.plans.families.rows import parts_of
from palpate.analysis.plans.families.spaces_answers import sentences
from palpate.analysis.ratings.collected_choices import NO_RIGHT_ANSWER, NOISE
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.statistics.refusals import StatisticsError
from palpate.protocols.pairs import PAIRS
from palpate.protocols.tracks import NO_CATCH

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import Row, Selected

NUMBERS = (
    "trials", "dprime", "dprime_low", "dprime_high", "se", "criterion", "criterion_se", "hit_rate", "false_alarm_rate",
)  # fmt: skip
USED = ("design", "alternatives", "target", "chosen", "correct", "hit", "catch")
CORRECTIONS = {
    "log_linear": "log-linear correction of every rate (Hautus 1995): half a hit and one trial are added (among m "
    "alternatives 1/m of a hit)",
    "when_extreme": "rates of 0 and 1 are moved by half an answer (Macmillan & Kaplan 1985)",
    "none": "no correction",
}


def dprime_answer(selected: Selected, settings: DPrime) -> Answer:
    """Return one row for each combination of `by`; one without d' has the reason."""
    by = BY if settings.by is None else settings.by
    require_columns(selected.table, [*by, *USED])
    rows: list[dict[str, Any]] = []
    for where, part in parts_of(selected.table, by):
        row: dict[str, Any] = {"design": None, "model": None, **dict.fromkeys(NUMBERS), "note": ""}
        try:
            row |= _row(part, settings)
        except (StatisticsError, DataRefused) as refusal:
            row["note"] = str(refusal)
        rows.append({**where, **row})
    if all(row["dprime"] is None for row in rows):
        raise StatisticsError(f"no d' could be computed: {rows[0]['note']}")
    confidence = f"{100 * settings.confidence:g}%"
    summary: tuple[Row, ...] = tuple(summary_rows(rows, by, ("dprime", "criterion"), settings.confidence))
    differences = tuple(difference_rows(rows, by, ("dprime", "criterion"), settings.confidence))
    means = [
        f"{', '.join(f'{n} {row[n]}' for n in by if n != PARTICIPANT)} {row['mean']:.2f} (n = {row['n']})".strip()
        for row in summary
        if row["quantity"] == "dprime"
    ]
    without = sum(row["dprime"] is None for row in rows)
    return Answer(
        rows=tuple(plain_row(row) for row in rows),
        method="d' and c by the decision model of each design (Macmillan & Creelman 2005; forced choices: Hacker & "
        f"Ratcliff 1979; triangle: Ennis 1993); {CORRECTIONS[settings.correction]}; {confidence} intervals by the "
        "delta method, of means over participants by Student's t",
        kinds={
            "dprime": "sensitivity, in standard deviations of one percept",
            "criterion": "criterion: c, of differencing the smallest difference that is called different",
            "se": "standard error, delta method",
            "difference": "mean over participants of one minus two",
            "p": "two-sided p of a paired t test, not corrected",
            "p_corrected": "p, corrected by Holm's method over the pairs of a quantity",
            "hit_rate": "hits as used (forced choice of several, oddity: correct answers)",
            "false_alarm_rate": "false alarms as used",
        },
        participants=int(selected.table[PARTICIPANT].nunique()) if PARTICIPANT in selected.table.columns else 0,
        values=sum(row["trials"] or 0 for row in rows),
        headline=f"Mean d' {'; '.join(means[:6])}",
        notes=sentences([f"{without} of {len(rows)} have no d' (see `note`)" if without else ""]),
        more={"summary": summary} | ({"differences": differences} if differences else {}),
    )


def _row(part: pd.DataFrame, settings: DPrime) -> dict[str, Any]:
    designs = sorted(set(part["design"].astype(str)))
    if len(designs) > 1:
        raise DataRefused(f"choices of several designs ({', '.join(designs)}) have no d' in common; name it in `by`")
    design = designs[0]
    catch = part["catch"].astype(str)
    if design in ("yes_no", "same_different"):
        noise = part["target"].astype(str).isin(NOISE) | (catch == "absent")
        used = part[noise | (catch == NO_CATCH)]
        noise = noise[used.index]
        model = "yes_no" if design == "yes_no" else settings.model
        result = _pairs(used["hit"], ~noise, model, settings)
    else:
        used = part[(catch == NO_CATCH) & part["correct"].notna()]
        if not len(used) and "procedure" in part.columns and (part["procedure"].astype(str) == PAIRS).any():
            raise DataRefused(NO_RIGHT_ANSWER)
        several = sorted({int(value) for value in used["alternatives"]})
        if len(several) != 1:
            raise DataRefused("choices of several numbers of alternatives have no d' in common; name it in `by`")
        places = sorted(set(used["target"].astype(str)))
        if design == "forced_choice" and several == [2] and len(places) == 2:
            target = used["target"].astype(str)
            named = (used["chosen"].astype(str) == target) == (used["correct"] == 1)
            right = target.where(named, target.map(dict(zip(places, reversed(places), strict=True))))
            first = right == places[0]  # of a comparison below its standard the standard is right
            chose = pd.Series(used["chosen"].astype(str) == places[0], index=used.index).astype(float)
            result = _pairs(chose, first, "two_intervals", settings)
        else:
            result = detection_of_share(
                float(used["correct"].sum()), len(used), design="oddity" if design == "oddity" else "forced_choice",
                alternatives=several[0], correction=settings.correction, confidence=settings.confidence,
            )  # fmt: skip
    note = "not above chance" if result.chance else ""
    return {
        "design": design, "model": result.model, "trials": len(used), "dprime": result.dprime,
        "dprime_low": result.low, "dprime_high": result.high, "se": result.se, "criterion": result.criterion,
        "criterion_se": result.criterion_se, "hit_rate": result.hit_rate,
        "false_alarm_rate": result.false_alarm_rate, "note": note,
    }  # fmt: skip


def _pairs(chose: pd.Series[Any], signal: pd.Series[Any], model: str, settings: DPrime) -> Detection:
    """Return d' of the rates of one answer in trials with and without a signal."""
    return detection_of_pairs(
        float(chose[signal].sum()), int(signal.sum()), float(chose[~signal].sum()), int((~signal).sum()),
        model=model, correction=settings.correction, confidence=settings.confidence,
    )  # fmt: skip
