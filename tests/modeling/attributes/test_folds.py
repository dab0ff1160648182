import dataclasses

import numpy as np
import pytest

from palpate.modeling.attributes.folds import groups_of, leave_one_texture_out, sample_textures, whole_fold
from palpate.modeling.attributes.material import Material, MaterialError
from tests.modeling.attributes.material_for_tests import simulated_material
from tests.modeling.attributes.small_evaluation import changed

M = simulated_material(24)


def folds_of(material, **more):
    return {fold.test: fold for fold in leave_one_texture_out(material, **more)}


def sides(fold):
    return set(fold.train), set(fold.held), {fold.test, *fold.apart}


def with_another(like, **more):
    """The material with a texture T99 that is `like` (T05, say), but for what is given."""
    of = next(texture for texture in M.textures if texture.id == like)
    given = {"made_from": frozenset({"its own"}), "label": "another", **more}
    return dataclasses.replace(M, textures=(*M.textures, dataclasses.replace(of, id="T99", **given)))


def test_every_texture_is_left_out_once_and_all_others_stand_on_one_side_each():
    folds = leave_one_texture_out(M)
    assert [fold.test for fold in folds] == list(M.ids)
    for fold in folds:
        train, held, tested = sides(fold)
        assert not (train & held or train & tested or held & tested)
        assert train | held | tested == set(M.ids)
        assert len(held) == 2  # a tenth of 23
        assert fold.known == tuple(sorted(train | held))


def noisy(rows, size):
    return {kind: values + np.float32(size) * np.abs(values).max() for kind, values in rows.items()}


def one_of(rows, others):
    """Three segments, of which the last one is shared."""
    return {kind: np.concatenate([others[kind][:2], values[2:3]]) for kind, values in rows.items()}


def variants_of(of):
    """Pictures that are further versions of T05's."""
    return {kind: rows[:1] for kind, rows in of.variants.items()}


T05, T06 = M.textures[4], M.textures[5]


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"touch": noisy(T06.touch, 0.1), "sight": {}, "variants": {}, "made_from": T05.made_from | {"x"}},
        {"touch": one_of(T05.touch, noisy(T06.touch, 0.1)), "sight": {}, "variants": {}},
        {"touch": {"mfcc": T05.touch["mfcc"][:1]}, "sight": {}, "variants": {}},
        {"sight": {k: rows[1:2] for k, rows in T05.sight.items()}, "touch": {}, "variants": {}},
        {"sight": {"glcm": T05.sight["glcm"][1:2]}, "touch": {}, "variants": {}},
        {"sight": variants_of(T05), "touch": {}, "variants": {}},
        {"variants": variants_of(T05), "touch": {}, "sight": {}},
        {"touch": noisy(T05.touch, 2e-6), "sight": {}, "variants": {}},
    ],
    ids=[
        "duplicate",
        "file",
        "segment",
        "one kind",
        "picture",
        "one kind of it",
        "variant",
        "their variants",
        "rounded",
    ],
)
def test_what_shares_content_never_falls_on_both_sides(more):
    folds = folds_of(with_another("T05", **more))
    for fold in folds.values():
        together = [side for side in sides(fold) if {"T05", "T99"} & side]
        assert len(together) == 1, fold
    assert folds["T05"].apart == ("T99",)
    assert folds["T99"].apart == ("T05",)


def test_a_chain_of_shared_files_is_one_group():
    linked = changed(changed(M, "T01", made_from=frozenset("ab")), "T07", made_from=frozenset("bc"))
    linked = changed(linked, "T13", made_from=frozenset("cd"))
    assert ("T01", "T07", "T13") in groups_of(linked.textures)
    assert folds_of(linked)["T07"].apart == ("T01", "T13")


def test_textures_that_are_only_alike_are_not_joined():
    far = with_another("T05", touch=noisy(T05.touch, 1e-3), sight=noisy(T05.sight, 1e-3), variants={})
    assert len(groups_of(far.textures)) == 25


def test_silence_black_pictures_and_the_same_hand_join_nobody():
    hand = T05.touch["hand"]
    blank = {
        "touch": {"mfcc": np.eye(1, 520, dtype="f4") * -226.3, "dft": np.zeros((1, 250), "f4"), "hand": hand[:1]},
        "sight": {"glcm": np.eye(1, 256, dtype="f4")},
        "variants": {},
    }
    both = dataclasses.replace(
        M, textures=(*M.textures, *(dataclasses.replace(T06, id=n, made_from=frozenset(), **blank) for n in ("A", "B")))
    )
    assert len(groups_of(both.textures)) == 26


def test_two_white_pictures_with_a_few_specks_join_nobody_either():
    nearly = {"touch": {}, "variants": {}, "made_from": frozenset()}
    specks = np.array([1.0, 3e-6, 0, 0, 0], "f4"), np.array([1.0, 0, 4e-6, 2e-6, 0], "f4")
    seen = [{"glcm": np.pad(row, (0, 251))[None], "resnet": M.textures[at].sight["resnet"][:1]}
            for at, row in enumerate(specks)]  # fmt: skip
    pair = [dataclasses.replace(T06, id=n, sight=one, **nearly) for n, one in zip("AB", seen, strict=True)]
    assert groups_of(tuple(pair)) == (("A",), ("B",))


def test_a_black_picture_joins_nobody_through_what_the_network_makes_of_it():
    black = {"resnet": M.textures[9].sight["resnet"][:1], "glcm": np.eye(1, 256, dtype="f4")}
    noise = {"resnet": M.textures[10].sight["resnet"][:2], "glcm": M.textures[10].sight["glcm"][:2]}
    lidded = {"touch": {}, "sight": black, "variants": noise, "made_from": frozenset()}
    both = [dataclasses.replace(T06, id=name, **lidded) for name in ("A", "B")]
    assert groups_of(both) == (("A",), ("B",))
    seen = {kind: np.concatenate([rows, T05.sight[kind][:1]]) for kind, rows in black.items()}
    more = [dataclasses.replace(texture, sight=seen, variants={}) for texture in both]
    assert groups_of(more) == (("A", "B"),)  # the second picture is one that shows something


def test_the_hand_alone_is_compared_where_there_is_nothing_else():
    twin = {"touch": {"hand": T05.touch["hand"]}, "sight": {}, "variants": {}, "made_from": frozenset()}
    both = [dataclasses.replace(T05, id=name, **twin) for name in ("A", "B")]
    assert groups_of(both) == (("A", "B"),)


def test_the_order_of_textures_and_rows_decides_nothing():
    chance = np.random.Generator(np.random.PCG64(1))
    order = chance.permutation(len(M.textures))
    moved = []
    for place in order:
        texture = M.textures[place]
        segments = chance.permutation(len(texture.touch["mfcc"]))
        moved.append(dataclasses.replace(texture, touch={kind: rows[segments] for kind, rows in texture.touch.items()}))
    assert folds_of(dataclasses.replace(M, textures=tuple(moved))) == folds_of(M)


def test_held_textures_come_from_different_classes_and_follow_the_seed():
    classes = {texture.id: texture.category for texture in M.textures}
    every = folds_of(M)
    assert all(len({classes[name] for name in fold.held}) == 2 for fold in every.values())
    assert len({fold.held for fold in every.values()}) > 10
    assert folds_of(M) == every != folds_of(M, seed=1)


def test_a_texture_left_out_alone_has_the_same_fold_as_among_all():
    (alone,) = leave_one_texture_out(M, only=("T09",))
    assert alone == folds_of(M)["T09"]


def test_whole_groups_are_held_and_something_is_always_left_to_learn_from():
    few = simulated_material(3)
    for fold in leave_one_texture_out(few, share=0.5):
        assert len(fold.train) == len(fold.held) == 1
    paired = M
    for one, other in zip(M.ids[::2], M.ids[1::2], strict=True):
        for name in (one, other):
            paired = changed(paired, name, made_from=frozenset({one}))
    for fold in leave_one_texture_out(paired):
        for one, other in zip(M.ids[::2], M.ids[1::2], strict=True):
            assert len([side for side in sides(fold) if {one, other} & side]) == 1


def test_nothing_is_held_where_no_share_is_requested():
    assert all(fold.held == () for fold in leave_one_texture_out(M, share=0.0))


def test_all_of_them_leaves_nothing_out():
    fold = whole_fold(M)
    assert sorted((*fold.train, *fold.held)) == list(M.ids)
    assert fold.test == "" and len(fold.held) == 2


def test_some_textures_come_from_different_classes():
    classes = {texture.id: texture.category for texture in M.textures}
    chosen = sample_textures(classes, 5)
    assert chosen == sample_textures(dict(reversed(classes.items())), 5)
    assert set(chosen) < set(sample_textures(classes, 9))
    assert len(chosen) == len(set(chosen)) == 5
    assert sorted(list(map(classes.get, chosen)).count(name) for name in set(classes.values())) == [1, 2, 2]


@pytest.mark.parametrize(
    ("material", "more", "words"),
    [
        (simulated_material(2), {}, "at least 3"),
        (changed(M, "T03", rated=None), {}, "T03 was not rated"),
        (M, {"share": 0.7}, "0 to 0.5"),
        (M, {"share": float("nan")}, "0 to 0.5"),
        (M, {"only": ("T77",)}, "no texture 'T77'"),
    ],
)
def test_what_cannot_be_divided_is_refused(material, more, words):
    with pytest.raises(MaterialError, match=words):
        leave_one_texture_out(material, **more)


def test_fifty_textures_that_are_one_are_refused():
    one = frozenset({"the same file"})
    same = Material(tuple(dataclasses.replace(texture, made_from=one) for texture in M.textures), M.attributes)
    with pytest.raises(MaterialError, match="there are 1 of 24"):
        leave_one_texture_out(same)
