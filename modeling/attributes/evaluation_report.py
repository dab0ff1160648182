"""The report of an evaluation of predicted attributes: one HTML file."""

from __future__ import annotations

from collections.abc import Sequence

from palpate.analysis.reports.figures import DrawnFigure
from palpate.analysis.reports.page import EVALUATION, Page, page_html
from palpate.modeling.attributes import evaluation_words as words
from palpate.modeling.attributes.choice import RULE, choice, fusion
from palpate.modeling.attributes.evaluation import AttributeEvaluation
from palpate.modeling.attributes.evaluation_sections import (
    features_section,
    methods_section,
    provenance,
    textures_section,
    time_section,
)
from palpate.modeling.attributes.evaluation_tables import method_rows
from palpate.modeling.attributes.lacking import lacking
from palpate.modeling.evaluate.outputs import Choice


def report_html(evaluation: AttributeEvaluation, pictured: Sequence[DrawnFigure] = ()) -> str:
    """The whole page as one text. Every name in it is escaped."""
    chosen = choice_of(evaluation)
    every = (
        chosen.section(RULE, reached(evaluation)), methods_section(evaluation, chosen),
        features_section(evaluation, chosen), textures_section(evaluation, pictured, chosen), time_section(pictured),
        provenance(evaluation),
    )  # fmt: skip
    sections = tuple(each for each in every if each is not None)
    return page_html(Page(words.TITLE, words.LEAD, banners(evaluation), facts(evaluation), sections), EVALUATION)


def choice_of(evaluation: AttributeEvaluation) -> Choice:
    """The default method and why."""
    return choice(method_rows(evaluation))


def banners(evaluation: AttributeEvaluation) -> list[str]:
    """What has to be known before any number is read."""
    told = [words.SIMULATED] if evaluation.material.simulated else []
    if evaluation.options.quick:
        told.append(words.QUICK.format(count=len(evaluation.tested)))
    elif evaluation.options.epochs is not None:
        told.append(words.FEW_EPOCHS.format(epochs=evaluation.options.epochs))
    if evaluation.options.early_stopping:
        told.append(words.EARLY)
    if len(evaluation.tested) < len(evaluation.material.textures) and not evaluation.options.quick:
        told.append(words.FEW_FOLDS.format(count=len(evaluation.tested), textures=len(evaluation.material.textures)))
    if evaluation.material.weights and any("resnet" in each.sight for each in evaluation.entries):
        told.append(words.WEIGHTS.format(weights=evaluation.material.weights))
    told += [*lacking(evaluation.material), *(f"Not used: {line}." for line in evaluation.unused())]
    joined = sorted({(each.test, *each.apart) for each in evaluation.domain.folds.values() if each.apart})
    groups = "; ".join(sorted({", ".join(sorted(group)) for group in joined}))
    return told + ([words.APART.format(groups=groups)] if groups else [])


def facts(evaluation: AttributeEvaluation) -> list[tuple[str, str]]:
    """What stands at the head of the page."""
    raters = sorted({each.rated.raters for each in evaluation.material.textures if each.rated is not None})
    people = " to ".join(f"{each}" if each else "not told" for each in sorted({raters[0], raters[-1]}))
    return [
        ("Textures", f"{len(evaluation.material.textures)}"),
        ("Left out, once each", f"{len(evaluation.tested)}"),
        ("People", people),
        ("Methods", f"{len(method_rows(evaluation))}"),
        ("Data, SHA-256", evaluation.domain.digest[:12]),
    ]


def reached(evaluation: AttributeEvaluation) -> list[tuple[str, str]]:
    """What was set out to be reached beside what was."""
    rows = method_rows(evaluation)
    told = [("Ours", line) for line in choice(rows).of_ours]
    both = fusion(rows)
    return told if both is None else [*told, both]
