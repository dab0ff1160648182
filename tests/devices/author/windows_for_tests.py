"""A designer's room on a shell without a window, with a door that needs no process."""

from collections import deque

from palpate.devices.author.app import DesignerApp
from palpate.devices.author.view import author_texts
from palpate.devices.window.geometry import Metrics
from palpate.devices.window.inputs import Key, Pressed, Released, Typed
from palpate.devices.window.screen import Page
from tests.devices.author.fakes import FakeMaker
from tests.devices.window.screens.pages import fonts
from tests.devices.window.shells_for_tests import FakeShell, do

SIZE = (1280, 720)


def page_for(language="en", size=SIZE, px_per_mm=3.6):
    return Page(Metrics(*size, px_per_mm), author_texts(language), fonts(language))


def room_in(lab, language="en", maker=None, **more):
    shell = FakeShell(deque())
    return DesignerApp(shell, page_for(language), maker or FakeMaker(), lab, **more)


def open_author(lab, **more):
    room = room_in(lab, **more)
    room.begin()
    return room


def typed(room, *texts):
    do(room, *(Typed(text, 0.0) for text in texts))


def keys(room, *names, shift=False):
    do(room, *(Key(name, shift, 0.0) for name in names))


def on(room):
    """The screen that is seen."""
    return room.on.screen


def box_of(room, name):
    return next(element.box for element in on(room).placed() if element.name == name)


def click(room, name):
    x, y = box_of(room, name).middle
    do(room, Pressed(x, y, 0.0), Released(x, y, 0.0))


def wish(room, number, value):
    """A tap on a slider at a value."""
    slider = room.main.view.slider(room.main.work, number)
    x, y = slider.box.middle[0], slider.row(value)
    do(room, Pressed(x, y, 0.0), Released(x, y, 0.0))
