"""The height field: seeded, the same everywhere, repeated at its borders, with the spectrum that the table asks for."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.surfaces import dilate
from palpate.devices.surfaces.fields import SIZE_MM, chance, self_affine
from palpate.devices.surfaces.relief import relief
from palpate.devices.surfaces.table import PATTERNS, read_surfaces
from palpate.devices.surfaces.tool import RADIUS_MM, ground, traced

TABLE = read_surfaces()
SMALL = 392


def spectrum(field):
    power = np.abs(np.fft.rfft2(field - field.mean())) ** 2
    n = len(field)
    return np.fft.rfftfreq(n, SIZE_MM / n)[np.newaxis], np.fft.fftfreq(n, SIZE_MM / n)[:, np.newaxis], power


def test_chance_is_the_same_on_every_machine():
    """The raw stream of PCG64 that NumPy promises to keep, seeded by a hash."""
    assert chance(3, "surface", 1).tolist() == [0.22161718632209815, 0.6033515888060399, 0.5639052835481769]
    assert chance(10_000, "a").min() >= 0 and chance(10_000, "a").max() < 1
    assert abs(np.corrcoef(chance(10_000, "a"), chance(10_000, "b"))[0, 1]) < 0.03


@pytest.mark.parametrize("pattern", PATTERNS)
def test_every_pattern_repeats_at_the_borders_and_only_its_id_decides(pattern):
    surface = replace(TABLE["T26"], pattern=pattern, pitch_mm=4.0, pattern_um=300.0, pattern_deg=30.0, bumps_um=100.0)
    one = relief(surface, pixels=SMALL).height_um
    assert (one == relief(surface, pixels=SMALL).height_um).all()
    assert not np.allclose(one, relief(replace(surface, id="other"), pixels=SMALL).height_um)
    for axis in (0, 1):
        steps = np.abs(np.diff(one, axis=axis))
        seam = np.abs(np.take(one, 0, axis) - np.take(one, -1, axis))
        assert seam.mean() < 2 * steps.mean(axis=1 - axis).max() and np.isfinite(one).all()


def test_the_parts_have_the_heights_of_the_table():
    plain = replace(TABLE["T42"], rms_um=20.0, bumps_um=0.0)
    assert relief(plain, pixels=SMALL).height_um.std() == pytest.approx(20, rel=1e-3)
    assert relief(replace(plain, rms_um=0.0, bumps_um=300.0), pixels=SMALL).height_um.std() == pytest.approx(
        300, rel=1e-3
    )
    ribs = relief(replace(plain, rms_um=0.0, pattern="ribs", pattern_um=80.0), pixels=SMALL).height_um
    assert np.ptp(ribs) == pytest.approx(80, rel=1e-2)


def test_the_roughness_has_its_exponent_and_its_grain():
    field = self_affine(784, 2.0, 0.7, 0.26, 1.0, 0.0, "slope")
    x, y, power = spectrum(field)
    radius = np.hypot(x, y)
    band = (radius > 0.4) & (radius < 1.2)
    slope = np.polyfit(np.log(radius[band]), np.log(power[band]), 1)[0]
    assert slope == pytest.approx(-2 * (1 + 0.7), abs=0.25)
    x, y, power = spectrum(self_affine(784, 1.0, 0.7, 0.26, 8.0, 90.0, "grain"))
    assert (power * y**2).sum() < 0.1 * (power * x**2).sum()


def test_a_pattern_has_its_pitch():
    surface = replace(TABLE["T44"], pitch_mm=2.5, pattern_deg=0.0, rms_um=0.0, bumps_um=0.0)
    x, _, power = spectrum(relief(surface, pixels=SMALL).height_um)
    assert x[0, power.sum(axis=0).argmax()] == pytest.approx(1 / 2.5)


@pytest.mark.parametrize(("name", "error_um"), [("T01", 0.5), ("T19", 1.0), ("T48", 2.0), ("T50", 12.0)])
def test_tracing_by_rows_and_columns_is_near_a_real_sphere(name, error_um):
    height = relief(TABLE[name], pixels=SMALL).height_um
    approximate, exact = traced(height), dilate(height)
    assert (approximate >= height).all() and np.sqrt(np.mean((approximate - exact) ** 2)) < error_um


def test_a_spike_is_felt_as_the_sphere_that_rolls_over_it():
    height = np.zeros((784, 784), np.float32)
    height[392, 392] = 100.0
    across = traced(height)[392, 392:] / 1000
    away = np.arange(392) * SIZE_MM / 784
    cap = np.clip(0.1 - (RADIUS_MM - np.sqrt(np.clip(RADIUS_MM**2 - away**2, 0, None))), 0, None)
    assert across[:7] == pytest.approx(cap[:7], abs=1e-5)


def test_a_soft_surface_gives_way_over_a_wider_patch():
    height = relief(replace(TABLE["T17"], bumps_um=0.0), pixels=784).height_um
    felt = [ground(height, stiffness).splined.std() for stiffness in (1000.0, 10.0, 1.0)]
    assert felt[0] > 1.1 * felt[1] > 1.5 * felt[2]
