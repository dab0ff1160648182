"""The designer's window: the current page, the actions of its buttons, and the work, which is saved at every change."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from palpate.devices.author import designs
from palpate.devices.author.designs import DesignError
from palpate.devices.author.pages import Aside, HelpScreen, NameScreen, OpenScreen, RecoverScreen
from palpate.devices.author.player import Player
from palpate.devices.author.screen import DesignerScreen
from palpate.devices.author.view import DesignerView, author_texts
from palpate.devices.author.work import History, Setting, Work, neutral
from palpate.devices.door.link.simulator import DoorSimulator
from palpate.devices.door.live import LiveDoor
from palpate.devices.door.making import Maker
from palpate.devices.window.app import WindowApp, WindowOptions, app_page, calibration_at_hand, opened_shell
from palpate.devices.window.scenes import Scene

LOCK = ".author.lock"
Then = Callable[[str], None]


def run_window(maker: Maker, options: WindowOptions) -> None:
    """Show the window until it is closed. Raises WindowError, DesignError, RigFileError."""
    calibration = calibration_at_hand(options)
    door, why = _door(options)
    with _alone(options.lab), opened_shell(calibration, options) as shell:
        page = app_page(calibration.metrics, author_texts(options.language))
        app = DesignerApp(shell, page, maker, options.lab, no_door=why)
        if door is None:
            app.run()
            return
        app.player = Player(door, app, time.monotonic_ns)
        try:
            app.run()
        finally:
            app.player.close()


@dataclass
class DesignerApp(WindowApp):
    """The designer's window. `player` is None if there is no door; `no_door` says why."""

    maker: Maker
    lab: Path
    player: Player | None = None
    no_door: str = ""
    main: DesignerScreen = field(init=False)
    _scene: Scene = field(init=False)
    _aside: tuple[Aside, Callable[[Aside], None]] | None = None
    _saved_work: Work | None = None
    _live: LiveDoor[Setting] | None = None
    _reported: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        start = Work(neutral(len(self.maker.attributes)))
        self.main = DesignerScreen(self.page, DesignerView(self.page, self.maker), History(start))
        self._scene = self.scene(self.main, "author")

    def begin(self) -> None:
        """Show the sliders, or first ask about the work of the last time."""
        self._saved_work = self.main.work
        self.door_is("rest")
        try:
            left = designs.kept_work(self.lab, self.maker)
        except DesignError as error:
            designs.put_aside(self.lab)
            left = None
            self.main.say(str(error), wrong=True)
        if left is None or left.untouched:
            self.put_on(self._scene)
        else:
            self._beside(RecoverScreen(self.page, left.name), lambda page: self._recovered(page, left))

    def turn(self) -> None:
        """Handle inputs, paint, save the work, and do what was requested, once."""
        (self.on or self._scene).turn()
        self._keep()
        # Say why the door in the hand stays as it is, where it took a change last and could not.
        changes = [] if self._live is None else self._live.changes
        if len(changes) > self._reported:
            self._reported = len(changes)
            if why := changes[-1].why:
                self.main.say(self.page.texts("plays_before", why=why), wrong=True)
        if self._aside is not None and self._aside[0].reply is not None:
            page, then = self._aside
            self._aside = None
            self.put_on(self._scene)
            then(page)
        while self._aside is None and self.main.requests:
            self._act(self.main.requests.pop(0))

    def door_is(self, state: str, problem: str = "") -> None:
        """Show the door's state beside the work; `problem` is to be repaired at the door."""
        texts, main = self.page.texts, self.main
        play = {"playing": "stop", "asking": "confirm"}.get(state, "play")
        shown, door = "rest" if state == "asking" else state, texts("state_off")
        if self.player is not None:
            door = texts(f"state_{shown}", name=texts("twin" if self.player.simulated else "real"))
        status = replace(main.status, door=door, play=play)
        if state == "asking":
            status = replace(status, notice=texts("door_failed", why=problem), wrong=True)
        elif state == "playing":
            status = replace(status, notice="", wrong=False)
        main.show_status(status)

    def hand_at(self, place: tuple[float, float] | None) -> None:
        """Show where the door is while it plays."""
        self.main.show_status(replace(self.main.status, hand=place))

    def _act(self, act: str) -> None:
        work = self.main.work
        match act:
            case "play":
                self._play()
            case "close":
                self.over = True
                if self.player is not None:
                    self.player.leave()
                if work.untouched:
                    designs.forget(self.lab)
            case "export" if work.name and work.saved == work.setting:
                self._export(work.name)
            case _ if self.player is not None and self.player.busy:
                self.main.tell("not_yet")
            case "save":
                self._beside(self._name_screen("name_prompt"), lambda page: self._named(page, self._save))
            case "export":
                screen = self._name_screen("name_export_prompt")
                self._beside(screen, lambda page: self._named(page, self._save_and_export))
            case "open" if names := designs.names(self.lab):
                self._beside(OpenScreen(self.page, names), lambda page: self._named(page, self._open))
            case "open":
                self.main.tell("no_designs")
            case "help":
                self._beside(HelpScreen(self.page), lambda _page: None)

    def _play(self) -> None:
        if self.player is None:
            self.main.say(self.page.texts("door_none", why=self.no_door), wrong=True)
        elif self.player.busy:
            self.player.press()
        else:
            setting, letter = self.main.work.setting, self.main.work.on
            force = self.main.view.made(setting).force_N
            self._live, self._reported = LiveDoor(lambda: self.main.work.setting, self._forces, setting), 0
            played = self.player.play(tuple(force.tolist()), f"design {letter}", self._live)
            self._live = None
            texts = self.page.texts
            words = texts(played.key, why=played.why) if "{why}" in texts.words[played.key] else texts(played.key)
            self.main.say(words, wrong=played.wrong)

    def _forces(self, setting: Setting) -> tuple[float, ...]:
        """Return the forces of a setting's door in newtons, as the view draws it."""
        return tuple(self.main.view.made(setting).force_N.tolist())

    def _name_screen(self, prompt: str) -> NameScreen:
        name = self.main.work.name
        return NameScreen(self.page, prompt, name, lambda chosen: chosen != name and chosen in designs.names(self.lab))

    def _named(self, page: Aside, then: Then) -> None:
        """Continue with the name that was entered; do nothing if the page was left."""
        name = None if page.reply is None else page.reply.value.get("name")
        if name is None:
            return
        try:
            then(name)
        except (DesignError, OSError) as error:
            self.main.say(self.page.texts("not_saved", why=str(error)), wrong=True)

    def _save(self, name: str) -> None:
        file = designs.save(self.lab, self._design(name))
        self.main.history.note(replace(self.main.work, name=name, saved=self.main.work.setting))
        self.main.tell("saved_as", file=str(file))
        self._keep()

    def _save_and_export(self, name: str) -> None:
        self._save(name)
        self._export(name)

    def _export(self, name: str) -> None:
        self.main.tell("exported_as", file=str(designs.export(self.lab, self._design(name))))

    def _design(self, name: str) -> designs.Design:
        setting = self.main.work.setting
        return designs.design_of(name, setting, self.maker, self.main.view.made(setting))

    def _open(self, name: str) -> None:
        """Put a design's wishes on the sliders; the loaded models make the door.

        If the loaded models are not the design's, the work gets no name: saved or exported under the old one, it would
        replace the old door.
        """
        design = designs.read_design(designs.designs_folder(self.lab) / f"{name}.json")
        setting = designs.setting_of(design, self.maker)
        same = dict(design.models) == dict(self.maker.identity)
        known = {"name": name, "saved": setting} if same else {"name": "", "saved": None}
        self.main.take_up(replace(self.main.work.put(setting), **known))
        self.main.tell("opened" if same else "other_models", name=name)

    def _recovered(self, page: Aside, left: Work) -> None:
        if page.reply is not None and page.reply.value.get("left"):
            designs.put_aside(self.lab)
        else:
            self.main.take_up(left)

    def _beside(self, page: Aside, then: Callable[[Aside], None]) -> None:
        self._aside = page, then
        self.put_on(self.scene(page, type(page).__name__))

    def _keep(self) -> None:
        """Save the work on the screen to disk."""
        if self.main.work is not self._saved_work and self.main.work != self._saved_work:
            self._saved_work = self.main.work
            designs.keep(self.lab, self.main.work, self.maker)


def _door(options: WindowOptions) -> tuple[DoorSimulator | None, str]:
    """Return the door to play on, not opened yet, or None and the reason why there is none. Raises RigFileError."""
    from palpate.devices.kinds import KINDS
    from palpate.devices.rig.file import read_rig, rig_path

    if options.twins:
        from palpate.devices.door.link.device import Settings, make

        return make("door", Settings(kind="door", driver="twin"), options.lab), ""
    path = options.rig or rig_path(options.lab)
    if options.rig is None and not path.is_file():
        return None, f"This station has no rig file ({path}): palpate rig simulate, or palpate author --twins"
    file = read_rig(path)
    name = file.names_for("door_generator")[0]
    device = KINDS[file.kind(name)].make(name, file.devices[name], file.path.parent)
    return (device, "") if isinstance(device, DoorSimulator) else (None, f"{path}: {name} is no door")


@contextmanager
def _alone(lab: Path) -> Iterator[None]:
    """Hold the lab's lock, because two windows would save to one file. Raises DesignError if it is held."""
    from filelock import FileLock, Timeout

    folder = designs.designs_folder(lab)
    folder.mkdir(parents=True, exist_ok=True)
    lock = FileLock(folder / LOCK, timeout=0)
    try:
        lock.acquire()
    except Timeout:
        raise DesignError(f"{lab}: another window is making a door for this lab; close it first") from None
    try:
        yield
    finally:
        lock.release()
