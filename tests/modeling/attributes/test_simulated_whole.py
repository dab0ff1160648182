"""From simulated sessions to what is predicted and found: ledgers, recordings, pictures, features, folds, a library."""

import json

import pytest
from click.testing import CliRunner

from palpate.modeling.attributes.evaluation.evaluate import AttributeOptions, evaluate_methods
from palpate.modeling.attributes.evaluation.tables import method_rows
from palpate.modeling.attributes.reading import read_material
from palpate.modeling.attributes.registry import METHODS
from palpate.modeling.attributes.training import train_attributes
from palpate.modeling.commands_library import textures
from palpate.studies.simulation.texture_simulator import SimulatedTextures

pytestmark = [pytest.mark.long, pytest.mark.needs("torch", "librosa", "pywt", "skimage")]

TEXTURES = ("T02", "T11", "T17", "T25", "T33", "T36", "T39", "T43", "T48")
"""Of nine classes, each attribute from low to high."""
FELT = {"ridge": (("dwt",), ()), "mean": ((), ())}
"""Wavelets have 24 numbers, as few as nine textures can tell apart."""
FELT_AND_SEEN = {**FELT, "ridge": (("dwt",), ("resnet",))}


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A simulated tool touched each for 7 s, a camera took one picture of each, three simulated people rated it."""
    place = tmp_path_factory.mktemp("set") / "lab"
    sessions = SimulatedTextures().make_set(
        place, lambda _line: None, textures=TEXTURES, seconds=7.0, pictures=1, raters=3
    )
    assert all(session.complete for session in sessions)
    return place


@pytest.fixture(scope="module")
def material(lab):
    """The textures with features of both modalities, with a quick look at pictures; cached in the lab."""
    return read_material(lab, quick=True, variants=0, workers=1)


def rows_of(evaluation):
    rows = {row["method"]: row for row in method_rows(evaluation)}
    assert rows["ridge"]["refused"] is rows["mean"]["refused"] is None
    return rows


def test_what_was_felt_predicts_textures_left_out_better_than_the_mean(lab, tmp_path):
    material = read_material(lab, sight=False, workers=1)
    assert material.simulated and sorted(material.ids) == list(TEXTURES)
    options = AttributeOptions(work=tmp_path, methods=("ridge", "mean"), ablations=False, workers=1)
    rows = rows_of(evaluate_methods(material, options, METHODS, FELT))
    assert rows["ridge"]["mae"] < 0.9 * rows["mean"]["mae"]
    written = train_attributes(material, "ridge", options, tmp_path / "models", METHODS, FELT)
    assert written.metrics["mae"] == rows["ridge"]["mae"]


def test_what_was_felt_and_seen_predicts_textures_left_out_better_than_the_mean(material, tmp_path):
    assert material.simulated and sorted(material.ids) == list(TEXTURES)
    assert all(
        texture.touch["dwt"].shape == (3, 24) and texture.sight["resnet"].shape == (1, 2048)
        for texture in material.textures
    )
    options = AttributeOptions(work=tmp_path, methods=("ridge", "mean"), ablations=False, workers=1)
    rows = rows_of(evaluate_methods(material, options, METHODS, FELT_AND_SEEN))
    assert rows["ridge"]["mae"] < 0.9 * rows["mean"]["mae"]


@pytest.fixture(scope="module")
def indexed(lab, material, tmp_path_factory):
    """The lab with a model of both senses and a library."""
    options = AttributeOptions(work=tmp_path_factory.mktemp("work"), quick=True, workers=1)
    train_attributes(material, "ridge", options, lab / "models", METHODS, FELT_AND_SEEN)
    counts = in_words("index", "--lab", str(lab), "--workers", "1")
    assert {counts[count] for count in ("textures", "rated", "predicted", "pictures")} == {len(TEXTURES)}
    return lab


def in_words(*words):
    result = CliRunner().invoke(textures, [*words, "--json"])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


@pytest.mark.parametrize(
    ("wish", "attribute", "most"),
    [("very rough", 0, min), ("bumpy, not sticky", 1, max), ("very soft", 3, max)],
    ids=["rough", "bumpy", "soft"],
)
def test_what_people_feel_most_is_found_by_what_the_model_predicts(material, indexed, wish, attribute, most):
    options = most(material.textures, key=lambda texture: texture.rated.mean[attribute]).id
    for source in ("--predicted", "--rated-only"):
        assert in_words("find", wish, "--lab", str(indexed), source)["found"][0]["id"] == options
