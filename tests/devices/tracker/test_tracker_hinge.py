"""A hinge found from a swing whose truth is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from devices.signals import DeviceError
from devices.tracker.hinge import fit_hinge, load_hinge, opening_deg

CENTRE, RADIUS = np.array([1200.0, -300.0, 2500.0]), 950.0


def swung(opening, radius=RADIUS, tilt=0.05, sense=1.0):
    """Positions of a marker on a door that turns about a tilted axis, at these angles in degrees."""
    axis = np.array([math.sin(tilt), math.cos(tilt), 0.0])
    first = np.cross(axis, [0.0, 0.0, 1.0])
    first /= np.linalg.norm(first)
    turn = np.radians(opening)[:, None] * sense
    return CENTRE + radius * (np.cos(turn) * first + np.sin(turn) * np.cross(axis, first))


def swing(degrees=62.0, n=800, noise=0.0, **how):
    opening = np.concatenate([np.zeros(20), np.linspace(0, degrees, n)])
    return opening, swung(opening, **how) + noise * np.random.default_rng(3).standard_normal((len(opening), 3))


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("degrees", [12.0, 62.0, 170.0])
def test_without_noise_the_hinge_is_exact_whichever_way_it_opens(degrees, sense):
    opening, positions = swing(degrees, sense=sense)
    hinge = fit_hinge(positions)
    np.testing.assert_allclose(opening_deg(positions, hinge), opening, atol=1e-7)
    np.testing.assert_allclose(hinge.centre, CENTRE, atol=1e-6)
    assert hinge.radius_mm == pytest.approx(RADIUS, abs=1e-6)
    assert max(hinge.around_mm, hinge.along_mm) < 1e-8
    assert hinge.arc_deg == pytest.approx(degrees, abs=1e-7)


def test_with_a_trackers_noise_the_stated_errors_hold():
    opening, positions = swing(noise=0.3)
    hinge = fit_hinge(positions)
    assert hinge.around_mm == pytest.approx(0.3, rel=0.1)
    assert hinge.along_mm == pytest.approx(0.3, rel=0.1)
    assert np.linalg.norm(np.array(hinge.centre) - CENTRE) < 4 * hinge.centre_error_mm
    wrong = opening_deg(positions, hinge) - opening
    assert np.sqrt(np.mean(wrong**2)) < 2 * hinge.angle_error_deg < 0.05


def test_the_stated_error_of_the_centre_is_the_one_of_many_calibrations():
    found = []
    for seed in range(60):
        _, positions = swing(n=300)
        found.append(fit_hinge(positions + 0.3 * np.random.default_rng(seed).standard_normal(positions.shape)))
    spread = np.std([one.centre for one in found], axis=0)
    assert spread.max() == pytest.approx(np.mean([one.centre_error_mm for one in found]), rel=0.35)


def test_hidden_samples_are_left_out_of_the_fit_and_have_no_angle():
    opening, positions = swing()
    positions[100:200] = np.nan
    hinge = fit_hinge(positions)
    told = opening_deg(positions, hinge)
    assert np.isnan(told[100:200]).all()
    np.testing.assert_allclose(np.delete(told, slice(100, 200)), np.delete(opening, slice(100, 200)), atol=1e-6)
    assert hinge.samples == len(opening) - 100


@pytest.mark.parametrize(
    ("positions", "said"),
    [
        (swing(n=5)[1], "25 seen samples"),
        (swing(degrees=6)[1], "swung by"),
        (np.outer(np.arange(100.0), [1, 2, 3]), "line or on one spot"),
        (np.full((100, 3), 7.0), "line or on one spot"),
        (np.random.default_rng(1).standard_normal((200, 3)) * 100, "off a circle"),
        (np.full((100, 3), np.nan), "0 seen samples"),
    ],
)
def test_what_is_no_swing_is_refused(positions, said):
    with pytest.raises(DeviceError, match=said):
        fit_hinge(positions)


def test_a_calibration_is_kept_as_a_file(tmp_path):
    hinge = fit_hinge(swing(noise=0.1)[1])
    hinge.save(tmp_path / "hinge.json")
    assert load_hinge(tmp_path / "hinge.json") == hinge
    for content in ("", "[]", "{}", '{"centre": [0, 0, NaN]}'):
        (tmp_path / "bad.json").write_text(content)
        with pytest.raises(DeviceError, match="bad.json"):
            load_hinge(tmp_path / "bad.json")
