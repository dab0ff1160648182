"""What tests of methods learn from: made-up textures with few columns of sight, so that networks are quick."""

from dataclasses import replace

import numpy as np

from palpate.modeling.attributes.methods import Learning
from tests.modeling.attributes.made_material import made_material

TOUCH, SIGHT = ("mfcc", "hand"), ("glcm",)
TRAIN, HELD, ASKED = slice(0, 30), slice(30, 34), slice(34, 46)


def learning(method=None, textures=None, **given):
    """Thirty textures, four of them beside where the method watches some."""
    found = made_material(textures=46, segments=4, pictures=3) if textures is None else None
    train = found.textures[TRAIN] if textures is None else tuple(textures)
    held = found.textures[HELD] if found is not None and method is not None and method.holds_out else ()
    made = Learning(train, held, made_material(1, 1, 1).attributes, touch=TOUCH, sight=SIGHT)
    return replace(made, **given)


def asked():
    """Twelve textures that are not among them, made in the same way."""
    return made_material(textures=46, segments=4, pictures=3).textures[ASKED]


def answers(fitted, textures):
    """(textures, attributes): the mean of each texture's rows."""
    return np.stack([fitted.predict(each).mean(axis=0) for each in textures])
