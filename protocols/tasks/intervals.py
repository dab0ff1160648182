"""The task that presents stimuli in intervals and asks for a choice: a level that a procedure chooses, or a pair.

2AFC, 2IFC, nAFC, yes/no, same/different and odd-one-out are its designs.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from palpate.protocols.events import Ask, Choose, Part, Present, Reply, Request, Show
from palpate.protocols.fields import Choice, Confidence, Fields, QuestionSpec, answered
from palpate.protocols.forms import FIELDS_TABLE, FormKind, OwnColumn, OwnTable
from palpate.protocols.intervals import EQUAL, Intervals
from palpate.protocols.keyed import Key, normal, uniform
from palpate.protocols.pairs import PAIRS
from palpate.protocols.study import Feedback, Observer, PracticeGoal, Stimulus, Study
from palpate.protocols.tasks.intervals_checks import notes, problems
from palpate.protocols.tasks.steps import Answered, Steps, Stopped, Task, TaskError
from palpate.protocols.tracks import ABSENT, NO_CATCH, Track
from palpate.protocols.trial import ParticipantRow, Trial

RIGHT, WRONG = "right_answer", "wrong_answer"
"""The keys of the pages of feedback in the screens' texts."""
DESIGNS = {
    "forced_choice": "forced choice", "yes_no": "yes/no", "same_different": "same/different", "oddity": "odd one out",
}  # fmt: skip


@dataclass(frozen=True)
class IntervalsForm(Fields):
    """The questions after the intervals, one of them which interval it was; the settings of its trial beside them.

    `chance` is the key of random draws for pairs in this session.
    """

    name: str = "intervals"
    intervals: Intervals = field(default_factory=Intervals)
    feedback: Feedback | None = None
    goal: PracticeGoal | None = None
    chance: tuple[Key, ...] = ()

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
    if not isinstance(form, IntervalsForm):
        raise TaskError(f"trial {trial.number}: no intervals to present")
    if track is None:
        return (yield from present_pair_ask(trial, form))
    if trial.practice and form.goal is not None and _is_met(form.goal, trial):
        return Stopped()
    index = trial.index
    if index is None and trial.catch == NO_CATCH:
        reply = yield Choose(trial)
        if "stop" in reply.value:
            return Stopped()
        index = reply.value["index"]
    place, parts = _parts(form, track, trial, index)
    context = _context(form, track, trial, index, place)
    answers, hit, correct = yield from _present_and_ask(trial, form, parts, context)
    if index is None or trial.catch != NO_CATCH:
        return Answered(answers)
    if trial.practice:
        return Answered(answers, (index, hit if correct is None else correct))
    past = (*trial.past, (index, hit))
    if len(past) >= track.trials:
        yield Choose(replace(trial, past=past))
    return Answered(answers, past[-1])


def present_pair_ask(trial: Trial, form: IntervalsForm) -> Steps:
    """Present the two stimuli of a pair, the first of them first, and ask; of oddity the first is the one that differs.

    Where it is then, is drawn for every attempt.
    """
    first, second = trial.stimuli
    design = form.intervals
    context: dict[str, Any] = {
        "track": trial.block, "stimulus": first.id, "other": second.id, "procedure": PAIRS,
    }  # fmt: skip
    place, felt = 1, trial.stimuli
    if design.design == "oddity":
        place = 1 + math.floor(design.of * uniform("target", *form.chance, trial.number, trial.attempt))
        felt = tuple(first if n == place else second for n in range(1, design.of + 1))
    if design.design != "forced_choice":
        context["target"] = design.target(place, absent=first.id == second.id)
    parts = [
        (stimulus, Part(n, design.of, seconds=design.seconds, gap_s=design.gap_s)) for n, stimulus in enumerate(felt, 1)
    ]
    if design.at_once:
        parts = [(first, Part(place, design.of, sides=tuple(s.id for s in felt), seconds=design.seconds))]
    answers, _, _ = yield from _present_and_ask(trial, form, parts, context)
    return Answered(answers)


def _present_and_ask(
    trial: Trial, form: IntervalsForm, parts: Sequence[tuple[Stimulus, Part]], context: Mapping[str, Any]
) -> Generator[Request, Reply, tuple[Mapping[str, Any], bool, bool | None]]:
    """Present the intervals, ask, and show whether the answer was right; return answers, hit and correctness."""
    for stimulus, part in parts:
        yield Present(replace(trial, stimulus=stimulus), part=part)
    reply = yield Ask(replace(form, context=context), trial)
    answers = reply.value["answers"]
    hit = form.intervals.is_hit(answers[form.choice.name], context.get("target", ""))
    correct = _is_correct(hit, context)
    if correct is not None and form.feedback is not None and (trial.practice or form.feedback.after == "all"):
        yield Show(RIGHT if correct else WRONG, form.feedback.seconds, trial)
    return answers, hit, correct


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
    """Return whether the answer is correct; None where the comparison equals its standard, or nothing is right."""
    correct_if = context.get("correct_if", "hit" if "target" in context else "neither")
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
    """Choose by the study's psychometric function of observers, or between the percepts of a pair; answer the other
    questions by chance.
    """
    trial = ask.trial
    if trial is None:
        raise ValueError("a choice among intervals needs a trial")
    chosen, right = (_chosen_of_pair if trial.track is None else _chosen_in_track)(person, ask, trial, form)
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


def _chosen_in_track(person: Any, ask: Ask, trial: Trial, form: IntervalsForm) -> tuple[str, bool]:
    """Return the answer, and whether it is right."""
    options, target = form.choice.options, form.context["target"]
    right = uniform(*person.moment("choice", ask, "")) < _share_right(person, trial, form, form.context)
    among = [option for option in options if form.intervals.is_hit(option, target) == right]
    return among[0 if right else math.floor(len(among) * uniform(*person.moment("wrong", ask, "")))], right


def _chosen_of_pair(person: Any, ask: Ask, trial: Trial, form: IntervalsForm) -> tuple[str, bool]:
    """Return the answer, and whether what was felt made it clear.

    The greater percept is chosen, the one furthest from the others is odd, two are the same unless they are more than
    two SD of the noise apart, and equal, where that is an answer, if they are less than half an SD apart. The percepts
    are `latents` by the name of the question; without them it is chance.
    """
    name, options = form.choice.name, form.choice.options
    share = uniform(*person.moment("choice", ask, name))
    if name not in person.simulation.latents or share < person.simulation.lapse_rate:
        return options[math.floor(len(options) * uniform(*person.moment("wrong", ask, name)))], False
    first, second = trial.stimuli
    several: tuple[Stimulus, ...] = (first, second)
    if form.intervals.design == "oddity":
        several = tuple(first if option == form.context["target"] else second for option in options)
    noise = person.simulation.noise_sd
    felt = [
        person.latent(name, stimulus) + noise * normal(*person.moment("noise", ask, f"{name} {n}"))
        for n, stimulus in enumerate(several, start=1)
    ]
    clear = max(felt) - min(felt) > 2 * noise
    match form.intervals.design:
        case "same_different":
            return ("different" if clear else "same"), clear
        case "oddity":
            middle = sorted(felt)[len(felt) // 2]
            return options[max(range(len(felt)), key=lambda n: abs(felt[n] - middle))], clear
        case _ if form.intervals.equal and max(felt) - min(felt) < 0.5 * noise:
            return EQUAL, False
        case _:
            return options[felt.index(max(felt))], clear


def _share_right(person: Any, trial: Trial, form: IntervalsForm, context: Mapping[str, Any]) -> float:
    observer = person.simulation.observer or Observer(threshold=0.0, guess=1 / len(form.choice.options))
    if trial.catch == ABSENT:
        return 1.0 - float(observer.yes)
    first, name = _felt(person, trial, context), trial.stimulus.id
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


def _felt(person: Any, trial: Trial, context: Mapping[str, Any]) -> float:
    """Return the level that is felt: what the device gives of the one that was chosen, if a simulated one says so."""
    feels, track, index = getattr(person, "feels", None), trial.track, context.get("index")
    if feels is not None and track is not None and index is not None:
        column = track.procedure.grids[0].column
        if column in (felt := feels(track.stimulus_at(index))):
            return float(felt[column])
    return float(_first(context["level"]) or 0.0)


def _rows(
    form: IntervalsForm, answers: Mapping[str, Any], reply: Mapping[str, Any], request: Mapping[str, Any]
) -> Iterator[dict[str, Any]]:
    context, chosen = request["context"], answers[form.choice.name]
    target, level, standard = context.get("target"), context.get("level"), context.get("standard")
    levels = level if isinstance(level, list) else [level, None]
    sure = next((answers[question.name] for question in form.questions if isinstance(question, Confidence)), None)
    right = None if target is None else form.intervals.is_hit(chosen, target)
    yield {
        "track": context["track"],
        "stimulus": context["stimulus"],
        "other": context.get("other"),
        "procedure": context["procedure"],
        "design": form.intervals.design,
        "alternatives": len(form.choice.options),
        "level": levels[0],
        "level_2": levels[1],
        "standard": standard,
        "target": target,
        "chosen": chosen,
        "correct": None if right is None else _is_correct(right, context),
        "hit": {"yes": True, "no": False, "different": True, "same": False}.get(chosen, right),
        "catch": context.get("catch", NO_CATCH),
        "confidence": None if sure is None else float(sure),
        "rt_s": reply.get("at_s", {}).get(form.choice.name, reply.get("seconds")),
    }


def _form(study: Study, who: ParticipantRow, seed: int, session: int) -> IntervalsForm | None:
    if study.intervals is None:
        return None
    intervals: Intervals = study.intervals
    asked: tuple[QuestionSpec, ...] = study.ask or (Choice(kind="choice", name="chosen", of="intervals"),)
    questions = tuple(
        question.model_copy(update={"options": intervals.answers}) if question.is_about_intervals else question
        for question in asked
    )
    goal = study.practice.until if study.practice is not None else None
    chance = ("pairs", study.study, seed, who.participant, session)
    return IntervalsForm(questions, intervals=intervals, feedback=study.feedback, goal=goal, chance=chance)


def _which_are_presented(study: Study) -> str:
    return f"by {', '.join(p.kind for p in study.procedure)}" if study.procedure else "in pairs"


TASK = Task(
    "Stimuli are presented in intervals, at levels that a procedure chooses or in pairs, and one interval is chosen.",
    choose_present_ask, keys=("intervals", "procedure", "pairs", "ask", "feedback"), required=("intervals",),
    form=_form, answers="choices", forward_only=True, check=problems, notes=notes,
    summary=lambda study: f"{DESIGNS[study.intervals.design]} {_which_are_presented(study)}",
)  # fmt: skip
FORM = FormKind(
    "choosing an interval",
    simulated,
    table=OwnTable(
        "choices",
        "One row for each choice among intervals.",
        (
            OwnColumn("track", "The track: its stimulus, or its block where levels are stimuli, or in pairs."),
            OwnColumn("stimulus", "The stimulus, as in the table of stimuli; of a pair the first, or the odd one."),
            OwnColumn("other", "The other stimulus of a pair."),
            OwnColumn("procedure", "What chose the level: constant, limits, staircase, questplus; or pairs."),
            OwnColumn("design", "The design: forced_choice, yes_no, same_different or oddity."),
            OwnColumn("alternatives", "How many answers there were to choose from.", "whole"),
            OwnColumn("level", "The level presented, in the unit of its column; empty without a stimulus.", "number"),
            OwnColumn("level_2", "The level in the second dimension, if there is one.", "number"),
            OwnColumn("standard", "The level of the standard, if it is known.", "number"),
            OwnColumn("target", "The interval of the stimulus; signal or noise; same or different; empty: none is."),
            OwnColumn("chosen", "The answer: the number of an interval, yes or no, same or different, or equal."),
            OwnColumn("correct", "Whether the answer is correct; empty where none is.", "truth"),
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
