"""The numbers behind Figures 5.3 and 5.6 of the thesis, and the files that hold them."""

import csv
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from palpate.devices.door.commands import doors
from palpate.devices.door.draw import feature_rows, opening_rows
from palpate.devices.picture import PictureError
from palpate.signals.doors.grid import DoorDataError

STUDY = Path("studies/door_ratings")


def draw(*arguments):
    return CliRunner().invoke(doors, ["draw", str(STUDY), *map(str, arguments)], catch_exceptions=False)


def broken_line(*corners):
    """A profile of straight lines through corners (degrees, newtons)."""
    degrees, newtons = zip(*corners, strict=True)
    return np.interp(np.arange(621) / 10, degrees, newtons)


def test_peaks_intervals_and_slopes_are_those_of_a_profile_of_straight_lines():
    profile = broken_line((0, 0), (10, 20), (20, -5), (35, 30), (50, 0), (60, 8), (61, 0.5), (61.1, 0), (62, 0))
    rows = feature_rows({"A": profile})

    def of(shows):
        return [(row["angle_deg"], row["to_deg"], row["value"]) for row in rows if row["shows"] == shows]

    assert [row["car"] for row in rows] == ["A"] * len(rows)
    assert len(of("profile")) == 621
    assert of("peak") == [(10, None, 20), (35, None, 30), (60, None, 8)]
    assert of("valley") == [(20, None, -5), (50, None, pytest.approx(0)), (61, None, pytest.approx(0.5))]
    assert of("interval") == [(10, 35, 25), (35, 60, 25)]
    slopes = [(0, 10, 2.0), (10, 20, -2.5), (20, 35, 35 / 15), (35, 50, -2.0), (50, 60, 0.8), (60, 61, -7.5)]
    assert of("slope") == [(a, b, pytest.approx(slope)) for a, b, slope in slopes]


def test_the_plateau_is_where_the_fall_slows():
    profile = broken_line((0, 0), (10, 30), (20, 0), (30, 40), (34, 24), (38, 22), (42, 0), (52, 20), (62, 10))
    ((a, b, mean_N),) = [
        (row["angle_deg"], row["to_deg"], row["value"])
        for row in feature_rows({"A": profile}) if row["shows"] == "plateau"
    ]  # fmt: skip
    assert (a, b) == (pytest.approx(34, abs=0.7), pytest.approx(38, abs=0.7))
    assert mean_N == pytest.approx(23, abs=0.5)


def test_a_profile_without_a_peak_has_none_and_can_be_drawn(tmp_path):
    assert {row["shows"] for row in feature_rows({"flat": np.zeros(621)})} == {"profile"}
    (tmp_path / "flat.csv").write_text("angle_deg,force_N\n" + "".join(f"{n / 10},0\n" for n in range(621)))
    (tmp_path / "stimuli.csv").write_text("car,variant,augmentation,source,file\nX,g0,original,measured,flat.csv\n")
    CliRunner().invoke(
        doors, ["draw", str(tmp_path), "--features", "--out", str(tmp_path / "f.png")], catch_exceptions=False
    )
    assert (tmp_path / "f.png").stat().st_size > 1000


def test_an_opening_is_counted_in_seconds_from_its_first_row():
    rows = opening_rows({"K8": np.arange(621.0)}, {"K8": (np.array([5.0, 5.5, 6.5]), np.array([0.0, 1.0, 4.0]))})
    track = [(row["time_s"], row["angle_deg"]) for row in rows if row["shows"] == "position"]
    assert track == [(0, 0), (0.5, 1), (1.5, 4)]
    assert [row["force_N"] for row in rows if row["shows"] == "profile"] == list(range(621))


def test_the_features_of_the_study_are_those_of_its_table(tmp_path):
    draw("--features", "--out", tmp_path / "features")
    assert {path.name for path in tmp_path.iterdir()} == {"features.svg", "features.png", "features.csv"}
    first = {}
    for row in csv.DictReader((tmp_path / "features.csv").read_text().splitlines()):
        if row["shows"] == "peak":
            first.setdefault(row["car"], (float(row["angle_deg"]), float(row["value"])))
    table = csv.DictReader((STUDY / "stimuli.csv").read_text().splitlines())
    expected = {r["car"]: (float(r["first_peak_deg"]), float(r["first_peak_N"])) for r in table if r["variant"] == "g0"}
    assert first == expected
    before = (tmp_path / "features.svg").read_bytes()
    draw("--features", "--out", tmp_path / "features")
    assert (tmp_path / "features.svg").read_bytes() == before


def test_openings_are_drawn_with_the_recordings(tmp_path):
    (tmp_path / "k8.csv").write_text("t;winkel\n1,0;0,0\n1,5;10,5\n2,0;30,0\n", encoding="utf-8")
    columns = ("--time-column", "t", "--angle-column", "winkel")
    draw("--opening", f"K8={tmp_path / 'k8.csv'}", *columns, "--out", tmp_path / "openings.png")
    rows = list(csv.DictReader((tmp_path / "openings.csv").read_text().splitlines()))
    assert [(r["time_s"], r["angle_deg"]) for r in rows if r["shows"] == "position"] == [
        ("0", "0"), ("0.5", "10.5"), ("1", "30")
    ]  # fmt: skip
    assert sum(row["shows"] == "profile" for row in rows) == 6 * 621


def test_what_cannot_be_drawn_is_refused_by_name(tmp_path):
    (tmp_path / "k8.csv").write_text("time_s,angle_deg\n1,0\n1,2\n")
    out = ("--out", tmp_path / "o.png")
    with pytest.raises(DoorDataError, match="--opening VW: .* has the doors BC3, FORD, G90, K3, K8, MQ4"):
        draw("--opening", f"VW={tmp_path / 'k8.csv'}", *out)
    with pytest.raises(DoorDataError, match=r"k8\.csv: two or more rows whose time_s rises"):
        draw("--opening", f"K8={tmp_path / 'k8.csv'}", *out)
    with pytest.raises(PictureError, match=r"o\.gif: a picture is written as \.png, \.svg, \.pdf"):
        draw("--features", "--out", tmp_path / "o.gif")
    assert "DOOR=FILE.csv is expected" in draw("--opening", "k8.csv", *out).output
    assert "two pictures" in draw("--features", "--opening", "K8=k8.csv", *out).output
    assert [path.name for path in tmp_path.iterdir()] == ["k8.csv"]
