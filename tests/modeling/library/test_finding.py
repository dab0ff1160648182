"""What is found, and in which order."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.modeling.library.entries import LibraryError, felt
from palpate.modeling.library.finding import chosen, find, fitting, known_of, named, wishes_of
from tests.modeling.library.made_library import entry, made_library, predicted, rated

LIBRARY = made_library()


def found(text, library=LIBRARY, kind=None):
    wishes = wishes_of(library, [text])
    return {each.entry.id: each.fit for each in find(chosen(library, (), kind), wishes, kind)}


def test_what_surely_fits_comes_first_then_what_is_less_known_then_what_surely_does_not():
    fits = found("rough, a bit sticky, not bumpy")
    assert list(fits)[:4] == ["T01", "T02", "T06", "T03"]
    assert fits["T01"] > 0.99 and 0.5 < fits["T06"] < 0.95 and fits["T05"] < 1e-6


def test_the_fit_is_the_product_of_the_attributes_memberships():
    one, two, together = (found(text)["T02"] for text in ("smooth 25", "flat 65", "flat 65, smooth 25"))
    assert 0 < one < 1 and 0 < two < 1 and together == pytest.approx(one * two)


def test_two_wishes_about_one_attribute_are_met_by_one_value():
    library = made_library(entry("T01", rated=rated(50, 50, 50, 50, se=0)))
    assert found("not rough, not smooth", library) == {"T01": 1.0} == found("neither rough nor smooth", library)


def test_what_is_certain_and_inside_fits_wholly_and_outside_not_at_all():
    library = made_library(entry("T01", rated=rated(10, 10, 10, 10, se=0)))
    assert found("rough, flat, sticky, hard", library) == {"T01": 1.0}
    assert found("rough, flat, sticky, soft", library) == {"T01": 0.0}


def test_of_an_attribute_that_is_not_known_anything_may_be_so():
    unknown = rated(10, 40, 35, 15).model_copy(update={"mean": (None, 40, 35, 15)})
    library = made_library(
        entry("T01", rated=rated(10, 40, 35, 15)), entry("T02", rated=unknown), entry("T03", rated=rated(90, 4, 4, 4))
    )
    fits = found("rough", library)
    assert list(fits) == ["T01", "T02", "T03"] and fits["T01"] > 0.99 and 0.2 < fits["T02"] < 0.5 and fits["T03"] < 0.01


@given(st.floats(0, 100), st.floats(0.1, 20), st.floats(0, 20))
def test_what_surely_fits_loses_by_being_known_less(value, se, more):
    fits = [
        found("rough, not bumpy", made_library(entry("T01", rated=rated(5, value / 4, 50, 50, se=each))))["T01"]
        for each in (se, se + more)
    ]
    assert fits[1] <= fits[0] + 1e-9


def test_rated_comes_before_predicted_unless_another_is_asked_for():
    both = named(LIBRARY, "T02")
    assert [felt(both, 0, kind).value for kind in (None, "rated", "predicted")] == [20, 20, 35]
    assert felt(both, 0, "predicted").sd == pytest.approx(15 / 1.6449, rel=1e-3)  # qnorm(0.95) in R
    assert set(found("rough", kind="rated")) == {"T01", "T02", "T03", "T04", "T05"}
    assert set(found("rough", kind="predicted")) == {"T02", "T06"}


def test_equal_fits_stand_by_name_whatever_the_order_of_the_library():
    twins = [entry(name, rated=rated(10, 40, 35, 15)) for name in ("T09", "T03", "T05")]
    assert list(found("rough", made_library(*twins))) == ["T03", "T05", "T09"]


def test_only_what_fits_is_given():
    assert not fitting(find(LIBRARY.textures, wishes_of(LIBRARY, ["very soft, extremely slippery"])), 10)
    rough = find(LIBRARY.textures, wishes_of(LIBRARY, ["rough"]))
    assert [each.entry.id for each in fitting(rough, 2)] == ["T01", "T05"]
    assert all(0 <= each.fit <= 1 and math.isfinite(each.fit) for each in rough)


def test_classes_and_names_are_found_in_any_letters():
    assert [each.id for each in chosen(LIBRARY, ["SandPaper", "mesh"])] == ["T01", "T02", "T05"]
    assert named(LIBRARY, "t05") == named(LIBRARY, "Mesh 05")


def test_a_class_or_a_name_that_there_is_not_is_told():
    with pytest.raises(LibraryError, match="no class 'sandpapers' in this library; did you mean 'sandpaper'"):
        chosen(LIBRARY, ["sandpapers"])
    with pytest.raises(LibraryError, match="no texture 'sandpaper 07' in this library; did you mean 'sandpaper 0"):
        named(LIBRARY, "sandpaper 07")
    with pytest.raises(LibraryError, match="no texture that a model predicted among the 1 "):
        chosen(made_library(entry("T01", rated=rated(1, 2, 3, 4))), (), "predicted")
    with pytest.raises(LibraryError, match="say --class mesh"):
        wishes_of(LIBRARY, ["mesh"])


def test_a_prediction_alone_is_as_unsure_as_its_interval():
    narrow, wide = (made_library(entry("T01", predicted=predicted(20, 9, 9, 9, half=half))) for half in (5, 40))
    assert found("rough", narrow)["T01"] > 0.99 and 0.4 < found("rough", wide)["T01"] < 0.8


def test_of_those_that_fit_alike_the_furthest_comes_first():
    library = made_library(
        entry("T01", rated=rated(9, 50, 50, 50, se=0)), entry("T02", rated=rated(2, 50, 50, 50, se=0)),
        entry("T03", rated=rated(6, 50, 50, 50, se=0)),
    )  # fmt: skip
    assert [each.entry.id for each in find(library.textures, wishes_of(library, ["rough"]))] == ["T02", "T03", "T01"]
    turned = [each.entry.id for each in find(library.textures, wishes_of(library, ["not smooth"]))]
    assert turned == ["T02", "T03", "T01"]


def test_an_id_goes_before_a_label_and_a_label_of_several_is_refused():
    one, two = entry("A", rated=rated(1, 1, 1, 1)), entry("B", rated=rated(2, 2, 2, 2))
    assert named(made_library(one.model_copy(update={"label": "B"}), two), "b").id == "B"
    twice = made_library(*(each.model_copy(update={"label": "same"}) for each in (one, two)))
    with pytest.raises(LibraryError, match="2 textures are called 'Same': A, B"):
        named(twice, "Same")


def test_nothing_is_near_to_what_nothing_is_known_of():
    one = entry("T01", rated=rated(1, 1, 1, 1))
    assert known_of(one, None) is known_of(one, "rated") is one
    with pytest.raises(LibraryError, match="T01: no model predicted it"):
        known_of(one, "predicted")
