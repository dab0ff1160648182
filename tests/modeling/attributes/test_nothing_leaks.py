"""What is left out is not learned from: whatever the tested texture holds, each method's fit is bit-equal."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.modeling.attributes.domain import learning
from palpate.modeling.attributes.entries import Entry
from palpate.modeling.attributes.evaluation.evaluate import AttributeOptions, domain_for
from palpate.modeling.attributes.material import load_material
from palpate.modeling.attributes.registry import METHODS, OWN_FEATURES
from tests.modeling.attributes.material_for_tests import simulated_material
from tests.modeling.attributes.small_evaluation import changed

pytestmark = pytest.mark.needs("torch")


LEFT_OUT, OTHER = "T05", "T06"
M = simulated_material(9, segments=3, pictures=2)


def with_other_content(name):
    """The material with other features, pictures' versions and ratings of one texture."""
    of = next(texture for texture in M.textures if texture.id == name)
    stranger = simulated_material(1, segments=3, pictures=2, seed=77).textures[0]
    rated = replace(of.rated, mean=100.0 - of.rated.mean, sd=of.rated.sd + 3.0)
    more = {"touch": stranger.touch, "sight": stranger.sight, "variants": stranger.variants}
    return changed(M, name, **more, rated=rated, made_from=frozenset({"another file"}))


def fitted(material, name, work):
    """All numbers of a method that was fitted without `LEFT_OUT`, by the way that an evaluation goes."""
    domain = domain_for(material, AttributeOptions(work=work, epochs=1), METHODS)
    entry = Entry(name, *OWN_FEATURES[name])
    given = learning(
        load_material(domain.work, domain.digest),
        domain.folds[LEFT_OUT],
        METHODS[name],
        entry,
        domain.seed,
        domain.settings,
    )
    arrays, metadata = METHODS[name].fit(given).saved()
    return dict(arrays), metadata


def same(one, other):
    return one[1] == other[1] and set(one[0]) == set(other[0]) and all(
        np.array_equal(one[0][key], other[0][key], equal_nan=True) for key in one[0]
    )  # fmt: skip


@pytest.mark.parametrize("name", list(METHODS))
def test_a_fit_knows_nothing_of_the_texture_that_is_left_out(name, tmp_path):
    before = fitted(M, name, tmp_path)
    assert same(before, fitted(with_other_content(LEFT_OUT), name, tmp_path))
    assert not same(before, fitted(with_other_content(OTHER), name, tmp_path))  # what is learned from does decide it
