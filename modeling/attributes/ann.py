"""The plain dense network of thesis 3.6.6: a branch for touch, a branch for sight, fused."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from palpate.modeling.attributes.methods import Learning, Method
from palpate.modeling.attributes.row_plans import Plan

if TYPE_CHECKING:
    from palpate.modeling.attributes.row_networks import FittedRows

PLAN = Plan("ann", ("touch", "sight"), shows=20)


def fit(learning: Learning) -> FittedRows:
    """Train it; see `row_networks.fit_rows`."""
    from palpate.modeling.attributes.row_networks import fit_rows

    return fit_rows(learning, PLAN)


def restored(tensors: Mapping[str, NDArray[Any]], told: Mapping[str, Any]) -> FittedRows:
    """What `FittedRows.saved` gave, fitted again."""
    from palpate.modeling.attributes.row_networks import restored_rows

    return restored_rows(PLAN, tensors, told)


ANN = Method(
    name="ann",
    title="Artificial neural network",
    fit=fit,
    sees=frozenset({"touch", "sight"}),
    holds_out=True,
    source="thesis 3.6.6",
)
