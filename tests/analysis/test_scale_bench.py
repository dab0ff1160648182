"""The bench of a lab that grows: on 20 sessions every verb is right. How long it takes, the bench says."""

import pytest

from analysis import bench_scale


def test_missing_sessions_are_made_in_runs_of_consecutive_numbers():
    assert list(bench_scale._runs([1, 2, 3, 7, 8, 9, 10], 3)) == [(1, 3), (7, 9), (10, 10)]
    assert list(bench_scale._runs([], 5)) == []


@pytest.mark.long
def test_every_verb_is_right_on_20_sessions(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(bench_scale, "SIZES", (20,))
    errors = {(case.case, case.method): case.error(case.run()) for case in bench_scale.cases(quick=True)}
    assert len(errors) == 12 and set(errors.values()) == {0.0}
