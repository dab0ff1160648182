"""Read a Study from the text of study.yaml, or report problems with file, line, path and nearest valid name.

The parts of a study must fit together: names that are used exist, and nothing appears twice.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from palpate.protocols.complaints import Problem, listed, translated
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.extensions import ExtensionError, finder, is_own
from palpate.protocols.needs import NEEDS
from palpate.protocols.registry import Registry, load_object
from palpate.protocols.study import Study, is_number
from palpate.protocols.tasks import TASKS, Task
from palpate.protocols.yaml_text import Document, Path

TASK_KEYS = (
    "attributes", "scale", "sides", "ask", "intervals", "procedure", "pairs", "feedback", "adjectives", "lexicon",
    "capture", "live", "settings",
)  # fmt: skip
"""The keys that belong to some tasks; they are listed so that reading a study imports its own task alone."""


class StudyError(ValueError):
    """A study file that cannot be used; the message lists the problems, one line each."""


def study_from(document: Document, stimuli: Sequence[Mapping[str, Any]], name: str) -> Study:
    """Return the study in `document`, its stimulus table being `stimuli` ({id, columns, sha256} each).

    Raises StudyError with every problem found (at most eight are shown).
    """
    if not isinstance(document.data, dict):
        raise StudyError(f"{name}: keys and values are expected at the top, e.g. study: NAME")
    try:
        data = _texts_as_keys(document.data)
        if "stimuli" in data:  # the stimulus table in the place of its name
            data["stimuli"] = list(stimuli)
        study = Study.model_validate(data)
    except StudyError as error:
        raise StudyError(f"{name}: {error}") from None
    except ValidationError as error:
        raise StudyError(listed(translated(error, Study), document, name)) from None
    if problems := list(inconsistencies(study)):
        raise StudyError(listed(problems, document, name))
    return study


def _texts_as_keys(value: Any) -> Any:
    """Return the value with all keys as texts: YAML also allows numbers as keys (groups: {1: ...}). Raises
    StudyError.
    """
    if isinstance(value, dict):
        texts = {str(key): _texts_as_keys(inner) for key, inner in value.items()}
        if len(texts) < len(value):
            twice = next(key for key in value if not isinstance(key, str) and str(key) in value)
            raise StudyError(f"the keys {twice!r} and {str(twice)!r} mean the same; one of them is expected")
        return texts
    if isinstance(value, list):
        return [_texts_as_keys(inner) for inner in value]
    return value


def own_parts(study: Study) -> Iterator[tuple[Path, str, str]]:
    """Yield the place, the kind and the name of each part of an extension that the study names."""
    several = len(study.procedure) > 1
    named: list[tuple[Path, str, str | None]] = [
        (("task",), "tasks", study.task),
        *((("needs", index), "needs", need) for index, need in enumerate(study.needs)),
        (("capture", "device"), "needs", None if study.capture is None else study.capture.device),
        *(
            (("procedure", index, "kind") if several else ("procedure", "kind"), "procedures", procedure.kind)
            for index, procedure in enumerate(study.procedure)
        ),
        (("simulation", "kind"), "participants", None if study.simulation is None else study.simulation.kind),
    ]
    for path, kind, name in named:
        if name is not None and is_own(name):
            yield path, kind, name


def _missing_parts(study: Study) -> Iterator[Problem]:
    for path, kind, name in own_parts(study):
        try:
            finder().part(kind, name)
        except ExtensionError as error:
            yield Problem(path, str(error))


def inconsistencies(study: Study) -> Iterator[Problem]:
    """Yield all inconsistencies between the parts of a study that each follow the schema."""
    if missing := list(_missing_parts(study)):
        yield from missing
        return
    yield from _repeated((s.id for s in study.stimuli), ("stimuli",), "the stimulus id")
    yield from parts_of_task(study)
    yield from _adjectives(study)
    for group, selection in study.groups.items():
        problems = [p for c, levels in selection.items() for p in _selection(study, group, c, levels)]
        yield from problems
        if not problems and not study.stimuli_of(group):
            yield Problem(("groups", group), "no stimulus belongs to this group")
    yield from _sample(study)
    if study.order.blocks is not None:
        yield from _column(study, study.order.blocks.by, ("order", "blocks", "by"))
        blocks = sorted({stimulus.columns.get(study.order.blocks.by, "") for stimulus in study.stimuli})
        for level in study.order.blocks.instructions:
            yield from _known(level, blocks, ("order", "blocks", "instructions", level), "a block")
    elif study.resume is not None and "block" in study.resume.repeat:
        yield Problem(("resume", "repeat"), "the study has no blocks: block would repeat the whole session")
    if study.practice is not None:
        ids = [s.id for s in study.stimuli]
        for index, name in enumerate(study.practice.stimuli):
            yield from _known(name, ids, ("practice", "stimuli", index), "a stimulus id")
        if study.practice.until is not None and "procedure" not in TASKS[study.task].keys:
            yield Problem(("practice", "until"), f"task {study.task} has no right answers to count")
    yield from _anchors(study)
    for index, column in enumerate(study.blind):
        yield from _column(study, column, ("console", "blind", index))
    yield from _analysis(study)
    yield from _simulation(study)


def _adjectives(study: Study) -> Iterator[Problem]:
    poles = [
        (("attributes", i, pole), word)
        for i, a in enumerate(study.attributes)
        for pole, word in enumerate((a.low, a.high))
        if a.outcome is None
    ]
    listed = study.adjectives.words if study.adjectives is not None else ()
    yield from _same_words(poles)
    if any(a.outcome for a in study.attributes):
        yield from _repeated((a.name for a in study.attributes), ("attributes",), "the name")
    yield from _same_words([(("adjectives", "words", index), word.word) for index, word in enumerate(listed)])


def _same_words(words: Iterable[tuple[Path, str]]) -> Iterator[Problem]:
    seen: set[str] = set()
    for path, word in words:
        key = " ".join(word.casefold().split())
        if key in seen:
            yield Problem(path, f"the adjective {word!r} appears twice")
        seen.add(key)


def _anchors(study: Study) -> Iterator[Problem]:
    """Yield problems of anchors: they must be stimuli, with values on the scale of an attribute."""
    if study.anchors is None:
        return
    task = TASKS[study.task]
    if not task.asks:
        yield Problem(
            ("anchors",), f"task {study.task} records stimuli and asks nothing, so there is nothing to anchor"
        )
    names = [*(attribute.name for attribute in study.attributes), *(question.name for question in study.ask)]
    ids = [stimulus.id for stimulus in study.stimuli]
    for index, anchor in enumerate(study.anchors.stimuli):
        path: Path = ("anchors", "stimuli", index)
        yield from _known(anchor.id, ids, (*path, "id"), "a stimulus id")
        if (anchor.wish is not None) != task.makes:
            yield Problem(path, "wish: {ATTRIBUTE: VALUE} belongs to the anchors of task authoring, and to no others")
        stands = {} if anchor.attribute is None or anchor.value is None else {anchor.attribute: anchor.value}
        for name, value in {**stands, **(anchor.wish or {})}.items():
            yield from _known(name, names, path, "an attribute, by its name or low adjective, or a question")
            if study.scale is not None and not study.scale.holds(value):
                yield Problem(path, f"{name}: {value:g} is not on the study's scale")
    if not study.anchors.rated and task.makes:
        yield Problem(("anchors", "rated"), "anchors made from wishes are not trials; leave rated out")
    elif not study.anchors.rated and not study.stimuli_of(None):
        yield Problem(("anchors", "rated"), "every stimulus is an anchor that is not rated; nothing is left for trials")


def _sample(study: Study) -> Iterator[Problem]:
    """Yield inconsistencies between the sample and the groups, and rules over sessions without several sessions."""
    sample, groups = study.participants, len(study.groups)
    if sample is not None and sample.per_group is not None:
        if not groups:
            yield Problem(("participants", "per_group"), "the study has no groups; say planned")
        elif sample.planned not in (None, sample.per_group * groups):
            total = f"{sample.per_group} in each of {groups} groups are {sample.per_group * groups}"
            yield Problem(("participants", "planned"), f"found {sample.planned}, but {total}")
    if study.order.over_sessions is not None and study.sessions < 2:
        yield Problem(("order", "over_sessions"), "needs participants: {sessions: 2} or more")
    if study.questions is not None and "demographics" not in study.opening:
        yield Problem(("questions",), "needs opening: [demographics], the form that asks them")
    yield from _repeated(study.questions or (), ("questions",), "the question")


def _selection(study: Study, group: str, column: str, levels: Sequence[str]) -> Iterator[Problem]:
    path = ("groups", group, column)
    missing = list(_column(study, column, path))
    yield from missing
    if not missing:
        known = sorted({s.columns[column] for s in study.stimuli})
        for index, level in enumerate(levels):
            yield from _known(level, known, (*path, index), f"a level of {column}")
        yield from _repeated(levels, path, f"the level of {column}")


def _analysis(study: Study) -> Iterator[Problem]:
    if study.analysis is None:
        return
    named: list[tuple[Path, str | None]] = [
        *((("analysis", "within", i), name) for i, name in enumerate(study.analysis.within)),
        (("analysis", "pooled"), study.analysis.pooled),
        (("analysis", "families"), study.analysis.families),
    ]
    for path, name in named:
        if name is not None:
            yield from _column(study, name, path)


def _simulation(study: Study) -> Iterator[Problem]:
    if study.simulation is None:
        return
    if (kind := study.simulation.kind) is not None:
        kinds: Registry[Any] = load_object("palpate.protocols.simulated_participants:KINDS")
        if (missing := kinds.why_not(kind, "kind of participants")) is not None:
            yield Problem(("simulation", "kind"), missing)
    names = [attribute.name for attribute in study.attributes]
    if study.adjectives is not None:
        names += [word.word for word in study.adjectives.words]
    if study.questionnaire is not None:
        names += [item.name for item in study.questionnaire.items]
    names += [question.name for question in study.ask]
    for attribute, weights in study.simulation.latents.items():
        path = ("simulation", "latents", attribute)
        yield from _known(
            attribute, names, path, "an attribute (by its name or low adjective), a word, an item or a question"
        )
        for column in weights:
            if column != "intercept":
                yield from _numeric_column(study, column, (*path, column))


def _numeric_column(study: Study, column: str, path: Path) -> Iterator[Problem]:
    missing = list(_column(study, column, path))
    yield from missing
    if missing:
        return
    for stimulus in study.stimuli:
        if not is_number(stimulus.columns[column]):
            found = stimulus.columns[column]
            yield Problem(path, f"stimulus {stimulus.id!r} has {found!r} in {column!r}, not a finite number")
            return


def _column(study: Study, column: str, path: Path) -> Iterator[Problem]:
    columns = sorted({name for s in study.stimuli for name in s.columns})
    yield from _known(column, columns, path, "a column of the stimulus table")
    if column in columns and any(column not in s.columns for s in study.stimuli):
        yield Problem(path, f"not every stimulus has the column {column!r}")


def _known(name: str, names: Iterable[str], path: Path, what: str) -> Iterator[Problem]:
    names = list(names)
    if name not in names:
        yield Problem(path, f"found {name!r}, expected {what}; {nearest(name, names)}")


def _repeated(names: Iterable[str], path: Path, what: str) -> Iterator[Problem]:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            yield Problem(path, f"{what} {name!r} appears twice")
        seen.add(name)


def _repeated_at(names: Sequence[str], path: Path, what: str) -> Iterator[Problem]:
    """Yield a problem at each name that appeared before."""
    for index, name in enumerate(names):
        if name in names[:index]:
            yield Problem((*path, index), f"{what} {name!r} appears twice")


def parts_of_task(study: Study) -> Iterator[Problem]:
    """Yield a problem for each part that the task requires and the file does not have, or that the task cannot have."""
    task = TASKS[study.task]
    present = {key for key in TASK_KEYS if getattr(study, key)}
    for key in task.required:
        if key not in present:
            yield Problem((key,), f"this key is required for task {study.task}")
    for key in sorted(present - {*task.keys}):
        others = " or ".join(name for name, other in TASKS.items() if key in other.keys)  # imports every task
        yield Problem((key,), f"belongs to task {others}, and this one is {study.task}")
    yield from task.check(study)
    yield from _of_ends(study)
    if task.forward_only and study.navigation == "back_and_forward":
        yield Problem(("navigation",), f"task {study.task} goes forward only")
    yield from _of_devices(study, task)


def _of_devices(study: Study, task: Task) -> Iterator[Problem]:
    """Yield a problem for each device that is needed and not listed, and for each listed device without a use."""
    used = task.device(study)
    if used and used not in study.needs:
        yield Problem(("needs",), f"task {study.task} needs the device {used}, which is not listed")
    if study.live is not None and "window" not in study.needs:
        yield Problem(("live",), "the sliders are moved while the door is felt: needs: [window] goes together with it")
    if study.noise is not None and "masking_noise" not in study.needs:
        yield Problem(("noise",), "a level of the noise goes together with needs: [masking_noise]")
    if study.capture is not None and NEEDS[study.capture.device].role != "records":
        yield Problem(("capture", "device"), f"nothing is recorded with {study.capture.device}")
    presenting = [need for need in study.needs if NEEDS[need].role == "presents"]
    for index, need in enumerate(study.needs):
        place = ("needs", index)
        if need in study.needs[:index]:
            yield Problem(place, f"{need} appears twice")
        elif NEEDS[need].role == "records" and need != (study.capture and study.capture.device):
            yield Problem(place, f"{_unrecorded(study, need)}; leave it out")
        elif need in presenting and NEEDS[need].makes != task.makes:
            yield Problem(place, f"nothing in task {study.task} is presented by {need}; leave it out")
        elif need in presenting[1:]:
            yield Problem(place, f"{need} would present nothing: {presenting[0]} presents the stimuli; leave one out")


def _unrecorded(study: Study, need: str) -> str:
    """Return why nothing records with a need, and what would."""
    if study.capture is not None:
        return f"task {study.task} records with {study.capture.device} alone, and nothing with {need}"
    return (
        f"nothing in task {study.task} records with {need}: task capture does, by capture: {{device: {need}, ...}} "
        "(a key record:, for recording during other tasks, does not exist yet)"
    )


def _of_ends(study: Study) -> Iterator[Problem]:
    for key in ("opening", "closing"):
        names = getattr(study, key)
        if len(set(names)) < len(names):
            yield Problem((key,), f"a form appears twice in {', '.join(names)}")
    if ("eligibility" in study.opening) != bool(study.eligible):
        yield Problem(("eligible",), "opening: [eligibility] and eligible: [{name, text, answer}, ...] go together")
    yield from _repeated_at([criterion.name for criterion in study.eligible], ("eligible",), "the question")
    if ("interview" in study.closing) != bool(study.interview):
        yield Problem(("interview",), "closing: [interview] and interview: [{name, text}, ...] go together")
    yield from _repeated_at([item.name for item in study.interview], ("interview",), "the question")
    if ("questionnaire" in study.closing) != (study.questionnaire is not None):
        yield Problem(("questionnaire",), "closing: [questionnaire] and questionnaire: {items: ...} go together")
    if study.questionnaire is not None:
        items = [item.name for item in study.questionnaire.items]
        yield from _repeated_at(items, ("questionnaire", "items"), "the item")
