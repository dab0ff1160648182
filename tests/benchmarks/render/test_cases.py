import numpy as np
import pytest

from benchmarks.render.cases import Nothing, cases, stepped
from benchmarks.render.extremes import run_extremes
from benchmarks.render.model import measured_card, predictor
from palpate.signals.models.fastest import fastest
from palpate.signals.models.file import read_model
from palpate.signals.textures.voice import open_voice, play


def test_the_bench_names_what_is_to_be_reached(tmp_path):
    named = {(case.case, case.method, case.error_kind) for case in cases(quick=True)}
    assert ("underruns", "normal priority", "underruns") in named
    assert ("late without a buffer", "real-time priority", "share later than 1 ms") in named
    assert len(named) == 16


def test_its_predictor_has_the_level_that_its_card_says(tmp_path):
    played = play(predictor(tmp_path), np.full(20_000, 100.0), np.ones(20_000), 1)
    assert float(np.std(played)) == pytest.approx(1.0, rel=0.1)
    assert measured_card(tmp_path).suffix == ".json"


def test_everything_that_can_come_in_leaves_it_bounded_silent_at_rest_and_mended(tmp_path):
    result = run_extremes(predictor(tmp_path), 0.25, seed=3)
    assert result.steps >= 15_000
    assert result.beyond <= 0.0
    assert result.at_rest == 0.0
    assert result.not_numbers == 0
    assert 20 * np.log10(result.apart) < 3.0
    assert result.restarts >= 1


def test_without_its_model_a_voice_is_silent(tmp_path):
    model = read_model(predictor(tmp_path))
    seconds, beyond = stepped(model, lambda read: Nothing(read.card), 200)
    assert seconds > 0
    assert beyond < -5.0
    assert open_voice(model, seed=1, runs=fastest).card == model.card
