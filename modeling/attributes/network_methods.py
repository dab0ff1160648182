"""The thesis' network and its two halves as methods (3.5); torch comes with their first fit.

They learn from every texture that they may, to the end of their course: which of thirty epochs is best cannot be told
from the five textures that a fold could spare (docs/reference/attribute-models.md has what it cost). Where
`early_stopping` is asked for they watch some, as in the thesis.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from palpate.modeling.attributes.material import Modality
from palpate.modeling.attributes.methods import BOTH, Learning, Method

if TYPE_CHECKING:
    from palpate.modeling.attributes.network_fit import FittedNetwork

SEEING: frozenset[Modality] = frozenset({"sight"})
FEELING: frozenset[Modality] = frozenset({"touch"})


def fit(learning: Learning, sees: frozenset[Modality], literal: bool = False) -> FittedNetwork:
    """Train it; see `network_fit.fit`."""
    from palpate.modeling.attributes.network_fit import fit as fit_network

    return fit_network(learning, sees, literal)


def restored(arrays: Mapping[str, NDArray[Any]], told: Mapping[str, Any]) -> FittedNetwork:
    """What `FittedNetwork.saved` gave, to be asked again."""
    from palpate.modeling.attributes.network_fit import restored as restored_network

    return restored_network(arrays, told)


def _method(name: str, title: str, sees: frozenset[Modality], source: str) -> Method:
    return Method(name, title, partial(fit, sees=sees), sees, source=source, may_hold=True, restore=restored)


VISUO_TACTILE = _method("visuo_tactile", "Visuo-tactile network", BOTH, "thesis 3.5")
VISUO_TACTILE_THESIS = Method(
    "visuo_tactile_thesis", "Visuo-tactile network, to the letter", partial(fit, sees=BOTH, literal=True), BOTH,
    holds_out=True, source="thesis 3.5: dense layers after the reconstruction, RMSE alone, 200 epochs, patience 10",
    restore=restored,
)  # fmt: skip
HV_NET = _method("hv_net", "Haptic vision network (HV-Net)", SEEING, "thesis 3.5.1")
HT_NET = _method("ht_net", "Haptic tactile network (HT-Net)", FEELING, "thesis 3.5.2")
