"""The figures of a door that follows the sliders."""

import numpy as np
import pytest

from benchmarks.doors.live_door import cases, followed, methods
from palpate.devices.door.designer import designer_for
from palpate.devices.door.plant.rendering import PASSAGE_TICKS

DESIGNER = designer_for(None)
WAYS = methods(DESIGNER)
USED = next(iter(WAYS.values()))


def test_every_method_has_median_and_95th_percentile_of_both_latencies_beside_its_error():
    declared = [(case.case, case.method) for case in cases(quick=True)]
    assert len(declared) == len(set(declared)) == 4 * len(WAYS)
    assert all(case.seconds is not None and case.error_kind == "N rms" for case in cases(quick=True))


@pytest.mark.parametrize("name", WAYS)
def test_a_change_comes_no_sooner_than_the_line_allows_and_no_sooner_than_the_passage_ends(name):
    result = followed(WAYS[name], USED, len(DESIGNER.attributes), 4)
    assert len(result.latency_s) <= 4 and result.missed == 0
    assert result.latency_s.min() > 621 * 4 * 10 / 1_000_000  # 621 points of 4 bytes, 10 bits case, at 1 Mbaud
    assert ((result.complete_s - result.latency_s) >= PASSAGE_TICKS / 1000 - 1e-9).all()
    assert (result.off_N > 1) == (name == "straight line from the middle")


def test_the_straight_line_is_the_model_itself_in_the_middle():
    middle = (50.0,) * len(DESIGNER.attributes)
    tangent = WAYS["straight line from the middle"]
    assert np.abs(tangent(middle) - USED(middle)).max() < 1e-6
