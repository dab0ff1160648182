"""From ledgers to tidy tables, statistics, figures and reports."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from palpate.protocols.registry import load_object

if __name__ != "palpate.analysis":
    raise ImportError("this package is palpate.analysis: from palpate import analysis")

# The public calls. Type checkers read these imports; `_places` does at run time, so that each name stands once.
# No module or folder right here may be named like one of them: importing it would hide the function.
if TYPE_CHECKING:
    from palpate.analysis.adjectives.agreement import word_agreement
    from palpate.analysis.adjectives.antonyms import antonym_pairs
    from palpate.analysis.adjectives.lexicon import lexicon, merge_word_lists
    from palpate.analysis.adjectives.relevance import relevance
    from palpate.analysis.adjectives.selections import gather_selections
    from palpate.analysis.choices.bradley_terry import bradley_terry
    from palpate.analysis.choices.intervals import profile_interval, resampled_answers
    from palpate.analysis.choices.posterior import posterior
    from palpate.analysis.choices.psychometric import fit_psychometric
    from palpate.analysis.choices.staircase import staircase
    from palpate.analysis.choices.thurstone import thurstone
    from palpate.analysis.mixed_models.blups import random_effects
    from palpate.analysis.mixed_models.comparing import compare_models
    from palpate.analysis.mixed_models.model import mixed_model
    from palpate.analysis.mixed_models.profiling import profile_intervals
    from palpate.analysis.ordinal.aligned import aligned_ranks
    from palpate.analysis.ordinal.friedman import friedman
    from palpate.analysis.ordinal.likert import likert
    from palpate.analysis.ordinal.nemenyi import nemenyi
    from palpate.analysis.ordinal.ordinal_model import ordinal_model
    from palpate.analysis.ordinal.wilcoxon import wilcoxon_tests
    from palpate.analysis.ratings.normalisation import normalised
    from palpate.analysis.ratings.target_errors import target_errors
    from palpate.analysis.ratings.within_intervals import mean_intervals
    from palpate.analysis.reliability.concordance import kendall_w
    from palpate.analysis.reliability.consistency import cronbach_alpha
    from palpate.analysis.reliability.intraclass import icc
    from palpate.analysis.reliability.kappa import cohen_kappa, fleiss_kappa
    from palpate.analysis.reliability.krippendorff import krippendorff_alpha
    from palpate.analysis.reliability.repeated import retest
    from palpate.analysis.spaces.classical import classical_mds
    from palpate.analysis.spaces.components import parallel_analysis, pca
    from palpate.analysis.spaces.nonmetric import nonmetric_mds
    from palpate.analysis.spaces.procrustes import procrustes
    from palpate.analysis.spaces.replicated import confidence_ellipses
    from palpate.analysis.spaces.vectors import property_vectors
    from palpate.analysis.statistics.anova import anova, rm_anova
    from palpate.analysis.statistics.apa import apa_f, apa_p, apa_t
    from palpate.analysis.statistics.equivalence import equivalence_tests
    from palpate.analysis.statistics.exact import self_check
    from palpate.analysis.statistics.f_and_t import (
        dz_interval,
        eta_squared_interval,
        eta_squared_intervals,
        hedges_interval,
    )
    from palpate.analysis.statistics.mixed_anova import mauchly_tests, mixed_anova
    from palpate.analysis.statistics.pairwise import pairwise_tests
    from palpate.analysis.statistics.refusals import StatisticsError


def __getattr__(name: str) -> Any:
    """Import a public name when it is used, so that importing the package costs nothing. Raises AttributeError."""
    places = {} if name.startswith("__") and name != "__all__" else _places()
    if name == "__all__":
        return sorted(places)
    if name not in places:
        raise AttributeError(f"module 'palpate.analysis' has no attribute {name!r}")
    return load_object(places[name])


def __dir__() -> list[str]:
    return sorted(_places())


@cache
def _places() -> dict[str, str]:
    """Return the place of each public name ("module:name"), from the imports under TYPE_CHECKING in this file."""
    import ast
    from pathlib import Path

    source = ast.parse(Path(__file__).read_text(encoding="utf-8"))
    (block,) = (node for node in source.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
    imports = [node for node in block.body if isinstance(node, ast.ImportFrom)]
    return {alias.name: f"{node.module}:{alias.name}" for node in imports for alias in node.names}
