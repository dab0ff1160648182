"""Rows of pictures: 2048 and 256 of each, further versions, kept by content, remade where damaged or changed."""

import hashlib
from dataclasses import replace

import numpy as np
import pytest

from palpate.analysis.features.augmenting import chance_of, varied
from palpate.analysis.features.glcm import glcm
from palpate.analysis.features.pictures import Looking, square
from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.attributes.resnet import fold_batch_norms, load_network, pool_of_patches, random_state
from palpate.modeling.attributes.resnet_weights import Weights
from palpate.modeling.attributes.seeing import Album, Picture, Sight, picture_rows, sight_with, thin
from palpate.modeling.training.threads import limited
from tests.analysis.features.picture_specimens import write_picture

pytestmark = pytest.mark.needs("torch")

LOOKING = Looking(side=256, patch=64, stride=64, grid=2)
HOW = Sight(LOOKING, variants=1)


@pytest.fixture(autouse=True)
def one_thread():
    """As in a job: rounding depends on how work is shared out."""
    with limited(1):
        yield


@pytest.fixture
def albums(tmp_path):
    return [Album(texture, tuple(picture(tmp_path, texture, n) for n in range(2))) for texture in ("T01", "T02")]


def picture(folder, texture, number, seed=None, name=None):
    path = folder / "pictures" / texture / (name or f"{number}.png")
    data = write_picture(path, 256, seed=10 * int(texture[1:]) + number if seed is None else seed)
    return Picture(path, hashlib.sha256(data).hexdigest(), f"{texture}, light {number}")


def look(albums, how=HOW, **options):
    return picture_rows(albums, how, **{"workers": 1, **options})


def test_a_picture_is_2304_numbers_and_each_version_as_many(albums):
    views = look(albums)
    assert list(views) == ["T01", "T02"]
    for view in views.values():
        for rows in (view.sight, view.variants):
            assert {kind: rows[kind].shape for kind in rows} == {"resnet": (2, 2048), "glcm": (2, 256)}
            assert all(values.dtype == np.float32 and np.isfinite(values).all() for values in rows.values())
        assert view.notes == ()
    values = square(albums[0].pictures[0].path.read_bytes(), "", 256).values
    network = fold_batch_norms(load_network(random_state(0)))
    parts = [values[a : a + 64, b : b + 64] for a in (0, 192) for b in (0, 192)]
    np.testing.assert_array_equal(views["T01"].sight["resnet"][0], pool_of_patches(network, np.stack(parts)))
    np.testing.assert_array_equal(views["T01"].sight["glcm"][0], glcm(values))


def test_versions_are_drawn_from_the_picture_and_looked_at_in_fewer_places(albums):
    view = look(albums[:1], replace(HOW, variants=2))["T01"]
    first = albums[0].pictures[0]
    values = square(first.path.read_bytes(), "", 256).values
    for version in (1, 2):
        drawn = varied(values, chance_of(first.sha256, version))
        np.testing.assert_array_equal(view.variants["glcm"][2 * (version - 1)], glcm(drawn))
    assert replace(HOW, looking=Looking()).at(0).starts == Looking().starts
    assert replace(HOW, looking=Looking()).at(1).starts == (0, 672, 1344)
    assert HOW.at(1).starts == HOW.at(0).starts == (0, 192)


def test_kept_rows_are_used_and_damaged_or_other_ones_are_made_anew(albums, tmp_path):
    folder = tmp_path / "features"
    first = look(albums, folder=folder)
    assert len(list(folder.glob("*.npz"))) == 8
    key = HOW.key(albums[0].pictures[0], 0)
    marked = {"resnet": np.full(2048, 7, "f4"), "glcm": np.full(256, 8, "f4")}
    from palpate.modeling.attributes.feature_cache import save_features

    save_features(folder, key, marked, {"notes": []})
    assert look(albums, folder=folder)["T01"].sight["resnet"][0][0] == 7, "what is kept is used"
    (folder / key).with_suffix(".npz").write_bytes(b"damaged")
    again = look(albums, folder=folder)
    for name, view in first.items():
        for kind, rows in (*view.sight.items(),):
            np.testing.assert_array_equal(rows, again[name].sight[kind])


def test_a_key_knows_picture_weights_places_and_chance(albums):
    one = albums[0].pictures[0]
    others = [
        HOW.key(albums[0].pictures[1], 0), replace(HOW, weights=Weights(seed=1)).key(one, 0),
        replace(HOW, looking=replace(LOOKING, grid=3)).key(one, 0), HOW.key(one, 1), HOW.key(one, 2),
        replace(HOW, seed=1).key(one, 1), replace(HOW, noise_sd=0.1).key(one, 1),
    ]  # fmt: skip
    assert len({HOW.key(one, 0), *others}) == 8
    assert HOW.key(one, 0) == replace(HOW, seed=1, noise_sd=0.2, variants=5).key(one, 0)
    assert HOW.key(one, 0) == HOW.key(replace(one, name="another", path=one.path / "elsewhere"), 0)


def test_two_processes_give_what_one_gives(albums, tmp_path):
    lines = []
    one = look(albums, replace(HOW, variants=0))
    two = look(albums, replace(HOW, variants=0), workers=2, folder=tmp_path / "features", report=lines.append)
    for name in one:
        for kind in ("resnet", "glcm"):
            np.testing.assert_array_equal(one[name].sight[kind], two[name].sight[kind])
    assert any("pictures of T02" in line for line in lines)
    assert len(list((tmp_path / "features").glob("*.npz"))) == 4


def test_a_picture_that_shows_nothing_is_left_out_and_one_that_has_changed_is_refused(albums, tmp_path):
    text = tmp_path / "pictures" / "T01" / "text.jpg"
    text.write_bytes(b"a text")
    bad = Picture(text, hashlib.sha256(b"a text").hexdigest(), "T01, light 9")
    views = look([Album("T01", (*albums[0].pictures, bad)), Album("T03", (bad,))])
    assert views["T01"].sight["resnet"].shape == views["T01"].variants["resnet"].shape == (2, 2048)
    assert views["T03"].sight == views["T03"].variants == {}
    assert "left out: T01, light 9: no picture" in views["T03"].notes[0]
    text.write_bytes(b"another")
    with pytest.raises(MaterialError, match="T01, light 9: .*text.jpg is not the recorded picture"):
        look([Album("T01", (bad,))])
    text.unlink()
    with pytest.raises(MaterialError, match="T01, light 9: .*text.jpg cannot be read"):
        look([Album("T01", (bad,))])


def test_in_a_quick_look_four_patches_of_three_pictures(albums):
    ten = Album("T01", tuple(replace(albums[0].pictures[0], name=str(n)) for n in range(10)))
    assert [picture.name for picture in thin(ten).pictures] == ["0", "4", "9"]
    assert thin(albums[0]) is albums[0]
    assert len(sight_with(Weights(), 0, True).looking.starts) == 2
    assert sight_with(Weights(), 0, False).looking == Looking()


def test_no_texture_and_no_picture_are_nothing(tmp_path):
    assert look([]) == {}
    view = look([Album("T01", ())])["T01"]
    assert view.sight == {} and view.notes == ()
    with pytest.raises(MaterialError, match="variants is -1"):
        Sight(variants=-1)
