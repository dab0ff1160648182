"""What tests of methods learn from: made-up textures with few columns of sight, so that networks are quick."""

from dataclasses import replace

import numpy as np

from palpate.modeling.attributes.methods import Learning
from tests.modeling.attributes.material_for_tests import simulated_material

TOUCH, SIGHT = ("mfcc", "hand"), ("glcm",)
TRAIN, HELD, TESTED = slice(0, 30), slice(30, 34), slice(34, 46)


def learning(method=None, textures=None, **given):
    """Thirty textures, four of them beside where the method watches some."""
    material = simulated_material(textures=46, segments=4, pictures=3) if textures is None else None
    train = material.textures[TRAIN] if textures is None else tuple(textures)
    held = material.textures[HELD] if material is not None and method is not None and method.holds_out else ()
    data = Learning(train, held, simulated_material(1, 1, 1).attributes, touch=TOUCH, sight=SIGHT)
    return replace(data, **given)


def unseen_textures():
    """Twelve textures that are not among them, made in the same way."""
    return simulated_material(textures=46, segments=4, pictures=3).textures[TESTED]


def answers(fitted, textures):
    """(textures, attributes): the mean of each texture's rows."""
    return np.stack([fitted.predict(texture).mean(axis=0) for texture in textures])
