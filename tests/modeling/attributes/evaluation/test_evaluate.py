"""."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from palpate.modeling.attributes.domain import LeaveOut, learning, predict_texture
from palpate.modeling.attributes.entries import KINDS, MAIN, SAME, Entry, entries
from palpate.modeling.attributes.evaluation.evaluate import (
    DEFAULT,
    choice,
    domain_for,
    evaluate_methods,
    fusion,
    usable,
)
from palpate.modeling.attributes.material import MaterialError, digest_of, load_material, save_material
from palpate.modeling.attributes.methods import Method
from palpate.modeling.evaluate.engine import result_of
from palpate.modeling.training.refusals import JobBroken
from tests.modeling.attributes import small_evaluation as small

ENTRY = Entry("ridge", ("mfcc",), ("glcm",))


@pytest.fixture(scope="module")
def evaluation(tmp_path_factory):
    return small.evaluation(tmp_path_factory.mktemp("work"), times={"mfcc": 0.1, "hand": 0.2, "glcm": 0.3})


def test_every_method_predicts_every_texture_without_having_seen_it(evaluation):
    assert [entry.method for entry in evaluation.entries] == list(small.METHODS)
    assert evaluation.tested == small.material().ids
    assert evaluation.predicted(evaluation.main("mean")).shape == evaluation.rated().shape == (12, 4)
    ratings = small.material().rated().textures
    for place, name in enumerate(evaluation.tested):
        others = np.mean([rating.rated.mean for rating in ratings if rating.id != name], axis=0)
        np.testing.assert_allclose(evaluation.predicted(evaluation.main("mean"))[place], others)


def test_all_methods_have_the_same_folds_and_one_that_watches_learns_from_fewer(tmp_path):
    seen = {}

    def watching(name):
        def fit(learning):
            seen.setdefault(name, []).append((learning.train, learning.held, learning.seed))
            return small.fit_mean(learning)

        return fit

    methods = {"a": Method("a", "A", watching("a")), "b": Method("b", "B", watching("b"), holds_out=True)}
    small.evaluation(tmp_path, methods=methods, seed=3)
    for (train, held, seed), (whole, none, _) in zip(seen["b"], seen["a"], strict=True):
        assert sorted(texture.id for texture in (*train, *held)) == [texture.id for texture in whole]
        assert (len(held), none, seed) == (1, (), 3)


def test_a_method_that_may_watch_does_so_on_request(tmp_path):
    seen = []

    def fit(learning):
        seen.append((len(learning.train), len(learning.held)))
        return small.fit_mean(learning)

    methods = {"a": Method("a", "A", fit, may_hold=True)}
    assert not small.evaluation(tmp_path, methods=methods).watching
    assert small.evaluation(tmp_path, methods=methods, early_stopping=True).watching  # nothing is taken from the first
    assert seen == [(11, 0)] * 12 + [(10, 1)] * 12


def test_what_is_trained_in_epochs_goes_first(tmp_path):
    fitted = []

    def fit(name):
        def noted(learning):
            fitted.append(name)
            return small.fit_mean(learning)

        return noted

    methods = {"tree": Method("tree", "Tree", fit("tree")), "net": Method("net", "Net", fit("net"), may_hold=True)}
    small.evaluation(tmp_path, methods=methods)
    assert fitted == ["net"] * 12 + ["tree"] * 12


def test_a_second_evaluation_takes_everything_from_the_first_and_finds_the_same(tmp_path):
    first, again = small.evaluation(tmp_path), small.evaluation(tmp_path)
    assert (first.results.loaded, again.results.loaded) == (0, len(first.results))
    for job, done in first.results.by_job.items():
        np.testing.assert_array_equal(again.results[job].predicted, done.predicted)


def test_the_order_of_the_textures_changes_no_number(evaluation, tmp_path):
    turned = small.material()
    turned = dataclasses.replace(turned, textures=turned.textures[::-1])
    again = small.evaluation(tmp_path, turned)
    assert digest_of(turned) == evaluation.domain.digest
    for job, done in evaluation.results.by_job.items():
        np.testing.assert_array_equal(again.results[job].predicted, done.predicted)


@pytest.mark.needs("pgrep")
def test_workers_find_what_one_process_finds(evaluation, tmp_path):
    options = small.options(tmp_path, workers=2, methods=("mean", "ridge"))
    again = evaluate_methods(small.material(), options, small.METHODS, small.OWN)
    for job, done in again.results.by_job.items():
        np.testing.assert_array_equal(evaluation.results[job].predicted, done.predicted)


def test_what_decides_a_result_decides_its_key(evaluation):
    domain, job = evaluation.domain, LeaveOut(evaluation.main("ridge"), "T03")
    parts = domain.parts
    others = [
        dataclasses.replace(domain, seed=1),
        dataclasses.replace(domain, settings={"epochs": 3}),
        dataclasses.replace(domain, parts={**parts, "T07/touch/mfcc": "another"}),
        dataclasses.replace(domain, parts={**parts, "T07/variants/glcm": "another"}),
        dataclasses.replace(domain, parts={**parts, "T07": "other ratings"}),
        dataclasses.replace(domain, parts={**parts, "T03/sight/glcm": "another"}),
        dataclasses.replace(
            domain, folds={**domain.folds, "T03": dataclasses.replace(domain.folds["T03"], held=(), train=("T01",))}
        ),
        dataclasses.replace(domain, methods={**domain.methods, "ridge": Method("ridge", "", digest_of)}),
    ]
    keys = {variant.key(job) for variant in (domain, *others)} | {domain.key(LeaveOut(job.entry, "T04"))}
    assert len(keys) == 10
    same = dataclasses.replace(domain, parts={**parts, "T07/touch/dft": "not looked at"})
    assert same.key(job) == domain.key(job)


@pytest.mark.parametrize("damage", [b"", b"{}", b'{"numbers": {}}'])
def test_a_damaged_result_is_computed_again(tmp_path, damage):
    evaluation = small.evaluation(tmp_path, methods={"mean": small.METHODS["mean"]})
    job = LeaveOut(evaluation.main("mean"), "T01")
    place = tmp_path / evaluation.domain.key(job)
    (place.with_suffix(".npz") if damage == b'{"numbers": {}}' else place.with_suffix(".json")).write_bytes(damage)
    np.testing.assert_array_equal(result_of(job, evaluation.domain).predicted, evaluation.results[job].predicted)


def test_a_method_that_refuses_is_named_and_the_others_go_on(tmp_path):
    methods = {**small.METHODS, "ann": Method("ann", "Refusing", small.fit_refusing)}
    result = small.evaluation(tmp_path, methods=methods)
    assert result.refused(result.main("ann")) == "this method has had enough."
    assert result.refused(result.main("ridge")) == ""


def test_a_fault_of_the_program_is_not_taken_for_a_refusal(tmp_path):
    with pytest.raises(JobBroken, match="a fault of the program"):
        small.evaluation(tmp_path, methods={"ann": Method("ann", "Broken", small.fit_broken)})


def test_a_quick_evaluation_leaves_five_textures_out_and_lets_methods_hurry(tmp_path):
    result = small.evaluation(tmp_path, quick=True)
    assert len(result.tested) == 5
    assert result.domain.settings == {"threads": 1, "quick": True}
    assert len(result.domain.folds["T01" if "T01" in result.tested else result.tested[0]].known) == 11


def test_few_of_them_are_left_out_and_learned_from_are_all_others(tmp_path):
    result = small.evaluation(tmp_path, folds=3)
    assert len(result.tested) == 3 and result.domain.settings == {"threads": 1}
    assert all(len(fold.known) == 11 for fold in result.domain.folds.values())


def test_an_unknown_method_is_refused_with_the_nearest(tmp_path):
    with pytest.raises(MaterialError, match="ridge"):
        evaluate_methods(small.material(), small.options(tmp_path, methods=("rigde",)), small.METHODS, small.OWN)


def test_textures_without_what_others_have_are_not_used_and_reported(tmp_path):
    material = small.changed(small.material(), "T02", touch={})
    material = small.changed(material, "T03", rated=None)
    material = small.changed(
        material, "T04", sight={kind: rows[:0] for kind, rows in material.textures[3].sight.items()}
    )
    used, why = usable(material)
    assert len(used.textures) == 9
    assert why == {
        "T02": "no recording of it can be used", "T03": "it was not rated", "T04": "no picture of it can be used",
    }  # fmt: skip
    evaluation = small.evaluation(tmp_path, material)
    assert evaluation.left_out == why
    assert "T02" not in evaluation.tested


def test_pictures_alone_are_enough_for_those_that_see(tmp_path):
    material = small.material()
    seen = dataclasses.replace(
        material, textures=tuple(dataclasses.replace(texture, touch={}) for texture in material.textures)
    )
    evaluation = small.evaluation(tmp_path, seen)
    assert len(evaluation.tested) == 12
    assert evaluation.refused(evaluation.main("hv_net")) == ""
    assert "no mfcc features" in evaluation.refused(evaluation.main("ht_net"))


def test_textures_are_stored_once_and_read_back_as_they_were(tmp_path):
    one_rater = dataclasses.replace(small.material().textures[4].rated, sd=np.full(4, np.nan), raters=1)
    material = small.changed(small.material(), "T05", notes=("a note",), rated=one_rater)
    key = save_material(material, tmp_path)
    path = tmp_path / "material" / f"{key}.npz"
    before = path.stat().st_mtime_ns
    assert save_material(dataclasses.replace(material, textures=material.textures[::-1]), tmp_path) == key
    assert path.stat().st_mtime_ns == before
    again = load_material(tmp_path, key)
    assert digest_of(again) == digest_of(material)
    assert again.textures[4].notes == ("a note",)
    np.testing.assert_equal(dataclasses.asdict(again.textures[4].rated), dataclasses.asdict(one_rater))
    assert again.textures[4].made_from == material.textures[4].made_from
    np.testing.assert_array_equal(again.textures[7].touch["dwt"], material.textures[7].touch["dwt"])
    with pytest.raises(MaterialError, match="under the same path"):
        load_material(tmp_path / "nowhere", key)


def test_the_digest_follows_every_part():
    material = small.material()
    of = material.textures[0]
    rated = dataclasses.replace(of.rated, mean=of.rated.mean + 1)
    others = [
        small.changed(material, "T01", category="another"),
        small.changed(material, "T01", rated=rated),
        small.changed(material, "T01", touch={**of.touch, "dft": of.touch["dft"] + 1}),
        small.changed(material, "T01", variants={}),
        dataclasses.replace(material, attributes=material.attributes[::-1]),
    ]
    assert len({digest_of(variant) for variant in (material, *others)}) == 6


def test_an_answer_is_the_rows_mean_within_the_scale(evaluation):
    class Rows:
        def __init__(self, rows):
            self.rows = rows

        def predict(self, _texture):
            return self.rows

    texture = evaluation.material.textures[0]
    mean, spread, count = predict_texture(Rows(np.array([[-30.0, 20.0], [10.0, 40.0]])), texture, 2)
    assert (mean.tolist(), spread.tolist(), count) == ([0.0, 30.0], [20.0, 10.0], 2)
    for wrong in (np.zeros((1, 3)), np.zeros((0, 2)), np.zeros(2), np.array([[1.0, np.nan]])):
        with pytest.raises(MaterialError, match="T01"):
            predict_texture(Rows(wrong), texture, 2)


def test_entries_are_in_the_tables_that_they_belong_to():
    every = entries(small.METHODS, small.METHODS, {"hv_net": ((), ("glcm",))})
    tables_of = {entry.name: entry.tables for entry in every}
    assert tables_of["hv_net: glcm"] == {MAIN, KINDS}
    assert tables_of["hv_net: resnet+glcm"] == {SAME, KINDS}
    assert tables_of["ht_net: mfcc+hand"] == {MAIN, SAME, KINDS}
    assert tables_of["ht_net: dft+hand"] == {KINDS}
    assert tables_of["mean: ratings alone"] == {MAIN}
    assert tables_of["visuo_tactile: mfcc+hand+resnet+glcm"] == {MAIN, KINDS}
    assert len([entry for entry in every if entry.method == "ridge"]) == 7
    assert len(entries(small.METHODS, small.METHODS, small.OWN, ablations=False)) == 5


def test_a_context_can_be_made_without_any_chance_of_a_leak(tmp_path):
    twin = dataclasses.replace(small.material().textures[0], id="TWIN")
    both = dataclasses.replace(small.material(), textures=(*small.material().textures, twin))
    domain = domain_for(both, small.options(tmp_path), small.METHODS)
    for fold in domain.folds.values():
        assert len({"T01", "TWIN"} & {fold.test, *fold.apart}) != 1
        assert len({"T01", "TWIN"} & set(fold.held)) != 1
    for name in ("T01", "TWIN"):
        given = learning(
            load_material(domain.work, domain.digest), domain.folds[name], small.METHODS["ridge"], ENTRY, 0, {}
        )
        assert {texture.id for texture in given.train} == set(small.material().ids) - {"T01"}
        assert given.held == ()
    assert domain.key(LeaveOut(ENTRY, "TWIN")) != domain.key(LeaveOut(ENTRY, "T01"))


def test_too_few_complete_textures_are_refused_with_what_is_missing(tmp_path):
    material = small.material()
    textures = [
        texture if place < 2 else dataclasses.replace(texture, touch={})
        for place, texture in enumerate(material.textures)
    ]
    few = dataclasses.replace(material, textures=tuple(textures))
    message = (
        "2 of 12 textures have all that the others have, 3 at least are needed. T03, T04, .*, T12: no recording of it"
    )
    with pytest.raises(MaterialError, match=message):
        small.evaluation(tmp_path, few)
    three = dataclasses.replace(material, textures=(material.textures[2], *textures[:2], *textures[3:]))
    assert small.evaluation(tmp_path, three).tested == ("T03", "T01", "T02")
    assert small.evaluation(tmp_path, three).unused() == [
        "T04, T05, T06, T07, T08, T09, T10, T11, T12: no recording of it can be used"
    ]


def row(method, mae, seconds=1.0, best_chance=False, ours_chance=False):
    chances = {"best_chance": best_chance, "ours_chance": ours_chance}
    return {"method": method, "title": method.upper(), "mae": mae, "train_s": seconds, **chances}


def test_the_least_mae_is_the_default_and_of_equals_the_faster():
    assert choice([row("ridge", 9.0), row("boosting", 8.0), row("visuo_tactile", 8.5)]).method == "boosting"
    assert choice([row("ridge", 8.0, 3.0), row("boosting", 8.0, 2.0)]).method == "boosting"


def test_a_method_that_was_refused_is_no_default():
    assert choice([row("ridge", 9.0), row("boosting", None)]).method == "ridge"
    result = choice([row("ridge", None)])
    assert result.method == DEFAULT
    assert "shipped default stays" in result.why


def test_where_the_proposed_network_is_not_the_best_the_report_says_which_is_and_whether_that_is_chance():
    (sentence,) = choice([row("ridge", 8.0), row("visuo_tactile", 9.5)]).of_ours
    assert sentence == "The MAE of the thesis' network is not the lowest: 9.50, 1.50 more than that of RIDGE."
    (sentence,) = choice([row("ridge", 8.0), row("visuo_tactile", 9.5, best_chance=True)]).of_ours
    assert sentence.endswith("RIDGE, which may be chance.")
    assert "not evaluated" in choice([row("ridge", 8.0)]).of_ours[0]


def test_where_it_is_the_best_its_lead_is_weighed():
    rows = [row("visuo_tactile", 5.0), row("ridge", 6.0, best_chance=True), row("mean", 20.0)]
    assert choice(rows).of_ours == (
        "The MAE of the thesis' network is the lowest.",
        "Its lead over RIDGE may be chance.",
    )
    assert choice([row("visuo_tactile", 5.0), row("mean", 20.0)]).of_ours[1] == "No interval of its leads holds 0."


def test_fusion_is_reported_as_reached_or_not():
    both = [row("visuo_tactile", 5.0), row("hv_net", 8.0), row("ht_net", 6.0, ours_chance=True)]
    label, sentence = fusion(both)
    assert label == "Fusion"
    assert sentence.endswith("(MAE; aim: less than each branch by itself): reached.")
    assert "HT_NET 6.00 (a difference that may be chance)" in sentence
    assert fusion([row("visuo_tactile", 7.0), *both[1:]])[1].endswith("not reached.")
    assert fusion(both[:2]) is None
    assert fusion([row("visuo_tactile", None), *both[1:]]) is None
