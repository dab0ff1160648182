"""Haptic CNN: three convolutions along the features of a picture, after Hassan et al. 2023 (thesis 3.6.6)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from palpate.modeling.attributes.methods import Learning, Method
from palpate.modeling.attributes.row_plans import CONVOLVED, Plan

if TYPE_CHECKING:
    from palpate.modeling.attributes.row_networks import FittedRows

PLAN = Plan("haptic_cnn", ("sight",), shows=10, settings=CONVOLVED)


def fit(learning: Learning) -> FittedRows:
    """Train it; see `row_networks.fit_rows`."""
    from palpate.modeling.attributes.row_networks import fit_rows

    return fit_rows(learning, PLAN)


def restored(tensors: Mapping[str, NDArray[Any]], told: Mapping[str, Any]) -> FittedRows:
    """What `FittedRows.saved` gave, fitted again."""
    from palpate.modeling.attributes.row_networks import restored_rows

    return restored_rows(PLAN, tensors, told)


HAPTIC_CNN = Method(
    name="haptic_cnn",
    title="Haptic CNN",
    fit=fit,
    sees=frozenset({"sight"}),
    holds_out=True,
    source="thesis 3.6.6; Hassan, Joolee and Jeon 2023: a 1D-CNN on features of pictures; sizes are ours",
)
