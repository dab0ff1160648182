"""Vision and touch agree where they meet, and each feels or sees what the other cannot.

On 784 x 784 fields (128 um) for time's sake; the shipped 50 at full size are in docs/explanation/simulated-surfaces.md.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.stats import spearmanr

from palpate.devices.surfaces.hand import SteadyHand
from palpate.devices.surfaces.photo import LIGHTS, light, photograph, save_photo
from palpate.devices.surfaces.relief import relief
from palpate.devices.surfaces.scene import SurfaceScene, first_rows
from palpate.devices.surfaces.table import SurfaceDataError, read_surfaces
from palpate.devices.surfaces.tool import ground

TABLE = read_surfaces()
PIXELS = 784
SAND = replace(TABLE["T17"], bumps_um=0.0, mottle=0.0, paint="none")


@lru_cache(maxsize=1)
def field_of(surface):
    """The last one is remembered: what is seen and felt of a surface is asked for one after the other."""
    return relief(surface, pixels=PIXELS)


def felt(surface, speed=100.0, force=1.0, seconds=2.0):
    """Level (m/s^2) and centroid (Hz) of the vibration from 20 to 500 Hz, and friction over normal force."""
    under = ground(field_of(surface).height_um, surface.stiffness_N_mm)
    scene = SurfaceScene(surface, seconds, "agree", hand=SteadyHand(speed, force), under=under)
    shaken = first_rows(scene.acceleration_m_s2(3000.0), int(3000 * seconds))[900:]
    power = (np.abs(np.fft.rfft(shaken - shaken.mean(axis=0), axis=0)) ** 2).sum(axis=1)
    hertz = np.fft.rfftfreq(len(shaken), 1 / 3000)
    power[(hertz < 20) | (hertz > 500)] = 0
    wrench = first_rows(scene.wrench(1000.0), int(1000 * seconds))[300:]
    level = np.sqrt(2 * power.sum()) / len(shaken)
    return level, (hertz * power).sum() / power.sum(), np.hypot(*wrench[:, :2].mean(axis=0)) / wrench[:, 2].mean()


def seen(surface, number=3):
    """Contrast and mean wavelength (mm) of a photo, of what is finer than 8 mm."""
    image = photograph(surface, field_of(surface), light(number), "agree").mean(axis=2)
    power = np.abs(np.fft.rfft2(image / image.mean() - 1)) ** 2
    waves = np.hypot(np.fft.rfftfreq(PIXELS, 100 / PIXELS), np.fft.fftfreq(PIXELS, 100 / PIXELS)[:, None])
    power[(waves < 0.125) | (waves > 3)] = 0
    return np.sqrt(2 * power.sum()) / PIXELS**2, power.sum() / (waves * power).sum()


def strongest(surface, speed):
    """Where the vibration of a steady stroke along x has its largest peak, in periods a millimetre."""
    under = ground(field_of(surface).height_um, surface.stiffness_N_mm)
    scene = SurfaceScene(surface, 5.0, "agree", hand=SteadyHand(speed, 1.0, 0.0), under=under)
    shaken = first_rows(scene.acceleration_m_s2(3000.0), 15_000)[3000:]
    power = (np.abs(np.fft.rfft((shaken - shaken.mean(axis=0)) * np.hanning(12_000)[:, None], axis=0)) ** 2).sum(axis=1)
    hertz = np.fft.rfftfreq(12_000, 1 / 3000)
    power[(hertz < 15) | (hertz > 500)] = 0
    return hertz[power.argmax()] / speed


def across(surface):
    """Power spectrum of a photo along x; one hundredth of a period a millimetre apart."""
    image = photograph(surface, field_of(surface), light(5), "agree").mean(axis=2)
    return (np.abs(np.fft.rfft(image / image.mean() - 1, axis=1)) ** 2).mean(axis=0)


def line_dB(power, periods_mm):
    """How far the spectrum stands out there from what lies within 30 % around it."""
    place = round(100 * periods_mm)
    around = np.median(power[int(place / 1.3) : int(place * 1.3) + 1])
    return 10 * np.log10(power[place - 1 : place + 2].max() / around)


@pytest.mark.long
def test_what_repeats_is_felt_at_the_speed_over_the_period_that_is_seen():
    """Weaves, twill, domes, ribs and wires as shipped: the vibration's largest peak is a line of their own photo."""
    names = ("T14", "T22", "T28", "T40", "T44", "T48")
    photos = [across(TABLE[name]) for name in names]
    for speed in (50.0, 125.0):
        peaks = [strongest(TABLE[name], speed) for name in names]
        dB = np.array([[line_dB(photo, peak) for photo in photos] for peak in peaks])
        assert dB.diagonal().min() > 12
        # The photo of another texture has no line there, nor has the own one where another speed would put it.
        assert np.median(dB[~np.eye(len(names), dtype=bool)]) < 3
        assert np.median([line_dB(photo, 1.12 * peak) for photo, peak in zip(photos, peaks, strict=True)]) < 3


@pytest.mark.long
@pytest.mark.parametrize("pattern", ["foam", "leather"])
def test_a_coarser_grain_of_one_material_is_seen_coarser_and_felt_lower(pattern):
    """Within one material only: across materials the contact's resonance rules the centroid."""
    family = [
        replace(SAND, pattern=pattern, rms_um=0.0, pitch_mm=pitch, pattern_um=60 * pitch, stiffness_N_mm=5000.0)
        for pitch in np.geomspace(0.6, 3.0, 5)
    ]
    assert spearmanr([(felt(surface)[1], seen(surface)[1]) for surface in family])[0] <= -0.9


def test_a_rougher_surface_is_seen_rougher_and_felt_louder():
    family = [replace(SAND, pattern_um=height, rms_um=height / 8) for height in (8.0, 16.0, 32.0, 64.0)]
    levels, contrasts = map(list, zip(*((felt(surface)[0], seen(surface)[0]) for surface in family), strict=True))
    assert levels == sorted(levels) and contrasts == sorted(contrasts) and levels[-1] > 3 * levels[0]


def test_across_textures_contrast_in_the_photo_goes_with_vibration():
    names = ("T02", "T06", "T09", "T10", "T14", "T19", "T25", "T31", "T34", "T42", "T45", "T50")
    plain = [replace(TABLE[name], paint="none", mottle=0.0, colour="#808080", bumps_um=0.0) for name in names]
    assert spearmanr([(seen(surface)[0], felt(surface)[0]) for surface in plain])[0] > 0.6


def test_faster_is_higher_and_louder_softer_is_duller():
    slow, fast = felt(SAND, 40.0), felt(SAND, 160.0)
    assert fast[1] > 1.15 * slow[1] and fast[0] > 1.5 * slow[0]
    dull = [felt(replace(SAND, stiffness_N_mm=stiffness_N_mm))[1] for stiffness_N_mm in (500.0, 20.0, 2.0)]
    assert dull == sorted(dull, reverse=True) and dull[-1] < 0.6 * dull[0]


def test_friction_and_stiffness_are_felt_and_not_seen():
    sticky = replace(SAND, static_friction=1.0, kinetic_friction=0.9)
    slick = replace(SAND, static_friction=0.25, kinetic_friction=0.2)
    assert felt(sticky)[2] > felt(slick)[2] + 0.5
    field = relief(SAND, pixels=PIXELS)
    one, two = (photograph(surface, field, light(0), "same") for surface in (sticky, slick))
    assert (one == two).all()
    # The camera exposes by itself, so that what light inside a soft surface changes is the contrast.
    hard, soft = (
        photograph(replace(SAND, stiffness_N_mm=stiffness_N_mm), field, light(0), "same").std()
        for stiffness_N_mm in (900.0, 90.0)
    )
    assert soft == pytest.approx(hard, rel=0.05)


def test_the_camera_exposes_for_the_same_brightness_whatever_the_paint_and_the_light():
    """A quarter of full scale, as a meter would have it."""
    brightness = []
    for name, number in (("T38", 0), ("T10", 1), ("T47", 5)):
        linear = (photograph(TABLE[name], relief(TABLE[name], pixels=196), light(number), "meter") / 255.0) ** 2.2
        brightness.append(linear.mean(axis=(0, 1)) @ [0.2126, 0.7152, 0.0722])
    np.testing.assert_allclose(brightness, 0.25, rtol=0.06)


def test_large_bumps_are_seen_and_not_felt():
    flat = replace(TABLE["T44"], pattern="none", rms_um=3.0, bumps_um=0.0)
    bumpy = replace(flat, bumps_um=500.0, bumps_mm=25.0)
    shades = []
    for surface in (flat, bumpy):
        image = photograph(surface, field_of(surface), light(0), "bumps").mean(axis=2)
        shades.append(image.reshape(28, 28, 28, 28).mean(axis=(1, 3)).std() / image.mean())
    assert shades[1] > 1.5 * shades[0]
    assert felt(bumpy)[0] == pytest.approx(felt(flat)[0], rel=0.25)


def test_ten_lights_differ_and_the_key_decides_the_noise(tmp_path):
    surface = TABLE["T26"]
    field = relief(surface, pixels=196)
    shots = [photograph(surface, field, light(number), "lights") for number in range(LIGHTS)]
    assert len({shot.tobytes() for shot in shots}) == LIGHTS
    assert all(shot.shape == (196, 196, 3) and shot.dtype == np.uint8 for shot in shots)
    assert all(20 < shot.mean() < 235 for shot in shots)
    assert (photograph(surface, field, light(3), "lights") == shots[3]).all()
    assert not (photograph(surface, field, light(3), "other") == shots[3]).all()
    save_photo(shots[0], tmp_path / "one.png")
    from PIL import Image

    assert (np.asarray(Image.open(tmp_path / "one.png")) == shots[0]).all()
    for number in (-1, LIGHTS):
        with pytest.raises(SurfaceDataError, match="from 0 to 9"):
            light(number)


def test_a_light_from_the_left_shades_the_right_side_of_a_ridge():
    """The photo lies as the hand moves: x to the right, y up."""
    ribs = replace(
        TABLE["T44"], pattern="ribs", pitch_mm=10.0, pattern_um=1500.0, pattern_deg=0.0, bumps_um=0.0, gloss=0.0
    )
    field = relief(ribs, pixels=PIXELS)
    lamp = replace(light(0), azimuth_deg=180.0, elevation_deg=35.0)
    image = photograph(ribs, field, lamp, "ridge").mean(axis=(0, 2))
    rises = np.gradient(field.height_um.mean(axis=0))
    assert np.corrcoef(image, rises)[0, 1] > 0.8
