import dataclasses
import json

import numpy as np
import pytest

from palpate.modeling.evaluate.engine import result_of
from palpate.modeling.textures.domain import Explore, Fit, Play
from palpate.modeling.textures.evaluation.evaluate import domain_for, evaluate_methods
from palpate.modeling.textures.evaluation.tables import figure_4_5, grid_rows
from palpate.modeling.textures.recording import TextureDataError
from palpate.modeling.training.refusals import JobBroken
from tests.modeling.textures import small_evaluation as small
from tests.modeling.textures.recording_for_tests import recording

pytestmark = pytest.mark.needs("torch")


@pytest.fixture(scope="module")
def evaluation(tmp_path_factory):
    domain, options = small.domain(tmp_path_factory.mktemp("work"))
    return evaluate_methods(domain, options)


def test_every_method_is_fitted_scored_and_run_free_on_every_texture(evaluation):
    assert [(fit.texture, fit.method) for fit in evaluation.fits] == [
        (texture, method) for texture in ("smooth", "rough") for method in ("foten", "foten_generative")
    ]
    for fit, done in evaluation.fits.items():
        assert done.numbers["explained"] > 0.8
        assert done.numbers["mae"] == pytest.approx(
            done.numbers["mae_m_s2"] / np.std(small.windows_of(evaluation, fit.texture)), rel=0.01
        )
        assert done.files[0].is_file()
    assert set(evaluation.steps) == {"foten", "foten_generative"}


def test_running_free_tells_a_living_model_from_one_that_dies_though_one_step_ahead_they_are_equal(evaluation):
    alive, dead = (
        evaluation.plays[Play(Fit("smooth", "foten_generative"))],
        evaluation.plays[Play(Fit("smooth", "foten"))],
    )
    steps = [evaluation.fits[play.job.fit].numbers["mae"] for play in (alive, dead)]
    assert steps[0] == pytest.approx(steps[1], rel=1e-6)
    assert 0.7 < alive.numbers["level"] < 1.3
    assert dead.numbers["level"] < 0.5
    by_mean = evaluation.plays[Play(Fit("smooth", "foten_generative"), sampled=False)]
    assert by_mean.numbers["level"] < 0.5


def test_a_second_evaluation_takes_everything_from_the_first_and_finds_the_same(evaluation):
    again = evaluate_methods(evaluation.domain, evaluation.options)
    assert again.results.loaded == len(again.results) == len(evaluation.results)
    for job, done in evaluation.plays.items():
        assert again.plays[job].numbers == done.numbers
        np.testing.assert_array_equal(again.plays[job].array("made"), done.array("made"))


def test_what_decides_a_result_decides_its_key(evaluation):
    domain = evaluation.domain
    fit, parts = Fit("smooth", "foten"), domain.parts["smooth"]
    swapped = dataclasses.replace(parts, validation=parts.test, test=parts.validation)
    louder = {**domain.recordings, "smooth": recording(8.0, 5, "smooth")}
    others = [
        dataclasses.replace(domain, seed=1),
        dataclasses.replace(domain, recordings=louder),
        dataclasses.replace(domain, settings={"quick": True, "epochs": 3}),
        dataclasses.replace(domain, parts={**domain.parts, "smooth": swapped}),
    ]
    keys = {variant.key(fit) for variant in (domain, *others)}
    keys |= {domain.key(Fit("smooth", "foten", 10, "mae")), domain.key(Play(fit)), domain.key(Play(fit, False))}
    keys |= {domain.key(Explore("smooth")), dataclasses.replace(domain, seconds=5.0).key(Explore("smooth"))}
    assert len(keys) == 10


@pytest.mark.parametrize("damage", [b"", b"{}", b'{"numbers": 3}'])
def test_a_damaged_result_is_computed_again(tmp_path, damage):
    domain, _ = small.domain(tmp_path, recorded=small.recordings(4.0, ("smooth",)))
    job = Fit("smooth", "foten")
    first = result_of(job, domain)
    (tmp_path / domain.key(job)).with_suffix(".json").write_bytes(damage)
    assert result_of(job, domain).numbers["mae"] == first.numbers["mae"]


def test_a_kept_model_that_was_changed_is_made_again(tmp_path):
    domain, _ = small.domain(tmp_path, recorded=small.recordings(4.0, ("smooth",)))
    first = result_of(Fit("smooth", "foten"), domain)
    content = json.loads(first.files[0].read_text())
    first.files[0].write_text(json.dumps({**content, "title": "another"}))
    again = result_of(Fit("smooth", "foten"), domain)
    assert json.loads(again.files[0].read_text())["title"] == content["title"]


def test_a_method_that_refuses_is_named_and_the_others_go_on(tmp_path):
    recordings = small.recordings(4.0, ("smooth",))
    domain, options = small.domain(tmp_path, recorded=recordings, methods_of=("foten", "ten"))
    evaluation = evaluate_methods(domain, options)
    assert evaluation.fits[Fit("smooth", "ten")].refused == "smooth: this method has had enough."
    assert "had enough" in evaluation.plays[Play(Fit("smooth", "ten"))].refused
    assert evaluation.plays[Play(Fit("smooth", "foten"))].numbers["level"] is not None


def test_a_fault_of_the_program_is_not_taken_for_a_refusal(tmp_path):
    broken = {**small.METHODS, "ten": dataclasses.replace(small.REFUSING, fit=small.fit_broken)}
    domain, options = small.domain(
        tmp_path, known=broken, recorded=small.recordings(4.0, ("smooth",)), methods_of=("ten",)
    )
    with pytest.raises(JobBroken, match="a fault of the program"):
        evaluate_methods(domain, options)


def test_windows_and_losses_are_compared_without_files_and_chosen_by_the_validation_part(tmp_path):
    domain, options = small.domain(
        tmp_path, recorded=small.recordings(4.0, ("smooth",)), methods_of=("foten",), grid=("foten", "ar")
    )
    evaluation = evaluate_methods(domain, options)
    grid = {fit: done for fit, done in evaluation.fits.items() if fit.of_the_grid}
    assert len(grid) == 2 * 25
    assert all(done.files == () and done.numbers["mae"] > 0 for done in grid.values())
    assert len({done.numbers["test_samples"] for done in evaluation.fits.values()}) == 1
    rows = grid_rows(evaluation)
    for method in ("foten", "ar"):
        tried = [row for row in rows if row["method"] == method]
        (chosen,) = [row for row in tried if row["chosen"]]
        assert len(tried) == 25
        assert chosen["validation_mae"] == min(row["validation_mae"] for row in tried)
    assert len(figure_4_5(evaluation)) == 25


def test_a_recording_too_short_to_split_is_left_out_and_reported(tmp_path):
    short = recording(0.3, 1, "blink")
    domain, _ = small.domain(tmp_path, recorded=(short, *small.recordings(4.0, ("smooth",))))
    assert list(domain.recordings) == ["smooth"]
    assert "blink" in domain.left_out["blink"]
    with pytest.raises(TextureDataError, match="blink"):
        small.domain(tmp_path, recorded=(short,))


def test_two_recordings_of_one_name_and_unknown_methods_are_refused(tmp_path):
    with pytest.raises(TextureDataError, match="one of each"):
        small.domain(tmp_path, recorded=(recording(4.0, 1, "same"), recording(4.0, 2, "same")))
    with pytest.raises(TextureDataError, match="foten"):
        domain_for(small.recordings(), small.ResonantSurfaces(), small.options(tmp_path, methods=("fotan",)))


def test_a_short_recording_without_more_surface_is_driven_by_itself(tmp_path):
    domain, options = small.domain(tmp_path, recorded=(recording(1.9, 1, "smooth"),), explore=False)
    evaluation = evaluate_methods(domain, options)
    assert evaluation.drives["smooth"].seen
    assert evaluation.plays[Play(Fit("smooth", "foten_generative"))].numbers["level"] > 0.5
