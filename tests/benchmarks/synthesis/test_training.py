"""The training's figures compare like with like: the same weights, the same windows, one clock."""

from itertools import count

import pytest
import torch

from benchmarks.synthesis.stock_foten import StockFoten
from benchmarks.synthesis.training import WAYS, cases
from palpate.modeling.textures.foten_network import Foten
from tests.modeling.textures.recording_for_tests import recording

pytestmark = pytest.mark.needs("torch")


def test_the_plain_network_has_as_many_weights_and_the_same_shapes():
    plain, ours = StockFoten(20), Foten(20)
    assert sum(parameter.numel() for parameter in plain.parameters()) == sum(
        parameter.numel() for parameter in ours.parameters()
    )
    assert plain(torch.randn(3, 3, 20)).shape == (3, 1)


def test_every_way_learns_from_the_same_windows_and_says_what_it_took():
    ticks = count()
    all_cases = list(cases(True, None, recording(0.5), clock=lambda: float(next(ticks))))
    assert len(all_cases) == 2 * len(WAYS)
    assert len({(case.input, case.n) for case in all_cases}) == 1
    assert {case.case for case in all_cases} == {"training FoTEN, one epoch", "training FoTEN, equal CPU time"}
    for case in all_cases:
        outcome = case.run()
        assert 0.01 < case.error(outcome) < 2.0
        assert case.seconds(outcome) > 0
