"""A door's hinge and angle from the path of a marker on it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.signals.aligning.hinge import fit_hinge
from palpate.signals.aligning.refusals import AlignError
from tests.examples import examples


def path(angles_deg, radius=900.0, centre=(120.0, -4000.0, 700.0), tilt=(0.1, -0.05, 1.0), noise=0.0, seed=0):
    """Positions in mm on a circle about an axis that is nowhere upright."""
    axis = np.array(tilt) / np.linalg.norm(tilt)
    across = np.cross(axis, [0.3, 1.0, 0.0])
    across /= np.linalg.norm(across)
    turned = np.radians(angles_deg)[:, None]
    points = np.array(centre) + radius * (np.cos(turned) * across + np.sin(turned) * np.cross(axis, across))
    return points + np.random.default_rng(seed).normal(0, noise, points.shape)


@given(st.floats(-180, 180), st.floats(15, 175), st.floats(50, 2000), st.booleans())
@settings(max_examples=examples(60), deadline=None)
def test_a_marker_on_a_door_gives_its_angle_wherever_the_tracker_stands(start, swing, radius, clockwise):
    opened = np.linspace(0, swing, 200)
    positions = path(start + (-opened if clockwise else opened), radius)
    hinge = fit_hinge(positions)
    assert hinge.radius == pytest.approx(radius, rel=1e-6) and hinge.misfit < 1e-6 * radius
    assert hinge.angle_deg(positions) == pytest.approx(opened, abs=1e-5)


def test_a_trackers_noise_of_half_a_millimetre_moves_the_angle_by_little():
    opened = np.r_[np.zeros(100), np.linspace(0, 65, 600), np.full(100, 65.0)]
    hinge = fit_hinge(path(opened, noise=0.5))
    truth = hinge.angle_deg(path(opened))
    assert np.ptp(truth - opened) < 0.2 and hinge.radius == pytest.approx(900, abs=2)


def test_a_door_that_gives_way_and_an_occluded_marker_change_nothing():
    opened = 30 + 30 * np.sin(np.linspace(-np.pi / 2, np.pi / 2, 300)) + 2 * np.sin(np.linspace(0, 60, 300))
    positions = path(opened)
    positions[100:140] = np.nan
    angle = fit_hinge(positions).angle_deg(positions)
    assert np.isnan(angle[100:140]).all()
    assert np.delete(angle, np.s_[100:140]) == pytest.approx(np.delete(opened - opened[0], np.s_[100:140]), abs=1e-6)


@pytest.mark.parametrize(
    ("positions", "says"),
    [
        (np.zeros((50, 3)), "did not move"),
        (np.full((50, 3), np.nan), "0 positions are known"),
        (path(np.linspace(0, 5, 50)), r"arc of 5.0 degrees: from 10 to 180"),
        (path(np.linspace(0, 300, 50)), "from 10 to 180"),
        (np.linspace(0, 1, 50)[:, None] * [1.0, 2.0, 3.0], "no arc|from 10 to 180"),
        (np.random.default_rng(0).normal(size=(50, 3)), "no arc"),
        (path(np.full(500, 20.0), noise=0.05), "no arc: it strays"),
        (
            path(np.r_[np.linspace(0, 60, 50)]) + np.repeat([[0, 0, 0], [0, 0, 150.0]], 25, axis=0),
            "Did the marker rest",
        ),
    ],
)
def test_a_path_that_is_no_doors_is_refused(positions, says):
    with pytest.raises(AlignError, match=says):
        fit_hinge(positions)
