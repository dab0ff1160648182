"""The bench of a lab that grows makes its sessions in runs, of which several processes make one each."""

from benchmarks import scale as bench_scale


def test_missing_sessions_are_made_in_runs_of_consecutive_numbers():
    assert list(bench_scale._runs([1, 2, 3, 7, 8, 9, 10], 3)) == [(1, 3), (7, 9), (10, 10)]
    assert list(bench_scale._runs([], 5)) == []


def test_a_timed_command_gives_its_seconds_its_peak_memory_and_what_it_printed():
    cost = bench_scale.timed("--version")
    assert cost.printed.startswith("palpate") and 0 < cost.seconds < 60 and 1 < cost.peak_MB < 1000
