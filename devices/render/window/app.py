"""The renderer's window: it passes actions to the renderer, and shows what is played."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from palpate.devices.render.job import Job
from palpate.devices.render.opened import NEED
from palpate.devices.render.process import Rendering
from palpate.devices.render.texture_models import available
from palpate.devices.render.trace import Trace
from palpate.devices.render.window.choice import Choice, method_word, render_texts, texture_word
from palpate.devices.render.window.elements import SHOWN, heard
from palpate.devices.render.window.screen import RendererScreen, Stroke
from palpate.devices.render.window.view import RendererStatus, RendererView
from palpate.devices.tablet.device import Tablet
from palpate.devices.tablet.force import Force
from palpate.devices.tablet.pipeline import Shape
from palpate.devices.tablet.pyglet_window import PygletTablet
from palpate.devices.tablet.reports import Report
from palpate.devices.window.app import NEVER, WindowApp, WindowOptions, app_page, calibration_at_hand, opened_shell
from palpate.devices.window.calibration import Calibration
from palpate.devices.window.scenes import Scene
from palpate.signals.textures.sounds import RenderError, Sounds

if TYPE_CHECKING:
    from palpate.devices.window.geometry import Box
    from palpate.devices.window.shell import Shell

LOOK_S, TELL_S = 0.04, 0.5
"""Intervals at which the trace is drawn, and the figures are updated."""
MOUSE = Shape(report_hz=60.0)
"""A mouse as a stylus: windows report it at least once per frame."""


@dataclass(frozen=True, kw_only=True)
class RenderOptions(WindowOptions):
    """The texture, the method of its model, and how they are played."""

    texture: str
    method: str
    seed: int
    sampled: bool
    accept_missed: bool
    ahead: int
    real_time: bool


class Plays(Protocol):
    """A renderer: `palpate.devices.render.process.Rendering`, or a substitute."""

    trace: Trace

    @property
    def running(self) -> bool:
        """Return whether it is playing."""

    def switch(self, sounds: Sounds | None) -> None:
        """Change to another texture, or to silence. Raises RenderError."""

    def push(self, reports: Sequence[Report]) -> None:
        """Send the newest reports of a stylus or a mouse. Raises RenderError."""

    def volume(self, gain: float) -> None:
        """Set the volume, from 0 to 1. Raise RenderError."""

    def record(self) -> Mapping[str, Any]:
        """Return the record so far. Raise RenderError."""


@dataclass(frozen=True)
class Hands:
    """The sources of strokes.

    `hand` is the shape of reports that the window pushes; None: the rig's tablet, read by the loop itself. `tablet` is
    a pen tablet whose reports only a window gets.
    """

    rig: Path | None
    hand: Shape | None
    tablet: PygletTablet | None = None


@dataclass
class RunningRenderings:
    """The renderings that were started, which end with the window."""

    running: list[Rendering] = field(default_factory=list)

    def begin(self, job: Job) -> Rendering:
        """Start to play, and return the rendering. Raises RenderError."""
        self.end()
        rendering = Rendering(job)
        rendering.__enter__()
        self.running.append(rendering)
        return rendering

    def end(self) -> None:
        """End the playing process, silently."""
        while self.running:
            self.running.pop().__exit__()


def run_window(options: RenderOptions) -> None:
    """Show the window until it is closed. Raises WindowError, RigFileError, DeviceError, ModelFileError."""
    calibration, hands, renderings = calibration_at_hand(options), hands_for(options), RunningRenderings()
    with opened_shell(calibration, options) as shell:
        try:
            app = app_on(shell, calibration, options, hands, renderings)
            picture = app.main.view.layout.picture
            app.stylus = _listening(hands, shell, picture, calibration.px_per_mm, app.epoch_s)
            app.run()
        finally:
            renderings.end()
            if hands.tablet is not None:
                hands.tablet.close()


def app_on(
    shell: Shell, calibration: Calibration, options: RenderOptions, hands: Hands, renderings: RunningRenderings
) -> RendererApp:
    """Return the window on an open shell."""
    page = app_page(calibration.metrics, render_texts(options.language))
    view = RendererView(page, available(options.lab), by_mouse=hands.hand is not None and hands.tablet is None)
    job = Job(None, hands.hand, hands.rig, options.ahead, options.real_time, epoch_s=time.monotonic())
    notes = (("not_measured", calibration.confirmed_at == NEVER), ("twins", hands.rig is None))
    return RendererApp(
        shell, page, RendererScreen(page, view, Choice(options.texture, options.method)),
        lambda sounds: renderings.begin(replace(job, sounds=sounds)),
        lambda card: Sounds(card, options.seed, options.sampled, options.accept_missed),
        shell.now_s(), " ".join(page.texts(key) for key, shown in notes if shown),
        curve=hands.hand.force if hands.hand is not None else MOUSE.force,
    )  # fmt: skip


@dataclass
class RendererApp(WindowApp):
    """The renderer's window.

    `sounds` makes a request from a card, `start` starts to play again (after an end, when a texture is chosen).
    `stylus` gives the reports of a pen tablet that only the window gets; `epoch_s` is the shell's time from which
    reports count. `notice` is shown first.
    """

    main: RendererScreen
    start: Callable[[Sounds], Plays]
    sounds: Callable[[Path], Sounds]
    epoch_s: float = 0.0
    notice: str = ""
    stylus: Callable[[], Sequence[Report]] | None = None
    curve: Force = field(default_factory=Force)
    plays: Plays | None = None
    silent: bool = False
    choice: Choice = field(init=False)
    _scene: Scene = field(init=False)
    _status: RendererStatus = field(init=False)
    _looked_s: float = -1.0
    _asked_s: float = -1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self.choice = self.main.choice
        self._scene = self.scene(self.main, "render")
        self._status = RendererStatus(notice=self.notice)
        self.main.show(self.main.heard, self._status)

    def begin(self) -> None:
        """Show the texture, and play it."""
        self.put_on(self._scene)
        self._play()

    def turn(self) -> None:
        """Pass on the user's actions, and show what is played."""
        self._scene.turn()
        main, before = self.main, self.choice
        for request in (main.requests.pop(0) for _ in range(len(main.requests))):
            if request == "close":
                self.over = True
            elif self.silent:
                self._play()
            else:
                self.silent = True
                self._status = replace(self._status, silent=True)
                self._safely(lambda plays: plays.switch(None))
        strokes, self.main.strokes = self.main.strokes, []
        reports = list(self.stylus()) if self.stylus is not None else [self._report(stroke) for stroke in strokes]
        if reports and self.plays is not None and self.plays.running:
            self._safely(lambda plays: plays.push(reports))
        if main.choice != before:
            self.choice = main.choice
            if (main.choice.texture, main.choice.method) != (before.texture, before.method):
                self._play()
            elif main.choice.volume != before.volume:
                self._safely(lambda plays: plays.volume(main.choice.volume))
        now_s = self.shell.now_s()
        if now_s - self._asked_s >= TELL_S:
            self._asked_s = now_s
            self._ask()
        if now_s - self._looked_s >= LOOK_S:
            self._looked_s = now_s
            self._look()

    def _play(self) -> None:
        """Play the chosen texture. If it cannot be played, the window says so and the last one goes on."""
        try:
            sounds = self.sounds(self.main.view.models[self.choice.texture][self.choice.method])
            if self.plays is None or not self.plays.running:
                self.plays = self.start(sounds)
                if self.choice.volume < 1:
                    self._safely(lambda plays: plays.volume(self.choice.volume))
            else:
                self.plays.switch(sounds)
            texts, choice = self.page.texts, self.choice
            names = {"texture": texture_word(texts, choice.texture), "method": method_word(texts, choice.method)}
            self.silent, self._status = False, replace(self._status, silent=False)
            self._say(" ".join(filter(None, (texts("switched", **names) + ".", self.notice))))
        except ValueError as error:
            self._say(self.page.texts("cannot", why=str(error)), wrong=True)

    def _report(self, stroke: Stroke) -> Report:
        """Return the mouse's stroke as a stylus' report, with the slider's force."""
        watch = self._scene.watch
        shown_s = 0.0 if watch is None else watch.shown_s + watch.lost_s
        pressure = self.curve.pressure(self.choice.force_N) if stroke.touching else 0.0
        at_s = shown_s + stroke.t_s - self.epoch_s
        return Report(at_s, stroke.x_mm, stroke.y_mm, pressure, stroke.touching)

    def _ask(self) -> None:
        """Update the shown record, and show if the process has ended."""
        plays = self.plays
        if plays is None:
            return
        try:
            self._status = replace(self._status, record=plays.record())
            if not plays.running:
                raise RenderError("its process is over.")
        except RenderError as error:
            self._say_ended(error)

    def _look(self) -> None:
        if self.plays is None:
            self.main.show(self.main.heard, self._status)
            return
        trace = self.plays.trace
        self.main.show(heard(trace.since(trace.count - SHOWN)[1]), self._status)

    def _safely(self, act: Callable[[Plays], None]) -> None:
        """Call a function with the renderer; if that fails, show that it has ended."""
        if self.plays is None:
            return
        try:
            act(self.plays)
        except RenderError as error:
            self._say_ended(error)

    def _say_ended(self, error: RenderError) -> None:
        self._say(self.page.texts("ended", why=str(error).rstrip(".") + "."), wrong=True)

    def _say(self, notice: str, wrong: bool = False) -> None:
        self._status = replace(self._status, notice=notice, wrong=wrong)


def hands_for(options: RenderOptions) -> Hands:
    """Return the rig's stylus and actuator; the mouse for a twin of a tablet; a twin's actuator without a rig.

    Raise RigFileError, DeviceError.
    """
    from palpate.devices.kinds import KINDS
    from palpate.devices.rig.file import read_rig, rig_path

    path = options.rig or rig_path(options.lab)
    if options.twins or (options.rig is None and not path.is_file()):
        return Hands(None, MOUSE)
    file = read_rig(path)
    name = next(device for device in file.names_for(NEED) if file.kind(device) == "tablet")
    tablet: Any = KINDS[file.kind(name)].make(name, file.devices[name], file.path.parent)
    if not isinstance(tablet, Tablet) or tablet.settings.driver == "twin":
        return Hands(path, MOUSE)
    if isinstance(tablet.source, PygletTablet):
        return Hands(path, tablet.shape, tablet.source)
    return Hands(path, None)


def _listening(
    hands: Hands, shell: Any, picture: Box, px_per_mm: float, epoch_s: float
) -> Callable[[], Sequence[Report]] | None:
    """Return a function for the reports of a tablet that only this window gets, as touches on the picture."""
    tablet = hands.tablet
    if tablet is None:
        return None
    tablet.window, tablet.px_per_mm = shell.window.winHandle, px_per_mm
    tablet.open()
    tablet.start(lambda: shell.now_s() - epoch_s)
    return lambda: [on_picture(report, picture, px_per_mm) for report in tablet.pull(0.0).reports]


def on_picture(report: Report, picture: Box, px_per_mm: float) -> Report:
    """Return the report, without contact if it is off the picture (thesis 4.5.3)."""
    inside = not report.away and picture.holds(report.x_mm * px_per_mm, report.y_mm * px_per_mm)
    return report if inside else report._replace(pressure=0.0, touching=False)
