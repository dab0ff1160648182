"""From a recording to 621 points: what must not matter, what must be refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.devices.door.commands import doors
from palpate.devices.door.recording import read_columns
from palpate.devices.door.stimuli import read_catalogue
from palpate.signals.doors.grid import POINTS, DoorDataError
from palpate.signals.doors.mechanics import hand_force, simulate
from palpate.signals.doors.profile_file import read_profile
from palpate.signals.doors.profiles import normalise, upsample_angle
from tests.examples import examples

DATA = Path(__file__).parent / "door_data"
GRID = np.arange(POINTS) / 10


def knots_of(draw: st.DrawFn) -> tuple[list[float], list[float]]:
    count = draw(st.integers(2, 8))
    places = sorted(draw(st.sets(st.integers(1, 61), min_size=count, max_size=count)))
    forces = draw(st.lists(st.floats(-20, 60), min_size=count + 2, max_size=count + 2))
    return [0.0, *map(float, places), 62.0], forces


@st.composite
def recordings(draw: st.DrawFn) -> tuple[list[float], list[float], np.ndarray]:
    """A piecewise-linear profile and the angles of a rising recording at a speed that varies tenfold."""
    angles, forces = knots_of(draw)
    speeds = np.array(draw(st.lists(st.floats(1, 10), min_size=3, max_size=20)))
    steps = np.interp(np.linspace(0, 1, draw(st.integers(1500, 5000))), np.linspace(0, 1, len(speeds)), speeds)
    reached = draw(st.floats(5, 70))
    path = np.cumsum(steps)
    return angles, forces, (path - path[0]) / (path[-1] - path[0]) * reached


@given(recordings())
@settings(max_examples=examples(60), deadline=None)
def test_a_rising_recording_of_a_known_profile_is_recovered_whatever_the_speed(recording) -> None:
    angles, forces, path = recording
    profile = normalise(path, np.interp(path, angles, forces))
    reached = path[-1] + 1e-9 >= GRID
    truth = np.interp(GRID, angles, forces)
    slopes = np.diff(forces) / np.diff(angles)
    bend = np.abs(np.diff(slopes, prepend=slopes[0], append=slopes[-1])).max() + np.abs(slopes).max()
    # A mean over a tenth of a degree differs from the value at its middle only next to a bend; at the end of the
    # recording the tenth is cut short; and the line between two rows cuts a corner off.
    assert np.abs(profile.force_N - truth)[reached].max() <= bend * (0.05 + np.diff(path).max())
    assert profile.padded_points == int((~reached).sum())
    assert not profile.force_N[~reached].any()


@given(st.floats(-30, 30), st.floats(-2, 2))
@settings(max_examples=examples(25), deadline=None)
def test_a_straight_line_is_exact_from_sparse_and_from_dense_rows(start, slope) -> None:
    for path in (np.linspace(0, 62, 63), np.linspace(0, 62, 20_000), 62 * np.linspace(0, 1, 5000) ** 1.5):
        profile = normalise(path, start + slope * path)
        expected = start + slope * GRID
        expected[-1] -= slope * 0.025  # the last tenth has only its first half
        assert profile.force_N == pytest.approx(expected, abs=1e-9)


def test_the_sampling_rate_does_not_matter() -> None:
    fast, slow = np.linspace(0, 64, 64_001), np.linspace(0, 64, 1601)
    shape = [10 * np.sin(path / 7) + path / 4 for path in (fast, slow)]
    difference = normalise(fast, shape[0]).force_N - normalise(slow, shape[1]).force_N
    assert np.abs(difference).max() < 1e-4


def test_a_door_that_opens_to_58_degrees_is_padded_with_40_zeros() -> None:
    path = np.linspace(0, 58, 2000)
    profile = normalise(path, np.full(2000, 7.5))
    assert profile.padded_points == 40
    assert profile.force_N[:581] == pytest.approx(7.5)
    assert set(profile.force_N[581:]) == {0.0}
    assert profile.force_N.shape == (621,)


def test_what_goes_backwards_or_comes_after_the_opening_is_left_out_and_counted() -> None:
    out, back = np.linspace(0, 30, 301), np.linspace(29.9, 25, 50)
    path = np.r_[out, back, np.linspace(25.1, 62, 370), np.linspace(61.9, 0, 100)]
    force = np.r_[np.full(301, 5.0), np.full(50, -99.0), np.full(370, 5.0), np.full(100, -99.0)]
    profile = normalise(path, force)
    assert (profile.backward_rows, profile.rows_after_opening, profile.rows) == (99, 100, 821)
    assert profile.force_N == pytest.approx(np.full(POINTS, 5.0))


def test_rows_at_one_angle_are_averaged_up_to_the_first_row_at_the_largest_angle() -> None:
    path = np.repeat(np.linspace(0, 62, 621), 3)
    force = np.tile([1.0, 2.0, 6.0], 621)
    profile = normalise(path, force)
    assert profile.force_N[:-2] == pytest.approx(3.0)
    assert profile.rows_after_opening == 2
    assert profile.force_N[-1] == pytest.approx(
        (3 + 3 * 1) / 4
    )  # halfway from 3 N to the one row at 62 degrees, averaged


def test_zero_counts_from_the_first_motion_and_forgets_the_rest_before_it() -> None:
    path = np.r_[np.full(500, 7.25), np.linspace(7.25, 70, 3000)]
    force = np.r_[np.linspace(-3, 0, 500), 0.5 * (np.linspace(7.25, 70, 3000) - 7.25)]
    with pytest.raises(DoorDataError, match=r"between 0\.00 and 7\.25 degrees.*--zero"):
        normalise(path, force)
    profile = normalise(path, force, zero=True)
    assert profile.zero_deg == 7.25
    assert profile.force_N[1:-1] == pytest.approx(0.5 * GRID[1:-1], abs=1e-9)


@pytest.mark.parametrize("noise_deg", [0.0, 0.02])
def test_a_simulated_laboratory_recording_gives_the_door_back(noise_deg) -> None:
    """Force at 1 kHz, a tracker at 80 Hz with an offset, a rest before and a swing back after (thesis 5.3.1.1)."""
    door = read_catalogue()["K8"].door
    fast, slow = np.arange(0, 5.5, 1e-3), np.arange(0.0031, 5.5, 1 / 80)

    def angle_at(time: np.ndarray) -> np.ndarray:
        share = np.clip((time - 0.7) / 4.0, 0, 1)
        return 63 * share**3 * (10 + share * (6 * share - 15)) - 3 * np.clip(time - 4.9, 0, 1)

    force = hand_force(door, angle_at(fast))
    jitter = np.random.default_rng(3).normal(0, noise_deg, len(slow)) if noise_deg else 0.0
    angle, force = upsample_angle(fast, force, slow, angle_at(slow) + 11.4 + jitter)
    profile = normalise(angle, force, zero=True)
    error = profile.force_N[5:] - simulate(door)[5:]
    assert np.sqrt(np.mean(error**2)) < (0.02 if noise_deg == 0 else 0.25)


@pytest.mark.parametrize(
    ("angle", "force", "message"),
    [
        ([0, 1, 2], [1, 2], r"angle has shape \(3,\) and force \(2,\)"),
        ([[0, 1]], [[1, 2]], "one value each a row"),
        ([], [], "no rows"),
        ([0, float("nan"), 3], [1, 2, 3], "Row 2: the angle is nan"),
        ([0, 1, 3], [1, 2, float("inf")], "Row 3: the force is inf"),
        ([0, 1, 1.9], [1, 2, 3], "less than 2 degrees"),
        ([5], [1], "less than 2 degrees"),
        ([0, 0.5, 1.08], [1, 2, 3], "--radians"),
        ([62, 31, 0], [1, 2, 3], "falling while the door opens"),
        ([70, 80, 90], [1, 2, 3], "less than 2 degrees of it lie between 0 and 62"),
        ([0, 1, 2, 4.5, 6], [1, 2, 3, 4, 5], r"between 2\.00 and 4\.50 degrees: a gap of 2\.50"),
        ([0, 1, 2, 63, 64], [1, 2, 3, 4, 5], r"between 2\.00 and 62\.00"),
        ([-50, -10, 3, 5], [1, 2, 3, 4], r"between 0\.00 and 3\.00"),
    ],
)
def test_a_recording_that_cannot_be_used_is_refused_by_name(angle, force, message) -> None:
    with pytest.raises(DoorDataError, match=message):
        normalise(angle, force)


@pytest.mark.parametrize(
    ("force_time", "angle_time", "message"),
    [
        ([0, 1, 1], [0, 1, 2], "force recording's time does not rise at row 3"),
        ([0, 1, 2], [0, 2, 1], "angle recording's time does not rise at row 3"),
        ([0, 1, 2], [5, 6, 7], "do not overlap: force from 0 to 2 s, angle from 5 to 7 s"),
        ([0, float("nan"), 2], [0, 1, 2], "Row 2: the force time is nan"),
    ],
)
def test_two_recordings_that_do_not_fit_are_refused(force_time, angle_time, message) -> None:
    with pytest.raises(DoorDataError, match=message):
        upsample_angle(force_time, [1, 2, 3], angle_time, [0, 30, 60])


def test_upsampling_interpolates_and_never_extrapolates() -> None:
    angle, force = upsample_angle(np.arange(11) / 10, np.arange(11.0), [0.25, 0.75], [10.0, 20.0])
    assert force.tolist() == [3, 4, 5, 6, 7]
    assert angle == pytest.approx([11, 13, 15, 17, 19])


@pytest.mark.parametrize(
    "content",
    [
        b"angle_deg,force_N\n0,1.5\n3,2\n",
        b"\xef\xbb\xbfangle_deg,force_N\r\n0,1.5\r\n3,2\r\n",
        b"angle_deg;force_N\n0;1,5\n3,0;2\n",
        b"t\tangle_deg\tforce_N\n0\t0\t1.5\n1\t3\t2\n",
        b"\n angle_deg , force_N \n\n0,1.5\n\n3,2\n,\n",
        "\ufeffangle_deg,force_N\n0,1.5\n3,2\n".encode("utf-16-le"),
        'angle_deg;force_N;"Öffnung"\n0;1,5;x\n3;2;y\n'.encode("cp1252"),
    ],
)
def test_encodings_delimiters_and_decimal_commas_are_understood(tmp_path, content) -> None:
    path = tmp_path / "recording.csv"
    path.write_bytes(content)
    read = read_columns(path, ("angle_deg", "force_N"))
    assert (read["angle_deg"].tolist(), read["force_N"].tolist()) == ([0.0, 3.0], [1.5, 2.0])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"angle,force_N\n0,1\n", "column 'angle_deg' is missing; found: angle, force_N"),
        (b"angle_deg,angle_deg,force_N\n0,0,1\n", "'angle_deg' appears more than once"),
        (b"", "found: an empty file"),
        (b"angle_deg,force_N\n0,1\n\n1,nan\n", "line 4: force_N is 'nan'"),
        (b"angle_deg,force_N\n0,1\n-inf,2\n", "line 3: angle_deg is '-inf'"),
        (b"angle_deg,force_N\n0,\n", "line 2: force_N is ''"),
        (b"angle_deg,force_N\n0\n", "line 2: 1 values, column 'force_N' would be value 2"),
        (b"angle_deg;force_N\n0;1.234,5\n", "line 2: force_N is '1.234,5'"),
        (b"PK\x03\x04\x00\x00\x00", "not a text file"),
    ],
)
def test_a_file_that_cannot_be_read_is_refused_with_its_line(tmp_path, content, message) -> None:
    path = tmp_path / "recording.csv"
    path.write_bytes(content)
    with pytest.raises(DoorDataError, match=message) as refusal:
        read_columns(path, ("angle_deg", "force_N"))
    assert str(path) in str(refusal.value)


def test_a_real_cabinet_door_with_backlash_is_imported_close_to_its_rows(tmp_path) -> None:
    out = tmp_path / "cabinet.csv"
    arguments = ["normalise", str(DATA / "cabinet_hindsight.csv"), "--force-column", "ftan_ati_N", "--out", str(out)]
    answer = CliRunner().invoke(doors, [*arguments, "--json"], catch_exceptions=False)
    account = json.loads(answer.output)
    assert (account["rows"], account["backward_rows"], account["padded_points"]) == (998, 19, 0)
    rows = read_columns(DATA / "cabinet_hindsight.csv", ("angle_deg", "ftan_ati_N"))
    profile = np.array(read_profile(out))
    angle, force = np.array(rows["angle_deg"]), np.array(rows["ftan_ati_N"])
    for degree in range(2, 62, 5):
        near = np.abs(angle - degree) < 0.75
        assert force[near].min() - 0.01 <= profile[degree * 10] <= force[near].max() + 0.01


def test_a_real_recording_with_holes_is_refused_and_nothing_is_written(tmp_path) -> None:
    out = tmp_path / "cabinet.csv"
    arguments = ["normalise", str(DATA / "cabinet_online.csv"), "--force-column", "f_tangential_N", "--out", str(out)]
    result = CliRunner().invoke(doors, arguments)
    assert isinstance(result.exception, DoorDataError)
    assert "cabinet_online.csv: No rows between 9.00 and 29.70 degrees" in str(result.exception)
    assert not out.exists()


def test_the_command_reads_radians_and_a_separate_angle_recording(tmp_path) -> None:
    time = np.arange(0, 4, 1e-3)
    (tmp_path / "force.csv").write_text("t;F\n" + "".join(f"{t:.3f};{5 + t:.3f}\n" for t in time), encoding="utf-8")
    slow = np.arange(0, 4.01, 1 / 80)
    angles = "".join(f"{t:.4f};{np.radians(16 * t):.6f}\n" for t in slow)
    (tmp_path / "angle.csv").write_text("t;phi\n" + angles, encoding="utf-8")
    out = tmp_path / "profile.csv"
    columns = ["--angle-column", "phi", "--force-column", "F", "--time-column", "t", "--radians"]
    files = [str(tmp_path / "force.csv"), "--angle-file", str(tmp_path / "angle.csv"), "--out", str(out)]
    result = CliRunner().invoke(doors, ["normalise", *files, *columns], catch_exceptions=False)
    assert "621 points from 4,000 rows" in result.output
    assert read_profile(out)[1:] == pytest.approx(5 + GRID[1:] / 16, abs=2e-3)


def test_a_force_that_no_door_has_is_refused_as_it_is_by_predict():
    from palpate.signals.doors.model_features import features

    angle = [i / 10 for i in range(621)]
    for call in (lambda: normalise(angle, [1e308, -1e308, *[0.0] * 619]), lambda: features(np.full(621, 1e308))):
        with pytest.raises(DoorDataError, match=r"a force of 1e\+308 N; a door's is at most 1e\+09"):
            call()
