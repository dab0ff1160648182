"""The thesis' network, its two branches (3.5) and the baseline networks (3.6.6) as methods; a fit imports torch.

The thesis' networks learn from all training textures for a fixed number of epochs: the five textures that a fold could
hold out do not show which of thirty epochs is best (docs/reference/attribute-models.md). With the setting
`early_stopping` they watch held textures, as in the thesis."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from palpate.modeling.attributes.material import Modality
from palpate.modeling.attributes.methods import BOTH, CONVOLVED, Learning, Method, RowPlan

if TYPE_CHECKING:
    from palpate.modeling.attributes.network_training import FittedNetwork
    from palpate.modeling.attributes.row_networks import FittedRows


SEEING: frozenset[Modality] = frozenset({"sight"})
FEELING: frozenset[Modality] = frozenset({"touch"})


def fit_network(learning: Learning, sees: frozenset[Modality], literal: bool = False) -> FittedNetwork:
    """Train the network with the modalities `sees`; see `network_training.fit_network`."""
    from palpate.modeling.attributes import network_training

    return network_training.fit_network(learning, sees, literal)


def restore_network(arrays: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any]) -> FittedNetwork:
    """Return the fitted network from the arrays and plain values of its `saved`."""
    from palpate.modeling.attributes import network_training

    return network_training.restore_network(arrays, metadata)


def _method(name: str, title: str, sees: frozenset[Modality], source: str) -> Method:
    return Method(
        name, title, partial(fit_network, sees=sees), sees, source=source, may_hold=True, restore=restore_network
    )


VISUO_TACTILE = _method("visuo_tactile", "Visuo-tactile network", BOTH, "thesis 3.5")
VISUO_TACTILE_THESIS = Method(
    "visuo_tactile_thesis", "Visuo-tactile network, to the letter", partial(fit_network, sees=BOTH, literal=True), BOTH,
    holds_out=True, source="thesis 3.5: dense layers after the reconstruction, RMSE alone, 200 epochs, patience 10",
    restore=restore_network,
)  # fmt: skip
HV_NET = _method("hv_net", "Haptic vision network (HV-Net)", SEEING, "thesis 3.5.1")
HT_NET = _method("ht_net", "Haptic tactile network (HT-Net)", FEELING, "thesis 3.5.2")


def fit_rows(learning: Learning, plan: RowPlan) -> FittedRows:
    """Train the network of a plan on rows of features; see `row_networks.fit_rows`."""
    from palpate.modeling.attributes import row_networks

    return row_networks.fit_rows(learning, plan)


def restore_rows(arrays: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any], plan: RowPlan) -> FittedRows:
    """Return the fitted network from the arrays and plain values of its `saved`."""
    from palpate.modeling.attributes import row_networks

    return row_networks.restore_rows(plan, arrays, metadata)


def _row_method(plan: RowPlan, title: str, source: str) -> Method:
    return Method(
        plan.name, title, partial(fit_rows, plan=plan), frozenset(plan.sees), holds_out=True, source=source,
        restore=partial(restore_rows, plan=plan),
    )  # fmt: skip


ANN = _row_method(RowPlan("ann", ("touch", "sight"), shows=20), "Artificial neural network", "thesis 3.6.6")
"""A dense network: a branch for touch and a branch for sight, fused."""
VISION_CNN = _row_method(
    RowPlan("vision_cnn", ("sight",), shows=10, settings=CONVOLVED),
    "Vision 1D-CNN",
    "thesis 3.6.6; Taye, Hwang and Lim 2020: a 1D-CNN; sizes are ours",
)
"""Two convolutions along the features of a picture."""
HAPTIC_CNN = _row_method(
    RowPlan("haptic_cnn", ("sight",), shows=10, settings=CONVOLVED),
    "Haptic CNN",
    "thesis 3.6.6; Hassan, Joolee and Jeon 2023: a 1D-CNN on features of pictures; sizes are ours",
)
"""Three convolutions along the features of a picture."""
TACTILE_CNN_LSTM = _row_method(
    RowPlan("tactile_cnn_lstm", ("touch",), shows=4, steps=5, settings=CONVOLVED),
    "Tactile CNN-LSTM",
    "thesis 2.1.3, 3.6.6; Awan, Hassan and Jeon 2023; sizes are ours",
)
"""Convolutions along a segment, an LSTM over segments."""
