"""The report of an evaluation of predicted attributes: one HTML file."""

from __future__ import annotations

from collections.abc import Sequence

from palpate.analysis.reports.blocks import Block, Points, Section
from palpate.analysis.reports.figures import DrawnFigure
from palpate.analysis.reports.page import EVALUATION, Page, page_html
from palpate.modeling.attributes import evaluation_words as words
from palpate.modeling.attributes.evaluation_sections import (
    features_section,
    methods_section,
    provenance,
    textures_section,
    time_section,
)
from palpate.modeling.attributes.evaluation_tables import method_rows
from palpate.modeling.attributes.judging_default import RULE, Choice, choice, fusion
from palpate.modeling.attributes.judging_whole import Judged
from palpate.modeling.attributes.lacking import lacking


def report_html(found: Judged, pictured: Sequence[DrawnFigure] = ()) -> str:
    """The whole page as one text. Every name in it is escaped."""
    chosen = choice_of(found)
    every = (
        in_short(found, chosen), methods_section(found, chosen), features_section(found, chosen),
        textures_section(found, pictured, chosen), time_section(pictured), provenance(found),
    )  # fmt: skip
    sections = tuple(each for each in every if each is not None)
    return page_html(Page(words.TITLE, words.LEAD, banners(found), facts(found), sections), EVALUATION)


def choice_of(found: Judged) -> Choice:
    """The default method and why."""
    return choice(method_rows(found))


def banners(found: Judged) -> list[str]:
    """What has to be known before any number is read."""
    told = [words.SIMULATED] if found.material.simulated else []
    if found.wanted.quick:
        told.append(words.QUICK.format(count=len(found.tested)))
    elif found.wanted.epochs is not None:
        told.append(words.FEW_EPOCHS.format(epochs=found.wanted.epochs))
    if found.wanted.early_stopping:
        told.append(words.EARLY)
    if len(found.tested) < len(found.material.textures) and not found.wanted.quick:
        told.append(words.FEW_FOLDS.format(count=len(found.tested), textures=len(found.material.textures)))
    if found.material.weights and any("resnet" in each.sight for each in found.entries):
        told.append(words.WEIGHTS.format(weights=found.material.weights))
    told += [*lacking(found.material), *(f"Not used: {line}." for line in found.unused())]
    joined = sorted({(each.test, *each.apart) for each in found.context.folds.values() if each.apart})
    groups = "; ".join(sorted({", ".join(sorted(group)) for group in joined}))
    return told + ([words.APART.format(groups=groups)] if groups else [])


def facts(found: Judged) -> list[tuple[str, str]]:
    """What stands at the head of the page."""
    raters = sorted({each.rated.raters for each in found.material.textures if each.rated is not None})
    people = " to ".join(f"{each}" if each else "not told" for each in sorted({raters[0], raters[-1]}))
    return [
        ("Textures", f"{len(found.material.textures)}"),
        ("Left out, once each", f"{len(found.tested)}"),
        ("People", people),
        ("Methods", f"{len(method_rows(found))}"),
        ("Data, SHA-256", found.context.digest[:12]),
    ]


def reached(found: Judged) -> list[tuple[str, str]]:
    """What was set out to be reached beside what was."""
    rows = method_rows(found)
    told = [("Ours", line) for line in choice(rows).of_ours]
    both = fusion(rows)
    return told if both is None else [*told, both]


def in_short(found: Judged, chosen: Choice) -> Section:
    """The default method and why, and what was set out to be reached."""
    points = [("Default", f"{chosen.method}. {chosen.why}"), ("The rule", RULE), *reached(found)]
    blocks: tuple[Block, ...] = (Points(tuple(points)),)
    return Section("short", "In short", blocks)
