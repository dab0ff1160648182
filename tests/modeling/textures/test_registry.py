import pytest

from palpate.modeling.textures.recording import TextureDataError
from palpate.modeling.textures.registry import BASELINE, DEFAULT, METHODS, THESIS, method_named

pytestmark = pytest.mark.needs("torch")


@pytest.mark.parametrize("name", METHODS)
def test_every_method_is_there_under_its_own_name(name):
    method = METHODS[name]
    assert method.name == name
    assert method.title
    assert method.source
    assert 10 <= method.window <= 56


def test_the_named_ones_are_methods_and_ours_is_sampled():
    assert {BASELINE, DEFAULT, THESIS} <= set(METHODS)
    assert METHODS[DEFAULT].sampled
    assert not METHODS[THESIS].sampled


def test_an_unknown_one_is_refused_with_the_nearest():
    with pytest.raises(TextureDataError, match="foten"):
        method_named("fotan")
