"""The window as a whole: which page is on, what its buttons come to, and the work kept at every change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.devices.author import designs
from palpate.devices.author.board import Board
from palpate.devices.author.designs import DesignError
from palpate.devices.author.making import Maker
from palpate.devices.author.pages import Aside, HelpScreen, NameScreen, OpenScreen, RecoverScreen
from palpate.devices.author.playing import Player
from palpate.devices.author.screen import Act, AuthorScreen
from palpate.devices.author.work import History, Setting, Work, neutral
from palpate.devices.door.live import LiveDoor
from palpate.devices.window.loop import Scene
from palpate.devices.window.screen import Page
from palpate.devices.window.shell import Shell

if TYPE_CHECKING:
    from PIL import Image

Then = Callable[[str], None]


@dataclass
class Room:
    """The designer's window. `player` is None where there is no door; `no_door` says why."""

    shell: Shell
    page: Page
    picture: Image.Image
    maker: Maker
    lab: Path
    player: Player | None = None
    no_door: str = ""
    over: bool = False
    main: AuthorScreen = field(init=False)
    _scene: Scene = field(init=False)
    _on: Scene | None = None
    _aside: tuple[Aside, Callable[[Aside], None]] | None = None
    _kept: Work | None = None
    _live: LiveDoor[Setting] | None = None
    _reported: int = 0

    def __post_init__(self) -> None:
        begun = Work(neutral(len(self.maker.attributes)))
        self.main = AuthorScreen(self.page, Board(self.page, self.maker), History(begun))
        self._scene = Scene(self.main, self.shell, self.picture, "author")

    def begin(self) -> None:
        """Put the sliders on, or first ask about the work that was left."""
        self._kept = self.main.work
        self.door_is("rest")
        try:
            left = designs.kept_work(self.lab, self.maker)
        except DesignError as error:
            designs.put_aside(self.lab)
            left = None
            self.main.say(str(error), wrong=True)
        if left is None or left.untouched:
            self._put_on(self._scene)
        else:
            self._beside(RecoverScreen(self.page, left.name), lambda page: self._recovered(page, left))

    def run(self) -> None:
        """Until the window is closed."""
        self.begin()
        while not self.over:
            self.turn()

    def turn(self) -> None:
        """One look at the window: what was done, drawn, kept, and acted upon."""
        (self._on or self._scene).turn()
        self._keep()
        self._say_changes()
        if self._aside is not None and self._aside[0].reply is not None:
            page, then = self._aside
            self._aside = None
            self._put_on(self._scene)
            then(page)
        while self._aside is None and self.main.asked:
            self._act(self.main.asked.pop(0))

    def door_is(self, state: str, asked: str = "") -> None:
        """The door's state, beside the work; `asked` is what it wants to be put right."""
        texts, main = self.page.texts, self.main
        play = {"playing": "stop", "asking": "confirm"}.get(state, "play")
        shown = "rest" if state == "asking" else state
        told = replace(main.told, door=self._door_words(shown), play=play)
        if state == "asking":
            told = replace(told, notice=texts("door_failed", why=asked), wrong=True)
        elif state == "playing":
            told = replace(told, notice="", wrong=False)
        main.show_told(told)

    def hand_at(self, place: tuple[float, float] | None) -> None:
        """Where the door is while it plays."""
        self.main.show_told(replace(self.main.told, hand=place))

    def _door_words(self, state: str) -> str:
        texts = self.page.texts
        if self.player is None:
            return texts("state_off")
        return texts(f"state_{state}", name=texts("twin" if self.player.simulated else "real"))

    def _act(self, act: Act) -> None:
        playing = self.player is not None and self.player.busy
        if act == "play":
            self._play()
        elif act == "close":
            self._close()
        elif act == "export" and self.main.work.name and self.main.work.saved == self.main.work.setting:
            self._export(self.main.work.name)
        elif playing:
            self.main.tell("not_yet")
        else:
            {"save": self._ask_name, "export": self._ask_name_to_export, "open": self._ask_design, "help": self._help}[
                act
            ]()

    def _play(self) -> None:
        if self.player is None:
            self.main.say(self.page.texts("door_none", why=self.no_door), wrong=True)
        elif self.player.busy:
            self.player.press()
        else:
            setting, letter = self.main.work.setting, self.main.work.on
            force = self.main.board.made(setting).force_N
            self._live, self._reported = LiveDoor(lambda: self.main.work.setting, self._forces, setting), 0
            played = self.player.play(tuple(force.tolist()), f"design {letter}", self._live)
            self._live = None
            texts = self.page.texts
            words = texts(played.key, why=played.why) if "{why}" in texts.words[played.key] else texts(played.key)
            self.main.say(words, wrong=played.wrong)

    def _forces(self, setting: Setting) -> tuple[float, ...]:
        """The door of a setting, as the board draws it."""
        return tuple(self.main.board.made(setting).force_N.tolist())

    def _say_changes(self) -> None:
        """Say why the door in the hand stays as it is, where it took a change last and could not."""
        changes = [] if self._live is None else self._live.changes
        if len(changes) > self._reported:
            self._reported = len(changes)
            if why := changes[-1].why:
                self.main.say(self.page.texts("plays_before", why=why), wrong=True)

    def _close(self) -> None:
        self.over = True
        if self.player is not None:
            self.player.leave()
        if self.main.work.untouched:
            designs.forget(self.lab)

    def _ask_name(self) -> None:
        self._beside(self._name_screen("name_prompt"), lambda page: self._named(page, self._save))

    def _ask_name_to_export(self) -> None:
        self._beside(self._name_screen("name_export_prompt"), lambda page: self._named(page, self._save_and_export))

    def _name_screen(self, prompt: str) -> NameScreen:
        name = self.main.work.name
        return NameScreen(self.page, prompt, name, lambda each: each != name and each in designs.names(self.lab))

    def _ask_design(self) -> None:
        if names := designs.names(self.lab):
            self._beside(OpenScreen(self.page, names), lambda page: self._named(page, self._open))
        else:
            self.main.tell("no_designs")

    def _help(self) -> None:
        self._beside(HelpScreen(self.page), lambda _page: None)

    def _named(self, page: Aside, then: Then) -> None:
        """Go on with the name that was given; nothing where the page was left."""
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
        return designs.design_of(name, setting, self.maker, self.main.board.made(setting))

    def _open(self, name: str) -> None:
        """The design's wishes, on the sliders; the door is made of them by the models that are loaded.

        Where these are others, it has no name: saved or exported as it was called, it would replace the old door.
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
        self._put_on(Scene(page, self.shell, self.picture, type(page).__name__))

    def _put_on(self, scene: Scene) -> None:
        if self._on is not None:
            self._on.vanish()
        self._on = scene
        scene.appear()

    def _keep(self) -> None:
        """The work on disk is the work on the screen."""
        if self.main.work is not self._kept and self.main.work != self._kept:
            self._kept = self.main.work
            designs.keep(self.lab, self.main.work, self.maker)
