"""Pages to try screens on, and a participant's hand."""

from functools import cache

from palpate.devices.window.build import screen_for
from palpate.devices.window.fonts import find_fonts
from palpate.devices.window.geometry import Metrics
from palpate.devices.window.inputs import Key, Moved, Pressed, Released, Typed
from palpate.devices.window.screen import Page
from palpate.devices.window.texts import load_texts
from palpate.protocols.events import Ask
from palpate.protocols.forms import Sliders
from palpate.protocols.study import Attribute, Scale, Stimulus
from palpate.protocols.trial import Trial

SIZES = {
    "1280x720 at 3.2": Metrics(1280, 720, 3.2),
    "1280x720 at 4": Metrics(1280, 720, 4.0),
    "1920x1080 at 3.6": Metrics(1920, 1080, 3.6),
    "2560x1440 at 4.3": Metrics(2560, 1440, 4.3),
    "3840x2160 at 6.4": Metrics(3840, 2160, 6.4),
    "3840x2160 at 7": Metrics(3840, 2160, 7.0),
}
SMALL = SIZES["1280x720 at 4"]
STEPS = Scale.model_validate({"from": -10, "to": 10, "step": 1})
FREE = Scale.model_validate({"from": 0, "to": 100})


@cache
def fonts(language="en"):
    """One look for fonts serves all tests of a process: fonts only remember what they measured."""
    return find_fonts(language)


def page(metrics=SMALL, language="en", **more) -> Page:
    return Page(metrics, load_texts(language), fonts(language), **{"total": 45, **more})


def sliders(count=4, scale=FREE, **more) -> Sliders:
    names = ("Rough", "Flat", "Sticky", "Hard", "New", "Calm", "Heavy", "Loud")
    return Sliders(tuple(Attribute(low=low, high=f"not {low}") for low in names[:count]), scale, **more)


def ask(form, back=False, practice=False, previous=None, former=None) -> Ask:
    trial = Trial(3, "1", practice, Stimulus(id="s"), form, may_go_back=back, rest_before=False, previous=previous)
    return Ask(form, trial, former)


class Hand:
    """Does to a screen what a participant would: every act takes a tenth of a second."""

    def __init__(self, form, metrics=SMALL, language="en", pages=None, hangul=False, **more):
        self.request = form if not hasattr(form, "items") else ask(form, **more)
        self.page = page(metrics, language, pages=pages or {}, hangul=hangul)
        self.screen = screen_for(self.request, self.page, 7)
        self.clock_s = 0.0

    def element(self, name):
        elements = [element for element in self.screen.scene() if element.name == name]
        assert elements, f"no {name} among {[element.name for element in self.screen.scene()]}"
        return elements[0]

    def tap(self, name, share=0.5):
        x, y = self.point(name, share)
        return self.do(Pressed, x, y).do(Released, x, y)

    def drag(self, name, *shares):
        points = [self.point(name, share) for share in shares]
        self.do(Pressed, *points[0])
        for point in points[1:]:
            self.do(Moved, *point)
        return self.do(Released, *points[-1])

    def point(self, name, share=0.5):
        element = self.element(name)
        box = getattr(element, "line", element.box)
        return box.left + share * (box.width - 1), box.top + box.height / 2

    def key(self, *names, shift=False):
        for name in names:
            self.do(Key, name, shift)
        return self

    def type(self, text):
        for character in text:
            if character == "\n":
                self.key("enter")
            else:
                self.do(Typed, character)
                if character == " ":
                    self.key("space")
        return self

    def do(self, act, *what):
        self.clock_s = round(self.clock_s + 0.1, 3)
        self.screen.handle(act(*what, self.clock_s))
        return self

    def wait(self, seconds=0.5):
        self.clock_s += seconds
        return self

    @property
    def value(self):
        assert self.screen.reply is not None, f"no reply; {self.screen.notice}"
        if isinstance(self.request, Ask):
            self.request.demand_answer(self.screen.reply)
        return self.screen.reply.value

    def text(self, name):
        """What an element says."""
        return {element.name: element.text for element in self.screen.placed()}.get(name)
