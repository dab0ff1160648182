"""What is found, and in which order."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.modeling.evaluate.intervals import JND
from palpate.modeling.library.entries import LibraryError, value_of
from palpate.modeling.library.search import (
    Excluded,
    distance_between,
    exclusions,
    find,
    find_texture,
    fitting,
    near,
    none_fits,
    require_known,
    select_textures,
    wishes_of,
)
from tests.modeling.library.library_for_tests import entry, predicted, rated, small_library

LIBRARY = small_library()


def fits_of(text, library=LIBRARY, kind=None):
    wishes = wishes_of(library, [text])
    return {match.entry.id: match.fit for match in find(select_textures(library, (), kind), wishes, kind)}


def test_what_surely_fits_comes_first_then_what_is_less_known_then_what_surely_does_not():
    fits = fits_of("rough, a bit sticky, not bumpy")
    assert list(fits)[:4] == ["T01", "T02", "T06", "T03"]
    assert fits["T01"] > 0.99 and 0.5 < fits["T06"] < 0.95 and fits["T05"] < 1e-6


def test_the_fit_is_the_product_of_the_attributes_memberships():
    one, two, together = (fits_of(text)["T02"] for text in ("smooth 25", "flat 65", "flat 65, smooth 25"))
    assert 0 < one < 1 and 0 < two < 1 and together == pytest.approx(one * two)


def test_two_wishes_about_one_attribute_are_fulfilled_by_one_value():
    library = small_library(entry("T01", rated=rated(50, 50, 50, 50, se=0)))
    assert fits_of("not rough, not smooth", library) == {"T01": 1.0} == fits_of("neither rough nor smooth", library)


def test_what_is_certain_and_inside_fits_wholly_and_outside_not_at_all():
    library = small_library(entry("T01", rated=rated(10, 10, 10, 10, se=0)))
    assert fits_of("rough, flat, sticky, hard", library) == {"T01": 1.0}
    assert fits_of("rough, flat, sticky, soft", library) == {"T01": 0.0}


def test_of_an_attribute_that_is_not_known_anything_may_be_so():
    unknown = rated(10, 40, 35, 15).model_copy(update={"mean": (None, 40, 35, 15)})
    library = small_library(
        entry("T01", rated=rated(10, 40, 35, 15)), entry("T02", rated=unknown), entry("T03", rated=rated(90, 4, 4, 4))
    )
    fits = fits_of("rough", library)
    assert list(fits) == ["T01", "T02", "T03"] and fits["T01"] > 0.99 and 0.2 < fits["T02"] < 0.5 and fits["T03"] < 0.01


@given(st.floats(0, 100), st.floats(0.1, 20), st.floats(0, 20))
def test_what_surely_fits_loses_by_being_known_less(value, se, more):
    fits = [
        fits_of("rough, not bumpy", small_library(entry("T01", rated=rated(5, value / 4, 50, 50, se=error))))["T01"]
        for error in (se, se + more)
    ]
    assert fits[1] <= fits[0] + 1e-9


def test_rated_comes_before_predicted_unless_another_is_requested():
    both = find_texture(LIBRARY, "T02")
    assert [value_of(both, 0, kind).value for kind in (None, "rated", "predicted")] == [20, 20, 35]
    assert value_of(both, 0, "predicted").sd == pytest.approx(15 / 1.6449, rel=1e-3)  # qnorm(0.95) in R
    assert set(fits_of("rough", kind="rated")) == {"T01", "T02", "T03", "T04", "T05"}
    assert set(fits_of("rough", kind="predicted")) == {"T02", "T06"}


def test_equal_fits_are_in_the_order_of_names_whatever_the_order_of_the_library():
    twins = [entry(name, rated=rated(10, 40, 35, 15)) for name in ("T09", "T03", "T05")]
    assert list(fits_of("rough", small_library(*twins))) == ["T03", "T05", "T09"]


def test_only_what_fits_is_given():
    assert not fitting(find(LIBRARY.textures, wishes_of(LIBRARY, ["very soft, extremely slippery"])), 10)
    rough = find(LIBRARY.textures, wishes_of(LIBRARY, ["rough"]))
    assert [match.entry.id for match in fitting(rough, 2)] == ["T01", "T05"]
    assert all(0 <= match.fit <= 1 and math.isfinite(match.fit) for match in rough)


def test_classes_and_names_are_found_in_any_letters():
    assert [texture.id for texture in select_textures(LIBRARY, ["SandPaper", "mesh"])] == ["T01", "T02", "T05"]
    assert find_texture(LIBRARY, "t05") == find_texture(LIBRARY, "Mesh 05")


def test_a_class_or_a_name_that_there_is_not_is_reported():
    with pytest.raises(LibraryError, match="no class 'sandpapers' in this library; did you mean 'sandpaper'"):
        select_textures(LIBRARY, ["sandpapers"])
    with pytest.raises(LibraryError, match="no texture 'sandpaper 07' in this library; did you mean 'sandpaper 0"):
        find_texture(LIBRARY, "sandpaper 07")
    with pytest.raises(LibraryError, match="no texture that a model predicted among the 1 "):
        select_textures(small_library(entry("T01", rated=rated(1, 2, 3, 4))), (), "predicted")
    with pytest.raises(LibraryError, match="say --class mesh"):
        wishes_of(LIBRARY, ["mesh"])


def test_a_prediction_alone_is_as_unsure_as_its_interval():
    narrow, wide = (small_library(entry("T01", predicted=predicted(20, 9, 9, 9, half=half))) for half in (5, 40))
    assert fits_of("rough", narrow)["T01"] > 0.99 and 0.4 < fits_of("rough", wide)["T01"] < 0.8


def test_of_those_that_fit_alike_the_furthest_comes_first():
    library = small_library(
        entry("T01", rated=rated(9, 50, 50, 50, se=0)), entry("T02", rated=rated(2, 50, 50, 50, se=0)),
        entry("T03", rated=rated(6, 50, 50, 50, se=0)),
    )  # fmt: skip
    assert [match.entry.id for match in find(library.textures, wishes_of(library, ["rough"]))] == ["T02", "T03", "T01"]
    turned = [match.entry.id for match in find(library.textures, wishes_of(library, ["not smooth"]))]
    assert turned == ["T02", "T03", "T01"]


def test_an_id_goes_before_a_label_and_a_label_of_several_is_refused():
    one, two = entry("A", rated=rated(1, 1, 1, 1)), entry("B", rated=rated(2, 2, 2, 2))
    assert find_texture(small_library(one.model_copy(update={"label": "B"}), two), "b").id == "B"
    twice = small_library(*(texture.model_copy(update={"label": "same"}) for texture in (one, two)))
    with pytest.raises(LibraryError, match="2 textures are called 'Same': A, B"):
        find_texture(twice, "Same")


def test_nothing_is_near_to_what_nothing_is_known_of():
    one = entry("T01", rated=rated(1, 1, 1, 1))
    assert require_known(one, None) is require_known(one, "rated") is one
    with pytest.raises(LibraryError, match="T01: no model predicted it"):
        require_known(one, "predicted")


def sure(name, *mean):
    return entry(name, rated=rated(*mean, se=0.0))


def entries_and_wishes(text, *entries):
    library = small_library(*entries)
    return library.textures, wishes_of(library, [text])


ROUGH_SOFT = [sure(f"T0{k}", 5, 50, 50, 95) for k in range(1, 8)]
"""Seven rough and soft textures."""


def test_the_wish_that_leaves_out_most_is_named_though_a_texture_meets_it_best():
    """Slippery is met wholly by one texture and leaves out seven; hard is met at best in part and leaves out two."""
    half_hard = [sure(f"T1{k}", 5, 50, 20, 38.5) for k in range(5)]
    others = [sure("T20", 5, 50, 20, 90), sure("T21", 5, 50, 90, 90)]
    entries, wishes = entries_and_wishes("hard, slippery", *half_hard, *others)
    assert exclusions(entries, wishes) == [Excluded("hard", 2, 1), Excluded("slippery", 6, 5)]
    assert none_fits(entries, wishes) == (
        "None of 7 textures fits. Most are left out by 'slippery': 6 of 7. Without 'slippery', 5 would fit."
    )


def test_what_helps_need_not_be_what_leaves_out_most():
    entries, wishes = entries_and_wishes("smooth, hard, flat", *ROUGH_SOFT, sure("T20", 95, 95, 50, 5))
    assert [exclusion.out for exclusion in exclusions(entries, wishes)] == [7, 7, 8]
    text = none_fits(entries, wishes)
    assert "Most are left out by 'flat': 8 of 8." in text and text.endswith("Without 'flat', 1 would fit.")
    entries, wishes = entries_and_wishes(
        "smooth, hard, flat", *ROUGH_SOFT[:3], sure("T20", 95, 95, 50, 5), sure("T21", 5, 5, 50, 95)
    )
    text = none_fits(entries, wishes)
    assert "by 'smooth' and 'hard' and 'flat': 4 of 5 each." in text and "Without 'flat', 1 would fit." in text


def test_where_no_wish_alone_is_to_blame_the_text_says_so():
    """Three wishes that each fit by a tenth: together a thousandth."""
    entries, wishes = entries_and_wishes("smooth, bumpy, slippery", sure("T01", 56.5, 56.5, 56.5, 50))
    assert [exclusion.out for exclusion in exclusions(entries, wishes)] == [0, 0, 0]
    assert "Each wish alone leaves out none; all at once, none is left." in none_fits(entries, wishes)


def test_two_that_both_exclude_everything_cannot_be_helped_by_giving_up_one():
    entries, wishes = entries_and_wishes("smooth, hard, sticky", *ROUGH_SOFT)
    text = none_fits(entries, wishes)
    assert text.endswith("by 'smooth' and 'hard' and 'sticky': 7 of 7 each. Giving up one wish does not help.")


def test_a_single_wish_needs_no_blame():
    entries, wishes = entries_and_wishes("smooth", *ROUGH_SOFT)
    assert none_fits(entries, wishes) == "None of 7 textures fits."


def test_wishes_of_one_phrase_are_given_up_together():
    entries, wishes = entries_and_wishes("neither rough nor soft, flat", *ROUGH_SOFT[:2], sure("T20", 50, 95, 50, 50))
    assert [(exclusion.text, exclusion.out, exclusion.without) for exclusion in exclusions(entries, wishes)] == [
        ("neither rough nor soft", 2, 0), ("flat", 3, 1),
    ]  # fmt: skip


def two(one, other, one_se=2.0, other_se=2.0):
    return entry("A01", rated=rated(*one, se=one_se)), entry("B02", rated=rated(*other, se=other_se))


def test_one_jnd_on_every_attribute_is_a_distance_of_one():
    assert distance_between(*two((50, 50, 50, 50), (60, 40, 60, 40)), 4).distance == pytest.approx(1)
    distance = distance_between(*two((50, 50, 50, 50), (90, 50, 50, 50)), 4)
    assert distance.distance == pytest.approx(2)  # sqrt(4^2 / 4)
    assert distance.apart == (4, 0, 0, 0)


@pytest.mark.parametrize("other", [(50, 50, 50, 50), (55, 45, 52, 50), (90, 20, 50, 40)])
@pytest.mark.parametrize("spread", [1.0, 6.0, 15.0])
def test_its_sd_and_likeness_are_those_of_drawn_textures(other, spread):
    distance = distance_between(*two((50, 50, 50, 50), other, spread, spread / 2), 4)
    chance = np.random.Generator(np.random.PCG64(1))
    drawn = chance.normal(np.subtract(other, 50), np.hypot(spread, spread / 2), (200_000, 4)) / JND
    distances = np.sqrt((drawn**2).mean(axis=1))
    assert distance.sd == pytest.approx(distances.std(), rel=0.08)
    assert distance.alike == pytest.approx((np.abs(drawn) < 1).all(axis=1).mean(), abs=0.005)


def test_what_is_known_for_sure_has_no_spread():
    assert distance_between(*two((1, 2, 3, 4), (1, 2, 3, 4), 0, 0), 4).sd == 0
    distance = distance_between(*two((1, 2, 3, 4), (9, 2, 3, 4), 0, 0), 4)
    assert distance.sd == 0 and distance.alike == 1
    assert distance_between(*two((1, 2, 3, 4), (11, 2, 3, 4), 0, 0), 4).alike == 0


def test_distances_are_the_same_from_either_side():
    one, other = two((10, 20, 30, 40), (44, 33, 22, 11), 3, 9)
    there, back = distance_between(one, other, 4), distance_between(other, one, 4)
    assert (there.distance, there.sd, there.alike) == pytest.approx((back.distance, back.sd, back.alike))


def test_the_nearest_come_first_and_a_texture_is_not_near_itself():
    library = small_library()
    matches = near(library.textures[0], library.textures, 4)
    assert [match.entry.id for match in matches] == ["T02", "T06", "T05", "T03", "T04"]


def test_an_attribute_that_is_not_known_makes_the_distance_unsure():
    one, other = two((50, 50, 50, 50), (50, 50, 50, 50))
    incomplete = other.model_copy(update={"rated": other.rated.model_copy(update={"mean": (None, 50, 50, 50)})})
    assert distance_between(one, incomplete, 4).sd > 3 * distance_between(one, other, 4).sd
    assert distance_between(one, incomplete, 4).alike < 0.4 and distance_between(one, other, 4).alike > 0.9
