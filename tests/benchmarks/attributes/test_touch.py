"""The bench from sensors to features: what was felt comes back."""

import pytest

from benchmarks.attributes.touch import ERROR, MEMORY, cases
from palpate.analysis.measuring.rows import MEASURED, measure

FROM_SENSORS = "from sensors to features"


@pytest.mark.needs("librosa", "pywt")
def test_what_was_felt_comes_back_within_half_a_percent():
    errors = {case.method: case.error(case.run()) for case in cases(quick=True) if case.case == FROM_SENSORS}
    assert set(errors) == {"as shipped", "hum not looked for"}
    assert all(0 < error < 0.5 for error in errors.values())


@pytest.mark.needs("librosa", "pywt")
def test_a_study_s_recordings_are_made_once_with_their_error_time_and_memory():
    error, memory = (measure(case) for case in cases(quick=True) if case.case != FROM_SENSORS)
    assert error.outcome == memory.outcome == MEASURED
    assert (error.error_kind, memory.error_kind) == (ERROR, MEMORY)
    assert 0 < error.error < 0.5
    assert 20 < memory.error < 4000  # workers that other tests had before keep what they had then
    assert error.seconds == memory.seconds > 0
