"""The library of a lab: from real ledgers, a real model file and pictures on record."""

import hashlib
import io
import os
import shutil
import signal
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from palpate.modeling.attributes import seeing
from palpate.modeling.attributes.material import QUICK_LOOK, MaterialError
from palpate.modeling.attributes.methods import Learning
from palpate.modeling.attributes.model_file import NAME, read_model, write_model
from palpate.modeling.attributes.reading import read_material
from palpate.modeling.attributes.reading_folder import SUFFIXES
from palpate.modeling.attributes.reading_folder import pictures_of as pictures_of_texture
from palpate.modeling.attributes.registry import METHODS
from palpate.modeling.commands_library import textures
from palpate.modeling.library.contact_sheet import pictures_of
from palpate.modeling.library.entries import NOTHING_KNOWN, LibraryError, value_of
from palpate.modeling.library.files import NewerLibrary, place_of, read_library
from palpate.modeling.library.lab import SIDE, index, name_of, remove_thumbnails, save_thumbnail, thumbnail
from palpate.modeling.library.search import find, wishes_of
from palpate.modeling.library.sources import LibraryOptions, pictures_in, predictor_of
from palpate.protocols.plan import compile_plan
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import SHIPPED, read_study
from palpate.studies.collecting.collect import collect, open_database
from palpate.studies.participants.people import add as enter
from palpate.studies.participants.registry import open_registry
from palpate.studies.participants.withdrawal import withdraw
from palpate.studies.sessions.session import start
from palpate.studies.simulation.rig import simulated
from tests.modeling.attributes.captured_textures import session
from tests.modeling.attributes.photo_labs import TWINS, photos, rated_by, taken

LEARNED = ("T01", "T02")


def with_model(lab, kind="touch", folder=None, **card):
    """A ridge regression of two of the lab's textures, by what was felt or seen of them; written as training does."""
    material = material_in(lab, kind)
    learned = tuple(texture for texture in material.textures if texture.id in LEARNED)
    touch, sight = (("mfcc", "hand"), ()) if kind == "touch" else ((), ("resnet", "glcm"))
    fitted = METHODS["ridge"].fit(Learning(learned, (), material.attributes, touch, sight))
    interval = {"method": "of a test", "coverage": 0.9, "half_width": (8.0, 9.0, 10.0, 11.0)}
    card_fields = {
        "name": NAME, "title": "A test", "method": "ridge", "touch": touch, "sight": sight,
        "weights": material.weights, "learned": LEARNED,
        "attributes": tuple((pair.low, pair.high) for pair in material.attributes), "interval": interval,
        "training": {"configuration": {"quick": True}},
    }  # fmt: skip
    return write_model(folder or lab / "models", fitted, {**card_fields, **card}, METHODS)


def material_in(lab, kind):
    """The textures with what was felt or seen of them, from a quick look."""
    return read_material(lab, quick=True, variants=0, workers=1, touch=kind == "touch", sight=kind == "sight")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Three textures in real ledgers: all of them felt, two rated by four people and photographed."""
    folder = tmp_path_factory.mktemp("whole")
    session(folder, "P009", [{"stimulus": name, "seconds": 7.0} for name in ("T01", "T02", "T03")])
    rated_by(folder, ("P001", "P002", "P003", "P004"), LEARNED)
    pictures = photos(folder)
    for place, texture in enumerate(LEARNED, start=1):
        pictures.shoot(place, texture, [taken(folder, texture, 1)])
    pictures.write(rig=TWINS)
    material_in(folder, "sight")  # Its features are kept: they are made once for all tests.
    return folder


@pytest.fixture
def felt_lab(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "lab")


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
    result = index(LibraryOptions(lab))
    library = read_library(lab)
    assert library == result.indexed.library and result.changed and library.simulated
    assert result.counts == {"textures": 3, "rated": 3, "predicted": 0, "pictures": 2, "left_out": 0}
    first = library.textures[0]
    assert (first.id, first.label, first.category, first.rated.raters) == ("T01", "wood 1 of 4", "wood", 4)
    usual = np.mean([np.square(texture.rated.sd) for texture in library.textures], axis=0)
    believed = np.sqrt((3 * np.square(first.rated.sd) + 5 * usual) / 8)
    assert first.rated.se == pytest.approx(believed / 2, abs=2e-3)  # four people
    assert find(library.textures, wishes_of(library, ["smooth, not soft"]))[0].entry.id == "T01"


def test_the_sources_are_named_with_their_content(lab):
    library = index(LibraryOptions(lab)).indexed.library
    assert [source.file for source in library.sources] == [
        f"sessions/texture_ratings_P00{n}_s1.sqlite" for n in range(1, 5)
    ]
    for source in library.sources:
        assert source.sha256 == hashlib.sha256((lab / source.file).read_bytes()).hexdigest()


def interrupted(lab, participant):
    """A simulated session of texture_ratings that Ctrl-C ended after its first texture."""
    loaded = read_study(SHIPPED / "texture_ratings" / "study.yaml")
    stimuli = tuple(stimulus for stimulus in loaded.study.stimuli if stimulus.id in ("T01", "T02", "T03"))
    study = loaded.study.model_copy(update={"stimuli": stimuli, "opening": ()})
    rig = simulated(study, loaded.folder)

    def stop(event):
        if event.kind == "trial_ended":
            os.kill(os.getpid(), signal.SIGINT)

    plan = compile_plan(study, ParticipantRow(participant, None, 0))
    assert start(lab, plan, replace(rig, open=lambda *a: replace(rig.open(*a), watch=stop))).status == "interrupted"


def test_only_sessions_that_ratings_were_taken_from_are_sources(lab):
    """One was interrupted, one withdrew, and one is left out by the lab's analysis plan."""
    rated_by(lab, ("P005", "P006"))
    (lab / "sessions" / "texture_ratings_P003_s1.sqlite").unlink()
    interrupted(lab, "P003")
    registry = open_registry(lab)
    enter(registry, "P005")
    withdraw(registry, "P005", "asked to")
    plan = lab / "studies" / "texture_ratings" / "analysis.yaml"
    plan.parent.mkdir(parents=True)
    plan.write_text("study: texture_ratings\nexclusions: [{participants: [P006], because: sneezed}]\ntests: []\n")
    library = index(LibraryOptions(lab)).indexed.library
    assert {texture.rated.raters for texture in library.textures} == {3}
    assert [source.file for source in library.sources] == [
        f"sessions/texture_ratings_P00{n}_s1.sqlite" for n in (1, 2, 4)
    ]


def test_ratings_that_were_collected_are_the_source_where_no_session_is_here(lab):
    paths = sorted((lab / "sessions").glob("texture_ratings_*.sqlite"))
    engine = open_database(f"sqlite:///{lab / 'lab.sqlite'}")
    list(collect(paths, engine))
    engine.dispose()
    for path in paths:
        path.unlink()
    assert [source.file for source in index(LibraryOptions(lab)).indexed.library.sources] == ["lab.sqlite"]


def picture_of(lab, texture, light=1):
    return next((lab / "pictures" / texture).glob(f"light{light:02d}-*"))


def test_a_picture_that_is_missing_or_changed_gives_way_to_the_next_one(lab):
    first = index(LibraryOptions(lab)).indexed.library
    picture_of(lab, "T01").unlink()
    picture_of(lab, "T02").write_bytes(b"changed")
    library = index(LibraryOptions(lab)).indexed.library
    assert [texture.picture for texture in library.textures] == [texture.picture for texture in first.textures]
    assert library.notes == first.notes


def test_without_any_picture_a_texture_is_indexed_with_a_note_and_a_plain_tile(lab):
    for light in (1, 2):
        picture_of(lab, "T01", light).unlink()
    result = index(LibraryOptions(lab))
    assert result.counts == {"textures": 3, "rated": 3, "predicted": 0, "pictures": 1, "left_out": 0}
    assert result.indexed.library.notes[-1].startswith(
        "no picture is shown of T01: texture_photos_E001_s1: no picture "
    )
    one, two = pictures_of(result.indexed.library.textures[:2], place_of(lab).parent)
    assert one is None and two[:2] == b"\xff\xd8"  # so begins a JPEG file
    assert not index(LibraryOptions(lab)).changed


def test_a_file_that_is_no_picture_leaves_a_plain_tile_too(lab):
    taken(lab, "T03", 1, folder="own")
    (lab / "own" / "T01.png").write_bytes(b"no picture")
    result = index(LibraryOptions(lab, pictures=lab / "own"))
    assert [texture.picture for texture in result.indexed.library.textures] == [None, None, "pictures/T03.jpg"]
    assert (
        "no picture is shown of T01: " in result.indexed.library.notes[-1]
        and "T01.png" in result.indexed.library.notes[-1]
    )


def test_made_again_it_is_the_same_file(lab):
    index(LibraryOptions(lab))
    files = {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in place_of(lab).parent.rglob("*.*")}
    assert len(files) == 3
    again = index(LibraryOptions(lab))
    assert not again.changed and again.removed == ()
    assert {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in place_of(lab).parent.rglob("*.*")} == files


def test_what_is_gone_is_reported_and_its_picture_goes(lab):
    index(LibraryOptions(lab))
    for path in (lab / "sessions").glob("texture_ratings_*"):
        path.unlink()
    rated_by(lab, ("P005", "P006"), ("T02", "T03"))
    assert index(LibraryOptions(lab)).removed == ("T01",)
    assert [path.name for path in (lab / "library" / "pictures").iterdir()] == ["T02.jpg"]


def test_pictures_of_a_folder_stand_in_for_those_of_sessions(lab, tmp_path):
    taken(lab, "T03", 1, folder="own")
    result = index(LibraryOptions(lab, pictures=lab / "own"))
    assert [texture.picture for texture in result.indexed.library.textures] == [None, None, "pictures/T03.jpg"]


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_a_model_predicts_what_nobody_rated_and_says_what_it_learned(felt_lab):
    with_model(felt_lab)
    library = index(LibraryOptions(felt_lab, workers=1)).indexed.library
    assert [texture.id for texture in library.textures] == ["T01", "T02", "T03"]
    learned, new = library.textures[0], library.textures[2]
    assert learned.predicted.learned and learned.rated.raters == 4
    assert new.rated is None and not new.predicted.learned
    expected = read_model(felt_lab / "models").predict(material_in(felt_lab, "touch").textures[2]).mean(axis=0)
    assert new.predicted.value == pytest.approx(np.clip(expected, 0, 100), abs=1e-3)
    assert np.array(new.predicted.high) - new.predicted.value == pytest.approx([8, 9, 10, 11], abs=2e-3)
    assert value_of(new, 3).sd == pytest.approx(11 / 1.644854, abs=1e-3)  # qnorm(0.95) in R
    (source,) = library.sources[-1:]
    card = felt_lab / "models" / f"{NAME}.json"
    assert source.sha256 == hashlib.sha256(card.read_bytes()).hexdigest() and source.what == "model: ridge"
    assert source.file == f"models/{NAME}.json"


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_a_model_from_elsewhere_is_named_without_a_place_in_the_lab(felt_lab, tmp_path):
    card = with_model(felt_lab, folder=tmp_path / "elsewhere" / "models")
    (source,) = index(LibraryOptions(felt_lab, model=card, workers=1)).indexed.library.sources[-1:]
    assert source.file == card.name and source.sha256 == hashlib.sha256(card.read_bytes()).hexdigest()


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_a_model_predicts_from_features_made_as_those_that_it_learned_from(felt_lab):
    """Features of a quick look at pictures are cached; those of all pictures would be computed anew."""
    with_model(felt_lab, "sight")
    before, lines = set((felt_lab / "features").iterdir()), []
    library = index(LibraryOptions(felt_lab, workers=1), lines.append).indexed.library
    assert set((felt_lab / "features").iterdir()) == before and not any("pictures of T" in line for line in lines)
    assert QUICK_LOOK in library.notes
    first = material_in(felt_lab, "sight").textures[0]
    expected = read_model(felt_lab / "models").predict(first).mean(axis=0)
    assert library.textures[0].predicted.value == pytest.approx(np.clip(expected, 0, 100), abs=1e-3)


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_a_model_without_intervals_is_taken_as_unsure(felt_lab):
    model = predictor_of(read_model(with_model(felt_lab, interval=None)), felt_lab)
    assert model.high == pytest.approx(1.644854 * NOTHING_KNOWN[1]) and "no intervals" in model.notes[-1]


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_other_weights_than_the_model_learned_from_are_refused(felt_lab, tmp_path):
    card = with_model(felt_lab, "sight", tmp_path / "elsewhere", weights="a file 0123")
    with pytest.raises(
        LibraryError, match="it learned from ResNet-50 with a file 0123, and these features have random"
    ):
        index(LibraryOptions(felt_lab, model=card, workers=1))


@pytest.mark.needs("torch", "librosa", "pywt", "skimage")
def test_a_lab_with_a_model_can_be_indexed_without_it(felt_lab):
    card = with_model(felt_lab)
    assert index(LibraryOptions(felt_lab, without_model=True)).counts["predicted"] == 0
    with pytest.raises(MaterialError, match="no such|no recording|picture"):
        index(LibraryOptions(felt_lab / "none", model=card))


def test_where_there_is_nothing_the_message_says_what_to_do(tmp_path):
    with pytest.raises(LibraryError, match="no texture was rated, and there is no model.*run texture_ratings"):
        index(LibraryOptions(tmp_path))
    assert not place_of(tmp_path).exists()


def test_a_newer_library_is_not_overwritten(lab):
    place_of(lab).parent.mkdir()
    place_of(lab).write_text('{"format": "palpate-library/9"}')
    with pytest.raises(NewerLibrary):
        index(LibraryOptions(lab))
    place_of(lab).write_text("damaged")
    assert index(LibraryOptions(lab)).changed


def test_the_verb_tells_what_it_did(lab):
    def output_of(*arguments):
        result = CliRunner().invoke(textures, ["index", "--lab", str(lab), *arguments], catch_exceptions=False)
        assert result.exit_code == 0
        return result.stdout

    assert output_of().startswith("3 textures: 3 rated, 0 predicted, 2 with a picture\n")
    assert output_of().endswith("index.json (as it was)\n") and '"changed":false' in output_of("--json")


@pytest.fixture
def unseen(monkeypatch):
    """Looking at pictures is a failure."""

    def looked(*_args, **_kwargs):
        raise AssertionError("features of pictures were asked for")

    monkeypatch.setattr(seeing, "run_jobs", looked)


def test_ratings_on_few_steps_want_their_scale(tmp_path, unseen):
    table = tmp_path / "own" / "ratings.csv"
    table.parent.mkdir()
    table.write_text("id,Rough-Smooth,Flat-Bumpy,Sticky-Slippery,Hard-Soft\nT01,1,2,3,7\nT02,4,4,4,4\n")
    with pytest.raises(MaterialError, match="--scale 1 7"):
        index(LibraryOptions(tmp_path, folder=tmp_path / "own"))
    with pytest.raises(MaterialError, match="the lower end comes first"):
        index(LibraryOptions(tmp_path, folder=tmp_path / "own", scale=(7.0, 1.0)))
    library = index(LibraryOptions(tmp_path, folder=tmp_path / "own", scale=(1.0, 7.0))).indexed.library
    assert [texture.rated.mean for texture in library.textures] == [(0, 16.667, 33.333, 100), (50, 50, 50, 50)]


def test_a_folder_of_images_with_a_table_makes_a_library(tmp_path, unseen):
    """No model asks for the pictures' features, so that none is made."""
    for place in (1, 2):
        taken(tmp_path, f"T0{place}", 1, folder="own")
    table = tmp_path / "own" / "ratings.csv"
    table.write_text(
        "id,label,class,Rough-Smooth,Flat-Bumpy,Sticky-Slippery,Hard-Soft,raters\n"
        "T01,grit,paper,10,40,35,20,8\nT02,felt,cloth,60,30,40,90,8\n"
    )
    result = index(LibraryOptions(tmp_path, folder=tmp_path / "own", workers=1))
    assert result.counts == {"textures": 2, "rated": 2, "predicted": 0, "pictures": 2, "left_out": 0}
    library = result.indexed.library
    assert [(texture.label, texture.category, texture.rated.mean[0]) for texture in library.textures] == [
        ("grit", "paper", 10), ("felt", "cloth", 60),
    ]  # fmt: skip
    assert library.textures[0].rated.se == pytest.approx((20 / np.sqrt(8),) * 4, abs=1e-3)  # no SD is given
    assert library.sources[0].sha256 == hashlib.sha256(table.read_bytes()).hexdigest()


def written(array, kind="PNG"):
    content = io.BytesIO()
    Image.fromarray(array).save(content, kind)
    return content.getvalue()


def square(size, middle=255):
    """A dark picture with a bright middle half."""
    picture = np.zeros((size, size, 3), np.uint8)
    quarter = size // 4
    picture[quarter : size - quarter, quarter : size - quarter] = middle
    return picture


@pytest.mark.parametrize("shape", [(1, 1), (10, 10), (300, 2000), (2000, 300), (1568, 1568)])
def test_a_picture_of_any_shape_becomes_a_small_square(shape):
    small = Image.open(io.BytesIO(thumbnail(written(np.full((*shape, 3), 90, np.uint8)), "x.png")))
    assert small.size == (SIDE, SIDE) and small.format == "JPEG"
    assert np.abs(np.asarray(small).astype(int) - 90).max() <= 2


def test_of_a_large_picture_the_middle_half_is_seen_of_a_small_one_all():
    large = np.asarray(Image.open(io.BytesIO(thumbnail(written(square(1568)), "x.png"))))
    assert large[2:-2, 2:-2].min() > 240
    small = np.asarray(Image.open(io.BytesIO(thumbnail(written(square(280)), "x.png"))))
    assert small[5, 5].max() < 20 and small[144, 144].min() > 240


@pytest.mark.parametrize("mode", ["L", "RGBA", "P", "1", "I;16"])
def test_any_colours_are_seen(mode):
    content = io.BytesIO()
    Image.new(mode, (20, 20)).save(content, "PNG")
    assert thumbnail(content.getvalue(), "x.png")


def test_of_16_bits_a_gray_stays_the_gray_that_it_is():
    small = Image.open(io.BytesIO(thumbnail(written(np.full((30, 30), 90 * 257, np.uint16)), "x.png")))
    assert np.abs(np.asarray(small).astype(int) - 90).max() <= 2


@pytest.mark.parametrize("content", [b"", b"no picture", written(square(64))[:80]])
def test_what_is_no_picture_is_refused(content):
    with pytest.raises(LibraryError, match="x.png: this picture cannot be read"):
        thumbnail(content, "x.png")


def test_equal_pictures_are_equal_bytes_and_left_alone(tmp_path):
    name = save_thumbnail(tmp_path, "T01", written(square(400)), "x.png")
    path = tmp_path / name
    before = path.stat().st_mtime_ns, path.read_bytes()
    assert save_thumbnail(tmp_path, "T01", written(square(400)), "x.png") == name == "pictures/T01.jpg"
    assert (path.stat().st_mtime_ns, path.read_bytes()) == before
    save_thumbnail(tmp_path, "T01", written(square(400, 90)), "x.png")
    assert path.read_bytes() != before[1]


def test_a_texture_of_any_name_has_a_plain_file():
    assert name_of("../T 01/é") != name_of("../T 01/e") and name_of("../T 01/é").count("/") == 1
    assert ".." not in name_of("..")


def test_only_what_lies_among_the_pictures_is_removed(tmp_path):
    save_thumbnail(tmp_path, "T01", written(square(40)), "x.png")
    (tmp_path / "index.json").touch()
    remove_thumbnails(tmp_path, ["pictures/T01.jpg", "index.json", "pictures/../index.json", "pictures/none.jpg"])
    assert [path.name for path in tmp_path.rglob("*.*")] == ["index.json"]


def test_pictures_in_a_folder_are_found_by_the_textures_names(tmp_path):
    (tmp_path / "T03").mkdir()
    for name in ("T01.png", "T02_2.jpg", "T02_10.jpg", "T03/a.png", "T01.txt", "T011.png", "other.png"):
        (tmp_path / name).touch()
    paths = dict(pictures_in(tmp_path, ["T01", "T02", "T03", "T04"]))
    assert {name: path.relative_to(tmp_path).as_posix() for name, path in paths.items()} == {
        "T01": "T01.png", "T02": "T02_2.jpg", "T03": "T03/a.png",
    }  # fmt: skip
    with pytest.raises(LibraryError, match="there is no such folder"):
        dict(pictures_in(tmp_path / "none", ["T01"]))


def test_what_is_shown_and_what_is_measured_are_the_same_files(tmp_path):
    (tmp_path / "T00").mkdir()
    (tmp_path / "T00" / "._T00.png").touch()  # as macOS leaves them beside copied ones
    names = [f"T{at:02}" for at in range(len(SUFFIXES) + 1)]
    for name, suffix in zip(names[1:], SUFFIXES, strict=True):
        (tmp_path / f"{name}{suffix.upper()}").touch()
    assert list(dict(pictures_in(tmp_path, names))) == names[1:]
    assert [name for name in names if list(pictures_of_texture(tmp_path, name))] == names[1:]


@pytest.mark.parametrize(
    ("files", "names", "expected"),
    [
        (("oak-dark.png", "oak.png"), ("oak", "oak-dark"), {"oak": "oak.png", "oak-dark": "oak-dark.png"}),
        (("oak-dark.png",), ("oak",), {}),
        (("T1_2.png", "T1_2_1.png", "T1_3.png"), ("T1", "T1_2"), {"T1": "T1_3.png", "T1_2": "T1_2.png"}),
        (("T10.png", "T1.png", "T1-2.png"), ("T1", "T10"), {"T1": "T1.png", "T10": "T10.png"}),
        (("T10.png", "T1/T10.png"), ("T1", "T10"), {"T1": "T1/T10.png", "T10": "T10.png"}),
    ],
)
def test_a_name_that_begins_another_does_not_take_its_picture(tmp_path, files, names, expected):
    for name in files:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    paths = {name: path.relative_to(tmp_path).as_posix() for name, path in pictures_in(tmp_path, names)}
    assert paths == expected
