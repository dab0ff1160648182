import pytest

from palpate.devices.window.calibration import (
    Calibration,
    demand_reading,
    density_from,
    read_calibration,
    station_file,
    write_calibration,
)
from palpate.devices.window.geometry import WindowError

MEASURED = Calibration((1920, 1080), 3.6123456789, 1, "2026-11-21T10:00:00+00:00")


def test_a_calibration_comes_back_from_its_file_as_it_was_written(tmp_path):
    file = write_calibration(tmp_path, MEASURED, "lab-pc.example.org")

    assert file == tmp_path / "stations" / "lab-pc" / "window.yaml"
    assert read_calibration(tmp_path, "lab-pc.example.org") == MEASURED
    assert [path.name for path in file.parent.iterdir()] == ["window.yaml"]


def test_a_calibration_comes_back_from_the_ledger_as_it_was_recorded():
    assert Calibration.from_definition(MEASURED.definition()) == MEASURED


def test_every_station_of_a_lab_has_its_own(tmp_path):
    write_calibration(tmp_path, MEASURED, "left")

    with pytest.raises(WindowError, match="right.window.yaml: this station's screen is not calibrated.*palpate window"):
        read_calibration(tmp_path, "right")


def test_a_host_name_stays_inside_the_lab(tmp_path):
    assert station_file(tmp_path, "../../etc/passwd").parent.parent == tmp_path / "stations"


@pytest.mark.parametrize(
    ("line", "wrong", "message"),
    [
        ("px_per_mm", "px_per_mm: nan", "line 4: px_per_mm = 'nan'.*from 1 to 40"),
        ("px_per_mm", "px_per_mm: 400", "line 4: px_per_mm = 400.*from 1 to 40"),
        ("px_per_mm", "px_per_m: 3.6", "line 4: unknown key 'px_per_m', did you mean 'px_per_mm'"),
        ("size_px", "size_px: [1920]", r"size_px = \[1920\].*width, height"),
        ("size_px", "size_px: [true, 1080]", "size_px = "),
        ("screen", "screen: -1", "screen = -1.*from 0"),
        ("screen", "screen: 0.0", "screen = 0.0"),
        ("confirmed_at", "", "confirmed_at is missing"),
        ("screen", "- a", "window.yaml"),
    ],
)
def test_a_wrong_line_of_the_file_is_named(tmp_path, line, wrong, message):
    file = write_calibration(tmp_path, MEASURED, "pc")
    lines = file.read_text().splitlines()
    file.write_text("\n".join(wrong if old.startswith(line) else old for old in lines) + "\n")

    with pytest.raises(ValueError, match=message):
        read_calibration(tmp_path, "pc")


def test_another_screen_size_is_refused_with_both_sizes():
    MEASURED.demand_size((1920, 1080))
    with pytest.raises(WindowError, match="calibrated at 1920x1080 px, the screen has 2560x1440.*palpate window"):
        MEASURED.demand_size((2560, 1440))


@pytest.mark.parametrize("read_mm", [126.5, 127.0, 127.5])
def test_a_reading_within_half_a_millimetre_confirms(read_mm):
    demand_reading(read_mm, 127.0)


@pytest.mark.parametrize("read_mm", [126.4, 127.6, 12.7, float("nan")])
def test_a_reading_further_off_is_refused(read_mm):
    with pytest.raises(WindowError, match="measures .* mm on the screen; at most 0.5 mm off"):
        demand_reading(read_mm, 127.0)


def test_the_density_follows_from_the_reading():
    assert density_from(480, 133.3333) == pytest.approx(3.6, rel=1e-6)


@pytest.mark.parametrize("read_mm", [0.0, -127.0, 5.0, 1e6, float("inf"), float("nan")])
def test_a_reading_that_gives_no_screen_is_refused(read_mm):
    with pytest.raises(WindowError, match="a reading from 12 to 480 mm is expected"):
        density_from(480, read_mm)
