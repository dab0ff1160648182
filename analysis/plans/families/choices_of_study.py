"""Reasons, known from a study's declaration alone, why its choices cannot answer a test."""

from __future__ import annotations

from typing import TYPE_CHECKING

from palpate.analysis.ratings.collected_choices import (
    NO_LEVELS,
    NO_RIGHT_ANSWER,
    NO_SCALE,
)

if TYPE_CHECKING:
    from palpate.analysis.plans.families.choices import ChoiceSettings
    from palpate.protocols.study import Study


def why_no_scale(_settings: ChoiceSettings, study: Study) -> str:
    """Return why stimuli cannot be scaled by the study's choices, "" if they can."""
    if study.pairs is None:
        return f"{NO_SCALE}this study has a `procedure`, not `pairs`"
    design = study.intervals.design
    return "" if design == "forced_choice" else f"{NO_SCALE}`intervals` have the design {design}"


def why_no_function(_settings: ChoiceSettings, study: Study) -> str:
    """Return why the study's choices have no psychometric function, "" if they have one."""
    return NO_LEVELS if study.pairs is not None else ""


def why_no_sensitivity(_settings: ChoiceSettings, study: Study) -> str:
    """Return why the study's choices have no d', "" if they have one."""
    return NO_RIGHT_ANSWER if study.pairs is not None and study.intervals.design == "forced_choice" else ""
