import json
import subprocess
import sys

import pytest
from click.testing import CliRunner

from palpate.devices.window.calibration import Calibration, read_calibration, write_calibration
from palpate.devices.window.commands import window
from palpate.devices.window.commands_calibrate import _read_until_right
from palpate.devices.window.geometry import WindowError
from tests.devices.window.shells_for_tests import FakeShell

GUESS = Calibration((1280, 720), 96 / 25.4, 0, "2026-11-21T10:00:00+00:00")


def read_until_right(typed):
    """Return the calibration that results from lines typed at the terminal, and the printed text."""
    reads = {}

    import click

    @click.command()
    def verb():
        reads["calibration"] = _read_until_right(FakeShell(), GUESS, "en")

    result = CliRunner().invoke(verb, input=typed)
    return reads.get("calibration"), result


def test_a_line_that_reads_right_confirms_the_guess():
    calibration, _ = read_until_right("127\n")

    assert calibration == GUESS


def test_a_reading_corrects_the_density_and_the_next_one_confirms_it():
    calibration, result = read_until_right("133.4\n127.2\n")

    assert calibration.px_per_mm == pytest.approx(480 / 133.4)
    assert "measure it again" in result.output


def test_an_empty_line_takes_127_and_a_comma_is_a_point():
    calibration, _ = read_until_right("130,0\n\n")

    assert calibration.px_per_mm == pytest.approx(480 / 130)


def test_what_is_no_number_or_no_length_is_asked_again():
    calibration, result = read_until_right("long\n0.5\n127\n")

    assert calibration == GUESS
    assert "'long' is not a number" in result.output
    assert "a reading from 12 to 480 mm is expected" in result.output


def test_readings_that_never_come_right_end_it():
    _, result = read_until_right("150\n" * 9)

    assert isinstance(result.exception, WindowError)
    assert "check the ruler" in str(result.exception)


def test_the_end_of_the_input_ends_it():
    _, result = read_until_right("")

    assert result.exit_code == 1


@pytest.mark.parametrize("size", ["1280", "1280x", "x720", "12x72", "1280x720x2", "-1280x720"])
def test_a_size_that_is_none_is_refused(size, tmp_path):
    result = CliRunner().invoke(window, ["screens", "--out", str(tmp_path), "--size", size])

    assert result.exit_code == 2
    assert "a size in pixels is expected, as 1280x720" in result.output


@pytest.mark.needs("psychopy")
def test_check_names_what_keeps_the_window_away(tmp_path, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    result = CliRunner().invoke(window, ["check", "--lab", str(tmp_path), "--json"])
    report = json.loads(result.output)

    assert result.exit_code == 1
    assert report["calibration"] is None
    assert any("this station's screen is not calibrated" in problem for problem in report["problems"])
    assert any("DISPLAY is not set" in problem for problem in report["problems"])
    assert {"en", "ko"} <= set(report["languages"])
    assert report["fonts"]["Latin"] is not None


@pytest.mark.needs("psychopy")
def test_check_shows_the_calibration_in_words(tmp_path, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    write_calibration(tmp_path, GUESS)
    result = CliRunner().invoke(window, ["check", "--lab", str(tmp_path)])

    assert "1280x720 px, 3.7795 px per mm (339 x 190 mm)" in result.output
    assert read_calibration(tmp_path) == GUESS


def test_the_verbs_import_nothing_heavy():
    code = (
        "import sys; from palpate.devices.window.commands import window; window(['--help'], standalone_mode=False); "
        "print(sorted({'PIL', 'psychopy', 'pyglet', 'numpy', 'Xlib'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert done.stdout.strip().endswith("[]")


def test_a_window_of_a_session_that_shows_no_force_loads_no_numpy():
    code = (
        "import sys, palpate.devices.window.presenter_window\n"
        "print(sorted({'PIL', 'psychopy', 'pyglet', 'numpy', 'Xlib'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
