"""Tactile CNN-LSTM: convolutions along a segment, an LSTM over segments, after Awan et al. 2023 (thesis 3.6.6)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from palpate.modeling.attributes.methods import Learning, Method
from palpate.modeling.attributes.row_plans import CONVOLVED, Plan

if TYPE_CHECKING:
    from palpate.modeling.attributes.row_networks import FittedRows

PLAN = Plan("tactile_cnn_lstm", ("touch",), shows=4, steps=5, settings=CONVOLVED)


def fit(learning: Learning) -> FittedRows:
    """Train it; see `row_networks.fit_rows`."""
    from palpate.modeling.attributes.row_networks import fit_rows

    return fit_rows(learning, PLAN)


def restored(tensors: Mapping[str, NDArray[Any]], told: Mapping[str, Any]) -> FittedRows:
    """What `FittedRows.saved` gave, fitted again."""
    from palpate.modeling.attributes.row_networks import restored_rows

    return restored_rows(PLAN, tensors, told)


TACTILE_CNN_LSTM = Method(
    name="tactile_cnn_lstm",
    title="Tactile CNN-LSTM",
    fit=fit,
    sees=frozenset({"touch"}),
    holds_out=True,
    source="thesis 2.1.3, 3.6.6; Awan, Hassan and Jeon 2023; sizes are ours",
)
