"""The jobs of an evaluation, in waves and in parallel; a finished job is saved on disk and never computed again."""

from __future__ import annotations

import shutil
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from numpy.typing import NDArray

from palpate.modeling.files.result_store import ResultStore, content_key
from palpate.modeling.training.refusals import JobError
from palpate.modeling.training.run_card import versions
from palpate.protocols.files import file_sha256
from palpate.protocols.progress import Clock, Report, silent
from palpate.protocols.undefined import finite_or_none
from palpate.signals.arrays import Array

CHECKPOINTS = "checkpoints"


class Job(Protocol):
    """One step of an evaluation, such as a method fitted on one fold. Hashable, and equal jobs have equal results."""

    @property
    def name(self) -> str:
        """The name in progress reports and errors."""


JobT = TypeVar("JobT", bound=Job)


@dataclass(frozen=True)
class Result(Generic[JobT]):
    """The result of a job, or the reason why it was refused.

    `numbers` are measurements by name, None where undefined; `arrays` predictions and the like; `files` what the job
    wrote beside them, below the domain's `work`.
    """

    job: JobT
    numbers: Mapping[str, float | None] = field(default_factory=dict)
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()
    refused: str = ""

    def array(self, name: str) -> Array:
        """Return one of its arrays."""
        array: Array = self.arrays[name]
        return array

    @property
    def predicted(self) -> Array:
        """The method's predictions for its test data."""
        return self.array("predicted")


@dataclass(frozen=True, kw_only=True)
class EvaluateOptions:
    """The options of every evaluation: `workers` and `cluster` as for `run_jobs`; `quick` for a trial run."""

    seed: int = 0
    quick: bool = False
    workers: int | None = None
    cluster: str | None = None


@dataclass(frozen=True, kw_only=True)
class Domain(ABC, Generic[JobT]):
    """The common inputs of all jobs of an evaluation: data, folds, methods. It pickles.

    `settings` are passed to the methods; `work` is the folder of finished jobs, None to save nothing.
    """

    refusals_raise: ClassVar[bool] = False
    """Whether a ValueError of a job ends the evaluation; otherwise it becomes a result, and the other jobs continue."""
    seed: int = 0
    settings: Mapping[str, Any] = field(default_factory=dict)
    work: Path | None = None
    clock: Clock = time.perf_counter

    @abstractmethod
    def compute(self, job: JobT) -> Result[JobT]:
        """Return the job's result. Raises ValueError where it is refused."""

    @abstractmethod
    def decides(self, job: JobT) -> Mapping[str, Any]:
        """Return all values that determine the job's result, as JSON holds them: data, fold, method, settings, code."""

    def spent(self, job: JobT, all_done: bool) -> Sequence[JobT]:
        """Return the jobs whose checkpoints are no longer needed once this job, or all jobs, are done."""
        return () if all_done else (job,)

    def key(self, job: JobT) -> str:
        """Return the key of the job's result: the digest of `decides`."""
        return content_key(versions=_installed(), **self.decides(job))

    def plain_settings(self) -> dict[str, str]:
        """Return the settings as text, for a key."""
        return {name: str(value) for name, value in sorted(self.settings.items())}

    def checkpoint(self, job: JobT) -> Path | None:
        """Return the folder of a job's checkpoints; None where none are saved."""
        return None if self.work is None else self.work / CHECKPOINTS / self.key(job)

    def remove_checkpoint(self, job: JobT) -> None:
        """Remove a job's checkpoints."""
        if (folder := self.checkpoint(job)) is not None:
            shutil.rmtree(folder, ignore_errors=True)

    def load(self, job: JobT) -> Result[JobT] | None:
        """Return the saved result of an equal job (same data, settings and code); None if there is no complete one."""
        if self.work is None or (stored := ResultStore(self.work).load(self.key(job))) is None:
            return None
        metadata, files = stored.metadata, tuple(self.work / name for name in stored.metadata["files"])
        if not all(path.is_file() for path in files) or _sha256s(files, self.work) != metadata["files"]:
            return None
        return Result(job, metadata["numbers"], stored.arrays, tuple(metadata["notes"]), files)

    def save(self, result: Result[JobT]) -> None:
        """Save a result, unless it was refused."""
        if self.work is None or result.refused:
            return
        metadata = {
            "job": result.job.name,
            "numbers": {name: None if n is None else finite_or_none(n) for name, n in result.numbers.items()},
            "notes": list(result.notes),
            "files": _sha256s(result.files, self.work),
        }
        ResultStore(self.work).save(self.key(result.job), result.arrays, metadata)


@dataclass(frozen=True)
class Results(Generic[JobT]):
    """The results of all jobs by job; `loaded` is how many were finished before."""

    by_job: Mapping[JobT, Result[JobT]]
    loaded: int

    def __getitem__(self, job: JobT) -> Result[JobT]:
        """Return a job's result."""
        return self.by_job[job]

    def __len__(self) -> int:
        """Return the number of jobs."""
        return len(self.by_job)


def result_of(job: JobT, domain: Domain[JobT]) -> Result[JobT]:
    """Return a job's result: the saved one of an equal job, else computed and saved."""
    if (saved := domain.load(job)) is not None:
        return saved
    try:
        result = domain.compute(job)
    except ValueError as refusal:
        if domain.refusals_raise:
            raise
        return Result(job, refused=str(refusal))
    domain.save(result)
    for spent in domain.spent(job, all_done=False):
        domain.remove_checkpoint(spent)
    return result


def evaluate(
    domain: Domain[JobT], waves: Sequence[Sequence[JobT]], options: EvaluateOptions, report: Report = silent
) -> Results[JobT]:
    """Run all jobs and return their results; a job may build on those of earlier waves.

    Finished results of an earlier, equal evaluation are loaded from `domain.work`. Raises JobBroken for a job that
    fails other than by a refusal, and JobError for a refusal if the domain raises refusals.
    """
    from palpate.modeling.training.jobs import run_jobs

    results = {job: saved for wave in waves for job in wave if (saved := domain.load(job)) is not None}
    loaded = frozenset(results)
    for wave in waves:
        missing = [job for job in wave if job not in results]
        if not missing:
            continue
        computed = run_jobs(
            partial(result_of, domain=domain), missing, workers=options.workers, cluster=options.cluster, report=report
        )
        for result in computed:
            _require_files(result)
            if options.cluster is not None and domain.load(result.job) is None:  # a worker saved it on its own disk
                domain.save(result)
        results |= dict(zip(missing, computed, strict=True))
    for spent in {other for job in results if job not in loaded for other in domain.spent(job, all_done=True)}:
        domain.remove_checkpoint(spent)
    return Results(results, len(loaded))


def _require_files(result: Result[JobT]) -> None:
    for path in result.files:
        if not path.is_file():
            raise JobError(
                f"{result.job.name}: its worker wrote {path}, which is not here. The cluster's workers need the lab's "
                "folder under the same path."
            )


def _sha256s(files: Sequence[Path], folder: Path) -> dict[str, str]:
    return {path.relative_to(folder).as_posix(): file_sha256(path) for path in files}


@cache
def _installed() -> Mapping[str, str | None]:
    """Return the versions of packages, read once: that takes a hundred times as long as the rest of a key."""
    return versions()
