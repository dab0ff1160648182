"""Magnitude estimates: Stevens' power law."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from palpate.analysis.plans.answers import Confidence, Kind, StatisticSettings
from palpate.protocols.registry import lazy_function
from palpate.protocols.study import Text


class PowerLawSettings(StatisticSettings):
    """The settings of a power law: the column of numbers, and the stimulus column with the physical intensity."""

    test: Literal["power_law"]
    value: Text = "number"
    intensity: Text
    confidence: Confidence = 0.95


KINDS: Mapping[str, Kind] = {
    "power_law": Kind(
        "Stevens' power law",
        PowerLawSettings,
        lazy_function("palpate.analysis.plans.families.magnitudes_answers:power_law_answer"),
        takes="fields",
        each="all",
        problems=lazy_function("palpate.analysis.plans.families.problems_of_study:intensity_problems"),
    ),
}
