"""Pictures of sessions: which attempts count, where files lie, that none has changed, whose they are."""

import shutil

import pytest

from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.attributes.reading_pictures import texture_pictures
from palpate.studies.participants.people import add as enter
from palpate.studies.participants.registry import open_registry
from palpate.studies.participants.withdrawal import withdraw
from tests.modeling.attributes.photo_labs import TWINS, photos, taken


def test_pictures_of_each_texture_with_its_class_in_the_order_of_the_session(tmp_path):
    session = photos(tmp_path)
    entries = {texture: [taken(tmp_path, texture, light) for light in (1, 2)] for texture in ("T03", "T01")}
    for trial, texture in enumerate(entries, start=1):
        session.shoot(trial, texture, entries[texture])
    session.write()
    first, second = texture_pictures(tmp_path)
    assert (first.id, first.label, first.category) == ("T03", "wood 3 of 9", "foam")
    assert (second.id, second.category, second.simulated) == ("T01", "wood", False)
    assert [picture.sha256 for picture in first.pictures] == [entry["sha256"] for entry in entries["T03"]]
    assert first.pictures[0].name == "T03, light 1 (texture_photos_E001_s1)"
    assert first.pictures[0].path == tmp_path / "pictures" / entries["T03"][0]["file"]
    assert first.album.pictures == first.pictures


def test_the_last_attempt_counts_and_none_that_faulted_or_was_repeated(tmp_path):
    session = photos(tmp_path)
    entries = [taken(tmp_path, "T01", light) for light in range(1, 6)]
    session.shoot(1, "T01", entries[:1], 1, "faulted")
    session.shoot(1, "T01", entries[1:2], 2)
    session.shoot(2, "T02", entries[2:3], 1)
    session.begin(3, "T03")
    session.experimenter(do="repeat", which="last")
    session.end("left")
    session.shoot(4, "T04", entries[3:4], 1, "repeated")
    session.shoot(4, "T04", entries[4:5], 2)
    session.write()
    digests = {texture.id: [one.sha256 for one in texture.pictures] for texture in texture_pictures(tmp_path)}
    assert digests == {"T01": [entries[1]["sha256"]], "T04": [entries[4]["sha256"]]}


def test_two_sessions_make_one_texture_and_the_same_bytes_count_once(tmp_path):
    entries = [taken(tmp_path, "T01", light) for light in (1, 2)]
    for name, pictures in (("E001", entries), ("E002", entries[1:])):
        session = photos(tmp_path, name)
        session.shoot(1, "T01", pictures)
        session.write(name)
    (texture,) = texture_pictures(tmp_path)
    assert len(texture.pictures) == 2


def test_who_withdrew_gave_no_pictures(tmp_path):
    for name, texture in (("E001", "T01"), ("E002", "T02")):
        session = photos(tmp_path, name)
        session.shoot(1, texture, [taken(tmp_path, texture, 1)])
        session.write(name)
    registry = open_registry(tmp_path)
    enter(registry, "E001")
    enter(registry, "E002")
    withdraw(registry, "E001", "asked to")
    assert [texture.id for texture in texture_pictures(tmp_path)] == ["T02"]


def test_real_and_simulated_pictures_are_not_mixed(tmp_path):
    for name, texture, rig in (("E001", "T01", TWINS), ("E002", "T02", None)):
        session = photos(tmp_path, name)
        session.shoot(1, texture, [taken(tmp_path, texture, 1)])
        session.write(name, rig)
    (real,) = texture_pictures(tmp_path)
    assert (real.id, real.simulated) == ("T02", False)
    assert real.notes == ("pictures of simulated sessions are left out: they are not mixed with others",)
    (simulated,) = texture_pictures(tmp_path, simulated=True)
    assert (simulated.id, simulated.simulated) == ("T01", True)


def test_a_twin_that_kept_no_file_gave_no_picture(tmp_path):
    session = photos(tmp_path)
    session.shoot(1, "T01", [{"light": 1, "surface": "T01"}, {"light": 2, "surface": "T01"}])
    session.write(rig=TWINS)
    (texture,) = texture_pictures(tmp_path)
    assert texture.pictures == () and texture.simulated
    assert texture.notes == ("2 simulated pictures were not saved as files: they show nothing here",)


def test_pictures_lie_where_the_session_s_rig_file_put_them(tmp_path):
    session = photos(tmp_path)
    session.shoot(1, "T01", [taken(tmp_path / "stations" / "desk", "T01", 1, folder="shots")])
    session.write(rig={"kind": "live", "twins": [], "settings": {"camera": {"kind": "camera", "pictures": "shots"}}})
    (texture,) = texture_pictures(tmp_path)
    assert texture.pictures[0].path.is_relative_to(tmp_path / "stations" / "desk" / "shots")
    shutil.move(tmp_path / "stations" / "desk" / "shots", tmp_path / "pictures")
    assert texture_pictures(tmp_path)[0].pictures[0].path.is_relative_to(tmp_path / "pictures")


def test_a_picture_that_has_changed_or_is_missing_is_refused_by_name(tmp_path):
    session = photos(tmp_path)
    entry = taken(tmp_path, "T01", 4)
    session.shoot(1, "T01", [entry])
    session.write()
    path = tmp_path / "pictures" / entry["file"]
    data = path.read_bytes()
    path.write_bytes(data[:-1])
    with pytest.raises(MaterialError, match=r"T01, light 4 \(texture_photos_E001_s1\): .*its SHA-256 differs"):
        texture_pictures(tmp_path)
    path.unlink()
    with pytest.raises(MaterialError, match=r"T01, light 4 .*: no picture .*light04-.*png; copy the pictures"):
        texture_pictures(tmp_path)
    path.write_bytes(data)
    assert len(texture_pictures(tmp_path)) == 1


def test_a_damaged_ledger_is_refused_and_no_session_is_nothing(tmp_path):
    assert texture_pictures(tmp_path) == ()
    session = photos(tmp_path)
    session.shoot(1, "T01", [taken(tmp_path, "T01", 1)])
    session.write()
    session.path.write_bytes(session.path.read_bytes()[:5000])
    with pytest.raises(MaterialError, match=r"texture_photos_E001_s1.sqlite"):
        texture_pictures(tmp_path)
