"""The shipped curves, what is known of them, and families that stay on one side of a split."""

import shutil

import numpy as np
import pytest

from benchmarks.keyswitch.bump import bump
from benchmarks.keyswitch.curves import CURVES, KINDS, KINDS_FILE, MEASURED, CurveError, measured
from benchmarks.keyswitch.families import families


def test_the_shipped_curves_are_119_real_ones_with_kind_and_maker_and_their_notice():
    curves = measured()
    assert len(curves) == 119 and curves.force_gf.shape == (119, 621) and len(set(curves.names)) == 119
    assert dict(zip(KINDS, np.bincount(curves.kind), strict=True)) == {"linear": 73, "tactile": 32, "clicky": 14}
    assert curves.travel_mm.min() > 2.7 and curves.travel_mm.max() < 4.5
    assert "Force curve data by ThereminGoat (theremingoat.com)" in (MEASURED / "NOTICE").read_text()
    assert "MIT License" in (MEASURED / "LICENSE").read_text()


def test_the_names_that_tell_a_kind_tell_the_one_that_is_stated():
    curves = measured()
    kind_of_word = {"Linear": "linear", "Tactile": "tactile", "Clickie": "clicky", "Clicky": "clicky"}
    named = [
        (kind, word)
        for name, kind in zip(curves.names, curves.kind, strict=True)
        for word in kind_of_word
        if word in name
    ]
    assert len(named) == 6
    assert all(KINDS[kind] == kind_of_word[word] for kind, word in named)


def test_a_family_is_linked_by_maker_and_by_brand():
    names = (
        "Kailh Box Navy",
        "Novelkeys Cream",
        "Novelkeys Arc",
        "Ajazz x Huano Fig",
        "Huano Fi",
        "Lubed Geon",
        "Popu",
    )
    makers = ("Kailh", "Kailh", "", "", "", "", "JWK")
    assert families(names, makers) == (names[0],) * 3 + (names[3],) * 2 + (names[5], names[6])


def test_families_of_the_shipped_curves_are_whole_and_none_is_most_of_them():
    curves = measured()
    for maker in set(curves.makers) - {""}:
        assert len({f for f, m in zip(curves.family, curves.makers, strict=True) if m == maker}) == 1
    assert len(set(curves.family)) == 17
    assert max(curves.family.count(family) for family in curves.family) == 19


def test_the_bump_of_a_ramp_is_nothing_and_of_a_known_fall_is_that_fall():
    travel = np.linspace(0, 1, 621)
    fall = np.interp(travel, [0, 0.4, 0.5, 1], [0, 60, 40, 80])
    greatest, steepest, place = bump(np.vstack([50 * travel, fall])).T
    assert greatest == pytest.approx([0, 20], abs=0.1) and place[1] == pytest.approx(0.5, abs=0.01)
    assert steepest == pytest.approx([0, 20 / 10 * 100 * 6 / 620], abs=0.01)


def test_nearly_every_switch_that_is_not_linear_has_a_bump():
    curves = measured()
    falls = bump(curves.force_gf)[:, 0] > 8.0
    assert np.sum(falls != (curves.kind != 0)) <= 3


BROKEN = {
    "a number that is none": (CURVES, lambda text: text.replace("44.72", "nought", 1), "could not convert"),
    "a force that is not finite": (CURVES, lambda text: text.replace("44.72", "nan", 1), "not finite"),
    "a point too few": (CURVES, lambda text: text.replace("44.72,", "", 1), "line 2 has 622 cells"),
    "a switch twice": (KINDS_FILE, lambda text: text + text.splitlines()[-1] + "\n", "a name again"),
    "another switch": (KINDS_FILE, lambda text: text.replace("TTC Neptune", "TTC Nepal"), "different switches: TTC Ne"),
    "a kind that is none": (KINDS_FILE, lambda text: text.replace(",clicky,", ",loud,", 1), "'loud'"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_a_file_that_is_not_right_is_refused(case, tmp_path):
    name, change, words = BROKEN[case]
    for file in (CURVES, KINDS_FILE):
        shutil.copy(MEASURED / file, tmp_path / file)
    (tmp_path / name).write_text(change((tmp_path / name).read_text()))
    with pytest.raises(CurveError, match=words):
        measured(tmp_path)
