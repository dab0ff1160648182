"""The declared figures: what they run and how their errors are evaluated (no times: those are for `palpate bench`)."""

import pytest

from benchmarks.sessions import sessions, startup


def test_a_durable_session_loses_nothing_and_one_in_memory_everything():
    errors = {}
    for case in sessions(quick=True):
        assert (case.area, case.n) == ("sessions", 284)
        assert "45 trials x 7 ratings" in case.input or case.input == "6 MB of samples"
        errors[case.method] = case.error(case.run())
    assert errors == {
        "palpate, durable": 0,
        "in memory only": 284,
        "palpate, byte for byte": 0,
        "palpate, chain verified": 0,
        "palpate, read back whole": 0,
        "of this, the shapes of its events": 0,
    }


def test_starting_up_is_measured_by_what_is_imported():
    cases = {case.method: case for case in startup(quick=True)}
    assert cases["palpate --help"].error(None) == 0
    assert cases["python -c pass"].error(None) == 0
    assert cases["palpate --help"].run().stdout.startswith(b"Usage: palpate")


@pytest.mark.parametrize("code", ["import numpy", "import pandas"])
def test_a_heavy_import_would_be_seen(code, tmp_path, monkeypatch):
    from benchmarks import sessions as bench

    monkeypatch.setattr(bench, "LOADED", f"{code}\n{bench.LOADED}")
    assert bench._heavy(["--help"]) >= 1
