"""Ridge regression on the engineered features."""

from __future__ import annotations

from dataclasses import dataclass

from palpate.modeling.doors.featured import Featured, featured
from palpate.modeling.doors.linear import best_penalty, path_of
from palpate.modeling.doors.methods import Learning, Method
from palpate.modeling.doors.preparing import on_one_thread, rows_of
from palpate.modeling.files.exported import Exported
from palpate.signals.arrays import Array
from palpate.signals.models.card import Dense


@dataclass(frozen=True)
class Ridge:
    """y = weight z + bias over the standardised features z; `penalty` is the one that was chosen."""

    front: Featured
    weight: Array
    bias: Array
    penalty: float

    def predict(self, given: Array) -> Array:
        """(n, 621) newtons to (n, attributes) on 0..100, not clipped."""
        return self.front(given) @ self.weight.T + self.bias

    def exported(self) -> Exported:
        """Features, standardising, one dense step."""
        steps = (*self.front.steps, Dense(weight="weight", bias="bias"))
        return Exported(steps, {**self.front.tensors, "weight": self.weight, "bias": self.bias})


@on_one_thread
def fit(learning: Learning) -> Ridge:
    """The penalty is that of least squared error over inner folds grouped by source."""
    rows = rows_of(learning, least=2)
    front, z = featured(rows)
    penalty = best_penalty(z, rows.rating, rows.group)
    path = path_of(z, rows.rating)
    weights = path.weights(penalty)
    learning.report(f"ridge: penalty {penalty:.3g}")
    return Ridge(front, weights.T, path.y_mean - path.x_mean @ weights, penalty)


RIDGE = Method(
    "ridge", "Ridge on engineered features", fit, source="Hoerl and Kennard 1970; features of thesis 5.3.4.1"
)
