"""The camera: whole pictures are hashed and stored in order, bad ones asked for again, missing ones a fault."""

import errno
import hashlib
import io
import os

import numpy as np
import pytest
from PIL import Image, ImageFilter
from pydantic import ValidationError

from palpate.devices.camera import look as keeping
from palpate.devices.camera.device import Settings, make
from palpate.devices.camera.look import Incomplete, Limits, look
from palpate.devices.device import DeviceError
from palpate.protocols.events import Aside, Fault, Reply, Sense
from tests.devices.stage.seats import Clock, Desk, Window, trial_of

SIDE = 200


def picture(seed, blur=0, white=0.0, side=SIDE, kind="PNG", mode="L"):
    drawn = np.random.default_rng(seed)
    coarse = np.kron(drawn.integers(0, 110, (10, 10)), np.ones((side // 10, side // 10)))
    noise = (coarse + drawn.integers(30, 110, (side, side))).astype("u1")
    noise[: int(side * white)] = 255
    image = Image.fromarray(noise)
    image = (image.filter(ImageFilter.GaussianBlur(blur)) if blur else image).convert(mode)
    out = io.BytesIO()
    image.save(out, kind)
    return out.getvalue()


def camera(folder, **changes):
    (folder / "incoming").mkdir(exist_ok=True)
    given = {"folder": "incoming", "pictures": "kept", "least_pixels": SIDE, "lights": 3, **changes}
    device = make("camera", Settings(**{"kind": "camera", "driver": "folder", **given}), folder)
    device.open()
    return device


def arriving(folder, files):
    """A camera program that writes one file at each half second."""
    turns, files = [0], list(files)

    def turn():
        turns[0] += 1
        if files and turns[0] % 10 == 0:
            name, data = files.pop(0)
            (folder / "incoming" / name).write_bytes(data)

    return turn


def shoot(device, folder, files, desk=None, clock=None, seconds=30.0, stimulus="T07"):
    clock, desk = clock or Clock(), desk or Desk()
    request = Sense("camera", seconds, trial_of(stimulus))
    return device.perform(request, Window(clock, arriving(folder, files)), desk, clock), desk


def test_pictures_are_hashed_stored_and_reported_by_their_lights(tmp_path):
    files = [(f"IMG_{n}.png", picture(n)) for n in (3, 1, 2)]
    outcome, desk = shoot(camera(tmp_path), tmp_path, files)
    assert isinstance(outcome, Reply) and outcome.value["recorded"] and outcome.value["left_out"] == []
    pictures = outcome.value["pictures"]
    assert [picture["light"] for picture in pictures] == [1, 2, 3]
    assert [picture["from"] for picture in pictures] == ["IMG_3.png", "IMG_1.png", "IMG_2.png"]
    for entry, (_, data) in zip(pictures, files, strict=True):
        assert entry["sha256"] == hashlib.sha256(data).hexdigest()
        assert (tmp_path / "kept" / entry["file"]).read_bytes() == data
        assert entry["file"].startswith("T07/light0") and (entry["width"], entry["height"]) == (SIDE, SIDE)
        assert entry["flags"] == []
    assert desk.demands == [
        f"T07, light {n} of 3: take the picture. Confirm only where no more come." for n in (1, 2, 3)
    ]
    assert desk.standing is None


def test_pictures_are_stored_in_the_lab_unless_the_rig_file_says_where(tmp_path):
    lab = tmp_path / "lab"
    for given, place in (({"pictures": None}, lab / "pictures"), ({"pictures": "kept"}, tmp_path / "kept")):
        device = camera(tmp_path, lights=1, **given)
        device.keep_in(lab)
        data = picture(7)
        outcome, _ = shoot(device, tmp_path, [(f"{place.name}.png", data)])
        assert (place / outcome.value["pictures"][0]["file"]).read_bytes() == data
        assert device.health(0).facts["kept in"] == ("LAB/pictures" if given["pictures"] is None else str(place))


def test_a_twin_has_as_many_lights_as_the_simulated_surfaces_and_no_more():
    from palpate.devices.surfaces.photo import LIGHTS

    assert Settings(kind="camera", driver="twin", lights=LIGHTS).count == LIGHTS
    with pytest.raises(ValidationError, match="a twin has 10, and 11 are requested"):
        Settings(kind="camera", driver="twin", lights=LIGHTS + 1)


def test_files_that_come_at_once_are_ordered_by_name_where_the_rig_says_so(tmp_path):
    device, clock = camera(tmp_path, order="name", lights=["left", "right"]), Clock()
    (tmp_path / "incoming" / "old.png").write_bytes(picture(9))

    def both():
        for n in (2, 1):
            path = tmp_path / "incoming" / f"{n}.png"
            path.exists() or path.write_bytes(picture(n))

    desk = Desk()
    outcome = device.perform(Sense("camera", 30.0, trial_of("T07")), Window(clock, both), desk, clock)
    assert [picture["from"] for picture in outcome.value["pictures"]] == ["1.png", "2.png"]
    assert desk.demands[0].startswith("T07, light 1 of 2 (left): take the picture")


def test_a_file_that_is_still_being_written_is_waited_for(tmp_path):
    device, clock, data = camera(tmp_path, lights=1, settle_s=0.5), Clock(), picture(1)
    path, sizes = tmp_path / "incoming" / "slow.png", iter(range(0, len(data), len(data) // 40))

    def grows():
        size = next(sizes, len(data))
        if not path.exists() or path.stat().st_size < len(data):
            path.write_bytes(data[:size])

    outcome = device.perform(Sense("camera", 30.0, trial_of("T07")), Window(clock, grows), Desk(), clock)
    assert outcome.value["pictures"][0]["sha256"] == hashlib.sha256(data).hexdigest()
    assert outcome.value["seconds"] > 2.0


def test_a_cut_off_file_is_no_picture_until_it_is_whole(tmp_path):
    whole = picture(1, kind="JPEG")
    files = [("a.jpg", whole[: len(whole) // 2]), ("b.jpg", picture(2, kind="JPEG")), *[("x.txt", b"")] * 4]
    outcome, _ = shoot(camera(tmp_path, lights=2), tmp_path, files, seconds=6.0)
    assert isinstance(outcome, Fault) and outcome.value["what"] == "silent"
    assert "camera gave 1 of 2 pictures of T07 in 6 s, without light 2; a.jpg is broken (" in outcome.value["message"]
    outcome, _ = shoot(camera(tmp_path, lights=2), tmp_path, [*files[:2], *files[2:], ("a.jpg", whole)])
    assert [picture["from"] for picture in outcome.value["pictures"]] == ["b.jpg", "a.jpg"]


def test_the_same_picture_twice_counts_once_also_from_another_sample(tmp_path):
    device = camera(tmp_path, lights=2)
    outcome, _ = shoot(device, tmp_path, [("1.png", picture(1)), ("2.png", picture(1)), ("3.png", picture(3))])
    assert [picture["from"] for picture in outcome.value["pictures"]] == ["1.png", "3.png"]
    assert outcome.value["left_out"] == ["2.png"]
    files = [("4.png", picture(3)), ("5.png", picture(5)), ("6.png", picture(6))]
    outcome, _ = shoot(device, tmp_path, files, stimulus="T12")
    assert [picture["from"] for picture in outcome.value["pictures"]] == ["5.png", "6.png"]


@pytest.mark.parametrize(
    ("bad", "message"),
    [({"blur": 5}, "blurred"), ({"white": 0.3}, "over exposed"), ({"side": 150}, "too small")],
)
def test_a_bad_picture_is_asked_for_again_and_replaced_or_kept_where_it_is_confirmed(tmp_path, bad, message):
    files = [("1.png", picture(1, **bad)), ("2.png", picture(2))]
    again = f"T07, light 1 of 2: the picture is {message}. Take it again, or confirm to keep it."
    outcome, desk = shoot(camera(tmp_path, lights=2), tmp_path, [*files, ("3.png", picture(3))])
    assert desk.demands[-1] == again
    assert [picture["from"] for picture in outcome.value["pictures"]] == ["3.png", "2.png"]
    files = [("4.png", picture(4, **bad)), ("5.png", picture(5))]
    outcome, desk = shoot(camera(tmp_path, lights=2), tmp_path, files, Keeps(again))
    assert outcome.value["pictures"][0]["flags"] == [message.replace(" ", "_")]


class Keeps(Desk):
    """Confirms one demand and no other."""

    def __init__(self, text):
        super().__init__(confirms=[])
        self.text = text

    def answer(self):
        return True if self.standing is not None and self.standing.text == self.text else None


def test_an_experimenter_who_has_no_more_pictures_says_so_and_the_next_attempt_asks_first(tmp_path):
    device, clock = camera(tmp_path, lights=2), Clock()
    outcome, _ = shoot(device, tmp_path, [], Desk(confirms=[2.0]), clock)
    assert isinstance(outcome, Fault) and clock.t_ns < 4 * 10**9
    assert outcome.value["message"] == "camera gave 0 of 2 pictures of T07 in 2 s, without lights 1, 2"
    files = [(f"{n}.png", picture(n)) for n in range(2)]
    outcome, desk = shoot(device, tmp_path, files, Desk(confirms=[0.2]))
    assert isinstance(outcome, Reply)
    assert desk.demands[0] == (
        "camera gave 0 of 2 pictures of T07 in 2 s, without lights 1, 2. Put it right, then confirm."
    )


def test_a_pause_is_not_waiting_and_what_was_taken_stays(tmp_path):
    device, clock, request = camera(tmp_path, lights=2), Clock(), Sense("camera", 5.0, trial_of("T07"))
    desk = Desk(asides=[None] * 60 + [Aside({"do": "pause"})])
    outcome = device.perform(request, Window(clock, arriving(tmp_path, [("1.png", picture(1))])), desk, clock)
    assert outcome == Aside({"do": "pause"})
    clock.t_ns += 600 * 10**9
    desk.asides = [Aside({"do": "go_on"})]
    assert device.perform(request, Window(clock), desk, clock).value == {"do": "go_on"}
    outcome = device.perform(request, Window(clock, arriving(tmp_path, [("2.png", picture(2))])), desk, clock)
    assert isinstance(outcome, Reply) and outcome.value["seconds"] <= 5.0


def test_another_request_starts_over(tmp_path):
    device, clock = camera(tmp_path, lights=2), Clock()
    desk = Desk(asides=[None] * 60 + [Aside({"do": "repeat", "which": "this"})])
    window = Window(clock, arriving(tmp_path, [("1.png", picture(1))]))
    assert isinstance(device.perform(Sense("camera", 30.0, trial_of("T07")), window, desk, clock), Aside)
    outcome, _ = shoot(device, tmp_path, [("2.png", picture(2)), ("3.png", picture(3))])
    assert [picture["from"] for picture in outcome.value["pictures"]] == ["2.png", "3.png"]


def test_a_folder_that_goes_is_a_fault_and_one_that_is_not_there_is_refused(tmp_path):
    device, clock = camera(tmp_path), Clock()
    gone = Window(clock, lambda: (tmp_path / "incoming").exists() and (tmp_path / "incoming").rmdir())
    outcome = device.perform(Sense("camera", 30.0, trial_of("T07")), gone, Desk(), clock)
    assert outcome.value["what"] == "link_lost" and "incoming cannot be read: No such file" in outcome.value["message"]
    with pytest.raises(DeviceError, match="the camera's folder .* cannot be read"):
        device.open()
    assert not device.health(0.0).ok


def test_a_full_disk_is_a_fault_and_leaves_no_half_picture(tmp_path, monkeypatch):
    def full(_descriptor):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("os.fsync", full)
    outcome, _ = shoot(camera(tmp_path), tmp_path, [("1.png", picture(1))])
    assert outcome.value["what"] == "refused" and outcome.value["message"].endswith("no space left on the device")
    assert not list((tmp_path / "kept").rglob("*"))


def test_the_twin_photographs_what_it_is_shown_and_keeps_it_as_it_is(tmp_path):
    device = make("camera", Settings(kind="camera", driver="twin", pictures="kept"), tmp_path)
    device.open()
    assert device.health(0.0).ok
    clock, request = Clock(), Sense("camera", 30.0, trial_of("T07"))
    with pytest.raises(DeviceError, match="has nothing before it"):
        device.perform(request, Window(clock), Desk(), clock)
    device.pictures_of = lambda sense: (picture([n, len(sense.trial.stimulus.id)]) for n in range(10))
    outcome = device.perform(request, Window(clock), Desk(), clock)
    assert len(outcome.value["pictures"]) == 10 and outcome.value["by"] == "twin"
    assert {tuple(picture["flags"]) for picture in outcome.value["pictures"]} == {("too_small",)}
    again = device.perform(Sense("camera", 30.0, trial_of("T07")), Window(clock), Desk(), clock)
    assert again.value["pictures"] == outcome.value["pictures"]


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "TIFF"])
def test_a_picture_of_any_format_that_is_cut_off_is_detected(kind):
    limits, data = Limits(SIDE, 0.05, 0.05), picture(1, kind=kind, mode="RGB")
    assert (look(data, limits).width, look(data, limits).flags) == (SIDE, ())
    for share in (0.0, 0.01, 0.5, 0.98):
        with pytest.raises(Incomplete):
            look(data[: int(len(data) * share)], limits)


def test_sixteen_bits_and_sigmas_raw_files_are_understood():
    values = np.random.default_rng(1).integers(0, 60_000, (SIDE, SIDE)).astype("u2")
    out = io.BytesIO()
    Image.fromarray(values).save(out, "TIFF")
    deep = look(out.getvalue(), Limits(SIDE, 0.05, 0.05))
    assert deep.flags == () and deep.white == 0.0 and deep.sharpness > 5
    raw = bytearray(b"FOVb" + bytes(24) + (5424).to_bytes(4, "little") + (3616).to_bytes(4, "little") + bytes(60))
    whole = bytes(raw + b"SECd" + bytes(8) + len(raw).to_bytes(4, "little"))
    image = look(whole, Limits(1568, 0.05, 0.05))
    assert (image.width, image.height, image.sharpness, image.flags) == (5424, 3616, None, ())
    with pytest.raises(Incomplete, match="before its directory"):
        look(whole[:-6], Limits(1568, 0.05, 0.05))


@pytest.mark.parametrize("name", ["../../etc", "a b", "한글", "x" * 90])
def test_an_id_that_is_no_plain_name_stays_inside_the_folder(tmp_path, name):
    file = keeping.keep("camera", tmp_path, name, 1, "0" * 64, "a.PNG", b"x")
    assert (tmp_path / file).resolve().parent.parent == tmp_path.resolve()
    assert file.endswith("/light01-0000000000000000.png")


def test_a_folder_driver_needs_a_folder():
    with pytest.raises(ValidationError, match="folder is missing"):
        Settings(kind="camera", driver="folder")
