"""What stands about the data on a regenerated study's page: facts, the plan's declarations, what was left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from palpate.analysis.plans.schema import AnalysisPlan
from palpate.analysis.ratings.dataset import Exclusion
from palpate.analysis.ratings.sample import sample_facts
from palpate.analysis.regenerating.regenerated import Regenerated
from palpate.analysis.reports.tables import Head, Table, text_table
from palpate.protocols.wording import count

NOTHING = "nothing"
"""What a rule of the plan left out that met nothing."""


def facts(found: Regenerated) -> list[tuple[str, str]]:
    """What stands at the head of the page."""
    material = found.material
    values = len(material.ratings.table) if material.ratings is not None else len(material.words)
    what = "Ratings" if material.ratings is not None else "Words"
    lines = [each for each in found.exclusions if each.what != NOTHING]
    return [
        ("Participants", f"{len(material.participants):,}"),
        *sample_facts(found.sample),
        ("Trials", f"{len(material.trials):,}"),
        *([(what, f"{values:,}")] if values else []),
        ("Exclusion ledger", count(len(lines), "line") if lines else "nothing left out"),
        ("Plan, SHA-256", found.plan.sha256[:12]),
    ]


def declared(found: Regenerated) -> list[str]:
    """What the plan fixes for all tests, in sentences."""
    plan: AnalysisPlan = found.plan.declared
    told = {
        "refuse": "A test that needs a missing cell is refused.",
        "listwise": "A participant who lacks a cell is left out of the tests that need it (listwise).",
        "mixed_model": "Where cells are missing, a linear mixed model answers an analysis of variance.",
    }
    sessions = "Interrupted sessions count." if plan.sessions == "also_interrupted" else "Only complete sessions count."
    scale = "" if plan.normalise == "none" else f" Ratings are normalised: {plan.normalise.replace('_', ' ')}."
    drawn = f" What is resampled uses {plan.draws:,} draws from seed {plan.seed}."
    return [f"Significance level α = {plan.alpha:g}. {sessions} {told[plan.missing]}{scale}{drawn}"]


def seconds_told(seconds: float) -> str:
    """A time with the digits that mean something."""
    return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.1f} s" if seconds >= 0.1 else "less than 0.1 s"


@dataclass(frozen=True)
class LeftOut:
    """The exclusion ledger: one row for each reason, and every line of it."""

    reasons: Table
    lines: Table


def left_out(exclusions: Sequence[Exclusion]) -> LeftOut:
    """The ledger by reason, with its counts; a rule that met nothing says so."""
    lines = [(each.what, each.who, each.why, f"{each.rows:,}") for each in exclusions if each.what != NOTHING]
    together: dict[tuple[str, str], list[Exclusion]] = {}
    for each in exclusions:
        together.setdefault((each.why, each.what), []).append(each)
    reasons = [_reason(why, what, own) for (why, what), own in together.items()]
    return LeftOut(
        text_table((Head("why", "words"), "what", Head("lines", "number"), Head("rows", "number")), reasons),
        text_table(("what", "whose", Head("why", "words"), Head("rows", "number")), lines),
    )


def _reason(why: str, what: str, own: Sequence[Exclusion]) -> tuple[str, str, str, str]:
    if what == NOTHING:
        return why, "met nothing", "0", "0"
    return why, what, f"{len(own):,}", f"{sum(each.rows for each in own):,}"
