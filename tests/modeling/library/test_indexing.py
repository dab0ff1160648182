"""From ratings and predictions to a library: what stands in it, and how sure it says it is."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.modeling.attributes.material import Material, MaterialError, Pair, Rated, Texture
from palpate.modeling.library.entries import LibraryError, value_of
from palpate.modeling.library.indexing import UNKNOWN_SD, Predictor, library_of, removed_textures
from tests.modeling.attributes.material_for_tests import PAIRS, simulated_material

MATERIAL = simulated_material(textures=6, segments=3, pictures=2)


def says(value, half=10.0, learned=(), pairs=PAIRS):
    """A model that says the same of every texture with features."""

    def predict(textures):
        rows = np.array([value]) + np.array([[-2.0], [2.0]])
        return [rows if texture.touch else MaterialError(f"{texture.id}: no mfcc features") for texture in textures]

    return Predictor(pairs, predict, np.full(4, -half), np.full(4, half), frozenset(learned))


def unrated(texture):
    return replace(texture, rated=None)


def with_textures(*textures):
    return replace(MATERIAL, textures=textures)


def test_ratings_alone_make_a_library_with_the_standard_error_of_their_mean():
    library = library_of(MATERIAL).library
    assert library.attributes == (("Rough", "Smooth"), ("Flat", "Bumpy"), ("Sticky", "Slippery"), ("Hard", "Soft"))
    assert [texture.id for texture in library.textures] == ["T01", "T02", "T03", "T04", "T05", "T06"]
    first = library.textures[0]
    assert first.rated.sd == (8,) * 4 and first.rated.raters == 20 and first.predicted is None
    assert first.rated.se == pytest.approx((8 / np.sqrt(20),) * 4, abs=1e-3)
    assert first.rated.mean == pytest.approx(MATERIAL.textures[0].rated.mean, abs=1e-3)
    assert first.made_from == ("0-0",) and library.simulated


def test_where_no_sd_is_given_people_differ_as_much_as_those_who_rated_the_others():
    lonely = replace(MATERIAL.textures[0], rated=Rated(np.full(4, 30.0), np.full(4, np.nan), 1))
    library = library_of(with_textures(lonely, *MATERIAL.textures[1:])).library
    assert library.textures[0].rated.se == (8,) * 4 and library.textures[0].rated.sd == (None,) * 4
    alone = library_of(with_textures(lonely)).library
    assert alone.textures[0].rated.se == (UNKNOWN_SD,) * 4
    four = replace(lonely, rated=Rated(np.full(4, 30.0), np.full(4, np.nan), 4))
    assert library_of(with_textures(four)).library.textures[0].rated.se == (UNKNOWN_SD / 2,) * 4


def test_predictions_stand_beside_ratings_and_alone_where_nobody_rated():
    material = with_textures(unrated(MATERIAL.textures[0]), *MATERIAL.textures[1:])
    library = library_of(material, says([10, 20, 30, 40], learned=["T02"])).library
    first, second = library.textures[:2]
    assert first.rated is None and first.predicted.value == (10, 20, 30, 40) and not first.predicted.learned
    assert first.predicted.low == (0, 10, 20, 30) and first.predicted.high == (20, 30, 40, 50)
    assert value_of(first, 0).sd == pytest.approx(10 / 1.644854, rel=1e-5)  # qnorm(0.95) in R
    assert second.rated is not None and second.predicted.learned


def test_a_model_alone_makes_a_library_with_its_own_attributes():
    material = Material(tuple(map(unrated, MATERIAL.textures)), (Pair("No", "Yes"),) * 4)
    assert library_of(material, says([1, 2, 3, 4])).library.attributes[0] == ("Rough", "Smooth")


def test_a_prediction_off_the_scale_lies_at_its_end():
    library = library_of(MATERIAL, says([-30, 20, 30, 140])).library
    assert library.textures[0].predicted.value == (0, 20, 30, 100)


def test_what_nothing_is_known_of_is_left_out_and_reported():
    silent = Texture("T09", "silent", "wood")
    indexed = library_of(with_textures(*MATERIAL.textures, silent), says([1, 2, 3, 4]))
    assert "T09" not in [texture.id for texture in indexed.library.textures]
    assert indexed.left_out == {"T09": "nobody rated it, and the model predicts nothing: T09: no mfcc features"}
    with pytest.raises(
        LibraryError, match="nothing is known of any texture .T09: nobody rated it, and there is no mod"
    ):
        library_of(with_textures(silent))
    with pytest.raises(LibraryError, match="nothing is known of any texture"):
        library_of(with_textures())


def test_a_model_of_other_attributes_is_refused():
    other = (Pair("Dry", "Wet"), *PAIRS[1:])
    with pytest.raises(
        LibraryError, match="people rated Rough-Smooth; .* the model predicts Dry-Wet; .*: train it on the"
    ):
        library_of(MATERIAL, says([1, 2, 3, 4], pairs=other))


def test_a_model_that_answers_no_number_is_refused():
    with pytest.raises(LibraryError, match="T01: the model's answer is not a number"):
        library_of(MATERIAL, says([np.nan, 2, 3, 4]))


def test_the_order_of_the_textures_does_not_matter_and_what_is_gone_is_named():
    whole = library_of(MATERIAL).library
    assert library_of(with_textures(*reversed(MATERIAL.textures))).library == whole
    fewer = library_of(with_textures(*MATERIAL.textures[1:4])).library
    assert removed_textures(whole, fewer) == ("T01", "T05", "T06")
    assert removed_textures(fewer, whole) == () == removed_textures(None, fewer)
