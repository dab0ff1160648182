"""Ledgers to tidy tables, statistics, figures and reports."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analysis.adjectives.agreement import word_agreement
    from analysis.adjectives.antonyms import antonym_pairs
    from analysis.adjectives.lexicon import lexicon, merge_word_lists
    from analysis.adjectives.relevance import relevance
    from analysis.adjectives.selections import gather_selections
    from analysis.choices.bradley_terry import bradley_terry
    from analysis.choices.intervals import profile_interval, resampled_answers
    from analysis.choices.posterior import posterior
    from analysis.choices.psychometric import fit_psychometric
    from analysis.choices.staircase import staircase
    from analysis.choices.thurstone import thurstone
    from analysis.mixed_models.blups import random_effects
    from analysis.mixed_models.comparing import compare_models
    from analysis.mixed_models.model import mixed_model
    from analysis.mixed_models.profiling import profile_intervals
    from analysis.ordinal.aligned import aligned_ranks
    from analysis.ordinal.friedman import friedman
    from analysis.ordinal.likert import likert
    from analysis.ordinal.nemenyi import nemenyi
    from analysis.ordinal.ordinal_model import ordinal_model
    from analysis.ordinal.rank_tests import wilcoxon_tests
    from analysis.ratings.normalising import normalised
    from analysis.ratings.target_errors import target_errors
    from analysis.ratings.within_intervals import mean_intervals
    from analysis.reliability.coincidence import krippendorff_alpha
    from analysis.reliability.concordance import kendall_w
    from analysis.reliability.consistency import cronbach_alpha
    from analysis.reliability.intraclass import icc
    from analysis.reliability.kappa import cohen_kappa, fleiss_kappa
    from analysis.reliability.repeated import retest
    from analysis.spaces.classical import classical_mds
    from analysis.spaces.components import pca
    from analysis.spaces.nonmetric import nonmetric_mds
    from analysis.spaces.procrustes import procrustes
    from analysis.spaces.replicated import confidence_ellipses
    from analysis.spaces.retained import parallel_analysis
    from analysis.spaces.vectors import property_vectors
    from analysis.statistics.apa import apa_f, apa_p, apa_t
    from analysis.statistics.between import anova
    from analysis.statistics.equivalence import equivalence_tests
    from analysis.statistics.eta_intervals import eta_squared_interval, eta_squared_intervals
    from analysis.statistics.mixed import mixed_anova
    from analysis.statistics.pairwise import pairwise_tests
    from analysis.statistics.refusals import StatisticsError
    from analysis.statistics.self_check import self_check
    from analysis.statistics.sphericity import mauchly_tests
    from analysis.statistics.standardised import dz_interval, hedges_interval
    from analysis.statistics.within import rm_anova

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
        return getattr(import_module(f"analysis.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'analysis' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
