"""The library of a lab: from real ledgers, a real model file and pictures on record."""

import hashlib
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from modeling.attributes import reading
from modeling.attributes.material import MaterialError
from modeling.attributes.methods import Learning
from modeling.attributes.model_file import NAME, read_model, write_model
from modeling.attributes.registry import METHODS
from modeling.commands_library import textures
from modeling.library.entries import NOTHING_KNOWN, LibraryError, felt
from modeling.library.files import NewerLibrary, place_of, read_library
from modeling.library.finding import find, wishes_of
from modeling.library.lab import index
from modeling.library.sources import Wanted, predictor_of
from tests.modeling.attributes.made_material import PAIRS, made_material
from tests.modeling.attributes.photo_labs import TWINS, photos, rated_by, taken

MATERIAL = made_material(textures=8, segments=4, pictures=2)


def with_model(folder, **card):
    """A ridge regression of the first six made textures, written as training does."""
    learned = MATERIAL.textures[:6]
    fitted = METHODS["ridge"].fit(Learning(learned, (), PAIRS))
    interval = {"method": "of a test", "coverage": 0.9, "half_width": (8.0, 9.0, 10.0, 11.0)}
    told = {
        "name": NAME, "title": "A test", "method": "ridge", "touch": ("mfcc", "hand"), "sight": ("resnet", "glcm"),
        "attributes": tuple((pair.low, pair.high) for pair in PAIRS), "learned": tuple(each.id for each in learned),
        "interval": interval, "weights": MATERIAL.weights,
    }  # fmt: skip
    return write_model(folder, fitted, {**told, **card}, METHODS)


@pytest.fixture
def features(monkeypatch):
    """The lab's features are the made ones; the two that were not learned from are not rated either."""
    asked = {}

    def read_material(lab, **given):
        asked.update(given)
        own = (*MATERIAL.textures[:6], *(replace(each, rated=None) for each in MATERIAL.textures[6:]))
        return replace(MATERIAL, textures=own)

    monkeypatch.setattr(reading, "read_material", read_material)
    return asked


@pytest.fixture
def lab(tmp_path):
    """Three textures that four simulated people rated, of two of which a camera took pictures."""
    rated_by(tmp_path, ("P001", "P002", "P003", "P004"))
    session = photos(tmp_path)
    for place, texture in enumerate(("T01", "T02"), start=1):
        session.shoot(place, texture, [taken(tmp_path, texture, light) for light in (1, 2)])
    session.write(rig=TWINS)
    return tmp_path


def test_ratings_alone_make_a_library_that_can_be_searched(lab):
    found = index(Wanted(lab))
    library = read_library(lab)
    assert library == found.told.library and found.changed and library.simulated
    assert found.counts == {"textures": 3, "rated": 3, "predicted": 0, "pictures": 2, "left_out": 0}
    first = library.textures[0]
    assert (first.id, first.label, first.category, first.rated.raters) == ("T01", "wood 1 of 4", "wood", 4)
    usual = np.mean([np.square(each.rated.sd) for each in library.textures], axis=0)
    believed = np.sqrt((3 * np.square(first.rated.sd) + 5 * usual) / 8)
    assert first.rated.se == pytest.approx(believed / 2, abs=2e-3)  # four people
    assert find(library.textures, wishes_of(library, ["smooth, not soft"]))[0].entry.id == "T01"


def test_the_sources_are_named_with_their_content(lab):
    library = index(Wanted(lab)).told.library
    assert [each.file for each in library.sources] == [
        f"sessions/texture_ratings_P00{n}_s1.sqlite" for n in range(1, 5)
    ]
    for each in library.sources:
        assert each.sha256 == hashlib.sha256((lab / each.file).read_bytes()).hexdigest()


def test_made_again_it_is_the_same_file(lab):
    index(Wanted(lab))
    files = {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in place_of(lab).parent.rglob("*.*")}
    assert len(files) == 3
    again = index(Wanted(lab))
    assert not again.changed and again.gone == ()
    assert {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in place_of(lab).parent.rglob("*.*")} == files


def test_what_is_gone_is_told_and_its_picture_goes(lab):
    index(Wanted(lab))
    for path in (lab / "sessions").glob("texture_ratings_*"):
        path.unlink()
    rated_by(lab, ("P005", "P006"), ("T02", "T03"))
    assert index(Wanted(lab)).gone == ("T01",)
    assert [path.name for path in (lab / "library" / "pictures").iterdir()] == ["T02.jpg"]


def test_pictures_of_a_folder_stand_in_for_those_of_sessions(lab, tmp_path):
    taken(lab, "T03", 1, folder="own")
    found = index(Wanted(lab, pictures=lab / "own"))
    assert [each.picture for each in found.told.library.textures] == [None, None, "pictures/T03.jpg"]


def test_a_model_predicts_what_nobody_rated_and_says_what_it_learned(tmp_path, features):
    with_model(tmp_path / "models")
    library = index(Wanted(tmp_path, workers=1)).told.library
    assert features["touch"] and features["sight"] and not features["quick"] and features["workers"] == 1
    learned, new = library.textures[0], library.textures[7]
    assert learned.predicted.learned and learned.rated is not None
    assert new.rated is None and not new.predicted.learned
    expected = read_model(tmp_path / "models").predict(MATERIAL.textures[7]).mean(axis=0)
    assert new.predicted.value == pytest.approx(np.clip(expected, 0, 100), abs=1e-3)
    assert np.array(new.predicted.high) - new.predicted.value == pytest.approx([8, 9, 10, 11], abs=2e-3)
    assert felt(new, 3).sd == pytest.approx(11 / 1.644854, abs=1e-3)  # qnorm(0.95) in R
    (source,) = library.sources[-1:]
    card = tmp_path / "models" / f"{NAME}.json"
    assert source.sha256 == hashlib.sha256(card.read_bytes()).hexdigest() and source.what == "model: ridge"


def test_a_model_from_features_in_a_hurry_is_asked_about_such_ones(tmp_path, features):
    with_model(tmp_path / "models", training={"configuration": {"quick": True}}, sight=())
    index(Wanted(tmp_path))
    assert features["quick"] and not features["sight"]


def test_a_model_without_intervals_is_taken_as_unsure(tmp_path, features):
    card = with_model(tmp_path, interval=None)
    model = predictor_of(read_model(card))
    assert model.high == pytest.approx(1.644854 * NOTHING_KNOWN[1]) and "no intervals" in model.notes[-1]


def test_other_weights_than_the_model_learned_from_are_refused(tmp_path, features):
    card = with_model(tmp_path / "elsewhere", weights="a file 0123")
    with pytest.raises(
        LibraryError, match="it learned from ResNet-50 with a file 0123, and these features have made up"
    ):
        index(Wanted(tmp_path, model=card))


def test_a_lab_with_a_model_can_be_indexed_without_it(lab):
    with_model(lab / "models")
    assert index(Wanted(lab, without_model=True)).counts["predicted"] == 0
    with pytest.raises(MaterialError, match="no such|no recording|picture"):
        index(Wanted(lab / "none", model=lab / "models" / f"{NAME}.json"))


def test_where_there_is_nothing_it_is_told_what_to_do(tmp_path):
    with pytest.raises(LibraryError, match="no texture was rated, and there is no model.*run texture_ratings"):
        index(Wanted(tmp_path))
    assert not place_of(tmp_path).exists()


def test_a_newer_library_is_not_overwritten(lab):
    place_of(lab).parent.mkdir()
    place_of(lab).write_text('{"format": "palpate-library/9"}')
    with pytest.raises(NewerLibrary):
        index(Wanted(lab))
    place_of(lab).write_text("damaged")
    assert index(Wanted(lab)).changed


def test_the_verb_tells_what_it_did(lab):
    def said(*arguments):
        result = CliRunner().invoke(textures, ["index", "--lab", str(lab), *arguments], catch_exceptions=False)
        assert result.exit_code == 0
        return result.stdout

    assert said().startswith("3 textures: 3 rated, 0 predicted, 2 with a picture\n")
    assert said().endswith("index.json (as it was)\n") and '"changed":false' in said("--json")


def test_a_folder_of_images_with_a_table_makes_a_library(tmp_path):
    for place in (1, 2):
        taken(tmp_path, f"T0{place}", 1, folder="own")
    table = tmp_path / "own" / "ratings.csv"
    table.write_text(
        "id,label,class,Rough-Smooth,Flat-Bumpy,Sticky-Slippery,Hard-Soft,raters\n"
        "T01,grit,paper,10,40,35,20,8\nT02,felt,cloth,60,30,40,90,8\n"
    )
    found = index(Wanted(tmp_path, folder=tmp_path / "own", workers=1))
    assert found.counts == {"textures": 2, "rated": 2, "predicted": 0, "pictures": 2, "left_out": 0}
    library = found.told.library
    assert [(each.label, each.category, each.rated.mean[0]) for each in library.textures] == [
        ("grit", "paper", 10), ("felt", "cloth", 60),
    ]  # fmt: skip
    assert library.textures[0].rated.se == pytest.approx((20 / np.sqrt(8),) * 4, abs=1e-3)  # no SD is told
    assert library.sources[0].sha256 == hashlib.sha256(table.read_bytes()).hexdigest()
