import pytest
from PIL import Image, ImageChops

from palpate.devices.window.geometry import Box
from palpate.devices.window.inputs import Key, Moved, Pressed, Released, Typed
from palpate.devices.window.paint import ACCENT, ALERT, CARD, EDGE, GROUND, INK, QUIET, TINT, contrast
from palpate.devices.window.pictures import picture, shown
from palpate.devices.window.screens.base import gathered
from palpate.devices.window.screens.specimens import specimens, wording
from tests.devices.window.screens.pages import SIZES, Hand, page, sliders

NAMES = list(specimens())


def all_events(screen):
    """Something of everything that can happen to a screen."""
    targets = [element.box for element in screen.scene() if element.stops]
    for n, box in enumerate(targets):
        x, y = box.left + (n % 5 + 1) * box.width / 6, box.top + box.height / 2
        yield from (Pressed(x, y, n), Moved(x + 9, y, n), Released(x + 9, y, n))
        yield from (Key("tab", False, n), Key("right", False, n), Typed("가", n), Key("backspace", True, n))


@pytest.mark.needs("fonts")
@pytest.mark.parametrize("name", NAMES)
def test_painting_what_changed_gives_the_same_picture_as_painting_everything(name):
    on = page(language="ko", pages={"instructions": "하나\n\n" * 60})
    screen = shown(specimens(wording("ko"))[name], on)
    image = Image.new("RGB", (1280, 720))
    assert screen.paint(image) == (on.metrics.screen,)
    assert screen.paint(image) == ()
    for event in all_events(screen):
        screen.handle(event)
        before = image.copy()
        boxes = screen.paint(image)
        difference = ImageChops.difference(before, image).getbbox()
        if difference is not None:
            left, top, right, bottom = difference
            assert any(box.overlaps(Box(left, top, right - left, bottom - top)) for box in boxes)
        if screen.reply is not None:
            break
    assert ImageChops.difference(image, picture(screen, on)).getbbox() is None


@pytest.mark.parametrize("name", NAMES)
def test_text_is_drawn_where_the_geometry_says(name):
    """The check of the geometry rests on measured ink: here it is compared with what is really painted."""
    on = page(SIZES["1920x1080 at 3.6"], pages={"instructions": "One ÅÇgj.\n\nTwo."})
    screen = shown(specimens()[name], on)
    for element in screen.scene():
        for placed in element.placed(on):
            if placed.ink is None or element.name != placed.name:
                continue
            image = Image.new("RGB", (1920, 1080), GROUND)
            element.paint(image, on)
            drawn = ImageChops.difference(image, Image.new("RGB", image.size, GROUND)).getbbox()
            left, top, right, bottom = drawn
            assert placed.ink.grown(2).contains(Box(left, top, right - left, bottom - top)), placed


@pytest.mark.parametrize("size", SIZES)
def test_the_painted_line_is_as_long_as_the_placed_one(size):
    on = page(SIZES[size])
    screen = Hand(sliders(2), SIZES[size]).screen
    line = next(element.box for element in screen.placed() if element.name == "slider 1.line")
    image = picture(screen, on)
    row = image.crop((line.left - 20, line.top, line.right + 20, line.top + 1))
    dark = [x for x in range(row.width) if row.getpixel((x, 0)) == INK]
    assert (len(dark), dark[0], dark[-1]) == (line.width, 20, 19 + line.width)


def test_after_something_else_was_shown_everything_is_painted_again():
    hand = Hand(sliders(2))
    image = Image.new("RGB", (1280, 720))
    hand.screen.paint(image)
    whole = image.copy()
    image.paste((0, 0, 0), (0, 0, 1280, 720))
    hand.screen.repaint()
    assert hand.screen.paint(image) == (hand.page.metrics.screen,)
    assert ImageChops.difference(image, whole).getbbox() is None


def test_moving_a_marker_touches_its_line_only():
    hand = Hand(sliders(7)).tap("slider 3", 0.2)
    image = Image.new("RGB", (1280, 720))
    hand.screen.paint(image)
    band = hand.element("slider 3").box
    hand.do(Pressed, *hand.point("slider 3", 0.7))
    assert hand.screen.paint(image) == (band,)


def test_boxes_that_overlap_are_joined():
    one, two, far = Box(0, 0, 10, 10), Box(5, 5, 10, 10), Box(50, 50, 5, 5)
    assert sorted(gathered([one, far, two]), key=lambda box: box.left) == [Box(0, 0, 15, 15), far]
    assert gathered([one, Box(12, 0, 5, 5), Box(8, 0, 6, 5)]) == [Box(0, 0, 17, 10)]


@pytest.mark.parametrize("ground", [GROUND, CARD])
def test_text_has_the_contrast_that_wcag_aaa_asks_for(ground):
    assert all(contrast(colour, ground) >= 7 for colour in (INK, QUIET, ALERT, ACCENT))
    assert contrast(EDGE, ground) >= 3


def test_text_on_tints_and_on_the_accent_is_as_readable():
    assert contrast(INK, TINT) >= 7 and contrast(CARD, ACCENT) >= 7
    assert contrast((0, 0, 0), (255, 255, 255)) == pytest.approx(21)
