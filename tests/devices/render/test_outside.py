"""Time that the loop was not given: read where Linux reports it, else left out."""

import os

from palpate.devices.render.headless import in_words
from palpate.devices.render.process import Outside, outside

CPU = "cpu  100 0 50 9000 3 0 1 250 0 0\ncpu0 50 0 25 4500 1 0 1 125 0 0\n"


def test_the_hosts_ticks_and_the_threads_wait_are_read(tmp_path):
    stat, scheduled = tmp_path / "stat", tmp_path / "schedstat"
    stat.write_text(CPU)
    scheduled.write_text("123456789 2500000 77\n")
    counts = outside(stat, scheduled)
    assert counts.waited_s == 0.0025
    assert counts.stolen_s == 250 / os.sysconf("SC_CLK_TCK")


def test_what_the_system_does_not_tell_is_none(tmp_path):
    (tmp_path / "short").write_text("cpu  1 2 3\n")
    (tmp_path / "odd").write_text("no numbers here\n")
    for stat in ("none", "short", "odd"):
        counts = outside(tmp_path / stat, tmp_path / "odd")
        assert counts == Outside(None, None)
        assert counts.since(Outside(1.0, 1.0)) == {"stolen_s": None, "waited_s": None}


def test_what_was_added_is_stored():
    assert Outside(3.5, 1.25).since(Outside(3.0, 1.0)) == {"stolen_s": 0.5, "waited_s": 0.25}


def test_outside_load_is_reported_where_it_is_worth_a_line():
    ready = {"late": 0, "steps": 1, "late_share": 0.0, "median_us": 1.0, "p99_us": 1.0, "worst_us": 1.0}
    output = {"ahead_ms": 10, "underruns": 0, "missing": 0, "limited": 0, "compensated": True}
    record = {"ready": ready, "output": output, "priority": "normal", "outside": {"stolen_s": 0.12, "waited_s": 0.0}}
    lines = list(in_words(record, 1.0, 1.0))
    assert any("0.12 s" in line and "host" in line for line in lines)
    assert not any("waiting" in line for line in lines)
    assert not any("host" in line for line in in_words({**record, "outside": {"stolen_s": None}}, 1.0, 1.0))
