"""The renderer's window without one: choices, strokes, what is shown, and what is done where something fails."""

from collections import deque

import numpy as np
import pytest
from PIL import Image

from palpate.devices.render.texture_models import available
from palpate.devices.render.trace import Trace
from palpate.devices.render.window.app import RendererApp, on_picture
from palpate.devices.render.window.choice import FOLDER, Choice, beside, in_view, render_texts
from palpate.devices.render.window.elements import columns, heard, scale_for, spectrum_dB
from palpate.devices.render.window.photo import PICTURES, at_true_size, photo_file, read_photo
from palpate.devices.render.window.screen import RendererScreen
from palpate.devices.render.window.view import RendererStatus, RendererView
from palpate.devices.surfaces.fields import SIZE_MM
from palpate.devices.tablet.reports import Report
from palpate.devices.window.geometry import Box, Metrics, WindowError, problems
from palpate.devices.window.inputs import Key, Moved, Pressed, Released, Typed
from palpate.devices.window.screen import Page
from palpate.devices.window.texts import read_words
from palpate.signals.textures.sounds import RenderError, Sounds
from tests.devices.render.made import model, write
from tests.devices.window.screens.pages import fonts
from tests.devices.window.shells_for_tests import FakeShell, do

SIZE, PX_PER_MM = (1280, 720), 3.6


class FakePlays:
    """Records its calls; each fails once `fails` is set."""

    def __init__(self, sounds):
        self.trace, self.running, self.fails = Trace.own(), True, ""
        self.sounds, self.reports, self.gains = [sounds], [], []

    def _did(self, what, value):
        if self.fails:
            raise RenderError(self.fails)
        what.append(value)

    def switch(self, sounds):
        self._did(self.sounds, sounds)

    def push(self, reports):
        for report in reports:
            self._did(self.reports, report)

    def volume(self, gain):
        self._did(self.gains, gain)

    def record(self):
        if self.fails:
            raise RenderError(self.fails)
        return {"ready": {"steps": 7, "late": 2, "late_share": 0.25}, "output": {"underruns": 1, "missing": 3,
                "ahead_ms": 10}, "voice": {"runtime": "native"}}  # fmt: skip


@pytest.fixture
def lab(tmp_path):
    for method in ("ar", "hapinf"):
        write(tmp_path / "models", model(name=f"texture-cloth-{method}"))
    write(tmp_path / "models", model(name="texture-rubber-ar", id="rubber", label="Rubber"))
    return tmp_path


def page_for(language="en", size=SIZE, px_per_mm=PX_PER_MM):
    return Page(Metrics(*size, px_per_mm), render_texts(language), fonts(language))


def room_in(lab, **more):
    players, board = [], RendererView(page_for(), only(lab))

    def begin(sounds):
        players.append(FakePlays(sounds))
        return players[-1]

    screen = RendererScreen(board.page, board, Choice("cloth", "ar"))
    room = RendererApp(FakeShell(deque()), board.page, screen, begin,
                lambda card: Sounds(card, 3), epoch_s=99.0, **more)  # fmt: skip
    room._scene.appear()
    room._play()
    return room, players


def only(lab):
    """The lab's own models: shipped ones are none of these tests' business."""
    own = {texture: {method: card for method, card in methods.items() if card.is_relative_to(lab)}
           for texture, methods in available(lab).items()}  # fmt: skip
    return {texture: methods for texture, methods in own.items() if methods}


def box(room, name):
    return next(element.box for element in room.main.placed() if element.name == name)


def click(room, name):
    x, y = box(room, name).middle
    do(room, Pressed(x, y, 0.0), Released(x, y, 0.0))


def test_a_stroke_of_the_mouse_is_one_of_a_stylus_in_mm_and_in_the_renderer_s_time(lab):
    room, (plays,) = room_in(lab)
    place = box(room, "picture")
    x, y = place.left + 36, place.top + 72
    do(room, Pressed(x, y, 0.0), Moved(x + 36, y, 0.0), Released(x + 36, y, 0.0))
    down, moved, up = plays.reports
    assert (down.x_mm, down.y_mm, moved.x_mm) == pytest.approx((10.0, 20.0, 20.0))
    assert (down.touching, moved.touching, up.touching) == (True, True, False)
    assert room.curve.newtons(down.pressure) == pytest.approx(0.8)
    assert 1.0 < down.t_s < moved.t_s < up.t_s < 1.2, "the shell's clock began at 100 s, the renderer's at 99"


def test_off_the_picture_nothing_is_touched(lab):
    room, (plays,) = room_in(lab)
    place = box(room, "picture")
    do(room, Pressed(*place.middle, 0.0), Moved(place.right + 40, place.middle[1], 0.0))
    assert [report.touching for report in plays.reports] == [True, False] and plays.reports[1].pressure == 0
    stylus = Report(0.0, 10.0, 10.0, 0.5, True)
    assert on_picture(stylus, Box(0, 0, 100, 100), 5.0) == stylus
    assert not on_picture(stylus, Box(60, 0, 100, 100), 5.0).touching


def test_textures_and_methods_are_switched_by_button_and_key(lab):
    room, (plays,) = room_in(lab)
    click(room, "method hapinf")
    click(room, "texture rubber")
    do(room, Key("right", False, 0.0), Key("down", False, 0.0))
    played = [sound.card.stem for sound in plays.sounds]
    assert played == ["texture-cloth-ar", "texture-cloth-hapinf", "texture-rubber-ar", "texture-cloth-ar",
                      "texture-cloth-hapinf"]  # fmt: skip
    assert {sound.seed for sound in plays.sounds} == {3}


def test_volume_force_and_silence(lab):
    room, (plays,) = room_in(lab)
    for name, share in (("volume", 0.25), ("press", 1.0)):
        track = room.main.view.track(name, room.choice)
        x = track.line.left + round(share * (track.line_px - 1))
        do(room, Pressed(x, track.box.middle[1], 0.0), Released(x, track.box.middle[1], 0.0))
    assert plays.gains[-1] == pytest.approx(0.25, abs=0.01) and room.choice.force_N == 3.0
    do(room, Typed("m", 0.0))
    assert plays.sounds[-1] is None and room.silent
    do(room, Typed("ㅡ", 0.0))
    assert plays.sounds[-1] is not None and not room.silent
    do(room, Typed("q", 0.0))
    assert room.over


def test_what_cannot_be_played_is_reported_and_the_last_texture_goes_on(lab):
    room, (plays,) = room_in(lab)
    plays.fails = "the model is damaged"
    click(room, "method hapinf")
    assert "the model is damaged" in room.main.status.notice and room.main.status.wrong
    plays.fails = ""
    click(room, "method ar")
    assert not room.main.status.wrong


def test_a_damaged_card_or_picture_does_not_end_the_window(lab):
    room, (plays,) = room_in(lab)
    (lab / "models" / "texture-cloth-hapinf.json").write_text("{")
    plays.fails = "the card is damaged"
    click(room, "method hapinf")
    do(room)
    assert "the card is damaged" in room.main.status.notice
    rubber = write(lab / "models", model(name="texture-rubber-ar", id="rubber", label="Rubber", picture="rubber.png"))
    rubber.with_name("rubber.png").write_bytes(b"none")
    plays.fails = ""
    click(room, "texture rubber")
    text = next(element.text for element in room.main.placed() if element.name == "no picture")
    assert text.startswith("No picture of this texture. ") and "rubber.png" in text


def test_a_renderer_that_has_ended_is_reported_and_restarted_with_the_next_choice(lab):
    room, players = room_in(lab)
    players[0].running, players[0].fails = False, "the actuator is gone"
    do(room, *[Moved(0, 0, 0.0)] * 60)
    assert "the actuator is gone. Choose" in room.main.status.notice
    click(room, "texture rubber")
    assert len(players) == 2 and players[1].sounds[0].card.stem == "texture-rubber-ar"


def test_the_figures_are_the_renderer_s(lab):
    room, _players = room_in(lab)
    do(room, *[Moved(0, 0, 0.0)] * 60)
    texts = {element.text for element in room.main.placed()}
    assert {"7", "2 (25 %)", "1 (3 samples)", "native"} <= texts


def test_what_is_shown_is_the_last_second():
    last = np.zeros((3, 1500))
    last[0, 600:1200] = 2 * np.sin(2 * np.pi * 100 * np.arange(600) / 1000)
    last[1], last[2] = 50.0, 0.7
    last_second = heard(last)
    assert len(last_second.samples) == 1000 and (last_second.speed_mm_s, last_second.force_N) == (50, 0.7)
    assert last_second.level_m_s2 == pytest.approx(np.sqrt(2), rel=0.05)
    low, high = columns(last_second.samples, 100)
    assert high[15:60].max() == pytest.approx(2, abs=0.1) and low[80] == high[80] == 0
    levels = spectrum_dB(last_second.samples)
    assert levels.argmax() * 4 == 100 and levels.max() < 3.1 and levels[-1] < -50 < levels[25]
    assert heard(np.zeros((3, 0))).samples.size == 0


def test_a_pure_tone_s_line_has_its_rms():
    tone = 10 * np.sqrt(2) * np.sin(2 * np.pi * 100 * np.arange(1000) / 1000)
    whole = 10 * np.log10(np.sum(10 ** (spectrum_dB(tone)[22:29] / 10)))
    assert whole == pytest.approx(20.0, abs=0.1)


@pytest.mark.parametrize(("value", "end"), [(0.0, 1.0), (float("nan"), 1.0), (0.9, 1.0), (1.0, 1.0), (3, 5), (51, 100)])
def test_axes_end_at_round_numbers(value, end):
    assert scale_for(value) == pytest.approx(end)


def test_neighbours_go_round_and_views_hold_the_chosen_one():
    names = tuple("abcdefgh")
    assert beside(names, "h", 1) == "a" and beside(names, "a", -1) == "h"
    assert all(name in in_view(names, name, 3) and len(in_view(names, name, 3)) == 3 for name in names)


def test_a_picture_has_its_true_size_and_is_cut_where_there_is_no_room(tmp_path):
    path = tmp_path / "p.png"
    Image.new("RGB", (400, 200), "red").save(path, dpi=(203.2, 203.2))
    photo = read_photo(path)
    assert photo.size_mm == pytest.approx((50.0, 25.0), rel=1e-3)
    assert at_true_size(photo, 4.0, (900, 900)).size == (200, 100)
    assert at_true_size(photo, 4.0, (80, 60)).size == (80, 60)
    Image.new("RGB", (400, 200)).save(tmp_path / "q.png")
    assert read_photo(tmp_path / "q.png").size_mm[0] == SIZE_MM, "a picture that says nothing shows a whole sample"
    path.write_text("no picture")
    with pytest.raises(WindowError, match="cannot be read as a picture"):
        read_photo(path)


def test_the_six_textures_have_pictures_of_a_sample_and_a_card_may_name_its_own(lab):
    shipped = sorted(PICTURES.glob("*.jpg"))
    assert len(shipped) == 6
    assert all(read_photo(photo).size_mm == pytest.approx((SIZE_MM, SIZE_MM), rel=2e-3) for photo in shipped)
    assert photo_file(model().card, lab) == PICTURES / "cloth.jpg"
    assert photo_file(model(picture="mine.png").card, lab) == lab / "mine.png"
    assert photo_file(model(id="silk").card, lab) is None


@pytest.mark.needs("fonts")
@pytest.mark.parametrize("language", ["en", "ko"])
@pytest.mark.parametrize(("size", "px_per_mm"), [((1280, 720), 3.6), ((1024, 640), 3.8), ((2736, 1824), 10.5)])
def test_everything_has_its_place_on_every_screen(lab, language, size, px_per_mm):
    page = page_for(language, size, px_per_mm)
    screen = RendererScreen(page, RendererView(page, only(lab)), Choice("cloth", "ar"))
    screen.show(
        heard(np.ones((3, 1000))), RendererStatus(record={"output": {"ahead_ms": 10}}, notice="A notice. " * 30)
    )
    assert problems(screen.placed(), page.metrics) == []


def test_both_languages_have_the_same_words():
    english, korean = (read_words(FOLDER / f"{name}.yaml") for name in ("en", "ko"))
    assert english.keys() == korean.keys()
    with pytest.raises(WindowError, match="no texts in language 'fr'"):
        render_texts("fr")
