"""The task that records a stimulus while it is explored."""

from __future__ import annotations

from collections.abc import Iterator

from palpate.protocols.complaints import Problem
from palpate.protocols.events import Present, Sense
from palpate.protocols.study import Study
from palpate.protocols.tasks.steps import Captured, Steps, Task, TaskError
from palpate.protocols.trial import Trial


def capture(trial: Trial) -> Steps:
    """Mount the stimulus, then record it while it is explored (thesis 3.4.1, 4.3.3, 5.3.1.1)."""
    yield Present(trial)
    if trial.recording is None:
        raise TaskError(f"trial {trial.number}: nothing to record")
    yield Sense(trial.recording.device, trial.recording.seconds, trial)
    return Captured()


def _durations(study: Study) -> Iterator[Problem]:
    """Yield a problem for the first stimulus without seconds, where they are a column of the stimulus table."""
    column = study.capture.seconds if study.capture is not None else None
    if not isinstance(column, str):
        return
    for stimulus in study.stimuli:
        if not _is_duration(found := stimulus.columns.get(column)):
            yield Problem(
                ("capture", "seconds"),
                f"stimulus {stimulus.id!r} has {found!r} in {column!r}; seconds from 0.1 to 3600 are expected",
            )
            return


def _is_duration(text: str | None) -> bool:
    try:
        return 0.1 <= float(text or "") <= 3600
    except ValueError:
        return False


CAPTURE = Task(
    "A stimulus is felt while sensors record it.",
    capture, keys=("capture",), required=("capture",), forward_only=True, check=_durations,
    device=lambda study: None if study.capture is None else study.capture.device,
    summary=lambda study: f"recorded by {study.capture.device if study.capture else 'nothing'}",
)  # fmt: skip
