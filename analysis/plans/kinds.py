"""The kinds of test and figure in plans, by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from palpate.protocols.registry import Registry

if TYPE_CHECKING:
    from palpate.analysis.figures.figure_kind import FigureKind
    from palpate.analysis.plans.answers import Kind

TESTS: Registry[Kind] = Registry(
    families=(
        "palpate.analysis.plans.families.variance",
        "palpate.analysis.plans.families.mixed_model",
        "palpate.analysis.plans.families.ordinal",
        "palpate.analysis.plans.families.reliability",
        "palpate.analysis.plans.families.adjectives",
        "palpate.analysis.plans.families.describing",
        "palpate.analysis.plans.families.spaces",
        "palpate.analysis.plans.families.choices",
        "palpate.analysis.plans.families.magnitudes",
    ),
    kind="tests",
    of="palpate.analysis.plans.answers:Kind",
)
"""The kinds of test by name; a new kind is a line in the `KINDS` of its family's module."""
_FIGURES = "palpate.analysis.figures"
FIGURES: Registry[FigureKind] = Registry(
    {
        "bubbles": f"{_FIGURES}.bubbles:BUBBLES",
        "means": f"{_FIGURES}.means:MEANS",
        "trends": f"{_FIGURES}.trends:TRENDS",
        "raincloud": f"{_FIGURES}.raincloud:RAINCLOUD",
        "rating_heatmap": f"{_FIGURES}.rating_heatmap:RATING_HEATMAP",
        "order_effect": f"{_FIGURES}.order_effect:ORDER_EFFECT",
        "treemap": f"{_FIGURES}.treemap:TREEMAP",
        "predicted": f"{_FIGURES}.predicted:PREDICTED",
        "class_heatmap": f"{_FIGURES}.class_heatmap:CLASS_HEATMAP",
        "violins": f"{_FIGURES}.violins:VIOLINS",
        "similarity_bars": f"{_FIGURES}.similarity_bars:SIMILARITY_BARS",
        "matching": f"{_FIGURES}.matching:MATCHING",
        "likert": f"{_FIGURES}.likert:LIKERT",
        "map": f"{_FIGURES}.map:MAP",
        "psychometric": f"{_FIGURES}.psychometric:PSYCHOMETRIC",
        "track": f"{_FIGURES}.track:TRACK",
        "posterior": f"{_FIGURES}.posterior:POSTERIOR",
        "estimates": f"{_FIGURES}.estimates:ESTIMATES",
        "power_law": f"{_FIGURES}.power_law:POWER_LAW",
    },
    kind="figures",
    of="palpate.analysis.figures.figure_kind:FigureKind",
)
