"""The simulated tool: what grows with what, and that only the key decides."""

import numpy as np
import pytest

from devices.blocks import interleaved
from devices.noise import gaussians
from devices.tool.texture import Texture, ToolDataError, texture_of
from devices.tool.twin import GRAVITY_M_S2, SENSOR_HZ, TRACKER_HZ, explore

SANDPAPER = Texture(roughness=88, bumpiness=34, slipperiness=22, softness=6)
GRASS = Texture(roughness=82, bumpiness=92, slipperiness=34, softness=66)
PLASTIC = Texture(roughness=18, bumpiness=26, slipperiness=78, softness=12)


def recorded(texture, seconds=30.0, seed=1):
    found = explore(texture, seconds, "test", seed)
    return np.array(found.acceleration_m_s2), np.array(found.force_N), np.array(found.position_mm)


def vibration(acceleration):
    """Acceleration without gravity and the hand's own slow motion: what is left of a 50 ms moving average."""
    window = np.full(51, 1 / 51)
    slow = np.array([np.convolve(np.pad(axis, 25, mode="edge"), window, mode="valid") for axis in acceleration])
    return acceleration - slow


def level(acceleration, size):
    """RMS over pieces of `size` samples, all axes together."""
    shaken = vibration(acceleration)
    pieces = shaken[:, : shaken.shape[1] // size * size].reshape(3, -1, size)
    return np.sqrt((pieces**2).sum(axis=0).mean(axis=1))


def speed_mm_s(position, size):
    velocity = np.diff(position[:2], axis=1) * TRACKER_HZ
    speed = np.hypot(*velocity)
    step = round(size * TRACKER_HZ / SENSOR_HZ)
    return speed[: len(speed) // step * step].reshape(-1, step).mean(axis=1)


def centroid_hz(acceleration):
    power = np.abs(np.fft.rfft(vibration(acceleration)[2])) ** 2
    hertz = np.fft.rfftfreq(acceleration.shape[1], 1 / SENSOR_HZ)
    return float((hertz * power)[hertz > 20].sum() / power[hertz > 20].sum())


def test_every_sensor_gives_its_rate_times_the_seconds():
    acceleration, force, position = recorded(SANDPAPER, 2.5)
    assert (acceleration.shape, force.shape, position.shape) == ((3, 2500), (3, 2500), (3, 300))


def test_only_the_key_decides():
    one, again, other = (explore(GRASS, 1.0, "test", seed) for seed in (1, 1, 2))
    assert one == again
    assert one.force_N != other.force_N and one.position_mm != other.position_mm


def test_the_vibration_grows_with_speed_and_with_force():
    """Partial slopes of log level on log speed and log force: the model's 0.8 and 0.5, noise aside."""
    acceleration, force, position = recorded(SANDPAPER, 120.0)
    size = 250
    log_level, log_speed = np.log(level(acceleration, size)), np.log(speed_mm_s(position, size))
    pressed = force[2][: len(force[2]) // size * size].reshape(-1, size).mean(axis=1)
    count = min(map(len, (log_level, log_speed, pressed)))
    terms = np.column_stack([np.ones(count), log_speed[:count], np.log(pressed[:count])])
    _, by_speed, by_force = np.linalg.lstsq(terms, log_level[:count], rcond=None)[0]
    assert by_speed == pytest.approx(0.8, abs=0.15)
    assert by_force == pytest.approx(0.5, abs=0.15)


def test_the_spectrum_depends_on_the_texture():
    rough, smooth = (recorded(texture)[0] for texture in (SANDPAPER, PLASTIC))
    assert level(rough, 1000).mean() > 2 * level(smooth, 1000).mean()
    flat, bumpy = (recorded(Texture(60, value, 40, 20))[0] for value in (0, 100))
    assert centroid_hz(bumpy) < 0.5 * centroid_hz(flat)


def test_friction_opposes_the_motion_and_follows_the_texture():
    sticky, slippery = (recorded(Texture(50, 30, value, 20))[1] for value in (0, 100))
    rubbed = [np.hypot(force[0], force[1]).mean() / force[2].mean() for force in (sticky, slippery)]
    assert rubbed == [pytest.approx(0.9, rel=0.1), pytest.approx(0.15, rel=0.15)]
    _, force, position = recorded(SANDPAPER)
    at = (np.arange(position.shape[1] - 1) + 0.5) / TRACKER_HZ
    felt = force[0][np.minimum(np.round(at * SENSOR_HZ).astype(int), force.shape[1] - 1)]
    assert np.corrcoef(felt, np.diff(position[0]))[0, 1] < -0.7


def test_the_hand_stays_on_the_sample_and_in_contact():
    acceleration, force, position = recorded(GRASS, 60.0)
    assert np.abs(position[:2]).max() < 50
    assert force[2].min() > 0.1 and force[2].max() < 3.8
    assert np.linalg.norm(acceleration.mean(axis=1)) == pytest.approx(GRAVITY_M_S2, rel=0.01)
    assert 40 < np.median(speed_mm_s(position, 250)) < 200


@pytest.mark.parametrize("seconds", [0.0, 3601.0, float("nan"), float("inf")])
def test_a_duration_out_of_range_is_refused(seconds):
    with pytest.raises(ToolDataError, match="from 0.1 to 3600 s"):
        explore(GRASS, seconds, "test")


@pytest.mark.parametrize("text", ["", "rough", "nan", "-1", "101"])
def test_a_column_that_is_no_estimate_is_refused_by_name(text):
    with pytest.raises(ToolDataError, match=r"stimulus 'T07': .* in the column 'sim_softness'"):
        texture_of({"sim_softness": text}, "T07")


def test_samples_that_say_nothing_are_average():
    assert texture_of({"label": "mine"}, "mine") == Texture(50, 50, 50, 50)


def test_noise_is_standard_normal_and_independent():
    noise, other = np.array(gaussians(100_000, "a")), np.array(gaussians(100_000, "b"))
    assert noise.mean() == pytest.approx(0, abs=0.015) and noise.std() == pytest.approx(1, abs=0.01)
    assert np.mean(np.abs(noise) > 1.96) == pytest.approx(0.05, abs=0.005)
    assert abs(np.corrcoef(noise, other)[0, 1]) < 0.015 and abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 0.015


def test_channels_become_rows_of_little_endian_floats():
    assert np.frombuffer(interleaved([1.0, 2.0], [3.0, 4.0]), "<f4").tolist() == [1.0, 3.0, 2.0, 4.0]
    with pytest.raises(ValueError, match="one length"):
        interleaved([1.0], [1.0, 2.0])
