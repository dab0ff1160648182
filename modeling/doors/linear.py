"""A linear model of either direction, as fitted by several methods; and ridge regression by one decomposition."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from palpate.modeling.doors.preparing import inner_folds
from palpate.modeling.files.exported import Exported
from palpate.modeling.linear_path import PENALTIES, Path, inner_errors, path_of
from palpate.signals.arrays import Array, Indices
from palpate.signals.models.card import Dense

__all__ = ["PENALTIES", "Linear", "Path", "best_penalty", "path_of"]


@dataclass(frozen=True)
class Linear:
    """y = weight x + bias; `check` refuses what the model does not answer to."""

    weight: Array
    bias: Array
    check: Callable[[Array], Array]

    def predict(self, given: Array) -> Array:
        """(n, in) to (n, out); see `palpate.modeling.doors.methods.Fitted`."""
        return self.check(given) @ self.weight.T + self.bias

    def exported(self) -> Exported:
        """One dense step."""
        return Exported((Dense(weight="weight", bias="bias"),), {"weight": self.weight, "bias": self.bias})


def best_penalty(x: Array, y: Array, group: Indices) -> float:
    """The penalty of least squared error, all outputs together, over inner folds that keep groups together."""
    total = inner_errors(x, y, inner_folds(group)).sum(axis=1)
    return float(PENALTIES[np.argmin(total)])
