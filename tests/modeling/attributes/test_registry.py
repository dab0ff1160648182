import subprocess
import sys

import pytest

from palpate.modeling.attributes.material import SIGHT_KINDS, TOUCH_KINDS, MaterialError
from palpate.modeling.attributes.registry import METHODS, OWN_FEATURES, PROPOSED, method_named

pytestmark = pytest.mark.needs("torch")


@pytest.mark.parametrize("name", list(METHODS))
def test_every_method_is_there_under_its_own_name_with_title_and_source(name):
    method = method_named(name)
    assert method.name == name
    assert method.title
    assert method.source


def test_the_thesis_network_its_baselines_and_what_one_would_try_are_there():
    assert PROPOSED in METHODS
    assert {"hv_net", "ht_net", "ann", "vision_cnn", "haptic_cnn", "tactile_cnn_lstm", "tactile_svm"} <= set(METHODS)
    assert {"ridge", "boosting", "mean"} <= set(METHODS)


@pytest.mark.parametrize("name", list(METHODS))
def test_own_features_are_kinds_of_the_senses_that_the_method_has(name):
    touch, sight = OWN_FEATURES[name]
    assert set(touch) <= set(TOUCH_KINDS)
    assert set(sight) <= set(SIGHT_KINDS)
    assert {sense for sense, kinds in (("touch", touch), ("sight", sight)) if kinds} == METHODS[name].sees


def test_methods_are_named_without_torch_and_without_scikit_learn():
    code = (
        "import sys; from palpate.modeling.attributes.registry import METHODS; "
        "[METHODS[name].title for name in METHODS]; sys.exit(bool({'torch', 'sklearn', 'scipy'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=60).returncode == 0


def test_an_unknown_method_is_refused_with_the_nearest_name():
    with pytest.raises(MaterialError, match="'rigde'; did you mean 'ridge'"):
        method_named("rigde")
