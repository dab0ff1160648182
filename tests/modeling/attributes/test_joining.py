"""Where no texture can be felt, or none seen, the report says why, and for how many."""

from dataclasses import replace

from palpate.modeling.attributes.evaluation.report import banners, report_html
from palpate.modeling.attributes.joining import missing_modalities
from tests.modeling.attributes import small_evaluation as small


def unfelt(notes):
    """The material without touch; `notes` by texture, else none."""
    material = small.material()
    return replace(
        material, textures=tuple(replace(texture, touch={}, notes=notes(texture.id)) for texture in material.textures)
    )


def short(name):
    where = f"data/{name}.csv: nothing of its {int(name[1:]) / 4:.2f} s is left where 2.5 s are trimmed"
    return (f"recordings left out: {where}", "no recording of it can be used")


def test_reasons_that_differ_in_names_and_numbers_alone_are_one():
    (reason,) = missing_modalities(unfelt(lambda name: short(name) if name > "T02" else ("not recorded", "odd")))
    assert reason == (
        "No recording of any of the 12 textures can be used: T03 and 9 more: recordings left out: data/T03.csv: nothing"
        " of its 0.75 s is left where 2.5 s are trimmed; T01 and 1 more: not recorded."
    )


def test_many_reasons_are_counted():
    words = "abcdefghijkl"
    (reason,) = missing_modalities(unfelt(lambda name: (f"recordings left out: {words[int(name[1:]) - 1]}",)))
    assert reason.endswith("T03: recordings left out: c; and 9 more reasons (the report's Provenance has them).")


def test_a_lab_without_sessions_says_so():
    material = unfelt(lambda _name: ("not recorded",))
    (reason,) = missing_modalities(
        replace(material, notes=("no session of texture_capture: nothing was felt", "another"))
    )
    assert reason.startswith(
        "No recording of any of the 12 textures can be used: no session of texture_capture: nothing"
    )
    assert reason.endswith("felt; T01 and 11 more: not recorded.")


def test_pictures_are_reported_alike_and_what_some_textures_have_is_not_missing():
    material = small.material()
    notes = ("left out: T (a.jpg): black", "left out: T (b.jpg): black", "left out: T (c.jpg): 10 pixels")
    unseen = tuple(replace(texture, sight={}, variants={}, notes=notes) for texture in material.textures)
    assert missing_modalities(replace(material, textures=unseen)) == [
        "No picture of any of the 12 textures can be used: T01 and 11 more: left out: T (b.jpg): black; "
        "T01 and 11 more: left out: T (c.jpg): 10 pixels."
    ]
    assert missing_modalities(replace(material, textures=(*unseen[:11], material.textures[11]))) == []


def test_the_report_and_the_terminal_say_it(tmp_path):
    evaluation = small.evaluation(tmp_path, unfelt(short))
    reason = "No recording of any of the 12 textures can be used: T01 and 11 more: recordings left out: data/T01.csv"
    assert any(line.startswith(reason) for line in banners(evaluation))
    assert reason in report_html(evaluation)
