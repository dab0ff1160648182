"""The kinds of test and figure that a plan may ask for, by name; each is imported only when a plan asks for it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from palpate.protocols.lazy import load_object

if TYPE_CHECKING:
    from palpate.analysis.figures.drawn import FigureKind
    from palpate.analysis.plans.answers import Kind

_ASKING = "palpate.analysis.plans.asking"
TESTS: Mapping[str, str] = {
    "anova": f"{_ASKING}.variance:ANOVA",
    "pairs": f"{_ASKING}.variance:PAIRS",
    "equivalence": f"{_ASKING}.variance:EQUIVALENCE",
    "mixed_model": f"{_ASKING}.mixed_model:MIXED_MODEL",
    "friedman": f"{_ASKING}.ordinal:FRIEDMAN",
    "nemenyi": f"{_ASKING}.ordinal:NEMENYI",
    "wilcoxon": f"{_ASKING}.ordinal:WILCOXON",
    "aligned_ranks": f"{_ASKING}.ordinal:ALIGNED_RANKS",
    "ordinal_model": f"{_ASKING}.ordinal:ORDINAL_MODEL",
    "likert": f"{_ASKING}.ordinal:LIKERT",
    "icc": f"{_ASKING}.reliability:ICC",
    "cronbach_alpha": f"{_ASKING}.reliability:CRONBACH_ALPHA",
    "kendall_w": f"{_ASKING}.reliability:KENDALL_W",
    "krippendorff_alpha": f"{_ASKING}.reliability:KRIPPENDORFF_ALPHA",
    "retest": f"{_ASKING}.reliability:RETEST",
    "raters": f"{_ASKING}.reliability:RATERS",
    "relevance": f"{_ASKING}.adjectives:RELEVANCE",
    "adjective_pairs": f"{_ASKING}.adjectives:ADJECTIVE_PAIRS",
    "word_agreement": f"{_ASKING}.adjectives:WORD_AGREEMENT",
    "lexicon": f"{_ASKING}.adjectives:LEXICON",
    "means": f"{_ASKING}.describing:MEANS",
    "trends": f"{_ASKING}.describing:TRENDS",
    "categories": f"{_ASKING}.describing:CATEGORIES",
    "target_error": f"{_ASKING}.describing:TARGET_ERROR",
    "pca": f"{_ASKING}.spaces:PCA",
    "mds": f"{_ASKING}.spaces:MDS",
    "procrustes": f"{_ASKING}.spaces:PROCRUSTES",
    "vectors": f"{_ASKING}.spaces:VECTORS",
    "bradley_terry": f"{_ASKING}.choices:BRADLEY_TERRY",
    "thurstone": f"{_ASKING}.choices:THURSTONE",
    "psychometric": f"{_ASKING}.choices:PSYCHOMETRIC",
}
_FIGURES = "palpate.analysis.figures"
FIGURES: Mapping[str, str] = {
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
    "map": f"{_FIGURES}.space_map:MAP",
}


def test_kind(name: str) -> Kind:
    """The kind of test of that name. Raises KeyError where there is none."""
    found: Kind = load_object(TESTS[name])
    return found


def figure_kind(name: str) -> FigureKind:
    """The kind of figure of that name. Raises KeyError where there is none."""
    found: FigureKind = load_object(FIGURES[name])
    return found
