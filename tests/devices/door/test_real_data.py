"""Real hinged doors, offsets and backlash included, come out as the right profile or as a clear refusal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from palpate.devices.door.commands import doors
from palpate.devices.door.recording import read_columns
from palpate.signals.aligning.hinge import fit_hinge
from palpate.signals.doors.grid import POINTS, DoorDataError
from palpate.signals.doors.profile_file import read_profile
from palpate.signals.doors.profiles import normalise

DATA = Path(__file__).parent / "pr2_data"
RADIUS_M = {"ikea_cabinet_log": 0.301, "ikea_cabinet_2": 0.309, "lab_cabinet_log": 0.380}
"""As the data's NOTICE states them."""
GRID = np.arange(POINTS) / 10


def opening(name, sensor="ati"):
    """Angle in degrees from the path of the hand, and what the hand pulled along it, in N."""
    axes = [f"ee_{axis}_m" for axis in "xyz"], [f"{sensor}_f{axis}_N" for axis in "xyz"]
    read = read_columns(DATA / f"{name}.csv", [*axes[0], *axes[1]])
    positions, forces = (np.column_stack([read[name] for name in names]) for names in axes)
    hinge = fit_hinge(positions)
    angle = hinge.angle_deg(positions)
    turned = np.radians(angle)[:, None]
    along = np.cos(turned) * hinge.ahead - np.sin(turned) * hinge.across
    return hinge, angle, -(along * forces).sum(axis=1)


def by_hand(angle, force):
    """A profile made in another way: within a tenth of a degree the mean of rows that open the door further."""
    furthest, rows = -np.inf, []
    for a, f in zip(angle, force, strict=True):
        if a >= furthest:
            furthest = a
            rows.append((a, f))
    places = sorted({round(a, 9) for a, _ in rows})
    forces = [np.mean([f for a, f in rows if abs(a - place) <= 1e-9]) for place in places]
    fine = np.linspace(0, 62, 62_001)
    line = np.interp(fine, places, forces)
    return np.array([line[np.abs(fine - at) <= 0.05 + 1e-9].mean() for at in GRID])


@pytest.mark.parametrize("name", RADIUS_M)
@pytest.mark.parametrize("sensor", ["ati", "est"])
def test_a_time_series_of_either_sensor_becomes_its_profile(name, sensor):
    hinge, angle, force = opening(name, sensor)
    assert hinge.radius == pytest.approx(RADIUS_M[name], abs=0.002)
    assert 90 < angle.max() < 98
    profile = normalise(angle, force)
    assert profile.padded_points == 0 and profile.widest_gap_deg < 2
    assert np.abs(profile.force_N - by_hand(angle, force))[1:-1].max() < 0.02


def test_two_sensors_that_disagree_are_never_mixed():
    """The joints' estimate lies above the force sensor by the robot's friction; shapes agree, levels do not."""
    ati, est = (normalise(*opening("ikea_cabinet_2", sensor)[1:]).force_N for sensor in ("ati", "est"))
    assert np.corrcoef(ati, est)[0, 1] > 0.9
    assert 5 < np.median(est - ati) < 15


def test_backlash_leaves_no_trace_in_the_profile():
    """The hand gives way by 1.5 degrees in the middle, pushing the other way, and comes back."""
    _, angle, force = opening("ikea_cabinet_2")
    plain = normalise(angle, force)
    at = int(np.flatnonzero(angle > 30)[0])
    back = angle[at] - 1.5 * np.sin(np.linspace(0, np.pi, 42)[1:-1])
    with_it = normalise(np.insert(angle, at + 1, back), np.insert(force, at + 1, np.full(40, -50.0)))
    assert with_it.backward_rows == plain.backward_rows + 40 > 40
    assert with_it.force_N == pytest.approx(plain.force_N, abs=1e-12)


@pytest.mark.parametrize("offset_deg", [-31.7, -0.4, 12.3, 150.0])
def test_an_angle_that_does_not_begin_at_zero_is_counted_from_the_first_motion(offset_deg):
    _, angle, force = opening("lab_cabinet_log")
    expected = normalise(angle, force, zero=True)
    profile = normalise(angle + offset_deg, force, zero=True)
    assert profile.zero_deg == pytest.approx(offset_deg, abs=1e-9)
    assert profile.force_N == pytest.approx(expected.force_N, abs=1e-6)


def test_an_undeclared_offset_is_refused_and_the_error_says_what_to_do():
    _, angle, force = opening("lab_cabinet_log")
    with pytest.raises(DoorDataError, match=r"No rows between 0.00 and 12.30 degrees.*--zero"):
        normalise(angle + 12.3, force)


def test_a_door_that_is_at_rest_first_shaking_by_the_trackers_noise_keeps_its_profile():
    _, angle, force = opening("ikea_cabinet_log")
    rest = np.random.default_rng(1).normal(0, 0.02, 300)
    profile = normalise(np.r_[rest, angle] + 40, np.r_[np.zeros(300), force], zero=True)
    assert profile.zero_deg == pytest.approx(40, abs=0.05)
    assert np.abs(profile.force_N - normalise(angle, force).force_N)[5:].max() < 0.1


@pytest.mark.parametrize("wrong", [np.negative, np.radians, np.zeros_like])
def test_an_angle_that_falls_or_is_in_radians_or_stands_is_refused(wrong):
    _, angle, force = opening("ikea_cabinet_2")
    with pytest.raises(DoorDataError, match=r"less than 2 degrees.*radians.*falling"):
        normalise(wrong(angle), force)


@pytest.mark.parametrize("glitch_deg", [45.0, 180.0])
def test_a_tracker_that_jumps_ahead_and_back_is_refused_by_the_place(glitch_deg):
    _, angle, force = opening("ikea_cabinet_2")
    jumping = angle.copy()
    jumping[np.flatnonzero(angle > 20)[0]] += glitch_deg
    with pytest.raises(DoorDataError, match=r"No rows between 20\.\d\d and 6[025]\.\d\d degrees|No rows between 19"):
        normalise(jumping, force)


def test_a_force_that_is_no_number_is_named_with_its_row():
    _, angle, force = opening("ikea_cabinet_2")
    force[500] = np.nan
    with pytest.raises(DoorDataError, match="Row 501: the force is nan"):
        normalise(angle, force)


def test_the_command_makes_the_profile_of_a_path_that_was_turned_into_an_angle(tmp_path):
    _, angle, force = opening("ikea_cabinet_2")
    rows = "".join(f"{a:.9f},{f:.9f}\n" for a, f in zip(angle, force, strict=True))
    (tmp_path / "door.csv").write_text("angle_deg,force_N\n" + rows, encoding="utf-8")
    arguments = ["normalise", str(tmp_path / "door.csv"), "--zero", "--out", str(tmp_path / "out.csv")]
    result = CliRunner().invoke(doors, arguments, catch_exceptions=False)
    assert "621 points from 998 rows" in result.output
    assert read_profile(tmp_path / "out.csv") == pytest.approx(normalise(angle, force).force_N, abs=1e-4)
