"""The bench from sensors to features: what was felt comes back."""

import pytest

from benchmarks.attributes.touch import ERROR, MEMORY, cases
from palpate.analysis.measuring.rows import MEASURED, measure

FROM_SENSORS = "from sensors to features"


@pytest.mark.needs("librosa", "pywt")
def test_what_was_felt_comes_back_within_half_a_percent():
    found = {each.method: each.error(each.run()) for each in cases(quick=True) if each.case == FROM_SENSORS}
    assert set(found) == {"as shipped", "hum not looked for"}
    assert all(0 < error < 0.5 for error in found.values())


@pytest.mark.needs("librosa", "pywt")
def test_a_study_s_recordings_are_made_once_and_their_error_time_and_memory_told():
    error, memory = (measure(each) for each in cases(quick=True) if each.case != FROM_SENSORS)
    assert error.outcome == memory.outcome == MEASURED
    assert (error.error_kind, memory.error_kind) == (ERROR, MEMORY)
    assert 0 < error.error < 0.5
    assert 20 < memory.error < 4000  # workers that other tests had before keep what they had then
    assert error.seconds == memory.seconds > 0
