"""Where nothing fits: what is said of the wishes is so."""

from palpate.modeling.library.excluding import Excluded, excluded, none_fits
from palpate.modeling.library.finding import wishes_of
from tests.modeling.library.made_library import entry, made_library, rated


def sure(name, *mean):
    return entry(name, rated=rated(*mean, se=0.0))


def asked(text, *entries):
    library = made_library(*entries)
    return library.textures, wishes_of(library, [text])


ROUGH_SOFT = [sure(f"T0{k}", 5, 50, 50, 95) for k in range(1, 8)]
"""Seven rough and soft textures."""


def test_the_wish_that_leaves_out_most_is_named_though_a_texture_meets_it_best():
    """Slippery is met wholly by one texture and leaves out seven; hard is met at best in part and leaves out two."""
    half_hard = [sure(f"T1{k}", 5, 50, 20, 38.5) for k in range(5)]
    others = [sure("T20", 5, 50, 20, 90), sure("T21", 5, 50, 90, 90)]
    entries, wishes = asked("hard, slippery", *half_hard, *others)
    assert excluded(entries, wishes) == [Excluded("hard", 2, 1), Excluded("slippery", 6, 5)]
    assert none_fits(entries, wishes) == (
        "None of 7 textures fits. Most are left out by 'slippery': 6 of 7. Without 'slippery', 5 would fit."
    )


def test_what_helps_need_not_be_what_leaves_out_most():
    entries, wishes = asked("smooth, hard, flat", *ROUGH_SOFT, sure("T20", 95, 95, 50, 5))
    assert [each.out for each in excluded(entries, wishes)] == [7, 7, 8]
    told = none_fits(entries, wishes)
    assert "Most are left out by 'flat': 8 of 8." in told and told.endswith("Without 'flat', 1 would fit.")
    entries, wishes = asked(
        "smooth, hard, flat", *ROUGH_SOFT[:3], sure("T20", 95, 95, 50, 5), sure("T21", 5, 5, 50, 95)
    )
    told = none_fits(entries, wishes)
    assert "by 'smooth' and 'hard' and 'flat': 4 of 5 each." in told and "Without 'flat', 1 would fit." in told


def test_where_no_wish_alone_is_to_blame_that_is_said():
    """Three wishes that each fit by a tenth: together a thousandth."""
    entries, wishes = asked("smooth, bumpy, slippery", sure("T01", 56.5, 56.5, 56.5, 50))
    assert [each.out for each in excluded(entries, wishes)] == [0, 0, 0]
    assert "Each wish alone leaves out none; all at once, none is left." in none_fits(entries, wishes)


def test_two_that_both_exclude_everything_cannot_be_helped_by_giving_up_one():
    entries, wishes = asked("smooth, hard, sticky", *ROUGH_SOFT)
    told = none_fits(entries, wishes)
    assert told.endswith("by 'smooth' and 'hard' and 'sticky': 7 of 7 each. Giving up one wish does not help.")


def test_a_single_wish_needs_no_blame():
    entries, wishes = asked("smooth", *ROUGH_SOFT)
    assert none_fits(entries, wishes) == "None of 7 textures fits."


def test_what_was_said_in_one_breath_is_given_up_at_once():
    entries, wishes = asked("neither rough nor soft, flat", *ROUGH_SOFT[:2], sure("T20", 50, 95, 50, 50))
    assert [(each.said, each.out, each.without) for each in excluded(entries, wishes)] == [
        ("neither rough nor soft", 2, 0), ("flat", 3, 1),
    ]  # fmt: skip
