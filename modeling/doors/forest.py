"""A random forest on the engineered features, stored as arrays."""

from __future__ import annotations

from dataclasses import dataclass

from palpate.modeling.doors.methods import Learning, Method
from palpate.modeling.doors.preparing import Featured, featured, rows_of
from palpate.modeling.files.model_files import Exported
from palpate.modeling.regression import Trees, trees_of
from palpate.signals.arrays import Array
from palpate.signals.models import card as model_card

TREES = 100
"""The number of trees; 300 are no better here (docs/reference/door-models.md)."""
LEAST_IN_LEAF = 3
"""The least number of rows in a leaf: no worse than 1, with a third of the nodes."""


@dataclass(frozen=True)
class Forest:
    """A fitted random forest, which predicts the mean of its trees."""

    front: Featured
    trees: Trees

    def predict(self, given: Array) -> Array:
        """Return ratings (n, attributes) on 0..100 of profiles (n, 621) in newtons."""
        answers: Array = self.trees.value[self.trees.leaves(self.front(given))].mean(axis=1)
        return answers

    def deviation(self, given: Array) -> Array:
        """Return the SD (n, attributes) between the trees' predictions, which ranks uncertainty but is no interval."""
        spread: Array = self.trees.value[self.trees.leaves(self.front(given))].std(axis=1)
        return spread

    def exported(self) -> Exported:
        """Return the steps: features, standardising, one forest step."""
        tensors = {name: getattr(self.trees, name) for name in Trees.__dataclass_fields__}
        step = model_card.Forest(**{name: name for name in tensors})
        return Exported((*self.front.steps, step), {**self.front.tensors, **tensors})


def fit(learning: Learning) -> Forest:
    """Fit Breiman's random forest to all attributes together: every split minimises the sum of their errors."""
    from sklearn.ensemble import RandomForestRegressor

    rows = rows_of(learning, "train", least=2)
    front, z = featured(rows)
    grown = RandomForestRegressor(
        TREES, min_samples_leaf=LEAST_IN_LEAF, max_features=1 / 3, random_state=learning.seed % 2**32, n_jobs=1
    ).fit(z, rows.rating)
    learning.report(f"forest: {TREES} trees")
    return Forest(front, trees_of([tree.tree_ for tree in grown.estimators_]))


FOREST = Method("forest", "Random forest on engineered features", fit, source="Breiman 2001")
