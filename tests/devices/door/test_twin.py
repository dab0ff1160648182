"""The twin: exact on the grid, exact in its bytes, strict about its files, and free of numpy."""

from __future__ import annotations

import math
import struct
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.devices.door.twin import open_door
from palpate.signals.doors.grid import POINTS, DoorDataError
from palpate.signals.doors.profile_file import read_profile
from tests.examples import examples

STRAIGHT = tuple(index / 20 for index in range(POINTS))
PROFILES = Path(__file__).parents[3] / "studies" / "door_ratings" / "profiles"


def test_an_opening_starts_closed_ends_open_and_is_halfway_at_half_time() -> None:
    opening = open_door(STRAIGHT, duration_s=2.0, rate_hz=100.0)
    assert len(opening.angle_deg) == len(opening.force_N) == 201
    assert (opening.angle_deg[0], opening.angle_deg[100], opening.angle_deg[200]) == (0.0, 31.0, 62.0)
    assert opening.rate_hz == 100.0


@given(st.floats(0.1, 10), st.floats(20, 1000))
@settings(max_examples=examples(50), deadline=None)
def test_the_path_rises_within_the_range_and_a_straight_profile_is_followed_exactly(duration_s, rate_hz) -> None:
    opening = open_door(STRAIGHT, duration_s, rate_hz)
    assert all(a <= b for a, b in zip(opening.angle_deg, opening.angle_deg[1:], strict=False))
    assert 0 == opening.angle_deg[0] <= opening.angle_deg[-1] <= 62
    assert all(
        force == pytest.approx(angle / 2, abs=1e-12)
        for angle, force in zip(opening.angle_deg, opening.force_N, strict=True)
    )


def test_the_minimum_jerk_path_has_its_known_top_speed() -> None:
    opening = open_door(STRAIGHT, 1.0, 10_000.0)
    top = max(b - a for a, b in zip(opening.angle_deg, opening.angle_deg[1:], strict=False)) * 10_000
    assert top == pytest.approx(1.875 * 62, rel=1e-6)  # Flash and Hogan 1985: 15/8 of the mean speed


def test_the_force_is_linear_between_the_profile_points() -> None:
    profile = [0.0] * POINTS
    profile[310] = 8.0
    opening = open_door(profile, 1.0, 20_001.0)
    for angle, force in zip(opening.angle_deg, opening.force_N, strict=True):
        assert force == pytest.approx(max(0.0, 8 * (1 - abs(angle - 31) * 10)), abs=1e-9)


def test_the_bytes_are_little_endian_float32_pairs() -> None:
    opening = open_door(STRAIGHT, 0.5, 8.0)
    assert len(opening.interleaved()) == 8 * 5
    numbers = struct.unpack("<10f", opening.interleaved())
    assert numbers[0::2] == pytest.approx(opening.angle_deg, rel=1e-6)
    assert numbers[1::2] == pytest.approx(opening.force_N, rel=1e-6)


@pytest.mark.parametrize(("duration_s", "rate_hz", "samples"), [(0.3, 10.0, 4), (0.1, 30.0, 4), (1.05, 10.0, 11)])
def test_the_number_of_samples_does_not_suffer_from_rounding(duration_s, rate_hz, samples) -> None:
    assert len(open_door(STRAIGHT, duration_s, rate_hz).angle_deg) == samples


@pytest.mark.parametrize(
    ("duration_s", "rate_hz", "message"),
    [
        (0, 100, "duration_s is 0"),
        (math.nan, 100, "duration_s is nan"),
        (2, math.inf, "rate_hz is inf"),
        (2, -1, "rate_hz is -1"),
        (0.001, 10, "0.01 samples"),
        (1e9, 1e9, "1e[+]18 samples"),
    ],
)
def test_a_duration_or_rate_that_makes_no_sense_is_refused(duration_s, rate_hz, message) -> None:
    with pytest.raises(DoorDataError, match=message):
        open_door(STRAIGHT, duration_s, rate_hz)


def test_a_profile_of_another_length_is_refused() -> None:
    with pytest.raises(DoorDataError, match="621 points, this one has 620"):
        open_door(STRAIGHT[:-1], 2, 100)


def test_every_committed_profile_is_read() -> None:
    paths = sorted(PROFILES.glob("*.csv"))
    assert len(paths) == 90
    assert all(len(read_profile(path)) == POINTS for path in paths)


@pytest.mark.parametrize(
    ("line", "text", "message"),
    [
        (1, "angle,force", "line 1: found 'angle,force', expected 'angle_deg,force_N'"),
        (5, "0.3,nan", "line 5: force_N is 'nan'"),
        (5, "0.3,", "line 5: force_N is ''"),
        (5, "x,1", "line 5: angle_deg is 'x'"),
        (5, "0.4,1", r"line 5: angle 0\.4 found, 0\.3 expected"),
        (5, "0.3,1,2", "line 5: 3 values found, 2 expected"),
        (622, "62.0,1\n62.1,1", "line 623: angle 62.1 found, the end of the file expected"),
        (622, "", "line 622: 0 values found"),
    ],
)
def test_a_profile_file_with_a_mistake_is_refused_with_its_line(tmp_path, line, text, message) -> None:
    lines = (PROFILES / "K3_g0.csv").read_text(encoding="utf-8").splitlines()
    lines[line - 1] = text
    path = tmp_path / "profile.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(DoorDataError, match=message) as refusal:
        read_profile(path)
    assert str(path) in str(refusal.value)


def test_a_short_or_binary_profile_file_is_refused(tmp_path) -> None:
    path = tmp_path / "profile.csv"
    path.write_text("angle_deg,force_N\n0.0,1\n0.1,1\n", encoding="utf-8")
    with pytest.raises(DoorDataError, match=r"2 points found, 621 expected.*normalise"):
        read_profile(path)
    path.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(DoorDataError, match="not a UTF-8 text file"):
        read_profile(path)


@pytest.mark.parametrize("module", ["palpate.devices.door.twin", "palpate.devices.door.commands"])
def test_neither_the_twin_nor_the_command_table_imports_numpy(module) -> None:
    check = (
        f"import sys, {module}; print(sorted({{'numpy', 'scipy', 'pandas', 'matplotlib', 'yaml'}} & set(sys.modules)))"
    )
    answer = subprocess.run([sys.executable, "-c", check], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"
