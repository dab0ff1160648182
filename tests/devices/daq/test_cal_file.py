"""The maker's calibration file: its values in N and N m, and the errors of a wrong one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.devices.daq.cal_file import AXES, read_cal_file
from palpate.devices.daq.force_torque import SAMPLE
from palpate.devices.daq.gauges import Slopes, calibration, compensated, moved, torque_Nm, wrench
from palpate.devices.device import DeviceError
from tests.examples import examples

TEXT = SAMPLE.read_text(encoding="utf-8")
ROWS = (
    '<UserAxis Name="{0}" values="{1}" max="{2}"/>',
    '<Axis Name="{0}" values="{1}" max="{2}" scale="{3}"/>',
)


def written(folder: Path, text: str | bytes) -> Path:
    path = folder / "FT.cal"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def plain(force="N", torque="N-m", extra="", rows=None, kind=0, root="", **attributes) -> str:
    """A file whose matrix is the unit matrix, in these units."""
    rows = np.eye(6) if rows is None else rows
    lines = [ROWS[kind].format(axis, " ".join(map(str, row)), 10, 1) for axis, row in zip(AXES, rows, strict=True)]
    more = "".join(f' {name}="{value}"' for name, value in attributes.items())
    return (
        f'<FTSensor Serial="FT1" BodyStyle="Nano17" NumGages="6"{root}><Calibration PartNumber="P" CalDate="1/2/2020"'
        f' ForceUnits="{force}" TorqueUnits="{torque}"{more}>{"".join(lines)}{extra}</Calibration></FTSensor>'
    )


def test_the_sample_says_what_stands_in_it_in_newtons_and_newton_metres() -> None:
    file = read_cal_file(SAMPLE)
    sensor_calibration = calibration(file, "sample")
    assert (file.serial, file.body, file.part, file.date) == ("FT00000", "Nano17", "SI-50-0.5", "2026-11-21")
    assert (file.low_V, file.high_V) == (-10.0, 10.0)
    assert sensor_calibration.rated.tolist() == [50.0, 50.0, 70.0, 0.5, 0.5, 0.5]
    assert sensor_calibration.matrix[0] == pytest.approx(file.user["Fx"])
    assert sensor_calibration.matrix[5] == pytest.approx(np.array(file.user["Tz"]) / 1000)


@pytest.mark.parametrize(
    ("force", "torque", "newton", "newton_metre"),
    [
        ("N", "N-mm", 1.0, 1e-3),
        ("N", "Nmm", 1.0, 1e-3),
        ("N", "N-m", 1.0, 1.0),
        ("N", "Nm", 1.0, 1.0),
        ("kN", "kN-m", 1e3, 1e3),
        ("lbf", "in-lbf", 4.4482216152605, 0.1129848290276167),
        ("lb", "lbf-in", 4.4482216152605, 0.1129848290276167),
        ("lbf", "ft-lb", 4.4482216152605, 1.3558179483314004),
        ("kg", "kg-cm", 9.80665, 0.0980665),
        ("g", "kgcm", 0.00980665, 0.0980665),
    ],
)
def test_units_become_newtons_and_newton_metres(tmp_path, force, torque, newton, newton_metre) -> None:
    """The pound-force is 4.4482216152605 N exactly; NIST SP 811 gives 1.129848 E-1 N m for the pound-force inch."""
    sensor_calibration = calibration(read_cal_file(written(tmp_path, plain(force, torque))), "FT")
    assert np.diag(sensor_calibration.matrix) == pytest.approx([newton] * 3 + [newton_metre] * 3, rel=1e-12)
    assert sensor_calibration.rated == pytest.approx([10 * newton] * 3 + [10 * newton_metre] * 3, rel=1e-12)


def test_rows_before_the_transform_and_rows_after_it_give_the_same_matrix(tmp_path) -> None:
    after = TEXT[: TEXT.index("<Axis Name")] + TEXT[TEXT.index("<UserAxis") :]
    before = TEXT[: TEXT.index("<UserAxis")] + "</Calibration></FTSensor>"
    one = calibration(read_cal_file(written(tmp_path, after)), "after").matrix
    other = calibration(read_cal_file(written(tmp_path, before)), "before").matrix
    assert (np.abs(one - other).max(axis=1) / np.abs(one).max(axis=1)).max() < 1e-5  # printed with five decimals


def test_a_file_whose_two_matrices_disagree_was_altered(tmp_path) -> None:
    altered = TEXT.replace("24.64468", "25.64468")
    assert altered != TEXT
    with pytest.raises(DeviceError, match="UserAxis Name=Ty> and <Axis Name=Ty> .* disagree by 2.1 %"):
        calibration(read_cal_file(written(tmp_path, altered)), "FT")


def test_a_transform_gives_the_torque_about_the_new_origin_then_turns_the_axes() -> None:
    """2 N along x at the old origin: about a point 3 m up z, the moment is -z cross F; a quarter turn maps x to -y."""
    there = moved([0, 0, 3], [0, 0, 0]) @ [2, 0, 0, 0, 0, 0]
    assert there == pytest.approx([2, 0, 0, 0, -6, 0])
    turned = moved([0, 0, 3], [0, 0, np.pi / 2]) @ [2, 0, 0, 0, 0, 0]
    assert turned == pytest.approx([0, -2, 0, -6, 0, 0])


@given(st.lists(st.floats(-3, 3), min_size=6, max_size=6), st.lists(st.floats(-9, 9), min_size=6, max_size=6))
@settings(max_examples=examples(60), deadline=None)
def test_a_transform_keeps_the_force_and_the_work_of_a_wrench(shift, load) -> None:
    """Force length and the product force x torque are invariants of a rigid change of frame."""
    moved_load = moved(shift[:3], shift[3:]) @ load
    assert np.linalg.norm(moved_load[:3]) == pytest.approx(np.linalg.norm(load[:3]), abs=1e-9)
    assert moved_load[:3] @ moved_load[3:] == pytest.approx(np.dot(load[:3], load[3:]), abs=1e-8)


def test_the_wrench_is_the_matrix_times_the_volts_without_the_bias() -> None:
    matrix, bias = np.arange(36.0).reshape(6, 6), np.arange(6.0)
    volts = np.array([[1.0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 2]])
    expected = [(matrix @ (row - bias)).tolist() for row in volts]
    assert wrench(volts, matrix, bias).tolist() == expected


def test_temperature_is_taken_out_by_the_thermistors_volts() -> None:
    slopes = Slopes(np.full(6, 0.2), np.full(6, 0.1), 1.0)
    cold = compensated(np.full((2, 6), 3.0), np.array([1.0, 2.0]), slopes)
    assert cold[0].tolist() == [3.0] * 6
    assert cold[1] == pytest.approx([(3.0 + 0.2) / (1 - 0.1)] * 6)


def test_slopes_and_ranges_are_read(tmp_path) -> None:
    extra = '<BiasSlope values="1 2 3 4 5 6"/><GainSlope values="6 5 4 3 2 1"/><Thermistor value="1.25"/>'
    file = read_cal_file(written(tmp_path, plain(extra=extra, OutputRange="10", OutputBipolar="False")))
    assert file.slopes == ((1, 2, 3, 4, 5, 6), (6, 5, 4, 3, 2, 1), 1.25)
    assert (file.low_V, file.high_V) == (0.0, 10.0)
    assert read_cal_file(SAMPLE).slopes is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no calibration file"),
        ("Fx 1 2 3", "no calibration file"),
        (TEXT[:900], "no calibration file"),
        ("<Other/>", "<Other>: the outermost element is <FTSensor>"),
        ('<FTSensor Serial="a" NumGages="6"/>', "a <Calibration> is expected inside"),
        (plain().replace('NumGages="6"', 'NumGages="8"'), "NumGages>: sensors of 6 gauges"),
        (plain().replace(' ForceUnits="N"', ""), "<Calibration ForceUnits>: it is missing"),
        (plain().replace(' Serial="FT1"', ""), "<FTSensor SerialNumber>: it is missing"),
        (plain().replace('Name="Fz"', 'Name="Fx"'), "<UserAxis>: one each of Fx, Fy, .* found Fx, Fy, Fx"),
        (plain().replace('"1.0 0.0', '"1.0 zero'), "<UserAxis Name=Fx values>: 'zero' is not a number"),
        (plain().replace('"1.0 0.0', '"1.0 nan'), "<UserAxis Name=Fx values>: 'nan' is not a finite number"),
        (plain().replace('"1.0 0.0', '"1.0'), "<UserAxis Name=Fx values>: 6 numbers are expected, found 5"),
        (plain().replace('max="10"', 'max="0"', 1), "<UserAxis Name=Fx max>: 0 is not a rated load"),
        (plain(kind=1).replace('scale="1"', 'scale="0"', 1), "<Axis Name=Fx scale>: 0 divides nothing"),
        (plain(rows=np.eye(6), GainMultiplier="2"), "GainMultiplier>: only 1 is supported"),
        (plain(OutputRange="1e9"), "OutputRange>: 1e[+]09 V is not a range"),
        ('<FTSensor Serial="a" NumGages="6"><Calibration ForceUnits="N" TorqueUnits="N-m"/></FTSensor>', "rows named"),
        (plain(extra='<GainSlope values="1 2"/>'), "<GainSlope values>: 6 numbers"),
    ],
)  # fmt: skip
def test_a_wrong_file_is_refused_by_its_name_and_element(tmp_path, text, words) -> None:
    with pytest.raises(DeviceError, match=rf"FT\.cal: .*{words}"):
        read_cal_file(written(tmp_path, text))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (plain("stone"), "ForceUnits 'stone' are not known; known are N, kN, lb"),
        (plain(torque="N"), "TorqueUnits 'N' are not known"),
        (plain(torque="N-mile"), "TorqueUnits 'N-mile' are not known"),
        (plain(kind=1, DistUnits="mile"), "DistUnits 'mile'"),
        (plain(kind=1, AngleUnits="turn"), "AngleUnits 'turn'"),
        (plain(rows=np.vstack([np.eye(6)[:5], np.eye(6)[4]])), "do not separate six loads"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused(tmp_path, text, words) -> None:
    with pytest.raises(DeviceError, match=words):
        calibration(read_cal_file(written(tmp_path, text)), "FT.cal")


def test_entities_are_refused_before_they_grow(tmp_path) -> None:
    bomb = '<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]>' + TEXT[TEXT.index("<FTSensor") :]
    for text in (bomb.encode(), ('<?xml version="1.0" encoding="UTF-16"?>' + bomb).encode("utf-16")):
        with pytest.raises(DeviceError, match="<!DOCTYPE>: a calibration file has none"):
            read_cal_file(written(tmp_path, text))


def test_what_is_missing_or_too_large_is_refused_unread(tmp_path) -> None:
    with pytest.raises(DeviceError, match=r"none\.cal: the calibration file cannot be read \(No such file"):
        read_cal_file(tmp_path / "none.cal")
    with pytest.raises(DeviceError, match="a calibration file has at most 1048576"):
        read_cal_file(written(tmp_path, b"<a>" + b" " * (1 << 20)))


def test_bytes_that_old_tools_leave_at_the_end_do_no_harm(tmp_path) -> None:
    assert read_cal_file(written(tmp_path, TEXT.encode() + b"\r\n\0\0\x1a")).user == read_cal_file(SAMPLE).user


@given(st.data())
@settings(max_examples=examples(150), deadline=None)
def test_a_damaged_file_is_read_or_refused_and_nothing_else(tmp_path_factory, data) -> None:
    text = bytearray(TEXT.encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text) - 1))
        text[at : at + data.draw(st.integers(0, 9))] = data.draw(st.binary(max_size=6))
    path = written(tmp_path_factory.mktemp("cal"), bytes(text))
    try:
        sensor_calibration = calibration(read_cal_file(path), "FT")
    except DeviceError as error:
        assert "FT" in str(error)
    else:
        assert np.isfinite(sensor_calibration.matrix).all()
        assert (sensor_calibration.rated > 0).all()
        assert torque_Nm(read_cal_file(path), "FT") > 0
