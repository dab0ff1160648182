"""Which parts of a study file belong to which task."""

from __future__ import annotations

from collections.abc import Iterator

from palpate.protocols.problems import Problem
from palpate.protocols.study import PRESENTING, RATED, RECORDING, Study

REQUIRED = {
    **dict.fromkeys(RATED, ("attributes", "scale")),
    "adjective_selection": ("adjectives",),
    "free_lexicon": (),
    "capture": ("capture",),
}
OWN = {"attributes": RATED, "scale": RATED, "sides": ("similarity",), "adjectives": ("adjective_selection",),
       "lexicon": ("free_lexicon",), "capture": ("capture",),
       "live": ("authoring",)}  # fmt: skip
ONE_WAY = ("authoring", "capture")
"""Tasks in which there is nothing to go back to."""


def parts_of_task(study: Study) -> Iterator[Problem]:
    """A part that the task needs and the file lacks, or that no such task has."""
    present = {name for name in OWN if getattr(study, name)}
    for name in REQUIRED[study.task]:
        if name not in present:
            yield Problem((name,), f"this key is required for task {study.task}")
    for name in sorted(present):
        if study.task not in OWN[name]:
            yield Problem((name,), f"belongs to task {' or '.join(OWN[name])}, and this one is {study.task}")
    yield from _of_similarity(study)
    yield from _of_ends(study)
    if study.task in ONE_WAY and study.navigation == "back_and_forward":
        yield Problem(("navigation",), f"task {study.task} goes forward only")
    if study.capture is not None:
        yield from _recorded(study, study.capture.seconds)
    yield from _of_devices(study)


def _of_similarity(study: Study) -> Iterator[Problem]:
    if study.task == "similarity" and len(set(study.sides)) < 2:
        yield Problem(("sides",), "two different sides to switch between are expected, as [real, virtual]")


def _of_devices(study: Study) -> Iterator[Problem]:
    """What records the stimuli, or makes what is wished for, is listed; and nothing that the task does not use."""
    used = "door_generator" if study.task == "authoring" else study.capture and study.capture.device
    if study.task in ONE_WAY and used and used not in study.needs:
        yield Problem(("needs",), f"task {study.task} needs the device {used}, which is not listed")
    if study.live is not None and "window" not in study.needs:
        yield Problem(("live",), "the sliders are moved while the door is felt: needs: [window] goes together with it")
    if study.noise is not None and "masking_noise" not in study.needs:
        yield Problem(("noise",), "a level of the noise goes together with needs: [masking_noise]")
    presenting = [need for need in study.needs if need in PRESENTING]
    for index, need in enumerate(study.needs):
        place = ("needs", index)
        if need in study.needs[:index]:
            yield Problem(place, f"{need} stands twice")
        elif need in RECORDING and need != (study.capture and study.capture.device):
            recording = f", which records with {study.capture.device}" if study.capture is not None else ""
            yield Problem(place, f"nothing in task {study.task}{recording} records with {need}; leave it out")
        elif need in PRESENTING and (need == "door_generator") != (study.task == "authoring"):
            yield Problem(place, f"nothing in task {study.task} is presented by {need}; leave it out")
        elif need in presenting[1:]:
            yield Problem(place, f"{need} would present nothing: {presenting[0]} presents the stimuli; leave one out")


def _of_ends(study: Study) -> Iterator[Problem]:
    for key in ("opening", "closing"):
        names = getattr(study, key)
        if len(set(names)) < len(names):
            yield Problem((key,), f"a form stands twice in {', '.join(names)}")
    if ("eligibility" in study.opening) != bool(study.eligible):
        yield Problem(("eligible",), "opening: [eligibility] and eligible: [{name, text, answer}, ...] go together")
    names = [criterion.name for criterion in study.eligible]
    for index, name in enumerate(names):
        if name in names[:index]:
            yield Problem(("eligible", index), f"the question {name!r} stands twice")
    if ("interview" in study.closing) != bool(study.interview):
        yield Problem(("interview",), "closing: [interview] and interview: [{name, text}, ...] go together")
    names = [item.name for item in study.interview]
    for index, name in enumerate(names):
        if name in names[:index]:
            yield Problem(("interview", index), f"the question {name!r} stands twice")
    asked = "questionnaire" in study.closing
    if asked != (study.questionnaire is not None):
        yield Problem(("questionnaire",), "closing: [questionnaire] and questionnaire: {items: ...} go together")
    if study.questionnaire is not None:
        items = [item.name for item in study.questionnaire.items]
        for index, name in enumerate(items):
            if name in items[:index]:
                yield Problem(("questionnaire", "items", index), f"the item {name!r} stands twice")


def _recorded(study: Study, seconds: float | str) -> Iterator[Problem]:
    if not isinstance(seconds, str):
        return
    for stimulus in study.stimuli:
        if not _is_duration(stimulus.columns.get(seconds, "")):
            found = stimulus.columns.get(seconds)
            yield Problem(
                ("capture", "seconds"),
                f"stimulus {stimulus.id!r} has {found!r} in {seconds!r}; seconds from 0.1 to 3600 are expected",
            )
            return


def _is_duration(text: str) -> bool:
    try:
        return 0.1 <= float(text) <= 3600
    except ValueError:
        return False
