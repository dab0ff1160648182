"""A drawing for a page: fewer bytes, the same picture, and marks that tell what they are."""

import re

import pytest

from palpate.analysis.figures.figure_kind import Mark
from palpate.analysis.figures.interactive import compact_svg, figure_markup, key_text, script
from palpate.analysis.figures.style import inline_svg
from palpate.analysis.regenerating.plan_figures import draw_all

SVG = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 720 300">
 <defs><clipPath id="f1-c"><rect x="1.23456" y="0" width="5" height="5"/></clipPath>
 <path id="f1-glyph" d="M 2944 4013
L 2944 2272" transform="scale(0.015625)"/></defs>
 <g id="f1-figure_1"><g id="f1-empty"/><g id="f1-m0">
   <path d="M 1.234567 -0.0001 L 2e-05 10.5" clip-path="url(#f1-c)" style="fill: #fff; stroke: none"/></g>
 <g id="f1-text" transform="translate(11.48625 55.494313) scale(0.09 -0.09)">
  <use xlink:href="#f1-glyph" x="3.14159"/></g>
 <path d="M 0 0" style="fill: #fff; stroke: none"/></g></svg>"""
MARK = Mark("m0", (("who\tis", 'P "1" <b>'), ("mean", "2.50")), "P & 1")


def test_fewer_bytes_and_the_same_picture():
    compact = compact_svg(SVG, "f1", {"f1-m0"})
    assert 'd="M 1.23 0 L 2e-05 10.5"' in compact or 'd="M 1.23 0 L 0 10.5"' in compact
    assert "translate(11.49 55.49) scale(0.09 -0.09)" in compact and "scale(0.015625)" in compact
    assert 'd="M 2944 4013 L 2944 2272"' in compact and 'href="#f1-glyph"' in compact and "xlink:href" not in compact
    assert (
        "f1-empty" not in compact
        and "f1-figure_1" not in compact
        and 'id="f1-m0"' in compact
        and 'id="f1-c"' in compact
    )
    assert compact.count("fill:#fff;stroke:none") == 1 and compact.count('class="f1s0"') == 2
    assert ">\n" not in compact


def test_every_length_stays_within_a_hundredth_of_a_point(small):
    (picture, *_) = [picture for picture in draw_all(small.figures[:1], None) if picture is not None]
    whole = inline_svg(picture.svg, "f1")
    less = compact_svg(whole, "f1", {f"f1-{mark.gid}" for mark in picture.marks})
    assert len(less) < 0.8 * len(whole)
    paths = [[[float(n) for n in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", d)] for d in re.findall(r' d="([^"]*)"', text)]
             for text in (whole, less)]  # fmt: skip
    assert len(paths[0]) == len(paths[1]) > 20
    for before, after in zip(*paths, strict=True):
        assert after == pytest.approx(before, abs=0.00501)


def test_a_mark_tells_its_numbers_and_nothing_of_it_is_markup():
    markup = str(figure_markup(SVG, [MARK], "f1", 'a "label"'))
    assert 'data-details="who is\tP &quot;1&quot; &lt;b&gt;\nmean\t2.50"' in markup
    assert 'data-key="P &amp; 1"' in markup and 'aria-label="a &quot;label&quot;"' in markup
    assert markup.count('class="mark"') == 1 and "--least:720px" in markup


def test_a_mark_that_is_not_drawn_is_left_out():
    assert 'class="mark"' not in str(figure_markup(SVG, [Mark("m7", (("a", "b"),), "k")], "f1"))


def test_two_keys_are_distinguished():
    assert key_text("a\tb", "c\nd") == "a b\tc d"


def test_the_script_needs_nothing_from_outside():
    code = script()
    assert not re.search(r"https?:|import\s|fetch\(|XMLHttpRequest|innerHTML|eval\(|localStorage", code)
    assert "</" not in code
