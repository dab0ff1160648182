import subprocess
import sys

import pytest

from modeling.doors.data import ModelDataError
from modeling.doors.registry import DEFAULT, FORWARD, INVERSE, SLOW, THESIS, method_named, methods_of

pytest.importorskip("torch")
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


def test_what_the_issue_asks_for_is_there():
    assert {"mean", "ridge", "forest", "pca_ridge", "gaussian_process", "mlp", "network"} <= set(FORWARD)
    assert {"nearest", "pca_regression", "search", "network", "generator"} <= set(INVERSE)


def test_ridge_is_had_without_torch():
    code = "import sys; from modeling.doors.registry import FORWARD; FORWARD['ridge']; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=60).returncode == 0


def test_an_unknown_method_is_refused_with_the_nearest_name():
    with pytest.raises(ModelDataError, match="no forward method 'rigde'.*'ridge'"):
        method_named("forward", "rigde")
    assert methods_of("inverse") is INVERSE
