"""What simulated people take for different in two vibrations, and what they do not feel."""

import numpy as np
import pytest

from palpate.signals.vibration_threshold import threshold_m_s2
from palpate.studies.sessions.rig import RigError
from palpate.studies.simulation.played_textures import alike, friction_apart

N = 3000
HAND = np.stack([np.full(N, 100.0), np.ones(N)])


def noise(seed=1, level=10.0):
    return level * np.random.Generator(np.random.PCG64(seed)).standard_normal(N)


def tone(hertz, level):
    return level * np.sqrt(2) * np.sin(2 * np.pi * hertz * np.arange(N) / 1000)


def test_the_same_is_the_same_and_friction_is_what_it_is():
    assert alike(noise(), noise(), HAND, 0.4).columns() == {"level_dB": 0.0, "spectrum_dB": 0.0, "friction": 0.4}
    assert friction_apart(0.2) == 0 and friction_apart(0.8) == pytest.approx(np.log(4)) == friction_apart(0.05)


def test_twice_as_much_is_6_dB_in_level_and_nothing_in_spectrum():
    comparison = alike(noise(), 2 * noise(), HAND, 0.0)
    assert comparison.level_dB == pytest.approx(6.02, abs=0.01) and comparison.spectrum_dB < 0.01


def test_two_pieces_of_one_noise_are_nearly_alike_and_another_spectrum_is_not():
    twins, other = (
        alike(noise(1), noise(2), HAND, 0.0),
        alike(noise(1), np.convolve(noise(2), [1, 1, 1, 1], "same"), HAND, 0),
    )
    assert twins.spectrum_dB < 1.2 and twins.level_dB < 0.6
    assert other.spectrum_dB > 3 * twins.spectrum_dB


def test_what_lies_below_the_threshold_is_not_felt():
    faint, strong = (tone(200.0, factor * threshold_m_s2(200.0)) for factor in (0.3, 30.0))
    assert alike(faint, np.zeros(N), HAND, 0.0).columns() == {"level_dB": 0.0, "spectrum_dB": 0.0, "friction": 0.0}
    assert alike(strong, np.zeros(N), HAND, 0.0).level_dB == pytest.approx(29.5, abs=1.0)


def test_what_is_played_while_the_hand_rests_does_not_count():
    hand, played = HAND.copy(), noise()
    hand[0, :1000] = 5.0
    played[:1000] = 1e6
    assert alike(noise(), played, hand, 0.0).level_dB == 0.0


@pytest.mark.parametrize(
    ("real", "played", "hand", "message"),
    [
        (noise(), noise()[1:], HAND, "are expected"),
        (noise(), noise() * np.nan, HAND, "not a number"),
        (noise(), noise(), HAND * 0.05, "0 frames"),
        (noise()[:500], noise()[:500], HAND[:, :500], "2 frames"),
    ],
)
def test_what_cannot_be_compared_is_refused(real, played, hand, message):
    with pytest.raises(RigError, match=message):
        alike(real, played, hand, 0.0)
