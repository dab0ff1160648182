"""The task that presents a stimulus among intervals, at a level that a procedure chooses, and asks for a choice.

2AFC, 2IFC, nAFC, yes/no, same/different and odd-one-out are its designs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from palpate.protocols.complaints import Problem
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.events import Ask, Choose, Part, Present, Reply, Show
from palpate.protocols.fields import Choice, Confidence, Fields, QuestionSpec, answered
from palpate.protocols.forms import FIELDS_TABLE, FormKind, OwnColumn, OwnTable
from palpate.protocols.keyed import normal, uniform
from palpate.protocols.needs import NEEDS
from palpate.protocols.strict import KnownKeys, problem_at
from palpate.protocols.study import (
    Feedback,
    Number,
    Observer,
    PracticeGoal,
    Share,
    Stimulus,
    Study,
    Text,
    Whole,
    is_number,
)
from palpate.protocols.tasks.steps import Answered, Steps, Stopped, Task, TaskError
from palpate.protocols.tracks import ABSENT, NO_CATCH, PRACTICE, Track, tracks_in
from palpate.protocols.trial import ParticipantRow, Trial
from palpate.protocols.yaml_text import Path

RIGHT, WRONG = "right_answer", "wrong_answer"
"""The keys of the pages of feedback in the screens' texts."""
MOST_INTERVALS = 8
DESIGNS = {
    "forced_choice": "forced choice", "yes_no": "yes/no", "same_different": "same/different", "oddity": "odd one out",
}  # fmt: skip
FEWEST = {"forced_choice": 2, "yes_no": 1, "same_different": 2, "oddity": 3}


class Every(KnownKeys):
    """One catch trial in every so many trials of a track."""

    every: Annotated[Whole, Field(ge=1, le=1000)]


class Catch(KnownKeys):
    """Catch trials: without a stimulus (`absent`; in same/different with two equal ones), or at the easiest level.

    People whose share of wrong answers in them is above `exclude_above` are left out of analyses. Catch trials of one
    in one (`absent: {every: 1}`) are the noise or "same" half of a yes/no or same/different design.
    """

    absent: Every | None = None
    easy: Every | None = None
    exclude_above: Share | None = None

    @model_validator(mode="after")
    def _some(self) -> Self:
        if self.absent is None and self.easy is None:
            raise ValueError("absent: {every: N} or easy: {every: N} is expected")
        return self


class Intervals(KnownKeys):
    """The design of a trial: how many intervals of how many seconds, what is in them, and what is asked.

    forced_choice: one of `count` intervals has the stimulus (2AFC, 2IFC, nAFC). yes_no: one interval, "was it there?".
    same_different: two, "are they the same?". oddity: one of three or more differs. The other intervals hold the
    `standard`: the id of a stimulus, or a level of the grid's column; without one they are blank. `at_once`: all are
    presented together, as left and right. `names` are the words on the buttons, in the order of the answers.
    """

    design: Literal["forced_choice", "yes_no", "same_different", "oddity"] = "forced_choice"
    count: Annotated[Whole, Field(ge=1, le=MOST_INTERVALS)] | None = None
    names: Annotated[tuple[Text, ...], Field(max_length=MOST_INTERVALS)] = ()
    seconds: Annotated[float, Field(gt=0, le=60, allow_inf_nan=False)] | None = None
    gap_s: Annotated[float, Field(ge=0, le=60, allow_inf_nan=False)] = 0.5
    standard: Number | Text | None = None
    at_once: bool = False
    catch: Catch | None = None

    @model_validator(mode="after")
    def _counted(self) -> Self:
        fewest = FEWEST[self.design]
        fixed = self.design in ("yes_no", "same_different")
        if self.count is not None and (self.count < fewest or (fixed and self.count != fewest)):
            raise problem_at(
                ("count",), f"{'' if fixed else 'at least '}{fewest} for design: {self.design}, found {self.count}"
            )
        if self.names and len(self.names) != len(self.answers):
            raise problem_at(("names",), f"{len(self.answers)} names are expected, for {', '.join(self.answers)}")
        if len(set(self.names)) < len(self.names):
            raise problem_at(("names",), "different names are expected")
        if self.design in ("same_different", "oddity") and self.standard is None:
            raise ValueError(
                f"standard: design {self.design} compares a stimulus with a standard: its id, or its level"
            )
        if self.at_once and self.of == 1:
            raise ValueError("at_once goes with two intervals or more")
        if self.design in ("forced_choice", "oddity") and self.catch is not None and self.catch.absent is not None:
            raise problem_at(
                ("catch", "absent"), f"absent has no place in design {self.design}, where one interval has the stimulus"
            )
        return self

    @property
    def of(self) -> int:
        """Return the number of intervals."""
        return self.count if self.count is not None else FEWEST[self.design]

    @property
    def answers(self) -> tuple[str, ...]:
        """Return the answers as they are stored, in the order of the buttons."""
        if self.design == "yes_no":
            return ("yes", "no")
        if self.design == "same_different":
            return ("same", "different")
        return tuple(str(n) for n in range(1, self.of + 1))

    @property
    def catch_every(self) -> tuple[int | None, int | None]:
        """Return in how many trials there is one without a stimulus, and one at the easiest level; None for none."""
        kinds = (None, None) if self.catch is None else (self.catch.absent, self.catch.easy)
        absent, easy = (None if kind is None else kind.every for kind in kinds)
        return absent, easy

    def target(self, place: int, absent: bool) -> str:
        """Return what is right: the number of an interval, signal or noise, same or different."""
        if self.design == "yes_no":
            return "noise" if absent else "signal"
        if self.design == "same_different":
            return "same" if absent else "different"
        return str(place)

    def is_hit(self, chosen: str, target: str) -> bool:
        """Return whether the answer names the interval of the stimulus, or whether there is one, or a difference."""
        return {"yes": "signal", "no": "noise"}.get(chosen, chosen) == target


def intervals_from(value: Any) -> Intervals:
    """Return the intervals in a study file. Raises ValueError."""
    return Intervals.model_validate(value)


@dataclass(frozen=True)
class IntervalsForm(Fields):
    """The questions after the intervals, one of them which interval it was; the settings of its trial beside them."""

    name: str = "intervals"
    intervals: Intervals = field(default_factory=Intervals)
    feedback: Feedback | None = None
    goal: PracticeGoal | None = None

    @property
    def choice(self) -> Choice:
        """Return the question which interval it was. Raises TaskError where there is none."""
        for question in self.questions:
            if isinstance(question, Choice) and question.of is not None:
                return question
        raise TaskError("no question is about the intervals")


def choose_present_ask(trial: Trial) -> Steps:
    """Choose the level, present the intervals, ask, and show whether the answer was right.

    After the last trial of a track its procedure is asked once more, for its estimate.
    """
    form, track = trial.form, trial.track
    if not isinstance(form, IntervalsForm) or track is None:
        raise TaskError(f"trial {trial.number}: no intervals to present")
    if trial.practice and form.goal is not None and _is_met(form.goal, trial):
        return Stopped()
    index = trial.index
    if index is None and trial.catch == NO_CATCH:
        reply = yield Choose(trial)
        if "stop" in reply.value:
            return Stopped()
        index = reply.value["index"]
    place, parts = _parts(form, track, trial, index)
    for stimulus, part in parts:
        yield Present(replace(trial, stimulus=stimulus), part=part)
    context = _context(form, track, trial, index, place)
    reply = yield Ask(replace(form, context=context), trial)
    answers = reply.value["answers"]
    hit = form.intervals.is_hit(answers[form.choice.name], context["target"])
    correct = _is_correct(hit, context)
    if correct is not None and form.feedback is not None and (trial.practice or form.feedback.after == "all"):
        yield Show(RIGHT if correct else WRONG, form.feedback.seconds, trial)
    if index is None or trial.catch != NO_CATCH:
        return Answered(answers)
    if trial.practice:
        return Answered(answers, (index, hit if correct is None else correct))
    past = (*trial.past, (index, hit))
    if len(past) >= track.trials:
        yield Choose(replace(trial, past=past))
    return Answered(answers, past[-1])


def _context(form: IntervalsForm, track: Track, trial: Trial, index: int | None, place: int) -> dict[str, Any]:
    """Return what a trial is about, for the ledger.

    `correct_if` is there where a comparison may be less than its standard: choosing it is then a miss.
    """
    felt = trial.stimulus if index is None else track.stimulus_at(index)
    context: dict[str, Any] = {"track": track.name, "stimulus": felt.id, "procedure": track.procedure.kind}
    if index is not None:
        context |= {"index": index, "level": track.levels[index]}
    if track.standard_level is not None:
        context["standard"] = track.standard_level
    context["target"] = form.intervals.target(place, trial.catch == ABSENT)
    if trial.catch != NO_CATCH:
        context["catch"] = trial.catch
    if form.intervals.design == "forced_choice" and track.standard_level is not None and index is not None:
        more = (_first(track.levels[index]) or 0.0) - track.standard_level
        more = -more if track.procedure.easier == "lower" else more
        context["correct_if"] = "hit" if more > 0 else "miss" if more < 0 else "neither"
    return context


def _is_correct(hit: bool, context: Mapping[str, Any]) -> bool | None:
    """Return whether the answer is correct; None where the comparison equals its standard."""
    correct_if = context.get("correct_if", "hit")
    return None if correct_if == "neither" else hit == (correct_if == "hit")


def _first(level: Any) -> float | None:
    first: float | None = level[0] if isinstance(level, tuple | list) else level
    return first


def _is_met(goal: PracticeGoal, trial: Trial) -> bool:
    return len(trial.past) >= goal.of and sum(hit for _, hit in trial.past[-goal.of :]) >= goal.correct


def _parts(
    form: IntervalsForm, track: Track, trial: Trial, index: int | None
) -> tuple[int, list[tuple[Stimulus, Part]]]:
    """Return the interval that has the stimulus, and each interval with what is presented in it.

    Where it is, is drawn for every attempt: a participant who has felt the first interval must not know the answer.
    """
    design, standard = form.intervals, track.standard
    place = 1 + math.floor(design.of * uniform("target", *track.chance, trial.number, trial.attempt))
    target = trial.stimulus if index is None else track.stimulus_at(index)
    level = None if index is None else track.levels[index]
    timing = {"seconds": design.seconds, "gap_s": design.gap_s}
    if design.at_once:
        other, absent = "" if standard is None else standard.id, trial.catch == ABSENT
        sides = tuple(target.id if n == place and not absent else other for n in range(1, design.of + 1))
        shown = standard if absent and standard is not None else target
        return place, [(shown, Part(place, design.of, level, sides=sides, seconds=design.seconds))]
    parts = []
    for n in range(1, design.of + 1):
        if n == place and trial.catch != ABSENT:
            parts.append((target, Part(n, design.of, level, **timing)))  # type: ignore[arg-type]
        elif standard is not None:
            parts.append((standard, Part(n, design.of, track.standard_level, **timing)))  # type: ignore[arg-type]
        else:
            parts.append((target, Part(n, design.of, blank=True, **timing)))  # type: ignore[arg-type]
    return place, parts


def simulated(person: Any, ask: Ask, form: IntervalsForm) -> tuple[Reply, float]:
    """Choose by the study's psychometric function of observers, and answer the other questions by chance."""
    trial, context = ask.trial, form.context
    if trial is None or trial.track is None:
        raise ValueError("a choice among intervals needs a trial of a track")
    right = uniform(*person.moment("choice", ask, "")) < _share_right(person, trial, form, context)
    options, target = form.choice.options, context["target"]
    if right:
        chosen = next(option for option in options if form.intervals.is_hit(option, target))
    else:
        wrong = [option for option in options if not form.intervals.is_hit(option, target)]
        chosen = wrong[math.floor(len(wrong) * uniform(*person.moment("wrong", ask, "")))]
    answers: dict[str, Any] = {}
    for question in form.questions:
        share = uniform(*person.moment("field", ask, question.name))
        if question is form.choice:
            answers[question.name] = chosen
        elif isinstance(question, Confidence):
            answers[question.name] = question.simulated(0.5 + 0.5 * share if right else 0.7 * share)
        else:
            answers[question.name] = question.simulated(share)
    return answered(person, ask, answers)


def _share_right(person: Any, trial: Trial, form: IntervalsForm, context: Mapping[str, Any]) -> float:
    observer = person.simulation.observer or Observer(threshold=0.0, guess=1 / len(form.choice.options))
    if trial.catch == ABSENT:
        return 1.0 - float(observer.yes)
    first, name = float(_first(context["level"]) or 0.0), trial.stimulus.id
    threshold = observer.threshold_of(context["track"], name)
    threshold += observer.threshold_sd * normal(*person.trait("threshold", name))
    falling = trial.track is not None and trial.track.procedure.easier == "lower"
    felt = threshold - first if falling else first - threshold
    match observer.shape:
        case "logistic":
            share = 1 / (1 + math.exp(-min(700.0, max(-700.0, observer.slope * felt))))
        case "gaussian":
            share = 0.5 * (1 + math.erf(observer.slope * felt / math.sqrt(2)))
        case _ if observer.scale == "linear":
            share = 1 - math.exp(-((max(0.0, first) / threshold) ** observer.slope)) if threshold > 0 else 1.0
        case _:
            share = 1 - math.exp(-(10 ** min(300.0, observer.slope * felt / (20 if observer.scale == "db" else 1))))
    return float(observer.guess + (1 - observer.guess - observer.lapse) * share)


def _rows(
    form: IntervalsForm, answers: Mapping[str, Any], reply: Mapping[str, Any], request: Mapping[str, Any]
) -> Iterator[dict[str, Any]]:
    context, chosen = request["context"], answers[form.choice.name]
    target, level, standard = context["target"], context.get("level"), context.get("standard")
    levels = level if isinstance(level, list) else [level, None]
    sure = next((answers[question.name] for question in form.questions if isinstance(question, Confidence)), None)
    right = form.intervals.is_hit(chosen, target)
    yield {
        "track": context["track"],
        "stimulus": context["stimulus"],
        "procedure": context["procedure"],
        "design": form.intervals.design,
        "alternatives": len(form.choice.options),
        "level": levels[0],
        "level_2": levels[1],
        "standard": standard,
        "target": target,
        "chosen": chosen,
        "correct": _is_correct(right, context),
        "hit": {"yes": True, "no": False, "different": True, "same": False}.get(chosen, right),
        "catch": context.get("catch", NO_CATCH),
        "confidence": None if sure is None else float(sure),
        "rt_s": reply.get("at_s", {}).get(form.choice.name, reply.get("seconds")),
    }


def _form(study: Study, _who: ParticipantRow, _seed: int, _session: int) -> IntervalsForm | None:
    if study.intervals is None:
        return None
    intervals: Intervals = study.intervals
    asked: tuple[QuestionSpec, ...] = study.ask or (Choice(kind="choice", name="chosen", of="intervals"),)
    questions = tuple(
        question.model_copy(update={"options": intervals.answers}) if _is_about(question) else question
        for question in asked
    )
    goal = study.practice.until if study.practice is not None else None
    return IntervalsForm(questions, intervals=intervals, feedback=study.feedback, goal=goal)


def _is_about(question: QuestionSpec) -> bool:
    return isinstance(question, Choice) and question.of is not None


def _problems(study: Study) -> Iterator[Problem]:
    """Yield problems between intervals, questions, procedures and the stimulus table."""
    if study.intervals is None or not study.procedure:
        return
    about = [question for question in study.ask if _is_about(question)]
    if study.ask and len(about) != 1:
        yield Problem(("ask",), f"one question of: intervals is expected, found {len(about)}")
    if any(question.optional for question in about):
        yield Problem(("ask",), "the question of: intervals cannot be optional")
    if study.order.repeats != 1:
        yield Problem(("order", "repeats"), "how often a level is presented is a matter of the procedure; leave it out")
    rows = [procedure.grids[0].of is not None for procedure in study.procedure]
    if any(rows) != all(rows):
        yield Problem(("procedure",), "of: stimuli is expected for all procedures or for none")
    problems = [*_standard(study, any(rows)), *_names(study)]
    for n, procedure in enumerate(study.procedure):
        path = ("procedure", n) if len(study.procedure) > 1 else ("procedure",)
        problems += _levels(study, procedure, path)
    problems += _devices(study)
    yield from problems
    if not problems:
        yield from _coverage(study)


def _standard(study: Study, rows: bool) -> Iterator[Problem]:
    standard, ids = study.intervals.standard, [stimulus.id for stimulus in study.stimuli]
    path: Path = ("intervals", "standard")
    if standard is not None and str(standard) not in ids and not isinstance(standard, int | float):
        yield Problem(path, f"found {standard!r}, expected a stimulus id or a level; {nearest(str(standard), ids)}")
    if rows and (standard is None or str(standard) not in ids):
        yield Problem(path, "of: stimuli needs a standard: the id of one stimulus of the table")
    two = any(len(procedure.grids) > 1 for procedure in study.procedure)
    if two and standard is not None and str(standard) not in ids:
        yield Problem(path, "a level as a standard has one dimension, and the procedure has two; name a stimulus")


def _names(study: Study) -> Iterator[Problem]:
    """Yield problems of names that are used and not there, or that mean something else."""
    ids = [stimulus.id for stimulus in study.stimuli]
    by = study.order.blocks.by if study.order.blocks is not None else None
    blocks = sorted({stimulus.columns.get(by, "") for stimulus in study.stimuli}) if by is not None else []
    if PRACTICE in ids or PRACTICE in blocks:
        yield Problem(("stimuli",), f"{PRACTICE!r} is the name of the practice trials; choose another one")
    standard = study.intervals.standard
    for n, name in enumerate(study.practice.stimuli if study.practice is not None else ()):
        if standard is not None and name == str(standard):
            yield Problem(
                ("practice", "stimuli", n), f"{name!r} is the standard, which is in no track; name another one"
            )
    observer = study.simulation.observer if study.simulation is not None else None
    if observer is not None and isinstance(observer.threshold, dict):
        named = [procedure.name for procedure in study.procedure]
        tracks = [
            *ids,
            *(f"{name} {procedure}" for name in [*ids, *blocks, "main"] for procedure in named),
            *blocks,
            "main",
        ]
        for name in observer.threshold:
            if name not in tracks:
                path: Path = ("simulation", "observer", "threshold", name)
                yield Problem(path, f"found {name!r}, expected a stimulus or a track; {nearest(name, ids)}")


def _devices(study: Study) -> Iterator[Problem]:
    """Yield problems between intervals, levels and the need that presents them."""
    needs = [NEEDS[need] for need in study.needs]
    presenting = next((need for need in needs if need.role == "presents" and not need.makes), None)
    if presenting is None:
        return
    intervals: Intervals = study.intervals
    if not presenting.parameters:
        yield Problem(("needs",), "task intervals is presented by vibration, or by samples that are placed by hand")
        return
    if intervals.at_once:
        yield Problem(("intervals", "at_once"), "one device presents the stimuli: it cannot present two at once")
    if intervals.standard is None and intervals.seconds is None and intervals.design != "oddity":
        yield Problem(("intervals",), "seconds: N is expected: how long is an interval that is blank?")
    for procedure in study.procedure:
        for grid in procedure.grids:
            if grid.of is None and grid.column not in presenting.parameters:
                known = nearest(grid.column, sorted(presenting.parameters))
                yield Problem(
                    ("procedure",), f"level: the column {grid.column!r} changes nothing that is presented; {known}"
                )


def _levels(study: Study, procedure: Any, path: Path) -> Iterator[Problem]:
    """Yield problems between a procedure and the stimulus table."""
    ids = [stimulus.id for stimulus in study.stimuli]
    for name in procedure.stimuli or ():
        if name not in ids:
            yield Problem(path, f"stimuli: found {name!r}, expected a stimulus id; {nearest(name, ids)}")
    grid = procedure.grids[0]
    if grid.of is None:
        return
    values = [stimulus.columns.get(grid.column, "") for stimulus in study.stimuli]
    if bad := [n for n, value in enumerate(values) if not is_number(value)]:
        found = f"stimulus {ids[bad[0]]!r} has {values[bad[0]]!r} in {grid.column!r}"
        yield Problem(path, f"{found}, not a finite number")
        return
    if procedure.kind == "questplus" and procedure.needs_positive_levels and min(map(float, values)) <= 0:
        yield Problem(path, "a Weibull function on a linear scale needs levels above 0; or say scale: db")


def _coverage(study: Study) -> Iterator[Problem]:
    """Yield problems of groups and blocks without a track, and of starts and levels within each of them."""
    by = study.order.blocks.by if study.order.blocks is not None else None
    if by is not None and any(by not in stimulus.columns for stimulus in study.stimuli):
        return
    covered: set[str] = set()
    for group in study.groups or (None,):
        stimuli = study.stimuli_of(group)
        for block in sorted({"main" if by is None else stimulus.columns[by] for stimulus in stimuli}):
            members = [s for s in stimuli if by is None or s.columns[by] == block]
            where = f" of block {block}" if by is not None else f" of group {group}" if group is not None else ""
            tracks = tracks_in(study, block, members, ())
            covered |= {stimulus.id for track in tracks for stimulus in track.stimuli}
            if not tracks:
                yield Problem(("procedure",), f"no procedure is for the stimuli{where}")
            for track in tracks:
                if len(track.levels) < 2:
                    yield Problem(("procedure",), f"track {track.name!r} has fewer than two levels")
                if len(set(track.levels)) < len(track.levels):
                    yield Problem(("procedure",), f"track {track.name!r}: two stimuli have one level")
                start = getattr(track.procedure, "start", None)
                if start is not None and float(start) not in track.levels:
                    yield Problem(("procedure",), f"start ({start}) is not a level of track {track.name!r}")
    standard = study.intervals.standard
    for stimulus in study.stimuli:
        if stimulus.id not in covered and (standard is None or stimulus.id != str(standard)):
            yield Problem(("procedure",), f"no procedure is for the stimulus {stimulus.id!r}, which is never presented")


TASK = Task(
    "Stimuli are presented in intervals, at levels that a procedure chooses, and one interval is chosen.",
    choose_present_ask, keys=("intervals", "procedure", "ask", "feedback"), required=("intervals", "procedure"),
    form=_form, answers="choices", forward_only=True, check=_problems,
    summary=lambda study: f"{DESIGNS[study.intervals.design]} by {', '.join(p.kind for p in study.procedure)}",
)  # fmt: skip
FORM = FormKind(
    "choosing an interval",
    simulated,
    table=OwnTable(
        "choices",
        "One row for each choice among intervals.",
        (
            OwnColumn("track", "The track: its stimulus, or its block where levels are stimuli."),
            OwnColumn("stimulus", "The stimulus, as in the table of stimuli."),
            OwnColumn("procedure", "The procedure that chose the level: constant, limits, staircase or questplus."),
            OwnColumn("design", "The design: forced_choice, yes_no, same_different or oddity."),
            OwnColumn("alternatives", "How many answers there were to choose from.", "whole"),
            OwnColumn("level", "The level presented, in the unit of its column; empty without a stimulus.", "number"),
            OwnColumn("level_2", "The level in the second dimension, if there is one.", "number"),
            OwnColumn("standard", "The level of the standard, if it is known.", "number"),
            OwnColumn("target", "The interval of the stimulus; signal or noise; same or different."),
            OwnColumn("chosen", "The answer."),
            OwnColumn("correct", "Whether the answer is correct; empty where level and standard are equal.", "truth"),
            OwnColumn("hit", "Whether the interval of the stimulus was chosen, or yes, or different.", "truth"),
            OwnColumn("catch", "Catch trials: absent or easy; else none."),
            OwnColumn("confidence", "How sure the participant was.", "number"),
            OwnColumn("rt_s", "When the choice was made, from the form's appearance.", "number", "s"),
        ),
        _rows,
    ),
    also=FIELDS_TABLE,
    any_answers=True,
)
