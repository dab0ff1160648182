"""Perceptual spaces: components, maps of stimuli, comparison of maps between groups, adjectives fitted to a map."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from palpate.analysis.plans.answers import Confidence, Kind, StatisticSettings
from palpate.analysis.plans.idle import Idle, outcomes_of_own_table
from palpate.protocols.registry import lazy_function
from palpate.protocols.study import Number, Text, Whole

_ANSWERS = "palpate.analysis.plans.families.spaces_answers"
_OF_STUDY = "palpate.analysis.plans.families.problems_of_study"

LEAST_DRAWS = 19  # the smallest p of fewer lies above .05


def _none_or_enough(draws: int) -> int:
    if 0 < draws < LEAST_DRAWS:
        raise ValueError(f"expected 0 (none) or {LEAST_DRAWS} and more")
    return draws


Count = Annotated[Whole, Field(ge=0)]
Resamples = Annotated[Whole, Field(ge=0), AfterValidator(_none_or_enough)]
Draws = Annotated[Whole, Field(ge=LEAST_DRAWS)]
Dimensions = Annotated[Whole, Field(ge=1)]
Pair = Annotated[tuple[Text, ...], Field(min_length=2, max_length=2)]


class Pca(StatisticSettings):
    """The settings of components of the means of `over` (stimuli) on `items` (attributes).

    `scaled`: components of correlations, else of covariances. `reference` is that of parallel analysis, if any. `draws`
    are for it and for the bootstrap over participants (default: the plan's).
    """

    test: Literal["pca"]
    items: Text = "attribute"
    over: Text = "stimulus"
    scaled: bool = False
    reference: Literal["normal", "permuted", "none"] = "normal"
    draws: Draws | None = None
    confidence: Confidence = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        yield from outcomes_of_own_table(self)


class Mds(StatisticSettings):
    """The settings of a map of `over` (stimuli) from distances of means on `items`, or from ratings of `pairs`.

    `pairs` names the two columns of a pair, `meaning` and `top` the meaning of its value (top: the similarity of
    identical stimuli). `scaled` divides each attribute by its standard deviation. `replications` resamples participants
    for the ellipses (0: none), `reference` shuffles the dissimilarities (0: no test), `scree` is the greatest number of
    dimensions tried.
    """

    test: Literal["mds"]
    method: Literal["classical", "nonmetric"] = "nonmetric"
    dimensions: Dimensions = 2
    items: Text = "attribute"
    over: Text = "stimulus"
    scaled: bool = False
    pairs: Pair | None = None
    meaning: Literal["dissimilarity", "similarity"] = "dissimilarity"
    top: Number | None = None
    ties: Literal["primary", "secondary"] = "primary"
    starts: Count = 20
    replications: Resamples = 100
    reference: Resamples = 39
    scree: Count = 5
    confidence: Confidence = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        yield from outcomes_of_own_table(self)
        if self.method == "classical":
            yield from (Idle(name, "with `method: classical`") for name in ("ties", "starts", "reference", "scree"))
        if self.pairs is None:
            yield from (Idle(name, "without `pairs`") for name in ("meaning", "top"))
        else:
            yield from (Idle(name, "with `pairs`") for name in ("items", "scaled", "missing"))
            if self.meaning == "dissimilarity":
                yield Idle("top", "with `meaning: dissimilarity`")
        if not self.replications or self.dimensions < 2:
            yield Idle("confidence", "without ellipses")
        if self.dimensions < 2:
            yield Idle("replications", "in one dimension, which has no ellipses")


class Procrustes(StatisticSettings):
    """The settings of a comparison of maps by different participants: every two levels of `groups`, or random `halves`.

    `on` is what is compared: a map ("classical", "nonmetric", "pca", in `dimensions`) or the means themselves
    ("attributes"). `draws`: permutations of the test, or splits into halves (default: the plan's).
    """

    test: Literal["procrustes"]
    groups: Text = "group"
    halves: bool = False
    on: Literal["classical", "nonmetric", "pca", "attributes"] = "classical"
    dimensions: Dimensions = 2
    items: Text = "attribute"
    over: Text = "stimulus"
    scaled: bool = False
    stretch: bool = True
    reflection: bool = True
    ties: Literal["primary", "secondary"] = "primary"
    starts: Count = 20
    draws: Draws | None = None
    confidence: Confidence = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        yield from outcomes_of_own_table(self)
        if self.on != "nonmetric":
            yield from (Idle(name, f"with `on: {self.on}`") for name in ("ties", "starts"))
        if self.on == "attributes":
            yield from (Idle(name, "with `on: attributes`") for name in ("dimensions", "scaled"))
        if self.halves:
            yield Idle("groups", "with `halves: true`")
            yield Idle("stretch", "with `halves: true`, whose r is the same at any size of the maps")
        else:
            yield Idle("confidence", "without `halves: true`")


class Vectors(StatisticSettings):
    """The settings of attributes as directions in a map; `on` and the next ones describe the map as mds or pca does."""

    test: Literal["vectors"]
    on: Literal["classical", "nonmetric", "pca"] = "nonmetric"
    dimensions: Dimensions = 2
    items: Text = "attribute"
    over: Text = "stimulus"
    scaled: bool = False
    ties: Literal["primary", "secondary"] = "primary"
    starts: Count = 20
    draws: Draws | None = None

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        yield from outcomes_of_own_table(self)
        if self.on != "nonmetric":
            yield from (Idle(name, f"with `on: {self.on}`") for name in ("ties", "starts"))


KINDS: Mapping[str, Kind] = {
    "pca": Kind("principal components", Pca, lazy_function(f"{_ANSWERS}:pca_answer"), each="all"),
    "mds": Kind(
        "multidimensional scaling",
        Mds,
        lazy_function(f"{_ANSWERS}:mds_answer"),
        each="all",
        problems=lazy_function(f"{_OF_STUDY}:map_problems"),
    ),
    "procrustes": Kind(
        "Procrustes comparison",
        Procrustes,
        lazy_function(f"{_ANSWERS}:procrustes_answer"),
        each="all",
        problems=lazy_function(f"{_OF_STUDY}:map_problems"),
    ),
    "vectors": Kind(
        "adjectives as vectors",
        Vectors,
        lazy_function(f"{_ANSWERS}:vectors_answer"),
        each="all",
        problems=lazy_function(f"{_OF_STUDY}:map_problems"),
    ),
}
