"""Rehearsal: the whole study played fast, every screen filled in by a simulated participant, for the experimenter."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.devices.acts import page_of
from palpate.devices.desk import Desk
from palpate.protocols.events import Aside, Choose, Present, Reply, Request, Sense, Show, World, WorldEvent
from palpate.protocols.plan import Plan
from palpate.studies.catalogue import StudyFiles
from palpate.studies.console.headless import asks_anything
from palpate.studies.live.opening import (
    LANGUAGE,
    Opening,
    desk_for,
    draw_forces,
    last_page,
    window_calibration,
    window_of,
)
from palpate.studies.live.options import REHEARSALS, LiveOptions
from palpate.studies.sessions.rig import Rig, RigPlan
from palpate.studies.sessions.session import SessionResult, start
from palpate.studies.sessions.session_files import ledger_path
from palpate.studies.simulation.rig import simulated

if TYPE_CHECKING:
    from palpate.devices.window.calibration import Calibration
    from palpate.devices.window.presenter import Presenter

NEVER = "not measured"
UNCALIBRATED_PX, UNCALIBRATED_PX_PER_MM = (1280, 720), 96 / 25.4
"""The window of a rehearsal at a station whose screen was never measured."""


@dataclass
class Rehearsed:
    """A simulated session that shows each act for a moment; its time is the simulated one.

    A page that only waits for a device is shown only the first time.
    """

    session: World
    presenter: Presenter
    desk: Desk
    pace_s: float
    clock: Callable[[], float] = time.monotonic
    shown: set[str] = field(default_factory=set)
    under_way: tuple[Request, WorldEvent] | None = None

    def now(self) -> int:
        """Return the simulated nanoseconds since the session began."""
        return self.session.now()

    def perform(self, request: Request) -> WorldEvent:
        """Return the simulated reply after showing it, or an aside that comes first."""
        if self.under_way is None or self.under_way[0] is not request:
            self.under_way = (request, self.session.perform(request))
        event = self.under_way[1]
        aside: Aside | None = None
        match request:
            case _ if not isinstance(event, Reply):
                pass
            case Choose():
                pass
            case Show():
                aside = self.show_page(request.page)
            case Sense():
                aside = self.show_page(page_of(request))
            case Present():
                prepared = None if request.part is not None else self.show_page("changing_sample")
                aside = prepared or self.show_page(page_of(request))
            case _:
                aside = self.presenter.show_answered(request, event, self.pace_s, self.desk)
        if aside is None:
            self.under_way = None
        return event if aside is None else aside

    def show_page(self, page: str) -> Aside | None:
        """Show a page for a moment the first time that it comes; skip it later."""
        until_s = self.clock() + (0.0 if page in self.shown else self.pace_s)
        aside = self.presenter.wait_for(page, self.desk, lambda: self.clock() >= until_s)
        if aside is None:
            self.shown.add(page)
        return aside


def rehearsal_plan(study_files: StudyFiles, lab: Path, options: LiveOptions) -> RigPlan:
    """Return how a rehearsal gets its rig: simulated people and devices, the real window, the console.

    Raises WindowError where the window is not available, RigError on a device that cannot be simulated.
    """
    inner = simulated(study_files.study, study_files.folder, lab)
    language = options.language or LANGUAGE
    calibration = _calibration(study_files, lab, options)
    description = {**inner.description, "kind": "rehearsal", "window": None, "language": language}

    def furnish(plan: Plan, t_ns: int, presenter: Presenter, opened: ExitStack) -> Rig:
        session = inner.open(plan, t_ns).world
        desk = desk_for(plan, session.now, presenter, options.as_json, opened)
        draw_forces(presenter, plan, lab)
        rehearsed = Rehearsed(session, presenter, desk, options.pace_s)

        def finish() -> None:
            rehearsed.show_page(last_page(desk))

        return Rig(rehearsed, opened.close, desk.watch, finish)

    full = options.windowed is None and calibration is not None and calibration.confirmed_at != NEVER
    opening = Opening(description, inner.check, window_of(study_files, lab, calibration, language, full), furnish)
    return RigPlan(description, opening.check, opening.open, drop=opening.drop)


def rehearse(lab: Path, plan: Plan, rig: RigPlan) -> SessionResult:
    """Rehearse the plan; its ledger lies in LAB/rehearsals/sessions, which nothing collects or analyses."""
    folder, number = lab / REHEARSALS, 1
    while ledger_path(folder, plan.study.study, plan.who.participant, number).exists():
        number += 1
    return start(folder, plan, rig, number)


def _calibration(study_files: StudyFiles, lab: Path, options: LiveOptions) -> Calibration | None:
    """Return this station's calibration; an invented one for a small window if the screen was never measured."""
    if options.no_window or not asks_anything(study_files.study):
        return None
    from palpate.devices.window.calibration import Calibration, station_file

    if station_file(lab).is_file():
        return window_calibration(study_files.study, lab, options)
    size = options.windowed or UNCALIBRATED_PX
    return Calibration(size, UNCALIBRATED_PX_PER_MM, options.screen or 0, NEVER)
