"""All methods that predict attributes, by name; a method's first fit imports torch or scikit-learn."""

from __future__ import annotations

from collections.abc import Mapping

from palpate.modeling.attributes.entries import PROPOSED
from palpate.modeling.attributes.material import SIGHT, TOUCH, MaterialError
from palpate.modeling.attributes.methods import Method
from palpate.protocols.registry import Registry

__all__ = ["METHODS", "OWN_FEATURES", "PROPOSED", "method_named"]

METHODS: Mapping[str, Method] = Registry(
    {
        "visuo_tactile": "palpate.modeling.attributes.network_methods:VISUO_TACTILE",
        "visuo_tactile_thesis": "palpate.modeling.attributes.network_methods:VISUO_TACTILE_THESIS",
        "hv_net": "palpate.modeling.attributes.network_methods:HV_NET",
        "ht_net": "palpate.modeling.attributes.network_methods:HT_NET",
        "ann": "palpate.modeling.attributes.network_methods:ANN",
        "vision_cnn": "palpate.modeling.attributes.network_methods:VISION_CNN",
        "haptic_cnn": "palpate.modeling.attributes.network_methods:HAPTIC_CNN",
        "tactile_cnn_lstm": "palpate.modeling.attributes.network_methods:TACTILE_CNN_LSTM",
        "tactile_svm": "palpate.modeling.attributes.tactile_svm:TACTILE_SVM",
        "ridge": "palpate.modeling.attributes.whole_textures:RIDGE",
        "boosting": "palpate.modeling.attributes.whole_textures:BOOSTING",
        "mean": "palpate.modeling.attributes.whole_textures:MEAN",
    }
)
OWN_FEATURES: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "visuo_tactile": (TOUCH, SIGHT),
    "visuo_tactile_thesis": (TOUCH, SIGHT),
    "hv_net": ((), SIGHT),
    "ht_net": (TOUCH, ()),
    "ann": (TOUCH, SIGHT),
    "vision_cnn": ((), ("resnet",)),
    "haptic_cnn": ((), ("glcm",)),
    "tactile_cnn_lstm": (("dft",), ()),
    "tactile_svm": (("dwt",), ()),
    "ridge": (TOUCH, SIGHT),
    "boosting": (TOUCH, SIGHT),
    "mean": ((), ()),
}
"""The features of each method in Tables 3.2 and 3.3, as (touch, sight): the thesis' features, or the closest of ours.

- `visuo_tactile`, `hv_net`, `ht_net`, `ann`: those of the thesis (3.4, 3.6.6).
- `vision_cnn`: its authors' network takes nearly raw pictures; closest of ours: a trained network's features.
- `haptic_cnn`: the thesis calls its features of pictures handcrafted (2.1.2); closest of ours: co-occurrence.
- `tactile_cnn_lstm`: its authors use the acceleration alone; closest of ours: its spectrum, without the hand.
- `tactile_svm`: its authors learn a sparse representation of the signal; closest of ours: wavelets, without the hand.
- `ridge`, `boosting`: all features, as in practice.
- `mean`: none.
"""


def method_named(name: str) -> Method:
    """Return the method of this name. Raises MaterialError, with the nearest name, for an unknown one."""
    if name not in METHODS:
        from palpate.protocols.did_you_mean import nearest

        raise MaterialError(f"no way of predicting attributes is called {name!r}; {nearest(name, METHODS)}")
    return METHODS[name]
