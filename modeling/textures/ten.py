"""The variants of FoTEN in Table 4.2: without a spectral block, with cepstral coefficients, with wavelets."""

from __future__ import annotations

from collections.abc import Callable

from palpate.modeling.textures.fitting import FittedWindows, fit_windows
from palpate.modeling.textures.foten import SETTINGS
from palpate.modeling.textures.foten_network import Foten, Spectral
from palpate.modeling.textures.heads import loss_named
from palpate.modeling.textures.methods import Learning, Method
from palpate.modeling.textures.spectral_features import MelBlock, WaveletBlock


def _variant(spectral: Spectral | None, window: int, loss: str) -> Callable[[Learning], FittedWindows]:
    """With the window and loss that served it best in the thesis, unless others are asked for."""

    def fit(learning: Learning) -> FittedWindows:
        asked = loss_named(str(learning.settings.get("loss", loss)))
        return fit_windows(lambda length: Foten(length, spectral), learning, asked, SETTINGS, window=window)

    return fit


TEN = Method(name="ten", title="TEN", fit=_variant(None, 25, "huber-2.0"), window=25, source="thesis 4.6.3, Table 4.2")
TEN_MFCC = Method(
    name="ten_mfcc", title="TEN + MFCC", fit=_variant(MelBlock, 30, "huber-1.6"), window=30,
    source="thesis 4.6.3, Table 4.2",
)  # fmt: skip
TEN_WAVELET = Method(
    name="ten_wavelet", title="TEN + wavelet", fit=_variant(WaveletBlock, 30, "mse"), window=30,
    source="thesis 4.6.3, Table 4.2",
)  # fmt: skip
