"""The contracts of tasks, forms, procedures, needs and simulated participants: what each does in a simulated session.

Each is tried in sessions of studies that name the part: those of the lab, and those that the extension brings.
"""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Generic, TypeVar, get_args

from palpate.protocols.contract import Demand, NotKept, Verdict, demand, verdicts
from palpate.protocols.events import Ask, Event, Request, Rest, World, WorldEvent
from palpate.protocols.extensions import is_own
from palpate.protocols.forms import FormKind, OwnColumn, OwnTable, own_tables_of
from palpate.protocols.needs import NEEDS, Need
from palpate.protocols.plan import Plan, compile_plan
from palpate.protocols.runner import Recorded, run
from palpate.protocols.simulated_participants import ParticipantKind, SimulatedParticipant
from palpate.protocols.tasks.steps import Task
from palpate.protocols.tracks import Past, Track
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import StudyFiles
from palpate.studies.participants.lab_forms import lab_forms
from palpate.studies.participants.row_assignment import allocate
from palpate.studies.procedures.advised import PATIENCE_S
from palpate.studies.procedures.adviser import End, ProcedureKind
from palpate.studies.sessions.session import start
from palpate.studies.sessions.tables import answers_of
from palpate.studies.simulation.rig import simulated

T = TypeVar("T")
MOST_CUTS, AHEAD = 100, 20
"""A session is cut after at most so many of its events, evenly spread, and goes on for so many requests."""
RANDOM_RUNS, SAMPLED = 3, 8
"""A procedure is run with so many observers who answer at random, and asked again at so many places of each run."""
LANGUAGES = ("en", "ko")
SCREENS = ((1280, 720, 4.0), (3840, 2160, 7.0))
"""Width and height in pixels, and pixels per mm: the smallest screen that is supported, and a 4K screen."""


@dataclass
class _Log:
    """A log in memory."""

    events: list[Event]

    def append(self, event: Event) -> None:
        """Add the event."""
        self.events.append(event)


class _Enough(Exception):
    """A session went on for as long as it is looked at."""


@dataclass
class _Watched:
    """A world that demands that every request is one that sessions, twins and the console know."""

    world: World
    most: int | None = None
    requests: list[Request] = field(default_factory=list)

    def now(self) -> int:
        """Return the time of the world."""
        return self.world.now()

    def perform(self, request: Request) -> WorldEvent:
        """Perform the request. Raises _Enough after the most that are wanted."""
        if len(self.requests) == self.most:
            raise _Enough
        known = isinstance(request, get_args(Request))
        demand(known, f"it yields {type(request).__name__}; one of {', '.join(k.__name__ for k in get_args(Request))}")
        self.requests.append(request)
        return self.world.perform(request)


@dataclass(frozen=True)
class Session:
    """A simulated session of a study in memory."""

    files: StudyFiles
    lab: Path

    @cached_property
    def plan(self) -> Plan:
        """Return the plan of the first participant."""
        study = self.files.study
        who = ParticipantRow("P001", next(iter(sorted(study.groups)), None))
        return compile_plan(study, who, 1, lab_forms(study, self.lab, live=False))

    @cached_property
    def whole(self) -> tuple[list[Event], list[Request]]:
        """Return the events of the whole session, and its requests."""
        return self.ran([])

    def ran(self, events: Sequence[Event], most: int | None = None) -> tuple[list[Event], list[Request]]:
        """Return the events of a session that goes on after these, for `most` requests, and these requests."""
        rig = simulated(self.files.study, self.files.folder, self.lab)
        rig.check(self.plan)
        opened = rig.open(self.plan, events[-1].t_ns if events else 0)
        try:
            log, world = _Log(list(events)), _Watched(opened.world, most)
            tape = Recorded(events, world, log)
            with suppress(_Enough):
                run(self.plan, tape, tape, {})
                tape.demand_end()
        finally:
            opened.safe()
        return log.events, world.requests

    @property
    def asks(self) -> list[Ask]:
        """Return what the participant was asked."""
        return [request for request in self.whole[1] if isinstance(request, Ask)]


@dataclass(frozen=True)
class Tried(Generic[T]):
    """A part that is tried in sessions of the studies that name it."""

    name: str
    part: T
    sessions: Sequence[Session]

    @property
    def first(self) -> Session:
        """Return the first session. Raises NotKept if no study names the part."""
        demand(self.sessions, f"no study names {self.name}: write one into LAB/studies, or into the extension")
        return self.sessions[0]


def _is_named(tried: Tried[Any]) -> str | None:
    names = [tried.first.files.study.study, *(session.files.study.study for session in tried.sessions[1:])]
    return ", ".join(names)


def _comes_to_its_end(tried: Tried[Any]) -> str | None:
    counts = []
    for session in tried.sessions or [tried.first]:
        last = session.whole[0][-1]
        demand(last.kind == "session_ended" and "as" not in last.value, f"it ends with {last.kind} {dict(last.value)}")
        counts.append(f"{len(session.whole[0])} events")
    return ", ".join(counts)


def _resumes(tried: Tried[Any], with_samples: bool = True) -> str | None:
    whole, _ = tried.first.whole
    step = -(-len(whole) // MOST_CUTS)
    cuts = range(1, len(whole) + 1, step)
    expected = whole if with_samples else _without_samples(whole)
    for cut in cuts:
        try:
            resumed, _ = tried.first.ran(whole[:cut], AHEAD)
        except Exception as error:
            raise NotKept(f"cut after event {cut} of {len(whole)}: {type(error).__name__}: {error}") from error
        found = resumed if with_samples else _without_samples(resumed)
        equal = len(found) >= cut and found == expected[: len(found)]
        demand(equal, f"cut after event {cut} of {len(whole)}, it goes on to other events")
    return f"cut at {len(cuts)} of its {len(whole)} events"


def _without_samples(events: Sequence[Event]) -> list[Event]:
    """Return the events without what sensors measured, which begins anew when a session is resumed."""
    return [replace(event, samples=()) for event in events]


def _replays(tried: Tried[Any]) -> str | None:
    session = tried.first
    tape = Recorded(session.whole[0])
    run(session.plan, tape, tape, {})
    tape.demand_end()
    return None


def _has_answers(tried: Tried[Task]) -> str | None:
    session, table = tried.first, tried.part.answers
    if not tried.part.asks:
        return "it asks nothing"
    rows = answers_of(session.plan, "tried/P001/1", session.whole[0])
    several = {"ratings": rows.responses, **vars(rows), **rows.own}.get(table, [])
    demand(several, f"`answers` is {table!r}, and no answer lies there; those with answers: {', '.join(rows.own)}")
    return f"{len(several)} rows of {table}"


TASK: tuple[Demand[Tried[Task]], ...] = (
    Demand("a study names it", _is_named, needed=True),
    Demand("a simulated session comes to its end, by requests that there are", _comes_to_its_end, needed=True),
    Demand("an interrupted session goes on as if it had not been interrupted", _resumes),
    Demand("a replay gives the same events", _replays),
    Demand("its answers lie in the table that it names", _has_answers),
)


def _forms(tried: Tried[FormKind]) -> Iterator[tuple[Ask, Session]]:
    """Yield each request with this form."""
    found = [(ask, session) for session in tried.sessions for ask in session.asks if ask.form.name == tried.name]
    demand(found, f"no study asks {tried.name}: its task makes the form, whose `name` is the registered one")
    yield from found


def _is_asked(tried: Tried[FormKind]) -> str | None:
    for ask, _ in _forms(tried):
        items = ask.form.items()
        demand(items and all(isinstance(item, str) for item in items), f"items() are {items!r:.200}, not names")
    return None


def _simulates_answers(tried: Tried[FormKind]) -> str | None:
    from palpate.protocols.simulated_participants import simulated_participant

    for ask, session in _forms(tried):
        reply, seconds = simulated_participant(session.plan).answer(ask)
        demand(seconds >= 0, f"a simulated answer takes {seconds} s")
        if reply.value.get("go") != "back":
            ask.demand_answer(reply)
    return None


def garbage(answers: Mapping[str, Any]) -> Iterator[Any]:
    """Yield values that answer no form, made of valid answers to one."""
    yield from (None, 3, "x", [], [1], {**answers, "no such item": 1})
    if answers:
        yield {}
    for item in answers:
        yield {name: value for name, value in answers.items() if name != item}
        yield {**answers, item: {"no": {"such": "answer"}}}
        yield {**answers, item: float("nan")}


def _refuses_garbage(tried: Tried[FormKind]) -> str | None:
    from palpate.protocols.simulated_participants import simulated_participant

    count = 0
    for ask, session in _forms(tried):
        reply, _ = simulated_participant(session.plan).answer(ask)
        for wrong in garbage(reply.value.get("answers", {})):
            demand(isinstance(ask.form.problem(wrong), str), f"problem({wrong!r:.120}) names no problem")
            count += 1
    return f"{count} wrong answers"


_TYPES: Mapping[str, tuple[type, ...]] = {"text": (str,), "number": (int, float), "whole": (int,), "truth": (bool,)}


def _rows_fit(tried: Tried[FormKind]) -> str | None:
    tables = own_tables_of(tried.name)
    for table in tables:
        keys = [column.name for column in table.columns if column.key]
        for session in tried.sessions:
            rows = answers_of(session.plan, "tried/P001/1", session.whole[0]).own.get(table.name, [])
            demand(rows or table is tried.part.also, f"no row of {table.name} came of a session")
            for row in rows:
                _demand_row(table, row)
            seen = [(row["seq"], *(row[key] for key in keys)) for row in rows]
            demand(len(set(seen)) == len(seen), f"{table.name}: two rows of one answer have the same {', '.join(keys)}")
    return ", ".join(table.name for table in tables) or "it has no table of its own"


def _demand_row(table: OwnTable, row: Mapping[str, Any]) -> None:
    for column in table.columns:
        demand(column.name in row, f"{table.name}: a row lacks {column.name}; it has {', '.join(row)}")
        _demand_value(table, column, row[column.name])
    shared = {"session", "seq", "participant", "trial", "session_number", "attempt", "block", "practice", "counts"}
    more = row.keys() - shared - {column.name for column in table.columns}
    demand(not more, f"{table.name}: a row has {', '.join(sorted(more))}, which is no declared column")


def _demand_value(table: OwnTable, column: OwnColumn, value: Any) -> None:
    fits = isinstance(value, _TYPES[column.kind]) and (column.kind == "truth" or not isinstance(value, bool))
    demand(
        fits or (value is None and not column.key), f"{table.name}: {column.name} is {value!r:.60}, not {column.kind}"
    )


def _is_drawn(tried: Tried[FormKind]) -> str | None:
    if is_own(tried.name) and not tried.part.screen:
        return "it has no screen, so it cannot be asked in a window"
    from palpate.devices.window.build import screen_for
    from palpate.devices.window.fonts import find_fonts
    from palpate.devices.window.geometry import Metrics, problems
    from palpate.devices.window.screen import Page
    from palpate.devices.window.texts import load_texts

    for language in LANGUAGES:
        texts, fonts = load_texts(language), find_fonts(language)
        for ask, session in list(_forms(tried))[:3]:
            for width, height, px_per_mm in SCREENS:
                page = Page(Metrics(width, height, px_per_mm), texts, fonts, total=len(session.plan.trials))
                screen: Any = screen_for(ask, page, 0)
                wrong = problems(screen.placed(), page.metrics)
                demand(not wrong, f"at {width}x{height} in {language}: {'; '.join(wrong)}")
                _paint(screen, page)
    return f"at {' and '.join(f'{width}x{height}' for width, height, _ in SCREENS)}, in {' and '.join(LANGUAGES)}"


def _paint(screen: Any, page: Any) -> None:
    from PIL import Image

    image = Image.new("RGB", (page.metrics.width_px, page.metrics.height_px))
    demand(screen.paint(image), "its first paint paints nothing")


FORM: tuple[Demand[Tried[FormKind]], ...] = (
    Demand("a study asks it, by its registered name", _is_asked, needed=True),
    Demand("a simulated answer is valid", _simulates_answers),
    Demand("garbage is refused", _refuses_garbage),
    Demand("its rows have the declared columns", _rows_fit),
    Demand("its screen can be drawn", _is_drawn),
)


def _tracks(tried: Tried[ProcedureKind]) -> list[Track]:
    trials = (trial for session in tried.sessions or [tried.first] for trial in session.plan.trials)
    tracks = {t.track.name: t.track for t in trials if t.track is not None and t.track.procedure.kind == tried.name}
    demand(tracks, f"no study has a track with the procedure {tried.name}")
    return list(tracks.values())


Observer = Callable[[int], bool]
"""Returns whether an answer at the level of this index is a hit."""


def _observers(track: Track) -> Iterator[tuple[str, Observer]]:
    """Yield observers: extreme ones, steady ones with a threshold at each third, and random ones."""
    yield "who is always right", lambda _index: True
    yield "who is always wrong", lambda _index: False
    for share in (1 / 3, 2 / 3):
        yield f"with a threshold at {share:.0%} of the levels", _steady(track, share)
    for seed in range(RANDOM_RUNS):
        yield f"who answers at random ({seed})", _at_random(seed)


def _steady(track: Track, share: float) -> Observer:
    edge = share * (len(track.levels) - 1)
    return lambda index: index >= edge if track.easiest else index <= edge


def _at_random(seed: int) -> Observer:
    chance = random.Random(seed)
    return lambda _index: chance.random() < 0.5


@dataclass(frozen=True)
class Course:
    """A track's course with an observer: its past, why it ended, and the slowest advice in seconds."""

    who: str
    past: Past
    ended: str
    slowest_s: float


def course(tried: Tried[ProcedureKind], track: Track, who: str, observer: Observer) -> Course:
    """Run a track with an observer. Raises NotKept for advice off the grid."""
    adviser, slowest_s = tried.part.make(track), 0.0
    past: Past = ()
    while True:
        begin_s = time.perf_counter()
        advice = adviser.advise(past)
        slowest_s = max(slowest_s, time.perf_counter() - begin_s)
        if isinstance(advice, End) or len(past) >= track.trials:
            return Course(who, past, advice.why if isinstance(advice, End) else "", slowest_s)
        index = advice.index
        on_grid = type(index) is int and 0 <= index < len(track.levels)
        demand(on_grid, f"{track.name}: {advice!r:.60} after {len(past)} answers; 0 to {len(track.levels) - 1}")
        past = (*past, (index, observer(index)))


@dataclass(frozen=True)
class TriedProcedure(Tried[ProcedureKind]):
    """A procedure that is tried: all demands are about the same courses."""

    @cached_property
    def courses(self) -> Sequence[tuple[Track, Course]]:
        """Return the course of every track with every observer. Raises NotKept for advice off the grid."""
        of_tracks = ((track, who, observer) for track in _tracks(self) for who, observer in _observers(track))
        return [(track, course(self, track, who, observer)) for track, who, observer in of_tracks]


def _keeps_to_the_grid(tried: TriedProcedure) -> str | None:
    lengths = [len(course.past) for _, course in tried.courses]
    return f"{min(lengths)} to {max(lengths)} trials"


def _ends_at_the_cap(tried: TriedProcedure) -> str | None:
    for track, run_of in tried.courses:
        demand(run_of.ended, f"{track.name}: no end after {track.trials} trials, its cap, of somebody {run_of.who}")
    return None


def _same_past_same_choice(tried: TriedProcedure) -> str | None:
    for track, run_of in tried.courses:
        fresh, used = tried.part.make(track), tried.part.make(track)
        for length in random.Random(1).sample(range(len(run_of.past) + 1), min(SAMPLED, len(run_of.past) + 1)):
            past = run_of.past[:length]
            again = tried.part.make(track).advise(past)
            equal = used.advise(past) == fresh.advise(past) == again
            demand(equal, f"{track.name}: equal pasts of {length} answers get different advice")
    return None


def _estimates(tried: TriedProcedure) -> str | None:
    said = []
    for track, run_of in tried.courses:
        for past in ((), run_of.past[:1], run_of.past):
            estimate = tried.part.make(track).estimate(past)
            numbers = (estimate.threshold, estimate.sd, estimate.bound, *(estimate.interval or ()))
            finite = all(number is None or number - number == 0 for number in numbers)
            demand(finite, f"{track.name}: {estimate} of somebody {run_of.who} is not finite")
            known = estimate.threshold is not None or estimate.outside in ("below", "above", "unknown")
            demand(known, f"{track.name}: {estimate} is no threshold; `outside` is below, above or unknown")
        if run_of.who.startswith("who is always"):
            said.append(f"{run_of.who.removeprefix('who is ')}: {estimate}")
    return "; ".join(dict.fromkeys(said))


def _is_in_time(tried: TriedProcedure) -> str | None:
    slowest_s = max(course.slowest_s for _, course in tried.courses)
    demand(slowest_s < PATIENCE_S, f"a choice takes {slowest_s:.2f} s; a session waits for {PATIENCE_S:g} s")
    return f"at most {1000 * slowest_s:.0f} ms"


PROCEDURE: tuple[Demand[TriedProcedure], ...] = (
    Demand("a study names it", _is_named, needed=True),
    Demand("its levels are in the grid", _keeps_to_the_grid),
    Demand("it ends at the cap of trials", _ends_at_the_cap),
    Demand("equal answers so far get an equal choice", _same_past_same_choice),
    Demand("its estimate is finite or an inequality, whoever answers", _estimates),
    Demand("it chooses in time", _is_in_time),
)


def _answers_alike(tried: Tried[ParticipantKind]) -> str | None:
    count = 0
    for session in tried.sessions or [tried.first]:
        device = session.plan
        person, again = tried.part.make(device, None), tried.part.make(device, None)
        for request in reversed(session.whole[1]):
            match request:
                case Ask():
                    first, second = person.answer(request), again.answer(request)
                    request.demand_answer(first[0])
                case Rest():
                    first, second = person.rest_s(request), again.rest_s(request)  # type: ignore[assignment]
                case _:
                    continue
            demand(first == second, f"{request.body()} gets {first} once and {second} another time")
            count += 1
    return f"{count} requests"


def _reads(tried: Tried[ParticipantKind]) -> str | None:
    person: SimulatedParticipant = tried.part.make(tried.first.plan, None)
    demand(person.reading_s >= 0, f"it reads a page in {person.reading_s} s")
    return f"{person.reading_s:g} s a page"


PARTICIPANT: tuple[Demand[Tried[ParticipantKind]], ...] = (
    Demand("a study names it", _is_named, needed=True),
    Demand("it answers every request of its studies' sessions", _comes_to_its_end, needed=True),
    Demand("equal requests get equal answers, in any order", _answers_alike),
    Demand("it reads pages", _reads),
    Demand("an interrupted session goes on as if it had not been interrupted", _resumes),
)


def _takes_kinds(tried: Tried[Need]) -> str | None:
    from palpate.devices.kinds import KINDS

    for kind in tried.part.takes:
        if (missing := KINDS.why_not(kind, "kind of device")) is not None:
            raise NotKept(missing)
    demand(tried.part.takes or tried.part.role is None, f"it {tried.part.role}, and takes no device")
    return ", ".join(tried.part.takes)


def _has_streams(tried: Tried[Need]) -> str | None:
    need = tried.part
    taken = {name: one.takes for name, one in NEEDS.items() if name != tried.name}
    streams = {t.stream: name for name, takes in taken.items() for t in takes.values() if t.stream}
    for kind, one in need.takes.items():
        demand(need.role != "records" or one.stream, f"it records {kind}, whose stream has no name")
        demand(not one.stream or one.rate_hz > 0, f"the stream {one.stream!r} has the rate {one.rate_hz:g} Hz")
        other = streams.get(one.stream, "")
        demand(not other, f"the stream {one.stream!r} is that of the need {other}")
    return ", ".join(one.stream for one in need.takes.values() if one.stream) or "it records nothing"


NEED: tuple[Demand[Tried[Need]], ...] = (
    Demand("it takes kinds of devices that exist", _takes_kinds),
    Demand("its streams have names of their own, and rates", _has_streams),
    Demand("a study names it", _is_named, needed=True),
    Demand("a simulated session with its devices comes to its end", _comes_to_its_end, needed=True),
    Demand("an interrupted session goes on to the same requests and answers", partial(_resumes, with_samples=False)),
)


def write_sample(files: StudyFiles, people: int, lab: Path) -> None:
    """Write a session of each of so many simulated participants of a study into a lab's folder."""
    rig = simulated(files.study, files.folder)
    for number in range(1, people + 1):
        who = allocate(files.study, f"P{number:03d}")
        start(lab, compile_plan(files.study, who, 1, lab_forms(files.study, lab, live=False)), rig)


def _check(
    contract: Sequence[Demand[Any]], tried: type[Tried[T]]
) -> Callable[[str, T, Sequence[StudyFiles], Path], list[Verdict]]:
    def check(name: str, part: T, studies: Sequence[StudyFiles], lab: Path) -> list[Verdict]:
        """Return the verdicts of the contract on a part, tried in sessions of these studies; `lab` has their forms."""
        return list(verdicts(name, contract, tried(name, part, [Session(files, lab) for files in studies])))

    return check


check_task, check_form, check_need = _check(TASK, Tried[Task]), _check(FORM, Tried[FormKind]), _check(NEED, Tried[Need])
check_procedure, check_participant = _check(PROCEDURE, TriedProcedure), _check(PARTICIPANT, Tried[ParticipantKind])
