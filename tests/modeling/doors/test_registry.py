import json
import subprocess
import sys
from pathlib import Path

import pytest

from palpate.modeling.doors.registry import (
    DEFAULT,
    FORWARD,
    INVERSE,
    SLOW,
    THESIS,
    demand_file,
    method_named,
    methods_of,
)
from palpate.modeling.evaluate.rows import ModelDataError

pytestmark = pytest.mark.needs("torch")

SHIPPED_MODELS = Path(__file__).parents[3] / "devices" / "door" / "made"
ALL = [("forward", name) for name in FORWARD] + [("inverse", name) for name in INVERSE]


@pytest.mark.parametrize(("direction", "name"), ALL)
def test_every_method_is_there_under_its_own_name_with_title_and_source(direction, name):
    method = method_named(direction, name)
    assert method.name == name
    assert method.title
    assert method.source
    assert method.needs_forward is None or method.needs_forward in FORWARD


def test_defaults_slow_ones_and_the_thesis_networks_are_methods():
    assert {(way, name) for way, name in DEFAULT.items()} | SLOW <= set(ALL)
    assert THESIS in FORWARD
    assert THESIS in INVERSE


def test_what_cannot_be_a_file_is_refused_before_anything_is_trained():
    demand_file("inverse", "generator")
    with pytest.raises(ModelDataError, match="'search' .* cannot be a file; one of nearest, .*generator"):
        demand_file("inverse", "search")


def test_the_shipped_models_are_of_the_default_methods():
    for way, name in (("forward", "door-perception"), ("inverse", "door-force")):
        assert json.loads((SHIPPED_MODELS / f"{name}.json").read_text())["method"] == DEFAULT[way]


def test_every_method_of_thesis_and_practice_is_there():
    assert {"mean", "ridge", "forest", "pca_ridge", "gaussian_process", "mlp", "network"} <= set(FORWARD)
    assert {"nearest", "pca_regression", "search", "network", "generator"} <= set(INVERSE)


def test_ridge_is_had_without_torch():
    code = (
        "import sys; from palpate.modeling.doors.registry import FORWARD; FORWARD['ridge']; "
        "sys.exit('torch' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=60).returncode == 0


def test_an_unknown_method_is_refused_with_the_nearest_name():
    with pytest.raises(ModelDataError, match="no forward method 'rigde'.*'ridge'"):
        method_named("forward", "rigde")
    assert methods_of("inverse") is INVERSE
