"""A lab's material: recordings, pictures and ratings joined by texture; gaps are noted, cached features are used."""

import hashlib
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from palpate.modeling.attributes.folds import groups_of
from palpate.modeling.attributes.material import FEW_READ, MaterialError
from palpate.modeling.attributes.reading import read_material
from palpate.studies.participants.people import add as enter
from palpate.studies.participants.registry import open_registry
from palpate.studies.participants.withdrawal import withdraw
from tests.modeling.attributes.captured_textures import session
from tests.modeling.attributes.photo_labs import LIVE, photos, rated_by, taken


def read(lab, **options):
    return read_material(lab, **{"quick": True, "variants": 0, "workers": 1, **options})


def write_pictures(lab, *textures, lights=1):
    session = photos(lab)
    for trial, texture in enumerate(textures, start=1):
        session.shoot(trial, texture, [taken(lab, texture, light) for light in range(1, lights + 1)])
    session.write()


@pytest.fixture
def lab(tmp_path):
    """T01 has everything; T02 no picture, T03 no recording, T04 only ratings."""
    session(tmp_path, "P001", [{"stimulus": "T01"}, {"stimulus": "T02"}])
    write_pictures(tmp_path, "T01", "T03")
    rated_by(tmp_path, ("P001", "P002"), ("T01", "T02", "T03", "T04"))
    return tmp_path


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_textures_are_joined_by_their_ids_and_keep_what_they_have(lab):
    material = read(lab, variants=1)
    assert material.ids == ("T01", "T02", "T03", "T04")
    whole, unseen, unfelt, rated = material.textures
    assert {kind: rows.shape for kind, rows in whole.touch.items()} == {
        "mfcc": (1, 520), "hand": (1, 6), "dft": (1, 250), "dwt": (1, 24)
    }  # fmt: skip
    for rows in (whole.sight, whole.variants):
        assert {kind: values.shape for kind, values in rows.items()} == {"resnet": (1, 2048), "glcm": (1, 256)}
    assert whole.rows("touch", ("mfcc", "hand")).shape == (1, 526)
    assert whole.rows("sight", ("resnet", "glcm")).shape == (1, 2304)
    assert (whole.label, whole.category) == ("wood 1 of 9", "wood") and len(whole.made_from) == 2
    assert unseen.sight == {} and "not photographed" in unseen.notes and "not recorded" not in unseen.notes
    assert unfelt.touch == {} and "not recorded" in unfelt.notes and unfelt.category == "foam"
    assert (rated.label, rated.category) == ("wood 4 of 4", "wood") and rated.made_from == frozenset()
    assert all(texture.rated is not None and texture.rated.raters == 2 for texture in material.textures)
    assert [pair.name for pair in material.attributes] == ["Rough-Smooth", "Flat-Bumpy", "Sticky-Slippery", "Hard-Soft"]
    assert material.weights.startswith("random (He normal, seed 0)") and material.simulated
    assert "quick look: 2 x 2 of 7 x 7 patches of at most 3 pictures of a texture" in material.notes


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_of_some_textures_alone_features_are_made_and_they_have_everything(lab):
    session(lab, "P002", [{"stimulus": "T03"}, {"stimulus": "T05"}])
    lines = []
    material = read(lab, most=1, report=lines.append)
    assert material.ids in (("T01",), ("T03",)) and material.textures[0].touch and material.textures[0].sight
    assert len(lines) == 2 and FEW_READ in material.notes
    assert set(read(lab, most=4).ids) == {"T01", "T03"}
    assert set(read(lab, most=5).ids) == {"T01", "T02", "T03", "T04", "T05"}  # there are no more than that


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_what_is_kept_is_not_made_again(lab):
    lines = []
    first = read(lab, report=lines.append)
    entries = {path: path.stat().st_mtime_ns for path in (lab / "features").iterdir()}
    assert len(entries) == 2 * (2 + 2) and any("recordings of T01" in line for line in lines)
    lines.clear()
    again = read(lab, report=lines.append)
    assert lines == [] and entries == {path: path.stat().st_mtime_ns for path in (lab / "features").iterdir()}
    next((lab / "features").glob("*.npz")).write_bytes(b"damaged")
    third = read(lab, report=lines.append)
    assert len(lines) == 1
    for one, other, last in zip(first.textures, again.textures, third.textures, strict=True):
        assert one.notes == other.notes == last.notes and one.made_from == other.made_from == last.made_from
        for kind, rows in {**one.touch, **one.sight}.items():
            for material in (other, last):
                np.testing.assert_array_equal(rows, {**material.touch, **material.sight}[kind])


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_touch_or_sight_alone_and_nothing_kept(lab):
    touch, sight = read(lab, sight=False, keep=False), read(lab, touch=False, keep=False)
    assert not (lab / "features").exists()
    assert touch.weights == "" and not any(texture.sight for texture in touch.textures)
    assert not any("photographed" in note for texture in touch.textures for note in texture.notes)
    assert sight.weights and not any(texture.touch for texture in sight.textures)
    assert sight.ids == ("T01", "T03", "T02", "T04")
    with pytest.raises(MaterialError, match="neither touch nor sight is requested"):
        read(lab, touch=False, sight=False)


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_a_texture_that_was_never_touched_and_lifted_segments_are_reported(tmp_path):
    session(tmp_path, "P001", [{"stimulus": "T01"}, {"stimulus": "T02", "press": 0.05}])
    whole, lifted = read(tmp_path).textures
    assert len(whole.touch["mfcc"]) == 1
    assert lifted.touch == {} and any("T02: no contact in any of 1 segments" in note for note in lifted.notes)


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_recordings_of_twins_or_of_a_rig_are_taken_and_never_both(tmp_path):
    session(tmp_path, "P001", [{"stimulus": "T01"}, {"stimulus": "T02"}])
    session(tmp_path, "P002", [{"stimulus": "T01", "seed": 9}], rig=LIVE)
    real, twins = read(tmp_path), read(tmp_path, simulated=True)
    assert real.ids == ("T01",) and not real.simulated
    assert twins.ids == ("T01", "T02") and twins.simulated
    assert not np.array_equal(real.textures[0].touch["mfcc"], twins.textures[0].touch["mfcc"])


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_where_all_who_touched_withdrew_the_pictures_are_left(tmp_path):
    session(tmp_path, "P001", [{"stimulus": "T01"}])
    write_pictures(tmp_path, "T01")
    registry = open_registry(tmp_path)
    enter(registry, "P001")
    withdraw(registry, "P001", "asked to")
    material = read(tmp_path)
    assert material.textures[0].touch == {} and material.textures[0].sight
    assert any("nothing was felt: " in note and "a participant who withdrew" in note for note in material.notes)


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_a_recording_that_cannot_be_used_leaves_the_texture_with_a_note(tmp_path):
    session(tmp_path, "P001", [{"stimulus": "T01"}, {"stimulus": "T02", "seconds": 4.0}])
    whole, short = read(tmp_path).textures
    assert whole.touch["mfcc"].shape == (1, 520)
    assert short.touch == {} and "no recording of it can be used" in short.notes
    (why,) = (note for note in short.notes if note.startswith("recordings left out: "))
    assert why.endswith("record longer") and short.made_from  # a lab's recordings are trimmed as they are
    assert read(tmp_path).textures[1].notes == short.notes


@pytest.mark.needs("librosa", "pywt")
def test_half_a_recording_that_the_tracker_did_not_see_is_noted_for_its_texture(tmp_path):
    session(tmp_path, "P001", [{"stimulus": "T01"}, {"stimulus": "T02", "seconds": 7.0, "seen_s": 4.0}])
    for _ in range(2):  # made, and kept
        whole, half = read(tmp_path).textures
        assert half.touch["mfcc"].shape == (2, 520)
        assert any("all signals are known together for 3.94 of 7.00 s" in note for note in half.notes)
        assert not any("known together" in note for note in whole.notes)


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_a_picture_that_shows_nothing_leaves_the_texture_with_a_note(tmp_path):
    write_pictures(tmp_path, "T01")
    session = photos(tmp_path, "E002")
    session.shoot(1, "T02", [taken(tmp_path, "T02", 1, side=10 + 6)])
    session.write("E002")
    material = read(tmp_path)
    assert material.textures[0].sight and not material.simulated
    assert material.textures[1].sight == {} and "no picture of it can be used" in material.textures[1].notes
    assert any("16 x 16 pixels: 224 on the shorter side are the least" in note for note in material.textures[1].notes)
    assert material.textures[1].rated is None and "not rated" in material.textures[1].notes
    assert "no session of texture_capture: nothing was felt" in material.notes


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_the_same_black_picture_of_two_textures_does_not_join_them(tmp_path):
    black = BytesIO()
    Image.new("L", (256, 256), 0).save(black, "PNG")
    session = photos(tmp_path)
    for trial, texture in enumerate(("T01", "T02"), start=1):
        entry = taken(tmp_path, texture, 2)
        (tmp_path / "pictures" / entry["file"]).write_bytes(black.getvalue())
        changed_entry = {**entry, "sha256": hashlib.sha256(black.getvalue()).hexdigest()}
        session.shoot(trial, texture, [taken(tmp_path, texture, 1), changed_entry])
    session.write()
    material = read(tmp_path, variants=1)
    assert [texture.sight["resnet"].shape for texture in material.textures] == 2 * [(2, 2048)]
    assert groups_of(material.textures) == (("T01",), ("T02",))
    assert all(len(texture.made_from) == 1 for texture in material.textures)
    assert groups_of(read(tmp_path, variants=1).textures) == (("T01",), ("T02",))


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_three_of_many_pictures_in_a_quick_look_and_all_group_the_texture(tmp_path):
    write_pictures(tmp_path, "T01", lights=5)
    (texture,) = read(tmp_path).textures
    assert texture.sight["resnet"].shape == (3, 2048) and len(texture.made_from) == 5


def test_a_lab_with_nothing_to_learn_from_is_refused(tmp_path):
    with pytest.raises(MaterialError, match="no such lab"):
        read(tmp_path / "nowhere")
    with pytest.raises(MaterialError, match="no picture of a texture in texture_capture or texture_photos that can"):
        read(tmp_path)
    session = photos(tmp_path)
    entry = taken(tmp_path, "T01", 1)
    session.shoot(1, "T01", [entry])
    session.write()
    (tmp_path / "pictures" / entry["file"]).write_bytes(b"changed")
    with pytest.raises(MaterialError, match="T01, light 1 .*its SHA-256 differs"):
        read(tmp_path)
    with pytest.raises(MaterialError, match="cannot be read"):
        read(tmp_path, weights=tmp_path / "none.pth")
