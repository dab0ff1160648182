"""What the benches of voice coil, door profiles, masking noise and camera hold true, and that a wrong part is seen."""

import functools
import math
from fractions import Fraction

import numpy as np
import pytest

from benchmarks import actuator, camera, profiles, sound
from palpate.devices.actuator.outputs import Coil
from palpate.devices.sound.noise import rms_of

BENCHES = (actuator, profiles, sound, camera)


@functools.cache
def quick_cases(room):
    return list(room.cases(True))


def of(room, case, method, given=""):
    """The case of a room's quick bench whose names hold these words."""
    (match,) = [
        quick_case
        for quick_case in quick_cases(room)
        if case in quick_case.case and method in quick_case.method and given in quick_case.input
    ]
    return match.error(match.run())


@pytest.mark.parametrize("room", BENCHES)
def test_every_case_is_named_once(room):
    names = [(case.case, case.input, case.method) for case in quick_cases(room)]
    assert len(set(names)) == len(names)
    assert {case.area for case in quick_cases(room)} == {room.AREA}


def test_the_coil_plays_what_is_commanded_with_its_filter_and_not_without():
    assert of(actuator, "strength", "identified") < 0.2
    assert 2 < of(actuator, "strength", "no filter") < 6


def test_the_true_response_is_the_twins_formula():
    """At the resonance a coil of damping d answers with gain / 2d; far above it with its gain."""
    coil = Coil()
    true = actuator.true_response(coil)
    size = dict(zip(true.hz, np.abs(true.response), strict=True))
    assert size[60.0] == pytest.approx(coil.gain_m_s2_V / (2 * coil.damping), rel=0.02)
    assert size[490.0] == pytest.approx(coil.gain_m_s2_V, rel=0.02)


def test_a_silent_second_is_a_wrong_strength():
    wished = actuator.commanded_signal(4)
    assert actuator.strength_error_dB(wished, wished) == pytest.approx(0, abs=1e-9)
    assert actuator.strength_error_dB(wished, wished / 2) == pytest.approx(20 * math.log10(2))


def test_normalise_follows_exact_arithmetic_and_a_known_door():
    assert of(profiles, "the rule", "palpate") < 1e-11
    assert of(profiles, "a known door", "palpate", "no noise") < 0.001
    assert of(profiles, "a known door", "ten evenly", "no noise") > 0.05


def test_the_exact_rule_gives_a_straight_line_back():
    angle = np.linspace(0, 62.4, 900)
    exact = profiles.exact_N(angle, 3 * angle)
    assert float(exact[100]) == pytest.approx(30, abs=1e-9) and exact[0] == 0
    assert len(exact) == 621 and all(isinstance(value, Fraction) for value in exact[1:])


def test_the_noise_has_the_level_and_the_spectrum_that_it_declares():
    assert of(sound, "masking noise: level", "palpate") < 1e-9
    assert of(sound, "third octaves", "palpate") < 1e-9 < of(sound, "third octaves", "random")
    assert of(sound, "A-weighted", "palpate") < 0.01
    assert sound.level_error_db(np.full(sound.RATE_HZ, 2 * rms_of(sound.LEVEL_DBFS))) == pytest.approx(6.0206, abs=1e-4)


def test_pink_noise_taken_for_white_is_wrong_by_decibels():
    assert sound.spectrum_error_db("white", sound.play_once("pink")) > 10


def test_pictures_are_evaluated_as_they_are():
    assert of(camera, "exposure", "palpate", "png") < 1e-5
    assert of(camera, "sharpness", "palpate", "png") < 0.01


def test_flags_that_are_not_true_are_counted():
    (case,) = [
        quick_case for quick_case in quick_cases(camera) if "flags" in quick_case.case and "jpeg" in quick_case.input
    ]
    result = case.run()
    assert case.error(result) == 0
    assert camera.flags_error(result[::-1]) > 0.3
