"""The designer's window without a display: what every button and key does, and what is saved."""

import json

import pytest

from palpate.devices.author.designs import KEPT, designs_folder, read_design
from palpate.devices.author.pages import HelpScreen, NameScreen, OpenScreen, RecoverScreen
from palpate.devices.author.work import neutral
from palpate.devices.door.twin import open_door
from palpate.signals.doors.profile_file import read_profile
from tests.devices.author.fakes import LOWS, FakeMaker
from tests.devices.author.windows_for_tests import click, keys, on, open_author, typed, wish
from tests.devices.window.shells_for_tests import do


def wishes(room):
    return room.main.work.setting.wish


def words(room):
    return next(element for element in on(room).placed() if element.name == "words").text


def saved_work(lab):
    return json.loads((designs_folder(lab) / KEPT).read_text())


def save_as(room, name):
    click(room, "save")
    typed(room, *name)
    keys(room, "enter")


def test_each_slider_sets_its_own_wish_and_the_door_is_designed_again(tmp_path):
    room = open_author(tmp_path)
    for number in range(7):
        wish(room, number, 10 * number + 5)
    assert wishes(room) == tuple(10.0 * number + 5 for number in range(7))
    assert room.maker.wishes[-1] == (wishes(room), 0.0)


def test_one_gesture_is_one_step_to_undo(tmp_path):
    room = open_author(tmp_path)
    wish(room, 0, 90)
    keys(room, "up", "up", "up")
    assert wishes(room)[0] == 93
    typed(room, "u")
    assert wishes(room)[0] == 90
    typed(room, "u")
    assert wishes(room)[0] == 50
    typed(room, "u")
    assert words(room).startswith("There is nothing to undo")
    typed(room, "r", "r")
    assert wishes(room)[0] == 93


def test_the_keyboard_alone_reaches_everything(tmp_path):
    room = open_author(tmp_path)
    keys(room, "tab", "up", "right", "pagedown", "right", "end", "right", "home")
    assert wishes(room)[:4] == (51, 40, 100, 0)
    keys(room, "up", shift=True)
    assert wishes(room)[3] == 10
    keys(room, *["tab"] * 4, "right", "right")
    assert room.main.work.setting.smoothing_deg == 0.2
    stops = room.main.stops()
    assert stops[:8] == [*(f"wish {number}" for number in range(7)), "smoothing"]
    assert {"play", "undo", "redo", "compare", "save", "open", "export", "reset", "help", "close"} < set(stops)


@pytest.mark.needs("fonts")
def test_hangul_letters_stand_for_the_keys_they_lie_on(tmp_path):
    room = open_author(tmp_path, language="ko")
    wish(room, 2, 20)
    typed(room, "ㅕ")
    assert wishes(room) == (50.0,) * 7


def test_two_are_compared_and_only_the_one_that_is_on_changes(tmp_path):
    room = open_author(tmp_path)
    wish(room, 1, 80)
    click(room, "compare")
    wish(room, 1, 20)
    work = room.main.work
    assert (work.on, work.a.wish[1], work.b.wish[1]) == ("B", 80, 20)
    assert {"side A", "side B"} <= {element.name for element in on(room).placed()}
    typed(room, "a")
    wish(room, 0, 70)
    assert room.main.work.b == work.b and room.main.work.a.wish[:2] == (70, 80)
    click(room, "compare")
    assert room.main.work.b is None and room.main.work.setting.wish[:2] == (70, 80)


@pytest.mark.needs("fonts")
def test_an_impossible_wish_is_reported_and_a_possible_one_is_not(tmp_path):
    room = open_author(tmp_path)
    assert words(room).startswith("The door should feel as wished")
    wish(room, 0, 100)
    assert "Hard-to-pull 85 for 100" in words(room), "the end that is wished for, not the other one"
    korean = open_author(tmp_path / "ko", language="ko")
    wish(korean, 0, 100)
    assert "당기기 힘듦 85 (원하는 값 100)" in words(korean)


def test_a_saved_design_holds_wish_models_and_profile_and_opens_again(tmp_path):
    room = open_author(tmp_path)
    wish(room, 3, 35)
    save_as(room, "calm 1")
    design = read_design(tmp_path / "designs" / "calm 1.json")
    assert design.wish == dict(zip(LOWS, wishes(room), strict=True)) and design.models == room.maker.identity
    assert list(design.force_N) == pytest.approx(room.main.view.made(room.main.work.setting).force_N, abs=5e-5)
    click(room, "reset")
    assert wishes(room) == neutral(7).wish
    click(room, "open")
    assert isinstance(on(room), OpenScreen)
    keys(room, "enter")
    assert wishes(room)[3] == 35 and words(room) == "Opened: calm 1"
    typed(room, "u")
    assert wishes(room) == neutral(7).wish


def test_a_design_of_other_models_is_computed_again_and_the_window_says_so(tmp_path):
    room = open_author(tmp_path)
    wish(room, 3, 35)
    save_as(room, "old")
    click(room, "close")
    other = open_author(tmp_path, maker=FakeMaker(identity={"force": {"name": "other", "sha256": "1" * 64}}))
    click(other, "open")
    keys(other, "enter")
    assert "made with other models" in words(other) and wishes(other)[3] == 35
    before = (tmp_path / "designs" / "old.json").read_bytes()
    typed(other, "e")
    typed(other, *"old")
    keys(other, "enter")
    assert isinstance(on(other), NameScreen) and "already" in on(other).notice[0]
    click(other, "leave")
    assert on(other) is other.main and not (tmp_path / "designs" / "old.csv").exists()
    assert (tmp_path / "designs" / "old.json").read_bytes() == before


def test_a_name_in_use_must_be_confirmed_and_a_bad_one_is_refused(tmp_path):
    room = open_author(tmp_path)
    save_as(room, "one")
    wish(room, 0, 10)
    other = open_author(tmp_path / "elsewhere")
    assert other.main.work.name == ""
    click(room, "reset")
    room.main.history.note(type(room.main.work)(neutral(7)))
    click(room, "save")
    typed(room, *"one")
    keys(room, "enter")
    assert isinstance(on(room), NameScreen) and "already" in on(room).notice[0]
    keys(room, "enter")
    assert on(room) is room.main and room.main.work.name == "one"
    room.main.history.note(type(room.main.work)(neutral(7)))
    click(room, "save")
    typed(room, *"a/b")
    keys(room, "enter")
    assert on(room).reply is None and not (tmp_path / "designs" / "a").exists()
    click(room, "leave")
    assert on(room) is room.main


def test_the_exported_profile_is_one_that_the_door_studies_read_and_the_twin_plays(tmp_path):
    room = open_author(tmp_path)
    wish(room, 0, 80)
    click(room, "export")
    typed(room, *"heavy")
    keys(room, "enter")
    profile = read_profile(tmp_path / "designs" / "heavy.csv")
    assert profile == pytest.approx(room.main.view.made(room.main.work.setting).force_N, abs=5e-5)
    assert max(open_door(profile, 3.0, 100.0).force_N) == pytest.approx(max(profile), abs=0.5)
    assert words(room).startswith("Exported:")
    wish(room, 0, 20)
    typed(room, "e")
    assert isinstance(on(room), NameScreen), "a changed design is not exported under the old one's name"


def test_every_move_is_saved_and_offered_after_the_window_has_gone(tmp_path):
    room = open_author(tmp_path)
    wish(room, 5, 61)
    assert saved_work(tmp_path)["a"]["wish"][5] == 61
    typed(room, "c")
    wish(room, 6, 7)
    work = room.main.work
    later = open_author(tmp_path)
    assert isinstance(on(later), RecoverScreen)
    keys(later, "enter")
    assert later.main.work == work
    anew = open_author(tmp_path)
    click(anew, "anew")
    assert anew.main.work.untouched and not (designs_folder(tmp_path) / KEPT).exists()
    assert json.loads((designs_folder(tmp_path) / ".autosave-before.json").read_text())["b"]["wish"][6] == 7


def test_nothing_is_offered_where_everything_was_saved(tmp_path):
    room = open_author(tmp_path)
    wish(room, 5, 61)
    save_as(room, "done")
    click(room, "close")
    assert room.over and not (designs_folder(tmp_path) / KEPT).exists()
    assert on(open_author(tmp_path)).__class__.__name__ == "DesignerScreen"


def test_damaged_work_is_moved_aside_and_reported(tmp_path):
    folder = designs_folder(tmp_path)
    folder.mkdir()
    (folder / KEPT).write_text('{"format": "palpate-authoring/1", "attributes": [')
    room = open_author(tmp_path)
    assert "no design of this program" in words(room) and (folder / ".autosave-before.json").exists()


def test_work_on_doors_of_other_attributes_is_moved_aside_and_reported(tmp_path):
    wish(open_author(tmp_path), 5, 61)
    other = open_author(tmp_path, maker=FakeMaker(attributes=(*LOWS[:6], "Loud")))
    assert on(other) is other.main and ".autosave-before.json" in words(other)
    wish(other, 0, 10)
    assert json.loads((designs_folder(tmp_path) / ".autosave-before.json").read_text())["a"]["wish"][5] == 61


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"force_N": [0.0] * 620}, "force_N"),
        ({"wish": {"New": 101.0}}, "wish.New"),
        ({"smoothing_deg": float("nan")}, "smoothing_deg"),
        ({"more": 1}, "more"),
    ],
)
def test_a_file_that_is_no_design_is_refused_by_its_place(tmp_path, change, message):
    room = open_author(tmp_path)
    save_as(room, "fine")
    path = designs_folder(tmp_path) / "fine.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    click(room, "open")
    keys(room, "enter")
    assert message in words(room) and wishes(room) == neutral(7).wish


def test_a_design_for_other_attributes_is_refused(tmp_path):
    save_as(open_author(tmp_path), "fine")
    other = open_author(tmp_path, maker=FakeMaker(attributes=(*LOWS[:6], "Loud")))
    click(other, "open")
    keys(other, "enter")
    assert "this design wishes for" in words(other)


def test_help_is_read_and_left(tmp_path):
    room = open_author(tmp_path)
    typed(room, "h")
    assert isinstance(on(room), HelpScreen)
    keys(room, "enter")
    assert on(room) is room.main


def test_without_a_door_play_says_what_to_do(tmp_path):
    room = open_author(tmp_path, no_door="This station has no rig file (x): palpate rig simulate")
    click(room, "play")
    assert "palpate rig simulate" in words(room)


def test_a_marker_taken_beside_its_middle_does_not_jump(tmp_path):
    from palpate.devices.window.inputs import Moved, Pressed, Released

    room = open_author(tmp_path)
    thumb = room.main.view.slider(room.main.work, 0).thumb
    x, y = thumb.middle[0], thumb.top + 1
    do(room, Pressed(x, y, 0.0), Released(x, y, 0.0))
    assert wishes(room)[0] == 50
    line = room.main.view.slider(room.main.work, 0).line
    do(room, Pressed(x, y, 0.0), Moved(x, y - line.height / 4, 0.0), Released(x + 400, y - 2 * line.height, 0.0))
    assert wishes(room) == (100.0, *(50.0,) * 6)
