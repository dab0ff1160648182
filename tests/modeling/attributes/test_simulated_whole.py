"""From simulated sessions to what is predicted: ledgers, recordings, features, folds and a fit."""

import pytest

from modeling.attributes.evaluation_tables import method_rows
from modeling.attributes.judging_whole import Wanted, judge
from modeling.attributes.reading import read_material
from modeling.attributes.registry import METHODS
from modeling.attributes.training import train_attributes
from protocols.plan import ParticipantRow, compile_plan
from studies.catalogue import SHIPPED
from studies.rig import simulated
from studies.session import start
from studies.texture_set_studies import chosen, planned
from tests.modeling.attributes.photo_labs import rated_by

TEXTURES = ("T02", "T11", "T17", "T25", "T33", "T36", "T39", "T43", "T48")
"""Of nine classes, each attribute from low to high."""
FELT = {"ridge": (("dwt",), ()), "mean": ((), ())}
"""Wavelets have 24 numbers, as few as nine textures can tell apart."""


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A simulated tool touched each for 7 s, and three simulated people rated it."""
    place = tmp_path_factory.mktemp("lab")
    study = planned(place, chosen(TEXTURES, 7.0))["texture_capture"].model_copy(update={"opening": ()})
    plan = compile_plan(study, ParticipantRow("P001", "perception", 0))
    start(place, plan, simulated(study, SHIPPED / "texture_capture"))
    rated_by(place, ("P001", "P002", "P003"), TEXTURES)
    return place


def test_what_was_felt_predicts_textures_left_out_better_than_the_mean(lab, tmp_path):
    material = read_material(lab, sight=False, workers=1, keep=False)
    assert material.simulated and sorted(material.ids) == list(TEXTURES)
    asked = Wanted(tmp_path, methods=("ridge", "mean"), ablations=False, workers=1)
    rows = {row["method"]: row for row in method_rows(judge(material, asked, METHODS, FELT))}
    assert rows["ridge"]["refused"] is rows["mean"]["refused"] is None
    assert rows["ridge"]["mae"] < 0.9 * rows["mean"]["mae"]
    written = train_attributes(material, "ridge", asked, tmp_path / "models", METHODS, FELT)
    assert written.metrics["mae"] == rows["ridge"]["mae"]
