"""Put a live session together: the window, the desk, and devices or their stand-ins, opened and closed as one."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.devices.fed_desk import FedDesk
from palpate.protocols.extras import demand_packages
from palpate.protocols.plan import Plan
from palpate.protocols.shell_command import shell_command
from palpate.protocols.study import Study
from palpate.studies.catalogue import StudyFiles
from palpate.studies.console.headless import Windowless, asks_anything
from palpate.studies.launching.changes import demand_same_devices, demand_same_screen
from palpate.studies.live.hardware import hardware_for
from palpate.studies.live.options import LiveOptions
from palpate.studies.live.world import clock_from, live_world
from palpate.studies.sessions.rig import RecordedBeside, Rig, RigError, RigPlan

if TYPE_CHECKING:
    from palpate.devices.window.calibration import Calibration
    from palpate.devices.window.presenter import Presenter
    from palpate.studies.console.desk import ExperimenterDesk

LANGUAGE = "en"
LAST_PAGE = {"declined": "thanks", "ineligible": "ineligible", "aborted": "aborted"}
"""The last page by the way that a session ended, where it did not end regularly."""


def live_plan(
    study_files: StudyFiles, lab: Path, options: LiveOptions, recorded: Mapping[str, Any] | None = None
) -> RigPlan:
    """Return how a live session gets its rig; `recorded` is how its devices described themselves when it was started.

    Raises RigError where the devices are not available, WindowError where this station's screen is not calibrated. The
    devices and the window are opened by `check`, before anything is recorded.
    """
    hardware = hardware_for(study_files, lab, options)
    hardware.recorded = recorded or {}
    if study_files.study.live is not None and "door_generator" in hardware.twins:
        raise RigError(
            "a door that follows the sliders needs a rig, and here a stand-in would take its place. `palpate rig "
            "simulate` writes a rig of simulated devices, which follow as real ones do"
        )
    calibration = window_calibration(study_files.study, lab, options)
    if calibration is not None:
        hardware.demand_other_screen(calibration.screen)
    language = options.language or LANGUAGE
    twins = hardware.simulated_needs
    description: dict[str, Any] = {"kind": "live", "window": None, "twins": twins, "language": language}
    if settings := hardware.settings():
        description |= {"settings": settings, "devices": hardware.description}

    def furnish(plan: Plan, t_ns: int, presenter: Presenter, opened: ExitStack) -> Rig:
        now_ns = clock_from(t_ns)
        desk = desk_for(plan, now_ns, presenter, options.as_json, opened)
        opened.callback(hardware.close)
        desk.tell(dict.fromkeys(twins, "simulated, idle"))
        station = hardware.station(plan)
        draw_forces(presenter, plan, lab)

        def switch_side(side: str) -> None:
            """Show the experimenter the side that the participant switched to, and report it to the device."""
            desk.tell({"side": side})
            station.switch_side(side)

        presenter.on_side = switch_side
        opened.callback(station.stop)
        opened.callback(hardware.safe)  # The first thing done in the end: before anything else, nothing moves.
        notes = hardware.changed_firmware()
        fed = FedDesk(desk, station.feed)
        status = lambda: desk.status  # noqa: E731
        world = live_world(plan, presenter, fed, status, station, now_ns, hardware.safe, notes)
        if (recorder := station.recorder) is not None:
            world = RecordedBeside(world, lambda: recorder.ready(presenter, fed, now_ns), recorder.take)
        return Rig(world, opened.close, desk.watch, lambda: presenter.finish(desk, last_page(desk)))

    window = window_of(study_files, lab, calibration, language, options.windowed is None)
    opening = Opening(description, hardware.open, window, furnish, hardware.close)
    measured = None if calibration is None else calibration.definition()
    return RigPlan(description, opening.check, opening.open, measured, opening.drop)


def draw_forces(presenter: Presenter, plan: Plan, lab: Path) -> None:
    """Let the window draw the forces of the present setting where the study shows them."""
    if plan.study.live is not None and plan.study.live.show_force:
        from palpate.studies.stimuli.made_doors import made_doors

        presenter.force_of = made_doors(lab).doors.force_N


def resumed_live_plan(
    study_files: StudyFiles, lab: Path, options: LiveOptions, header: Mapping[str, Any]
) -> tuple[RigPlan, dict[str, Any] | None]:
    """Return the rig plan that resumes a recorded live session, and what goes on record of a changed screen or device.

    Stand-ins and the language are those that the session started with. Raises RigError on a rehearsal, ScreenChanged on
    another screen and DevicesChanged on other devices unless that is accepted, and what `live_plan` raises.
    """
    rig = header["rig"]
    if rig["kind"] == "rehearsal":
        raise RigError("a rehearsal cannot be resumed: rehearse again")
    as_recorded = replace(
        options,
        twins=options.twins or (options.rig is None and "settings" not in rig),  # started without a rig file
        language=options.language or rig.get("language"),
    )
    calibration = window_calibration(study_files.study, lab, as_recorded)
    accepted: dict[str, Any] = {}
    if calibration is not None:
        accepted |= demand_same_screen(header, calibration, options.accept_change) or {}
    planned = live_plan(study_files, lab, as_recorded, rig.get("devices"))
    accepted |= demand_same_devices(header, planned.description, options.accept_change) or {}
    return planned, accepted or None


def window_calibration(study: Study, lab: Path, options: LiveOptions) -> Calibration | None:
    """Return this station's calibration, cut to the window of the options; None if the study shows nothing.

    Raises ExtraMissing where the packages of the window are missing, WindowError where the screen is not calibrated,
    RigError where the calibration is of another screen.
    """
    if not asks_anything(study):
        return None
    from palpate.devices.window.calibration import read_calibration, station_file

    if not station_file(lab).is_file():  # calibrating needs it, too: say it first
        demand_packages("a window", "psychopy")
    calibration = read_calibration(lab)
    if options.screen not in (None, calibration.screen):
        raise RigError(
            f"screen {calibration.screen} is calibrated, and screen {options.screen} is requested: "
            f"{shell_command('window', 'calibrate', '--screen', options.screen)}"
        )
    return replace(calibration, size_px=options.windowed) if options.windowed is not None else calibration


@dataclass
class Opening:
    """A planned rig that is not open yet; `check` opens devices and window, so that a refusal leaves nothing behind.

    `description` goes into the ledger; its `window` is filled in once the window is open. `devices` checks and opens
    the devices, `let_go` closes them again; `furnish` makes the rest of the rig around the window and puts what is to
    be closed on the stack.
    """

    description: dict[str, Any]
    devices: Callable[[Plan], None]
    window: Callable[[Plan], Presenter]
    furnish: Callable[[Plan, int, Presenter, ExitStack], Rig]
    let_go: Callable[[], None] = lambda: None
    presenter: Presenter | None = None

    def check(self, plan: Plan) -> None:
        """Open devices and window. Raises RigError or WindowError where one is not available."""
        self._open_window(plan)
        if self.presenter is not None:
            self.description["window"] = dict(self.presenter.description) or None

    def open(self, plan: Plan, t_ns: int) -> Rig:
        """Return the open rig, whose session time goes on from t_ns. On an error everything opened is closed."""
        presenter = self.presenter or self._open_window(plan)
        self.presenter = None
        opened = ExitStack()
        opened.callback(self.let_go)
        opened.callback(presenter.close)
        try:
            rig = self.furnish(plan, t_ns, presenter, opened)
        except BaseException:
            opened.close()
            raise
        return replace(rig, safe=opened.close)

    def drop(self) -> None:
        """Close what `check` opened, the devices first; do nothing if nothing is open."""
        presenter, self.presenter = self.presenter, None
        with ExitStack() as ends:
            if presenter is not None:
                ends.callback(presenter.close)
            ends.callback(self.let_go)

    def _open_window(self, plan: Plan) -> Presenter:
        """Open the devices and the window."""
        self.devices(plan)
        try:
            self.presenter = self.window(plan)
        except BaseException:
            self.let_go()
            raise
        return self.presenter


def desk_for(
    plan: Plan, now_ns: Callable[[], int], presenter: Presenter, as_json: bool, opened: ExitStack
) -> ExperimenterDesk:
    """Open the experimenter's desk at this process's terminal; it shows which side the participant has switched to."""
    from palpate.studies.console.desk import open_desk

    desk = open_desk(plan, now_ns, sys.stdin, sys.stderr if as_json else sys.stdout)
    opened.callback(desk.close)
    if "size_px" in (shown := presenter.description):
        width, height = shown["size_px"]
        desk.tell({"screen": f"{width}x{height}, {shown['px_per_mm']:.2f} px/mm, {shown['language']}"})
    presenter.on_side = lambda side: desk.tell({"side": side})
    return desk


def window_of(
    study_files: StudyFiles, lab: Path, calibration: Calibration | None, language: str, full: bool
) -> Callable[[Plan], Presenter]:
    """Return a function that opens the participant's window for a plan; without a calibration it opens none.

    The screens' words are those of LAB/texts/LANGUAGE.yaml, where the lab has that file.
    """
    own = lab / "texts" / f"{language}.yaml"

    def opened(plan: Plan) -> Presenter:
        if calibration is None:
            return Windowless()
        from palpate.devices.window.presenter_window import open_presenter

        return open_presenter(
            study_files.study, calibration, language, study_files.folder, fullscreen=full, plan=plan,
            texts_file=own if own.is_file() else None,
        )  # fmt: skip

    return opened


def last_page(desk: ExperimenterDesk) -> str:
    """Return the text key of the session's last page."""
    return LAST_PAGE.get(desk.status.ended or "", "end")
