"""The masking noise: its level, its spectrum, its seam, its ramps, and how loud it may be."""

import hashlib
from itertools import pairwise

import numpy as np
import pytest
from pydantic import ValidationError

from palpate.devices.sound.device import Settings, make
from palpate.devices.sound.noise import Fader, Player, a_weighted_db, loop, rms_of

RATE = 48_000


def octaves(samples, lowest=31.25, count=9):
    power = np.abs(np.fft.rfft(samples)) ** 2
    hz = np.fft.rfftfreq(len(samples), 1 / RATE)
    edges = [lowest * 2**n for n in range(count + 1)]
    return [10 * np.log10(power[(hz >= a) & (hz < b)].sum()) for a, b in pairwise(edges)]


def settings(**changes):
    return Settings(**{"kind": "masking_noise", "driver": "twin", **changes})


def test_white_noise_gains_three_decibels_an_octave_and_pink_noise_none():
    white, pink = octaves(loop("white", RATE, 1)), octaves(loop("pink", RATE, 1))
    assert np.allclose(np.diff(white), 10 * np.log10(2), atol=0.02)
    assert np.allclose(np.diff(pink), 0, atol=0.05)


def test_a_level_in_dbfs_is_that_of_a_full_scale_sine_and_the_loudest_noise_never_clips():
    sine = np.sin(2 * np.pi * np.arange(RATE) / 48)
    assert np.sqrt(np.mean(sine**2)) == pytest.approx(rms_of(0.0))
    for colour in ("white", "pink"):
        noise = loop(colour, RATE, 7) * rms_of(-12.0)
        assert np.sqrt(np.mean(noise**2)) == pytest.approx(rms_of(-12.0))
        assert np.abs(noise).max() < 1.0


THIRDS = {  # IEC 61672-1:2013, Table 3: nominal frequency in Hz and A-weighting in dB
    20: -50.5, 25: -44.7, 31.5: -39.4, 40: -34.6, 50: -30.2, 63: -26.2, 80: -22.5, 100: -19.1, 125: -16.1, 160: -13.4,
    200: -10.9, 250: -8.6, 315: -6.6, 400: -4.8, 500: -3.2, 630: -1.9, 800: -0.8, 1000: 0.0, 1250: 0.6, 1600: 1.0,
    2000: 1.2, 2500: 1.3, 3150: 1.2, 4000: 1.0, 5000: 0.5, 6300: -0.1, 8000: -1.1, 10000: -2.5, 12500: -4.3,
    16000: -6.6, 20000: -9.3,
}  # fmt: skip


def test_the_a_weighted_level_is_that_of_the_standards_table():
    hz = np.fft.rfftfreq(RATE * 10, 1 / RATE)
    gain = 10 ** (np.interp(np.log(np.maximum(hz, 20)), np.log([*THIRDS]), [*THIRDS.values()]) / 10)
    for colour in ("white", "pink"):
        power = np.abs(np.fft.rfft(loop(colour, RATE, 1))) ** 2
        by_table = 10 * np.log10((power * gain).sum() / power.sum())
        assert a_weighted_db(colour, RATE) == pytest.approx(by_table, abs=0.1)


def test_the_loop_goes_on_over_its_end_as_anywhere_else():
    player = Player(loop("white", RATE, 3), Fader(1.0, 1.0))
    played = np.concatenate([player.fill(n) for n in [RATE * 10 - 5, 10, 512]])
    inside, seam = np.abs(np.diff(played[: RATE * 10 - 6])), np.abs(np.diff(played[RATE * 10 - 6 :]))
    assert seam.max() < inside.max()
    wrapped = np.concatenate([played[RATE * 5 : RATE * 10], played[: RATE * 5]])
    assert np.allclose(octaves(wrapped), octaves(loop("white", RATE, 3)), atol=1e-9)


def test_the_seed_alone_decides_the_noise():
    assert np.array_equal(loop("pink", RATE, 5), loop("pink", RATE, 5))
    assert not np.allclose(loop("pink", RATE, 5), loop("pink", RATE, 6))
    raw = np.random.PCG64(5).random_raw(4)
    assert hashlib.sha256(raw.tobytes()).hexdigest()[:12] == "b565812713ca"


def test_the_ramps_reach_their_ends_without_a_step():
    fader = Fader()
    fader.to(1.0, 100)
    up = np.concatenate([fader.next(n) for n in (30, 50, 40)])
    fader.to(0.0, 100)
    down = np.concatenate([fader.next(n) for n in (60, 60)])
    gains = np.concatenate([up, down])
    assert up[-1] == 1.0
    assert down[-1] == 0.0 and fader.silent.is_set()
    assert np.abs(np.diff(gains, prepend=0.0)).max() <= 0.01 + 1e-12


def test_a_ramp_that_is_turned_round_halfway_goes_back_from_where_it_is():
    fader = Fader()
    fader.to(1.0, 100)
    half = fader.next(50)[-1]
    fader.to(0.0, 100)
    assert abs(fader.next(1)[0] - half) <= 0.01 + 1e-12


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"level_dbfs": -20.0}, "nobody has measured how loud"),
        ({"level_db_spl": 60.0}, "needs db_spl_at_0_dbfs"),
        ({"level_db_spl": 90.0, "db_spl_at_0_dbfs": 110.0}, "less than or equal to 80"),
        ({"level_dbfs": -15.0, "db_spl_at_0_dbfs": 110.0}, "95.0 dB SPL: hearing is protected"),
        ({"level_db_spl": 75.0, "db_spl_at_0_dbfs": 80.0}, "turn the amplifier up"),
        ({"level_dbfs": float("nan")}, "less than or equal to -12"),
        ({"loudness": 3}, "Extra inputs"),
    ],
)
def test_a_level_that_harms_or_cannot_be_had_is_refused(given, message):
    with pytest.raises(ValidationError, match=message):
        settings(**given)


def test_a_calibrated_level_is_played_at_what_the_headphones_need_for_it(tmp_path):
    chosen = settings(level_db_spl=65.0, db_spl_at_0_dbfs=110.0, calibrated="2026-11-21")
    player = make("noise", chosen, tmp_path)
    player.open()
    assert np.sqrt(np.mean(player.player.samples**2)) == pytest.approx(rms_of(-45.0))
    assert player.describe()["db_spl"] == 65.0
    assert player.health(0.1).calibrated == "2026-11-21"
    player.close()
