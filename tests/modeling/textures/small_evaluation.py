"""A small evaluation: recordings of a resonance that follows the hand, methods without torch, simulated surfaces."""

from dataclasses import dataclass, replace

import numpy as np

from palpate.modeling.files.model_files import Exported
from palpate.modeling.textures.evaluation.evaluate import TextureOptions, domain_for
from palpate.modeling.textures.methods import Method
from palpate.modeling.textures.recording import TextureDataError
from palpate.modeling.textures.windows import samples_of, windows
from palpate.signals.models.card import Dense
from palpate.studies.simulation.texture_simulator import SimulatedTextures
from tests.modeling.textures.recording_for_tests import recording

ORDER = 12


def recordings(seconds=8.0, names=("smooth", "rough")):
    return tuple(recording(seconds, seed, name) for seed, name in enumerate(names))


@dataclass(frozen=True)
class ResonantSurfaces(SimulatedTextures):
    """Simulated explorations."""

    def scene(self, texture, seconds, seed):
        return recording(seconds, 100 + seed, texture).signals

    def again(self, texture, seconds, seed):
        return recording(seconds, 900 + seed, texture).signals


@dataclass(frozen=True)
class FittedLinear:
    weights: np.ndarray
    log_sd: float
    window: int = ORDER
    sampled: bool = True
    missed: tuple[str, ...] = ()

    def predict(self, given):
        return given[:, 0] @ self.weights

    def exported(self):
        weight = np.zeros((2 if self.sampled else 1, 3 * self.window))
        weight[0, : self.window] = self.weights
        bias = np.array([0.0, self.log_sd][: len(weight)])
        return Exported((Dense(weight="w", bias="b"),), {"w": weight, "b": bias})


def _fit(learning, sampled):
    rows = windows(learning.recording, learning.parts.train, learning.window or ORDER)
    weights = np.linalg.lstsq(rows.given[:, 0], rows.target, rcond=None)[0]
    off = rows.target - rows.given[:, 0] @ weights
    return FittedLinear(weights, float(np.log(off.std())), learning.window or ORDER, sampled)


def fit_sampled(learning):
    return _fit(learning, True)


def fit_missing(learning):
    return replace(_fit(learning, True), missed=("It stayed 9 dB off.",))


def fit_plain(learning):
    return _fit(learning, False)


def fit_refusing(learning):
    raise TextureDataError(f"{learning.recording.texture}: this method has had enough.")


def fit_broken(_learning):
    raise RuntimeError("a fault of the program")


SAMPLED = Method(name="foten_generative", title="Ours", fit=fit_sampled, window=ORDER, sampled=True, source="a test")
PLAIN = Method(name="foten", title="The thesis'", fit=fit_plain, window=ORDER)
BASE = Method(name="ar", title="The baseline", fit=fit_plain, window=ORDER)
REFUSING = Method(name="ten", title="Refusing", fit=fit_refusing, window=ORDER)
MISSING = Method(name="ten_wavelet", title="Far off", fit=fit_missing, window=ORDER, sampled=True)
METHODS = {"ar": BASE, "foten": PLAIN, "foten_generative": SAMPLED, "ten": REFUSING, "ten_wavelet": MISSING}


def options(work, methods=("foten", "foten_generative"), explore=True, **more):
    return TextureOptions(work=work, methods=methods, explore=explore, quick=True, workers=1, **more)


def domain(work, recorded=None, simulator=None, known=METHODS, methods_of=("foten", "foten_generative"), **more):
    choice = options(work, methods_of, **more)
    clock = iter(range(10**6)).__next__
    return domain_for(recorded or recordings(), simulator or ResonantSurfaces(), choice, known, clock=clock), choice


def windows_of(evaluation, texture):
    """The training part's acceleration."""
    return samples_of(evaluation.domain.recordings[texture], evaluation.domain.parts[texture].train)[0]
