"""All methods that continue a texture, by name; a method's libraries are imported with its first use."""

from __future__ import annotations

from collections.abc import Mapping

from palpate.modeling.textures.methods import Method
from palpate.modeling.textures.recording import TextureDataError
from palpate.protocols.registry import Registry

METHODS: Mapping[str, Method] = Registry(
    {
        "ar": "palpate.modeling.textures.ar:AR",
        "fnn": "palpate.modeling.textures.fnn:FNN",
        "gan": "palpate.modeling.textures.gan:GAN",
        "dstn": "palpate.modeling.textures.dstn:DSTN",
        "hapinf": "palpate.modeling.textures.hapinf:HAPINF",
        "foten": "palpate.modeling.textures.foten:FOTEN",
        "foten_thesis": "palpate.modeling.textures.foten:FOTEN_THESIS",
        "foten_generative": "palpate.modeling.textures.foten:FOTEN_GENERATIVE",
        "ten": "palpate.modeling.textures.foten:TEN",
        "ten_mfcc": "palpate.modeling.textures.foten:TEN_MFCC",
        "ten_wavelet": "palpate.modeling.textures.foten:TEN_WAVELET",
    }
)
"""The rivals in Table 4.1 first, then the thesis' network, as commonly read and to the letter, and ours, then the
variants in Table 4.2.
"""
ON_REQUEST = ("foten_thesis",)
"""Methods that are evaluated only by request: beside `foten` they cost as much again."""
DEFAULT = "foten_generative"
"""The method to train without an evaluation of the same recordings."""
THESIS = "foten"
"""The method that the thesis proposes (4.4)."""
BASELINE = "ar"
"""The method to beat: piecewise autoregression."""


def method_named(name: str) -> Method:
    """Return the method of this name. Raises TextureDataError with the nearest known name."""
    demand_known((name,))
    return METHODS[name]


def demand_known(names: tuple[str, ...]) -> None:
    """Raise TextureDataError for the name of an unknown method, without importing anything."""
    for name in names:
        if name not in METHODS:
            from palpate.protocols.did_you_mean import nearest

            raise TextureDataError(f"there is no texture method {name!r}; {nearest(name, METHODS)}")
