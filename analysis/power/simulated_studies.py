"""The material of simulated sessions that are run in memory for their answers only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from palpate.analysis.ratings.reading import CollectedRows, Material, Rating, assembled, material_of
from palpate.analysis.ratings.session_choice import Choice, SessionRow
from palpate.protocols.canonical import digest
from palpate.protocols.events import Event, Present, Reply, Request
from palpate.protocols.forms import own_tables
from palpate.protocols.plan import Plan, compile_plan
from palpate.protocols.runner import run
from palpate.protocols.simulated_participants import simulated_participant
from palpate.protocols.simulated_world import Done, Simulated, VirtualClock
from palpate.protocols.study import Study
from palpate.protocols.tasks import gives_ratings
from palpate.studies.participants.lab_forms import lab_forms
from palpate.studies.participants.row_assignment import allocate
from palpate.studies.procedures.advised import advised
from palpate.studies.sessions.tables import Answers, answers_of, session_name

INTERCEPT = "intercept"
IN_MEMORY = "kept in memory only"


@dataclass
class _Events:
    """A log in memory."""

    events: list[Event] = field(default_factory=list)

    def append(self, event: Event) -> None:
        self.events.append(event)


def with_effect(study: Study, effect: float) -> Study:
    """Return the study whose simulated people feel every difference between stimuli `effect` times as strongly.

    At 0 they feel none, so a test then detects something only by chance. Intercepts, noise and differences between
    people are unchanged. Of thresholds the differences between tracks are multiplied, around their mean.
    """
    if study.simulation is None:
        return study
    observer = study.simulation.observer
    if observer is not None and isinstance(observer.threshold, dict):
        mean = sum(observer.threshold.values()) / len(observer.threshold)
        thresholds = {name: mean + effect * (value - mean) for name, value in observer.threshold.items()}
        own = observer.model_copy(update={"threshold": thresholds})
        return study.model_copy(update={"simulation": study.simulation.model_copy(update={"observer": own})})
    latents = {
        item: {column: weight if column == INTERCEPT else weight * effect for column, weight in weights.items()}
        for item, weights in study.simulation.latents.items()
    }
    return study.model_copy(update={"simulation": study.simulation.model_copy(update={"latents": latents})})


def people(count: int) -> list[str]:
    """Return pseudonyms P001, P002, ...: rows of the counterbalancing square follow from them as in a real study."""
    return [person(number) for number in range(1, count + 1)]


def person(number: int) -> str:
    """Return the pseudonym of a person by number, as P001."""
    return f"P{number:03d}"


def simulated_material(study: Study, lab: Path, participants: Sequence[str], seed: int) -> Material:
    """Run every session of each participant through the real runner and return the answers."""
    forms = lab_forms(study, lab, live=False)
    sessions = range(1, study.sessions + 1)
    plans = [compile_plan(study, allocate(study, who), seed, forms, n) for who in participants for n in sessions]
    answered: list[tuple[Plan, Answers]] = []
    for plan in plans:
        log = _Events()
        world = Simulated(simulated_participant(plan), _presented, VirtualClock())
        run(plan, advised(plan, world), log, {})
        answered.append((plan, answers_of(plan, _session(plan), log.events)))
    sessions_run = [
        SessionRow(
            session=_session(plan),
            study_digest=digest(plan.study.conditions()),
            participant=plan.who.participant,
            group_name=plan.who.group,
            seed=plan.seed,
            simulated=True,
            status="complete",
            trials_planned=len(plan.trials),
            trials_answered=sum(row["status"] in ("answered", "captured") for row in answers.trials),
            head_hash="",
            file=IN_MEMORY,
            file_sha256="",
            number=plan.session,
        )
        for plan, answers in answered
    ]
    choice = Choice(digest(study.conditions()), tuple(sessions_run), ())
    rows = CollectedRows(
        trials=[_with_person(plan, row) for plan, answers in answered for row in answers.trials],
        words=[_with_person(plan, row) for plan, answers in answered for row in answers.words],
        answers=[_with_person(plan, row) for plan, answers in answered for row in answers.answers],
        own={
            name: [_with_person(plan, row) for plan, answers in answered for row in answers.own[name]]
            for name in own_tables()
            if any(answers.own[name] for _, answers in answered)
        },
    )
    ratings = [rating for plan, answers in answered for rating in _ratings(plan, answers)]
    return material_of(study, choice, assembled(study, choice, ratings) if gives_ratings(study) else None, rows)


def _session(plan: Plan) -> str:
    return session_name(plan.study.study, plan.who.participant, plan.session)


def _presented(request: Request, _t_ns: int) -> Done:
    """Present the stimulus at once: what simulated people feel is in the study, not in a device."""
    if not isinstance(request, Present):
        raise NoAnswers(f"the study records ({request.body()['do']}); only what people answer has a power")
    return Done(Reply({}), 0.0)


class NoAnswers(ValueError):
    """The study's task gives no answers, so it has no tests."""


def _with_person(plan: Plan, row: dict[str, object]) -> dict[str, object]:
    return {"participant": plan.who.participant, "group": plan.who.group or "", **row}


def _ratings(plan: Plan, answers: Answers) -> list[Rating]:
    trials = {row["trial"]: row for row in answers.trials}
    return [
        Rating(
            session=row["session"],
            participant=plan.who.participant,
            group_name=plan.who.group,
            trial=row["trial"],
            block=trials[row["trial"]]["block"],
            practice=trials[row["trial"]]["practice"],
            stimulus=trials[row["trial"]]["stimulus"],
            attribute=row["attribute"],
            value=row["value"],
            response_time_s=row["response_time_s"],
            revised=row["revised"],
        )
        for row in answers.responses
        if row["counts"]
    ]
