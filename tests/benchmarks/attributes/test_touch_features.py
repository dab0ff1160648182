"""The bench of touch says what is true: librosa's numbers, and where energy stays."""

import pytest

from benchmarks.attributes.touch_features import cases


@pytest.mark.needs("librosa", "pywt")
def test_each_way_errs_as_is_documented():
    errors = {(case.case, case.method): case.error(case.run()) for case in cases(quick=True)}
    assert errors["cepstral coefficients", "palpate, all segments at once"] < 1e-6
    assert errors["three axes on one", "DFT321, segment by segment"] < 1e-10
    assert errors["three axes on one", "DFT321 in frames, as for rendering"] > 1e-4
    assert errors["three axes on one", "sum of the axes"] > 0.01
    kinds = {method: error for (case, method), error in errors.items() if case == "features of a recording"}
    assert len(kinds) == 5
    assert set(kinds.values()) == {0.0}
