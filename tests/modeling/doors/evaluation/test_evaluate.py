import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from palpate.modeling.doors.evaluation.evaluate import evaluate_doors, floors
from palpate.modeling.doors.evaluation.result_tables import as_json, tables
from palpate.modeling.doors.results import DoorOptions, domain_for, evaluate_methods, waves
from palpate.modeling.doors.training import Training, train_pair
from palpate.modeling.evaluate.rows import ModelDataError
from tests.modeling.doors.small_evaluation import METHODS, options, small_data

pytestmark = pytest.mark.needs("torch")


def evaluated(data, options_):
    return evaluate_methods(domain_for(data, options_, METHODS), options_)


def test_every_stimulus_is_tested_once_by_a_model_that_never_saw_its_profile():
    evaluation = evaluated(small_data(), options("remember"))
    (remember,) = evaluation.methods("forward")
    assert sorted(remember.data.ids) == sorted(small_data().ids)
    assert np.all(remember.predicted == 1000.0)


def test_the_leaky_split_counts_training_variants_of_what_was_seen():
    evaluation = evaluated(small_data(), options("ridge", split="leaky"))
    (ridge,) = evaluation.methods("forward")
    assert len(ridge.data) == 15 * 6
    assert ridge.split == "leaky"


def test_finished_jobs_are_taken_again_and_a_damaged_one_is_done_anew(tmp_path):
    log = tmp_path / "log"
    choice = options("remember", work=tmp_path / "jobs", settings={"log": str(log)})
    first = evaluated(small_data(), choice)
    again = evaluated(small_data(), choice)
    assert (first.jobs.loaded, again.jobs.loaded) == (0, 3)
    assert len(log.read_text().splitlines()) == 3
    np.testing.assert_array_equal(first.methods("forward")[0].predicted, again.methods("forward")[0].predicted)
    next((tmp_path / "jobs").glob("*.npz")).write_bytes(b"PK\3\4 cut off")
    assert evaluated(small_data(), choice).jobs.loaded == 2
    assert len(log.read_text().splitlines()) == 4


def test_other_data_other_settings_and_another_seed_are_other_jobs(tmp_path):
    choice = options("ridge", work=tmp_path)
    data = small_data()
    domains = [
        domain_for(data, choice, METHODS),
        domain_for(data, replace(choice, settings={"epochs": 3}), METHODS),
        domain_for(data, replace(choice, seed=1), METHODS),
        domain_for(replace(data, rating=data.rating + 0.01), choice, METHODS),
    ]
    job = waves(domains[0], choice)[0][0]
    assert len({domain.key(job) for domain in domains}) == 4
    assert domains[0].load(job) is None


def test_what_an_inverse_method_builds_on_gets_the_checkpoint_of_its_own_forward_job(tmp_path):
    log = tmp_path / "log"
    evaluated(small_data(), options("below", "above", work=tmp_path / "jobs", settings={"log": str(log)}))
    fits = [line.split() for line in log.read_text().splitlines()]
    forward = [place for name, place in fits if name == "below"]
    assert len(forward) == 6
    assert sorted(forward[:3]) == sorted(forward[3:])
    assert len({place for name, place in fits if name == "above"} - set(forward)) == 3


def test_a_quick_training_of_an_inverse_method_keeps_no_checkpoint_but_what_it_builds_on_does(tmp_path):
    log = tmp_path / "log"
    evaluated(small_data(), options("", "above", quick=True, work=tmp_path / "jobs", settings={"log": str(log)}))
    places = dict(line.split() for line in log.read_text().splitlines())
    assert places["above"] == "None"
    assert Path(places["below"]).parent.name == "checkpoints"


def test_the_checkpoints_of_a_forward_method_go_though_only_what_builds_on_it_was_requested(tmp_path):
    methods = {way: dict(known) for way, known in METHODS.items()}
    methods["forward"]["below"] = replace(METHODS["forward"]["below"], fit=with_checkpoint)
    choice = options("", "above", work=tmp_path / "jobs", settings={"log": str(tmp_path / "log")})
    evaluate_methods(domain_for(small_data(), choice, methods), choice)
    assert (tmp_path / "log").read_text().count("below") == 3
    assert list((tmp_path / "jobs" / "checkpoints").glob("*")) == []


def with_checkpoint(learning):
    learning.settings["checkpoint"].mkdir(parents=True)
    return METHODS["forward"]["below"].fit(learning)


def test_a_model_to_be_used_is_fitted_once_whichever_direction_needs_it(tmp_path):
    log = tmp_path / "log"
    choice = options(work=tmp_path / "jobs", settings={"log": str(log)})
    pair = Training({"forward": "below", "inverse": "above"}, tmp_path / "models", choice, METHODS)
    written = train_pair(small_data(), pair, lambda _line: None)
    assert [trained.method for trained in written.values()] == ["below", "above"]
    fits = [line.split()[0] for line in log.read_text().splitlines()]
    assert (fits.count("below"), fits.count("above")) == (3 + 3 + 1, 3 + 1)


def test_results_do_not_depend_on_the_order_of_the_stimuli():
    data, choice = small_data(), options("ridge")
    shuffled = data.rows(np.random.Generator(np.random.PCG64(2)).permutation(len(data)))
    one, two = evaluated(data, choice).methods("forward")[0], evaluated(shuffled, choice).methods("forward")[0]
    order = [two.data.ids.index(name) for name in one.data.ids]
    np.testing.assert_allclose(one.predicted, two.predicted[order], rtol=0, atol=1e-9)


def test_a_whole_evaluation_as_tables_and_as_json_without_nan():
    evaluation = evaluate_small(small_data(simulated=True))
    rows = tables(evaluation)
    assert {"methods_forward", "methods_inverse", "table_5_3_mae", "table_5_6_waveform", "loop", "corners"} <= set(rows)
    content = json.loads(json.dumps(as_json(evaluation), allow_nan=False))
    assert content["default"]["forward"]["method"] == "ridge"
    assert content["no_ceiling"].startswith("A table of means holds no single ratings")
    loop = [row for row in rows["loop"] if row["method"] == "nearest"]
    assert len(loop) == 7
    assert all(row["loop_fresh"] >= 0 for row in loop)
    assert rows["corners"][0]["corners"] == 128
    (method,) = (row for row in rows["methods_forward"] if row["method"] == "ridge")
    assert method["file_difference"] < 1e-9
    assert method["file_bytes"] > 500


def test_real_peoples_ratings_are_evaluated_by_the_forward_model_alone():
    row = evaluate_small(small_data(simulated=False)).inverse[0]
    assert row["loop_fresh"] is None
    assert row["loop_judge"] > 0


def test_the_measured_door_is_predicted_by_models_that_never_saw_it():
    evaluation = evaluate_small(small_data())
    names = [measured.name for measured in evaluation.measured]
    assert names == ["actual", "edited_v1", "edited_v2", "edited_v3", "edited_v4"]
    actual = evaluation.measured[0]
    assert actual.rated is not None
    assert not np.allclose(actual.predicted, actual.rated)
    assert not any(np.array_equal(actual.made_N, force) for force, door in
                   zip(evaluation.data.force_N, evaluation.data.doors, strict=True) if door == "BC3")  # fmt: skip
    assert evaluate_small(small_data(doors=("BC3", "K8"))).measured == ()


def evaluate_small(data):
    return evaluate_doors(data, None, options("mean ridge", "nearest"))


def test_the_oracle_is_under_every_method_that_gives_back_a_known_profile():
    choice = options("", "nearest")
    domain = domain_for(small_data(), choice, METHODS)
    oracle, code = floors(domain)
    nearest = evaluate_methods(domain, choice).methods("inverse")[0]
    assert 0 < oracle["mae"] <= float(np.abs(nearest.predicted - nearest.actual).mean())
    assert code["mae"] > 0


def test_two_stimuli_and_ratings_that_are_all_equal_are_refused():
    data = small_data()
    with pytest.raises(ModelDataError):
        domain_for(data.rows(np.array([0, 1])), options("ridge"), METHODS)
    with pytest.raises(ModelDataError, match="all ratings are"):
        domain_for(replace(data, rating=np.ones_like(data.rating)), options("ridge"), METHODS)


def test_the_slow_methods_are_not_trained_on_the_splits_beside_unless_requested():
    choice = DoorOptions(methods={"forward": ("ridge", "network"), "inverse": ()})
    domain = domain_for(small_data(), choice)
    splits = {
        name: {job.split for job in waves(domain, choice)[0] if job.method == name} for name in ("ridge", "network")
    }
    assert splits == {"ridge": {"grouped", "leave_one_door_out", "leaky"}, "network": {"grouped"}}
