"""Pictures of sessions: which attempts count, where files lie, that none has changed, whose they are."""

import shutil

import pytest

from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.attributes.reading_pictures import photographed
from palpate.studies.participants.people import add as enter
from palpate.studies.participants.registry import open_registry
from palpate.studies.participants.withdrawal import withdraw
from tests.modeling.attributes.photo_labs import TWINS, photos, taken


def test_pictures_of_each_texture_with_its_class_in_the_order_of_the_session(tmp_path):
    made = photos(tmp_path)
    told = {texture: [taken(tmp_path, texture, light) for light in (1, 2)] for texture in ("T03", "T01")}
    for trial, texture in enumerate(told, start=1):
        made.shoot(trial, texture, told[texture])
    made.write()
    first, second = photographed(tmp_path)
    assert (first.id, first.label, first.category) == ("T03", "wood 3 of 9", "foam")
    assert (second.id, second.category, second.simulated) == ("T01", "wood", False)
    assert [each.sha256 for each in first.pictures] == [each["sha256"] for each in told["T03"]]
    assert first.pictures[0].name == "T03, light 1 (texture_photos_E001_s1)"
    assert first.pictures[0].path == tmp_path / "pictures" / told["T03"][0]["file"]
    assert first.album.pictures == first.pictures


def test_the_last_attempt_counts_and_none_that_faulted_or_was_repeated(tmp_path):
    made = photos(tmp_path)
    told = [taken(tmp_path, "T01", light) for light in range(1, 6)]
    made.shoot(1, "T01", told[:1], 1, "faulted")
    made.shoot(1, "T01", told[1:2], 2)
    made.shoot(2, "T02", told[2:3], 1)
    made.begin(3, "T03")
    made.experimenter(do="repeat", which="last")
    made.end("left")
    made.shoot(4, "T04", told[3:4], 1, "repeated")
    made.shoot(4, "T04", told[4:5], 2)
    made.write()
    found = {each.id: [one.sha256 for one in each.pictures] for each in photographed(tmp_path)}
    assert found == {"T01": [told[1]["sha256"]], "T04": [told[4]["sha256"]]}


def test_two_sessions_make_one_texture_and_the_same_bytes_count_once(tmp_path):
    told = [taken(tmp_path, "T01", light) for light in (1, 2)]
    for name, pictures in (("E001", told), ("E002", told[1:])):
        made = photos(tmp_path, name)
        made.shoot(1, "T01", pictures)
        made.write(name)
    (found,) = photographed(tmp_path)
    assert len(found.pictures) == 2


def test_who_withdrew_gave_no_pictures(tmp_path):
    for name, texture in (("E001", "T01"), ("E002", "T02")):
        made = photos(tmp_path, name)
        made.shoot(1, texture, [taken(tmp_path, texture, 1)])
        made.write(name)
    registry = open_registry(tmp_path)
    enter(registry, "E001")
    enter(registry, "E002")
    withdraw(registry, "E001", "asked to")
    assert [each.id for each in photographed(tmp_path)] == ["T02"]


def test_real_and_simulated_pictures_are_not_mixed(tmp_path):
    for name, texture, rig in (("E001", "T01", TWINS), ("E002", "T02", None)):
        made = photos(tmp_path, name)
        made.shoot(1, texture, [taken(tmp_path, texture, 1)])
        made.write(name, rig)
    (real,) = photographed(tmp_path)
    assert (real.id, real.simulated) == ("T02", False)
    assert real.notes == ("pictures of simulated sessions are left out: they are not mixed with others",)
    (made_up,) = photographed(tmp_path, simulated=True)
    assert (made_up.id, made_up.simulated) == ("T01", True)


def test_a_twin_that_kept_no_file_gave_no_picture(tmp_path):
    made = photos(tmp_path)
    made.shoot(1, "T01", [{"light": 1, "surface": "T01"}, {"light": 2, "surface": "T01"}])
    made.write(rig=TWINS)
    (found,) = photographed(tmp_path)
    assert found.pictures == () and found.simulated
    assert found.notes == ("2 simulated pictures were not saved as files: they show nothing here",)


def test_pictures_lie_where_the_session_s_rig_file_put_them(tmp_path):
    made = photos(tmp_path)
    made.shoot(1, "T01", [taken(tmp_path / "stations" / "desk", "T01", 1, folder="shots")])
    made.write(rig={"kind": "live", "twins": [], "settings": {"camera": {"kind": "camera", "pictures": "shots"}}})
    (found,) = photographed(tmp_path)
    assert found.pictures[0].path.is_relative_to(tmp_path / "stations" / "desk" / "shots")
    shutil.move(tmp_path / "stations" / "desk" / "shots", tmp_path / "pictures")
    assert photographed(tmp_path)[0].pictures[0].path.is_relative_to(tmp_path / "pictures")


def test_a_picture_that_has_changed_or_is_missing_is_refused_by_name(tmp_path):
    made = photos(tmp_path)
    told = taken(tmp_path, "T01", 4)
    made.shoot(1, "T01", [told])
    made.write()
    path = tmp_path / "pictures" / told["file"]
    data = path.read_bytes()
    path.write_bytes(data[:-1])
    with pytest.raises(MaterialError, match=r"T01, light 4 \(texture_photos_E001_s1\): .*its SHA-256 differs"):
        photographed(tmp_path)
    path.unlink()
    with pytest.raises(MaterialError, match=r"T01, light 4 .*: no picture .*light04-.*png; copy the pictures"):
        photographed(tmp_path)
    path.write_bytes(data)
    assert len(photographed(tmp_path)) == 1


def test_a_damaged_ledger_is_refused_and_no_session_is_nothing(tmp_path):
    assert photographed(tmp_path) == ()
    made = photos(tmp_path)
    made.shoot(1, "T01", [taken(tmp_path, "T01", 1)])
    made.write()
    made.path.write_bytes(made.path.read_bytes()[:5000])
    with pytest.raises(MaterialError, match=r"texture_photos_E001_s1.sqlite"):
        photographed(tmp_path)
