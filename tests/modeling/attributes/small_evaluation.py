"""A small evaluation of attributes: simulated textures, and methods that take no time."""

from dataclasses import dataclass, replace

import numpy as np

from palpate.modeling.attributes.evaluation.evaluate import AttributeOptions, evaluate_methods
from palpate.modeling.attributes.material import Material, MaterialError
from palpate.modeling.attributes.methods import Method
from tests.modeling.attributes.material_for_tests import simulated_material


@dataclass(frozen=True)
class Linear:
    """Least squares with a firm penalty on the mean rows of what it looks at."""

    weights: np.ndarray
    mean: np.ndarray
    touch: tuple
    sight: tuple

    def predict(self, texture):
        return (_row(texture, self.touch, self.sight) @ self.weights + self.mean)[None]

    def saved(self):
        kinds = {"touch": list(self.touch), "sight": list(self.sight)}
        return {"weights": self.weights, "mean": self.mean}, {"method": "ridge", **kinds}


def restored(arrays, metadata):
    return Linear(arrays["weights"], arrays["mean"], tuple(metadata["touch"]), tuple(metadata["sight"]))


def _row(texture, touch, sight):
    parts = [texture.rows("touch", touch).mean(axis=0)] if touch else []
    parts += [texture.rows("sight", sight).mean(axis=0)] if sight else []
    return np.concatenate(parts) if parts else np.zeros(1)


def fit_linear(learning):
    rows = np.stack([_row(texture, learning.touch, learning.sight) for texture in learning.train])
    rated = np.stack([texture.rated.mean for texture in learning.train])
    gram = rows @ rows.T + len(rows[0]) * np.eye(len(rows))
    weights = rows.T @ np.linalg.solve(gram, rated - rated.mean(axis=0))
    return Linear(weights, rated.mean(axis=0), learning.touch, learning.sight)


def fit_mean(learning):
    rated = np.mean([texture.rated.mean for texture in learning.train], axis=0)
    return Linear(np.zeros((1, len(rated))), rated, (), ())


def fit_refusing(_learning):
    raise MaterialError("this method has had enough.")


def fit_broken(_learning):
    raise RuntimeError("a fault of the program")


TOUCH, SIGHT = frozenset({"touch"}), frozenset({"sight"})
METHODS = {
    "mean": Method("mean", "The mean", fit_mean, frozenset(), restore=restored),
    "ridge": Method("ridge", "Ridge", fit_linear, restore=restored),
    "visuo_tactile": Method(
        "visuo_tactile", "The thesis' network", fit_linear, may_hold=True, source="a test", restore=restored
    ),
    "hv_net": Method("hv_net", "Sight", fit_linear, SIGHT, restore=restored),
    "ht_net": Method("ht_net", "Touch", fit_linear, TOUCH, restore=restored),
}
OWN = {"ridge": (("mfcc", "hand"), ("glcm",))}


def material(textures=12, **more):
    return simulated_material(textures, **{"noise": 0.3, **more})


def options(work, **more):
    return AttributeOptions(work=work, **{"workers": 1, "ablations": False, **more})


def evaluation(work, rated_material=None, methods=METHODS, times=None, **more):
    clock = iter(range(10**6)).__next__
    return evaluate_methods(rated_material or material(), options(work, **more), methods, OWN, times=times, clock=clock)


def changed(material, name, **more):
    """The material with one texture changed."""
    textures = tuple(replace(texture, **more) if texture.id == name else texture for texture in material.textures)
    return replace(material, textures=textures) if textures else Material((), material.attributes)
