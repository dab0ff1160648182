"""The baseline networks on rows of textures, as methods (thesis 3.6.6); torch comes with their first fit."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from palpate.modeling.attributes.methods import Learning, Method
from palpate.modeling.attributes.row_plans import CONVOLVED, Plan

if TYPE_CHECKING:
    from palpate.modeling.attributes.row_networks import FittedRows


def fit(learning: Learning, plan: Plan) -> FittedRows:
    """Train it; see `row_networks.fit_rows`."""
    from palpate.modeling.attributes.row_networks import fit_rows

    return fit_rows(learning, plan)


def restored(tensors: Mapping[str, NDArray[Any]], told: Mapping[str, Any], plan: Plan) -> FittedRows:
    """What `FittedRows.saved` gave, fitted again."""
    from palpate.modeling.attributes.row_networks import restored_rows

    return restored_rows(plan, tensors, told)


def _method(plan: Plan, title: str, source: str) -> Method:
    return Method(
        plan.name, title, partial(fit, plan=plan), frozenset(plan.sees), holds_out=True, source=source,
        restore=partial(restored, plan=plan),
    )  # fmt: skip


ANN = _method(Plan("ann", ("touch", "sight"), shows=20), "Artificial neural network", "thesis 3.6.6")
"""A plain dense network: a branch for touch, a branch for sight, fused."""
VISION_CNN = _method(
    Plan("vision_cnn", ("sight",), shows=10, settings=CONVOLVED),
    "Vision 1D-CNN",
    "thesis 3.6.6; Taye, Hwang and Lim 2020: a 1D-CNN; sizes are ours",
)
"""Two convolutions along the features of a picture."""
HAPTIC_CNN = _method(
    Plan("haptic_cnn", ("sight",), shows=10, settings=CONVOLVED),
    "Haptic CNN",
    "thesis 3.6.6; Hassan, Joolee and Jeon 2023: a 1D-CNN on features of pictures; sizes are ours",
)
"""Three convolutions along the features of a picture."""
TACTILE_CNN_LSTM = _method(
    Plan("tactile_cnn_lstm", ("touch",), shows=4, steps=5, settings=CONVOLVED),
    "Tactile CNN-LSTM",
    "thesis 2.1.3, 3.6.6; Awan, Hassan and Jeon 2023; sizes are ours",
)
"""Convolutions along a segment, an LSTM over segments."""
