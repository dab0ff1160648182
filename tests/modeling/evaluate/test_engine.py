"""The engine by itself: jobs that double a number, on disk, in waves, in parallel; refused, damaged, out of date."""

import importlib
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from palpate.modeling.evaluate.engine import Domain, EvaluateOptions, Result, evaluate, result_of
from palpate.modeling.training.refusals import JobBroken, JobError
from palpate.protocols import code_digest as digests
from palpate.protocols.code_digest import code_digest

HERE = EvaluateOptions(workers=1)


@dataclass(frozen=True)
class Double:
    number: int
    below: bool = False

    @property
    def name(self):
        return f"twice {self.number}"


@dataclass(frozen=True, kw_only=True)
class Doubling(Domain):
    code: str = ""
    log: Path

    def compute(self, job):
        with self.log.open("a") as log:
            log.write(f"{job.number}\n")
        if job.number < 0:
            raise ValueError("below zero")
        if job.number == 13:
            raise RuntimeError("a fault of the program")
        if (folder := self.checkpoint(job)) is not None:
            folder.mkdir(parents=True)
        below = result_of(Double(job.number), self).numbers["twice"] if job.below else 0
        file = self.work / "models" / f"{job.number}.txt" if self.work else None
        if file:
            file.parent.mkdir(exist_ok=True)
            file.write_text(job.name)
        numbers = {"twice": 2.0 * job.number + below, "unknown": float("nan")}
        return Result(job, numbers, {"predicted": np.arange(3.0)}, ("a note",), (file,) if file else ())

    def decides(self, job):
        return {"job": [job.number, job.below], "settings": self.plain_settings(), "code": self.code}


class Strict(Doubling):
    refusals_raise = True


@pytest.fixture
def domain(tmp_path):
    return Doubling(work=tmp_path / "work", log=tmp_path / "log", settings={"epochs": 2})


def computed(domain):
    numbers = domain.log.read_text().split() if domain.log.exists() else []
    domain.log.unlink(missing_ok=True)
    return [int(number) for number in numbers]


def test_a_finished_job_is_loaded_with_all_that_came_of_it(domain):
    waves = [[Double(3), Double(1)], [Double(3, below=True)]]
    first = evaluate(domain, waves, HERE)
    assert computed(domain) == [3, 1, 3]
    again = evaluate(domain, waves, HERE)
    assert computed(domain) == [] and (first.loaded, again.loaded) == (0, 3)
    assert list(again.by_job) == [*waves[0], *waves[1]]
    loaded = again[Double(3, below=True)]
    assert loaded.numbers == {"twice": 12.0, "unknown": None} and loaded.notes == ("a note",)
    assert [file.read_text() for file in loaded.files] == ["twice 3"]
    np.testing.assert_array_equal(loaded.predicted, first[Double(3, below=True)].predicted)


def test_a_further_job_is_computed_alone_and_checkpoints_go(domain):
    evaluate(domain, [[Double(3)]], HERE)
    computed(domain)
    assert len(evaluate(domain, [[Double(3), Double(4)]], HERE)) == 2
    assert computed(domain) == [4]
    assert list((domain.work / "checkpoints").iterdir()) == []


def test_a_refusal_is_a_result_that_is_not_saved_and_the_others_go_on(domain):
    results = evaluate(domain, [[Double(-1), Double(2)]], HERE)
    assert (results[Double(-1)].refused, results[Double(2)].refused) == ("below zero", "")
    computed(domain)
    evaluate(domain, [[Double(-1), Double(2)]], HERE)
    assert computed(domain) == [-1]


def test_a_refusal_ends_an_evaluation_that_wants_all_results(domain):
    strict = Strict(work=domain.work, log=domain.log)
    with pytest.raises(JobError, match=r"twice -1.*below zero"):
        evaluate(strict, [[Double(-1), Double(2)]], HERE)


def test_a_fault_of_the_program_is_no_refusal(domain):
    with pytest.raises(JobBroken, match="a fault of the program"):
        evaluate(domain, [[Double(13)]], HERE)


def test_without_a_folder_nothing_is_kept(tmp_path):
    domain = Doubling(log=tmp_path / "log")
    for _ in range(2):
        assert evaluate(domain, [[Double(5)]], HERE).loaded == 0
    assert computed(domain) == [5, 5] and list(tmp_path.iterdir()) == []


def test_settings_and_code_decide_the_clock_does_not(domain):
    evaluate(domain, [[Double(3)]], HERE)
    for other in (replace(domain, settings={"epochs": 3}), replace(domain, code="other")):
        assert evaluate(other, [[Double(3)]], HERE).loaded == 0
    assert evaluate(replace(domain, clock=lambda: 0.0), [[Double(3)]], HERE).loaded == 1


@pytest.mark.parametrize("damage", ["gone", "changed"])
def test_a_result_whose_file_is_not_as_it_was_written_is_computed_again(domain, damage):
    file = evaluate(domain, [[Double(3)]], HERE)[Double(3)].files[0]
    file.unlink() if damage == "gone" else file.write_text("something else")
    assert evaluate(domain, [[Double(3)]], HERE).loaded == 0
    assert file.read_text() == "twice 3"


def test_a_file_that_only_a_worker_elsewhere_has_is_missed(domain):
    class Elsewhere(Doubling):
        def compute(self, job):
            return replace(super().compute(job), files=(Path("/nowhere/model.json"),))

        def save(self, result):
            pass

    with pytest.raises(JobError, match="/nowhere/model.json, which is not here. The cluster's workers need"):
        evaluate(Elsewhere(work=domain.work, log=domain.log), [[Double(3)]], HERE)


@pytest.mark.needs("pgrep")
def test_workers_give_the_same_results(domain, tmp_path):
    jobs = [Double(number) for number in range(6)]
    here = evaluate(domain, [jobs], HERE)
    elsewhere = evaluate(replace(domain, work=tmp_path / "other"), [jobs], EvaluateOptions(workers=2))
    assert [here[job].numbers["twice"] for job in jobs] == [elsewhere[job].numbers["twice"] for job in jobs]


def test_a_change_of_the_code_and_a_renamed_module_are_never_taken_for_the_old_ones(domain, tmp_path, monkeypatch):
    package = tmp_path / "labs_own"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "method.py").write_text("from labs_own.parts import x\n")
    (package / "parts.py").write_text("x = 1\n")
    monkeypatch.syspath_prepend(tmp_path)

    def loaded(module="labs_own.method"):
        importlib.invalidate_caches()
        for cached in (code_digest, digests._imports, digests._path, digests._with_tables):
            cached.cache_clear()  # as in a new process
        return evaluate(replace(domain, code=code_digest(module)), [[Double(3)]], HERE).loaded

    assert (loaded(), loaded()) == (0, 1)
    (package / "parts.py").write_text("x = 2\n")
    assert (loaded(), loaded()) == (0, 1)
    (package / "method.py").rename(package / "network.py")
    assert loaded("labs_own.network") == 0
    with pytest.raises(LookupError, match="no module 'labs_own.method'"):
        loaded()
    assert "labs_own" not in sys.modules
