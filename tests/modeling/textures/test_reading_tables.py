"""Tables of any rate, unit and separator; each mistake is reported with its file and line."""

import numpy as np
import pytest

from palpate.modeling.textures.reading_tables import Held, read_tables
from palpate.modeling.textures.recording import TextureDataError
from palpate.modeling.textures.splitting import split
from tests.modeling.textures.textures_for_tests import hand, vibration


def table(path, header, columns, separator=",", form="%.7g"):
    np.savetxt(path, np.column_stack(columns), delimiter=separator, header=header, comments="", fmt=form)
    return path


def columns(n=19_000, rate_hz=10_000.0):
    speed, force = hand(n, rate_hz)
    return [np.arange(n) / rate_hz, vibration(n), speed, force]


def test_a_short_noisy_recording_at_10_kHz_with_hum_on_one_channel(tmp_path):
    t, felt, speed, force = columns()
    hummed = 0.3 * felt + 0.4 * np.sin(2 * np.pi * 50 * t) + 0.2 * np.sin(2 * np.pi * 150 * t)
    table(tmp_path / "felt_mat.csv", "time,acceleration,speed,force", [t, hummed, speed, force])
    (recording,) = read_tables(tmp_path)
    assert (recording.texture, recording.label, recording.signals.shape) == ("felt_mat", "felt mat", (3, 1900))
    assert any("mains hum of 50 Hz" in note for note in recording.notes)
    assert any("time in s, acceleration in m/s^2" in note for note in recording.notes)
    np.testing.assert_allclose(recording.speed_mm_s[50:-50], speed[::10][50:-50], rtol=0.01)
    assert recording.made_from[0].startswith("felt_mat.csv ")
    assert len(split(recording).train) == 7
    (left,) = read_tables(tmp_path, remove_hum=False)
    assert left.acceleration_m_s2.std() > 1.5 * recording.acceleration_m_s2.std()


def test_units_axes_positions_and_empty_cells(tmp_path):
    rows = ["t_ms;ax [g];ay [g];az [g];comment;x_cm;y_cm;Force (mN)"]
    chance = np.random.default_rng(0)
    for number in range(6000):
        second = number / 3000
        place = f"{4 * np.sin(3 * second):.5f};{4 * np.cos(3 * second):.5f}" if number % 25 == 0 else ";"
        felt = ";".join(f"{value:.5f}" for value in 0.1 * chance.standard_normal(3) + [0, 0, 1])
        rows.append(f"{1000 * second:.3f};{felt};words;{place};{'800' if number % 3 == 0 else ''}")
    (tmp_path / "a.csv").write_text("\ufeff" + "\n".join(rows) + "\n", encoding="utf-8")
    (recording,) = read_tables(tmp_path / "a.csv")
    np.testing.assert_allclose(recording.speed_mm_s[50:-50], 120, rtol=0.01)
    np.testing.assert_allclose(recording.force_N, 0.8, atol=1e-9)
    # 0.98 m/s^2 of white noise on three axes, of which 20 to 450..500 of 1500 Hz stay
    assert recording.acceleration_m_s2.std() == pytest.approx(0.980665 * np.sqrt(3 * 455 / 1500), rel=0.05)


def test_what_was_not_recorded_can_be_given(tmp_path):
    file = table(tmp_path / "one.txt", "acceleration", [columns()[1]])
    with pytest.raises(TextureDataError, match="no column of times"):
        read_tables(file)
    with pytest.raises(TextureDataError, match="no column for force and speed"):
        read_tables(file, held=Held(rate_hz=10_000.0))
    (recording,) = read_tables(file, held=Held(10_000.0, 45.0, 0.8))
    assert any("it is given as 45 mm/s" in note for note in recording.notes)
    assert any("force never varies" in note for note in recording.notes)


def test_times_that_are_written_coarsely_are_read(tmp_path):
    t, felt, speed, force = columns(6000, 3000.0)
    exact, coarse = tmp_path / "exact.csv", tmp_path / "coarse.csv"
    table(exact, "t,acceleration,speed,force", [t, felt, speed, force], form="%.9f")
    table(coarse, "t,acceleration,speed,force", [t, felt, speed, force], form=["%.3f", "%.9f", "%.9f", "%.9f"])
    one, other = read_tables([exact, coarse])
    n = min(one.signals.shape[1], other.signals.shape[1])
    assert np.abs(one.signals[:, :n] - other.signals[:, :n])[:, 100:-100].max() < 0.05


@pytest.mark.parametrize(
    "header",
    [
        "Time (s),Acceleration (m/s^2),Speed [mm/s],Normal Force (N)", "time_s,acc_x,vel,f_n", "t,az,speed,Fz",
        "Time/s,Acceleration/(m/s²),Speed/(mm/s),Force/N", "timestamp,accX (m s^-2),speed_mm_s,Fn",
        "time (sec),acceleration in m/s^2,velocity,force_N", "# time,acceleration_m_s2,speed,force",
        "t,a_x [ms⁻²],vel,force",
    ],
)  # fmt: skip
def test_common_headers_of_one_channel_are_understood(tmp_path, header):
    t, felt, speed, force = columns(3000, 3000.0)
    one = read_tables(table(tmp_path / "one.csv", header, [t, felt, speed, force]))[0]
    other = read_tables(table(tmp_path / "other.csv", HEAD, [t, felt, speed, force]))[0]
    np.testing.assert_array_equal(one.signals, other.signals)


def test_spaces_comments_decimal_commas_and_times_since_1970_are_read(tmp_path):
    t, felt, speed, force = columns(3000, 10_000.0)
    expected = read_tables(table(tmp_path / "t.csv", HEAD, [t, felt, speed, force], form="%.6f"))[0].signals
    np.savetxt(tmp_path / "a.txt", np.round([t, felt, speed, force], 6).T, header="made\ntime acceleration speed force")
    lines = (tmp_path / "t.csv").read_text().replace(",", ";").replace(".", ",").splitlines()
    (tmp_path / "b.tsv").write_text("\r\n".join(f"{line};" if at else line for at, line in enumerate(lines)) + "\r\n")
    table(tmp_path / "c.csv", HEAD, [t + 1.7e9, felt, speed, force], form=["%.4f", "%.6f", "%.6f", "%.6f"])
    for name in ("a.txt", "b.tsv", "c.csv"):
        np.testing.assert_allclose(read_tables(tmp_path / name)[0].signals, expected, atol=1e-3)


def test_missing_samples_do_not_slow_the_clock(tmp_path):
    t, felt, speed, force = columns(19_000)
    rows = [f"{a:.4f},{b:.6f},{c:.4f},{d:.4f}" for a, b, c, d in zip(t, felt, speed, force, strict=True)]
    (tmp_path / "t.csv").write_text("\n".join(["time,acceleration,speed,force", *rows[:9000], *rows[9300:]]))
    (recording,) = read_tables(tmp_path)
    assert recording.borders == (900,)
    assert not any("uneven" in note for note in recording.notes)
    (whole,) = read_tables(table(tmp_path / "whole.csv", HEAD, [t, felt, speed, force]))
    np.testing.assert_allclose(recording.acceleration_m_s2[100:800], whole.acceleration_m_s2[100:800], atol=0.01)


HEAD = "time,acceleration,speed,force"
GOOD = "\n".join(f"{k / 1000:.3f},{k * 37 % 19},50,1" for k in range(500))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "empty"),
        (HEAD, "no row"),
        (f"{HEAD}\n{GOOD}\n0.5,1,2", "line 502: 3 cells"),
        (f"{HEAD}\n0,1,x,1\n{GOOD}", "line 2: speed is 'x'"),
        (f"{HEAD}\n{GOOD}\n0.500,nan,50,1", "line 502: acceleration is 'nan'"),
        (f"{HEAD}\n{GOOD}\n,1,50,1", "line 502: the time is empty"),
        (f"time;acceleration;speed;force\n{GOOD.replace(',', ';')}\n0,5;1;50;1", "which of them is the decimal sign"),
        (GOOD, "line 1: numbers, where a header"),
        (f"{HEAD}\ns,m/s^2,mm/s,N\n{GOOD}", "line 2: time is 's'.*units stand in the header"),
        (f"# made\n\n{HEAD}\n{GOOD}\n\n0.5,1,2", "line 505: 3 cells"),
        (f"{HEAD},{'x' * 200_000}\n{GOOD}", "is this a table"),
        (f"{HEAD}\n{GOOD.replace(',50,', ',0.05,')}", "never above 0.05, and no unit is given; is it in m/s"),
        (f"time,acceleration (V),speed,force\n{GOOD}", "in 'V'; known are"),
        (f"time,acceleration (furlong),speed,force\n{GOOD}", "in 'furlong'; known are"),
        (f"time,force,speed,force\n{GOOD}", "'force' appears there twice"),
        (f"time,acc,speed,power\n{GOOD}", "no column for force"),
        (f"time_ms,acceleration,speed,force\n{GOOD}", "at 1e.06 Hz: 100 to 250000 Hz"),
        (f"{HEAD}\n" + "\n".join(f"0,{k * 37 % 19},50,1" for k in range(500)), "do not rise"),
        (f"{HEAD}\n0,1,50,1", "two or more"),
    ],
)
def test_a_table_that_cannot_be_read_is_refused_with_its_place(tmp_path, text, message):
    file = tmp_path / "t.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(TextureDataError, match=message) as refused:
        read_tables(file)
    assert str(file) in str(refused.value)


def test_bytes_that_are_no_text_missing_files_and_namesakes_are_refused(tmp_path):
    (tmp_path / "t.csv").write_bytes(b"time\xff\n")
    with pytest.raises(TextureDataError, match="byte 4 is not UTF-8"):
        read_tables(tmp_path)
    with pytest.raises(TextureDataError, match="no such file"):
        read_tables(tmp_path / "none.csv")
    (tmp_path / "sub").mkdir()
    with pytest.raises(TextureDataError, match="no table in it"):
        read_tables(tmp_path / "sub")
    (tmp_path / "sub" / "t.csv").write_text("x")
    with pytest.raises(TextureDataError, match="two files are named 't'"):
        read_tables([tmp_path / "t.csv", tmp_path / "sub"])
