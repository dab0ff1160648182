"""The answers about magnitude estimates from the selected rows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from palpate.analysis.magnitudes.power_law import power_law
from palpate.analysis.plans.answers import Answer, require_columns
from palpate.analysis.plans.families.spaces_answers import numeric, rows_of, sentences
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.statistics.apa import number
from palpate.protocols.wording import phrase

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import Selected
    from palpate.analysis.plans.families.magnitudes import PowerLawSettings

QUESTION = "question"


def power_law_answer(selected: Selected, settings: PowerLawSettings) -> Answer:
    """Return the population's exponent in one row; further tables of people and of stimuli."""
    table = selected.table
    require_columns(table, (settings.value, settings.intensity))
    if QUESTION in table.columns and len(asked := sorted(set(table[QUESTION].astype(str)))) > 1:
        raise DataRefused(f"answers to {phrase(asked)}; name one: where: {{{QUESTION}: {asked[0]}}}")
    used = numeric(table, (settings.value, settings.intensity))
    law = power_law(used, settings.value, settings.intensity, confidence=settings.confidence)
    people, per = len(law.people), f"{100 * settings.confidence:g} %"
    interval = f"{per} interval over people (Student's t)"
    row = {
        "exponent": law.exponent, "se": law.se, "ci_low": law.ci_low, "ci_high": law.ci_high, "people": people,
        "r2_mean": float(law.people["r2"].mean()),
    }  # fmt: skip
    kinds = {
        "exponent": f"exponent of {settings.intensity}", "se": "standard error over people", "ci_low": interval,
        "ci_high": interval, "r2_mean": "mean of people's r2, of logarithms",
        "magnitude": "geometric mean after log normalisation",
    }  # fmt: skip
    ends = f"{per} CI [{number(law.ci_low)}, {number(law.ci_high)}]" if people > 1 else "one person, no interval"
    return Answer(
        rows=rows_of(pd.DataFrame([row])),
        method="Mean over people of each one's least-squares exponent, on logarithms (Stevens 1957); magnitudes after "
        "log normalisation, with within-participant intervals (Cousineau 2005; Morey 2008)",
        kinds=kinds,
        participants=people,
        values=len(used),
        headline=f"Exponent {number(law.exponent)}, {ends}",
        notes=sentences(["" if len(law.stimuli) else "People felt different stimuli: no common magnitudes are given"]),
        more={"people": rows_of(law.people), **({"stimuli": rows_of(law.stimuli)} if len(law.stimuli) else {})},
    )
