import numpy as np
import pytest

from palpate.devices.device import DeviceError
from palpate.devices.render.hand_simulated import simulated_hand
from palpate.devices.render.hands import OnTablet, Pushed, Scripted, read_hand
from palpate.devices.tablet.pipeline import Shape, Stylus
from palpate.devices.tablet.reports import Report
from palpate.signals.textures.sounds import RenderError


def written(folder, text):
    path = folder / "hand.csv"
    path.write_text(text)
    return path


def strokes(seconds=1.0, speed=100.0, hz=133):
    return [Report(n / hz, speed * n / hz, 5.0, 0.5, True) for n in range(int(seconds * hz))]


def test_speed_and_force_of_any_rate_are_brought_to_1_khz(tmp_path):
    rows = "".join(f"{5 + n / 50:.3f},{100 + n},{n / 100}\n" for n in range(51))
    hand = read_hand(written(tmp_path, "\ufefft_s,speed_mm_s,force_N,more\n" + rows.replace("\n", ",x\n")))
    assert len(hand) == 1001
    assert hand.seconds == pytest.approx(1.0, abs=2e-3)
    np.testing.assert_allclose(hand.speed_mm_s, 100 + np.arange(1001) / 20)
    assert hand.at(1000) == pytest.approx((150.0, 0.5))
    assert hand.at(1001) == (0.0, 0.0)
    assert hand.at(-1) == (0.0, 0.0)


def test_a_stylus_recording_goes_through_the_filters_of_a_real_one(tmp_path):
    rows = "".join(f"{r.t_s},{r.x_mm},{r.y_mm},{r.pressure}\n" for r in strokes())
    hand = read_hand(written(tmp_path, "t_s,x_mm,y_mm,pressure\n" + rows))
    stylus, waiting, want = Stylus(Shape()), strokes(), []
    for n in range(len(hand)):
        while waiting and waiting[0].t_s <= n / 1000:
            stylus.report(waiting.pop(0))
        want.append(stylus.step(n / 1000))
    np.testing.assert_allclose(np.array(want).T, [hand.speed_mm_s, hand.force_N])
    assert hand.at(500) == pytest.approx((100.0, 0.13 * np.exp(3.32 * 0.5)), rel=0.02)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t_s,speed,force_N\n0,1,1\n", r"the column speed_mm_s is missing; t_s, speed_mm_s, force_N or t_s, x_mm"),
        ("", r"found none"),
        ("t_s,speed_mm_s,force_N\n0,1,1\n", r"1 row; two at least"),
        ("t_s,speed_mm_s,force_N\n0,1,1\n1,1,1\n0.5,1,1\n", r"line 4: t_s is 0.5; seconds that rise"),
        ("t_s,speed_mm_s,force_N\n0,1,1\nnan,1,1\n", r"line 3: t_s is nan"),
        ("t_s,speed_mm_s,force_N\n0,1,1\n1,two,1\n", r"does not hold three numbers"),
        ("t_s,speed_mm_s,force_N\n0,1,1\n1,1\n", r"does not hold three numbers"),
        ("t_s,speed_mm_s,force_N\n0,1,1\n900000,1,1\n", r"Is t_s in seconds\?"),
    ],
)
def test_a_table_that_is_no_hand_is_refused(tmp_path, text, message):
    with pytest.raises(RenderError, match=message):
        read_hand(written(tmp_path, text))


def test_files_that_cannot_be_read_are_refused(tmp_path):
    with pytest.raises(RenderError, match=r"nobody\.csv: cannot be read as a hand's recording: No such file"):
        read_hand(tmp_path / "nobody.csv")
    (tmp_path / "hand.csv").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(RenderError, match=r"it is not a table in UTF-8"):
        read_hand(tmp_path / "hand.csv")
    with pytest.raises(DeviceError, match=r"numbers are expected"):
        read_hand(written(tmp_path, "t_s,x_mm,y_mm,pressure\n0,1,1,1\n1,x,1,1\n"))


def test_tables_that_are_none_further_down_are_refused_too(tmp_path):
    for content in (b"t_s,speed_mm_s,force_N\n" + b"1,1,1\n" * 5000 + b"\xe9", b"[" + b"1" * 200_000):
        (tmp_path / "hand.csv").write_bytes(content)
        with pytest.raises(RenderError, match=r"hand\.csv: cannot be read as a hand's recording: it is not a table"):
            read_hand(tmp_path / "hand.csv")


def test_spaces_about_names_and_numbers_mean_nothing(tmp_path):
    hand = read_hand(written(tmp_path, "t_s , speed_mm_s,force_N \n0, 100 ,1\n\n0.001,100,1\n"))
    assert (hand.speed_mm_s, hand.force_N) == ([100.0] * 2, [1.0] * 2)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda n, r: r._replace(t_s=0.1) if n == 50 else r, r"time stamps that run backwards, in 1 of 133 rows"),
        (lambda n, r: r._replace(pressure=7.0) if n else r, r"pressures outside 0 to 1.* in 13. of 133 rows"),
    ],
)
def test_reports_that_no_tablet_gives_are_refused(tmp_path, spoil, message):
    reports = [spoil(n, report) for n, report in enumerate(strokes())]
    rows = "".join(f"{r.t_s},{r.x_mm},{r.y_mm},{r.pressure}\n" for r in reports)
    with pytest.raises(RenderError, match=message):
        read_hand(written(tmp_path, "t_s,x_mm,y_mm,pressure\n" + rows))


def test_missing_values_reach_the_voice_as_what_they_are(tmp_path):
    hand = read_hand(written(tmp_path, "t_s,speed_mm_s,force_N\n0,50,1\n0.01,,1\n0.02,50,1\n"))
    assert np.isnan(hand.speed_mm_s[5])
    assert hand.speed_mm_s[20] == 50.0


def test_a_simulated_hand_is_what_its_seed_says_and_within_the_thresholds():
    hand = simulated_hand(3.0, 4)
    assert hand == simulated_hand(3.0, 4)
    assert hand != simulated_hand(3.0, 5)
    speed, force = np.array(hand.speed_mm_s), np.array(hand.force_N)
    moving = speed > 0
    assert len(hand) == 3000
    assert moving.mean() > 0.5
    assert ((speed[moving] > 10) & (speed[moving] <= 300)).all()
    assert ((force[moving] > 0.15) & (force[moving] <= 3.6)).all()
    assert not force[~moving].any()
    with pytest.raises(RenderError, match=r"1 to 3600"):
        simulated_hand(0.0, 1)


def test_pushed_reports_give_what_the_stylus_would():
    clock = [0.0]
    hand, stylus, waiting = Pushed(lambda: clock[0]), Stylus(Shape()), strokes()
    for report in strokes():
        hand.push(report)
    for n in range(900):
        clock[0] = n / 1000 + 1e-6
        while waiting and waiting[0].t_s <= n / 1000:
            stylus.report(waiting.pop(0))
        assert hand.at(n) == stylus.step(n / 1000)
    clock[0] += 1e-4
    assert hand.at(900) == hand.felt  # asked twice within a millisecond


def test_pushed_reports_after_a_pause_cost_no_second_of_steps():
    clock = [0.0]
    hand = Pushed(lambda: clock[0])
    hand.at(0)
    clock[0] = 3600.0
    assert hand.at(1) == (0.0, 0.0)
    for n in range(100):
        clock[0] = 3600 + n / 100
        hand.push(Report(clock[0], float(n), 0.0, 0.5, True))
        hand.at(n)
    assert hand.felt[0] == pytest.approx(100.0, rel=0.05)


def test_reports_that_cannot_be_do_not_reach_the_voice():
    clock = [0.0]
    hand = Pushed(lambda: clock[0])
    for n, x in enumerate([0.0, 1.0, float("nan"), 3.0, 1e300]):
        clock[0] = n / 100
        hand.push(Report(clock[0], x, 0.0, 0.5, True))
        felt = hand.at(n)
    assert np.isfinite(felt).all()
    assert felt[0] <= 300.0
    assert hand.refused.refused["not_a_number"] == 1


def test_a_tablet_is_read_and_its_newest_taken():
    class Tablet:
        felt = (0.0, 0.0)

        def read(self, timeout_s):
            assert timeout_s == 0.0
            self.felt = (42.0, 1.0)

    assert OnTablet(Tablet()).at(7) == (42.0, 1.0)


def test_a_script_of_two_lengths_is_refused():
    with pytest.raises(RenderError, match=r"2 speeds and 1 forces"):
        Scripted([1.0, 2.0], [1.0])
