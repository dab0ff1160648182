"""Ledgers to tidy tables, statistics, figures and reports."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if __name__ != "palpate.analysis":
    raise ImportError("this package is palpate.analysis: from palpate import analysis")

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
    from palpate.analysis.ordinal.rank_tests import wilcoxon_tests
    from palpate.analysis.ratings.normalising import normalised
    from palpate.analysis.ratings.target_errors import target_errors
    from palpate.analysis.ratings.within_intervals import mean_intervals
    from palpate.analysis.reliability.coincidence import krippendorff_alpha
    from palpate.analysis.reliability.concordance import kendall_w
    from palpate.analysis.reliability.consistency import cronbach_alpha
    from palpate.analysis.reliability.intraclass import icc
    from palpate.analysis.reliability.kappa import cohen_kappa, fleiss_kappa
    from palpate.analysis.reliability.repeated import retest
    from palpate.analysis.spaces.classical import classical_mds
    from palpate.analysis.spaces.components import pca
    from palpate.analysis.spaces.nonmetric import nonmetric_mds
    from palpate.analysis.spaces.procrustes import procrustes
    from palpate.analysis.spaces.replicated import confidence_ellipses
    from palpate.analysis.spaces.retained import parallel_analysis
    from palpate.analysis.spaces.vectors import property_vectors
    from palpate.analysis.statistics.apa import apa_f, apa_p, apa_t
    from palpate.analysis.statistics.between import anova
    from palpate.analysis.statistics.equivalence import equivalence_tests
    from palpate.analysis.statistics.eta_intervals import eta_squared_interval, eta_squared_intervals
    from palpate.analysis.statistics.mixed import mixed_anova
    from palpate.analysis.statistics.pairwise import pairwise_tests
    from palpate.analysis.statistics.refusals import StatisticsError
    from palpate.analysis.statistics.self_check import self_check
    from palpate.analysis.statistics.sphericity import mauchly_tests
    from palpate.analysis.statistics.standardised import dz_interval, hedges_interval
    from palpate.analysis.statistics.within import rm_anova

__all__ = [
    "StatisticsError",
    "aligned_ranks",
    "anova",
    "antonym_pairs",
    "apa_f",
    "apa_p",
    "apa_t",
    "bradley_terry",
    "classical_mds",
    "cohen_kappa",
    "compare_models",
    "confidence_ellipses",
    "cronbach_alpha",
    "dz_interval",
    "equivalence_tests",
    "eta_squared_interval",
    "eta_squared_intervals",
    "fit_psychometric",
    "fleiss_kappa",
    "friedman",
    "gather_selections",
    "hedges_interval",
    "icc",
    "kendall_w",
    "krippendorff_alpha",
    "lexicon",
    "likert",
    "mauchly_tests",
    "mean_intervals",
    "merge_word_lists",
    "mixed_anova",
    "mixed_model",
    "nemenyi",
    "nonmetric_mds",
    "normalised",
    "ordinal_model",
    "pairwise_tests",
    "parallel_analysis",
    "pca",
    "posterior",
    "procrustes",
    "profile_interval",
    "profile_intervals",
    "property_vectors",
    "random_effects",
    "relevance",
    "resampled_answers",
    "retest",
    "rm_anova",
    "self_check",
    "staircase",
    "target_errors",
    "thurstone",
    "wilcoxon_tests",
    "word_agreement",
]

# No module or folder right here may be named like one of these: importing it would hide the function.
_HOMES = {
    "StatisticsError": "statistics.refusals",
    "aligned_ranks": "ordinal.aligned",
    "anova": "statistics.between",
    "antonym_pairs": "adjectives.antonyms",
    "apa_f": "statistics.apa",
    "apa_p": "statistics.apa",
    "apa_t": "statistics.apa",
    "bradley_terry": "choices.bradley_terry",
    "classical_mds": "spaces.classical",
    "cohen_kappa": "reliability.kappa",
    "compare_models": "mixed_models.comparing",
    "confidence_ellipses": "spaces.replicated",
    "cronbach_alpha": "reliability.consistency",
    "dz_interval": "statistics.standardised",
    "equivalence_tests": "statistics.equivalence",
    "eta_squared_interval": "statistics.eta_intervals",
    "eta_squared_intervals": "statistics.eta_intervals",
    "fit_psychometric": "choices.psychometric",
    "fleiss_kappa": "reliability.kappa",
    "friedman": "ordinal.friedman",
    "gather_selections": "adjectives.selections",
    "hedges_interval": "statistics.standardised",
    "icc": "reliability.intraclass",
    "kendall_w": "reliability.concordance",
    "krippendorff_alpha": "reliability.coincidence",
    "lexicon": "adjectives.lexicon",
    "likert": "ordinal.likert",
    "mauchly_tests": "statistics.sphericity",
    "mean_intervals": "ratings.within_intervals",
    "merge_word_lists": "adjectives.lexicon",
    "mixed_anova": "statistics.mixed",
    "mixed_model": "mixed_models.model",
    "nemenyi": "ordinal.nemenyi",
    "nonmetric_mds": "spaces.nonmetric",
    "normalised": "ratings.normalising",
    "ordinal_model": "ordinal.ordinal_model",
    "pairwise_tests": "statistics.pairwise",
    "parallel_analysis": "spaces.retained",
    "pca": "spaces.components",
    "posterior": "choices.posterior",
    "procrustes": "spaces.procrustes",
    "profile_interval": "choices.intervals",
    "profile_intervals": "mixed_models.profiling",
    "property_vectors": "spaces.vectors",
    "random_effects": "mixed_models.blups",
    "relevance": "adjectives.relevance",
    "resampled_answers": "choices.intervals",
    "retest": "reliability.repeated",
    "rm_anova": "statistics.within",
    "self_check": "statistics.self_check",
    "staircase": "choices.staircase",
    "target_errors": "ratings.target_errors",
    "thurstone": "choices.thurstone",
    "wilcoxon_tests": "ordinal.rank_tests",
    "word_agreement": "adjectives.agreement",
}


def __getattr__(name: str) -> Any:
    """Import a public call only when it is asked for, so that importing the room costs nothing."""
    if name in _HOMES:
        return getattr(import_module(f"palpate.analysis.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'palpate.analysis' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
