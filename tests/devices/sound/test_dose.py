"""The daily dose of noise, and noise that ends by itself: at the dose, and where the session hangs."""

import numpy as np
import pytest

from palpate.devices.device import DeviceError, DeviceFault
from palpate.devices.fed_desk import FedDesk
from palpate.devices.sound.device import FEED_S, MaskingNoise, Settings
from palpate.devices.sound.dose import seconds_left, share_of_day
from palpate.devices.sound.output import Tape

RATE = 8000


class Room:
    def __init__(self, **changes):
        self.s, self.played = 0.0, []
        self.out = Tape(RATE, lambda: self.s, self.played.append)
        given = {"kind": "masking_noise", "driver": "twin", "rate_hz": RATE, "db_spl_at_0_dbfs": 100, **changes}
        self.noise = MaskingNoise("noise", Settings(**given), self.out)
        self.noise.open()

    def passes(self, seconds, feed=True):
        """RMS of what sounds in the last tenth of a second."""
        for _ in range(round(seconds / 0.1)):
            self.s += 0.1
            if feed:
                self.noise.feed()
            self.out.advance()
        return float(np.sqrt(np.mean(self.played[-1] ** 2)))


def test_the_dose_is_8_h_at_80_db_a_and_three_db_halve_the_time():
    """ITU-T H.870: 80 dB(A) for 40 h a week; 1.6 Pa^2 h a week."""
    assert share_of_day(80, 8 * 3600) == pytest.approx(1)
    assert share_of_day(80 + 10 * np.log10(2), 4 * 3600) == pytest.approx(1)
    assert share_of_day(70, 8 * 3600) == pytest.approx(0.1) and share_of_day(70, -1) == 0
    assert seconds_left(77, 0.5) == pytest.approx(4 * 3600 * 10**0.3) and seconds_left(60, 1.2) == 0
    pascal2_hours = 5 * 8 * (20e-6 * 10 ** (80 / 20)) ** 2
    assert pascal2_hours == pytest.approx(1.6)


def test_the_noise_ends_when_the_dose_of_the_day_is_had_and_stays_off():
    room = Room()
    left = 5.0
    room.noise.limit_dose(1 - share_of_day(room.noise.settings.db_a, left), None)
    room.noise.start()
    assert room.passes(4.5) > 0.005
    assert room.passes(1.0) == 0.0
    with pytest.raises(DeviceFault, match=r"today's dose of noise \(80 dB\(A\) for 8 h .* end the session") as ended:
        room.noise.check()
    assert ended.value.what == "limit"
    room.noise.start()
    assert room.passes(1.0) == 0.0
    room.noise.close()
    room.noise.open()
    room.noise.start()
    assert room.passes(1.0) == 0.0, "opening it again gives no new dose"


@pytest.mark.parametrize(("share", "minutes", "refused"), [(0.0, 30, False), (1.0, None, True), (0.999, 600, True)])
def test_a_session_that_would_go_beyond_the_dose_is_refused(share, minutes, refused):
    room = Room()
    if not refused:
        room.noise.limit_dose(share, minutes)
        assert room.noise.describe()["limits"]["share_before"] == share
        return
    with pytest.raises(DeviceError, match=r"has had 100 % of today's dose of noise.*wait until tomorrow"):
        room.noise.limit_dose(share, minutes)


def test_a_session_that_hangs_has_no_noise_after_ten_seconds_and_may_go_on():
    room = Room()
    room.noise.start()
    assert room.passes(30) > 0.005
    assert room.passes(FEED_S - 0.2, feed=False) > 0.005
    assert room.passes(1.0, feed=False) == 0.0
    with pytest.raises(DeviceFault, match="the session was not heard of for 10 s") as hung:
        room.noise.check()
    assert hung.value.what == "heartbeat_lost"
    room.noise.start()
    assert room.passes(1.0) > 0.005
    room.noise.check()


def test_a_level_that_no_rig_file_allows_is_not_played_however_it_was_set():
    for changes in ({"level_dbfs": 0.0}, {"level_dbfs": float("nan")}, {"level_db_spl": 110.0, "level_dbfs": -20}):
        room = Room()
        room.noise.close()
        room.noise.settings = room.noise.settings.model_copy(update=changes)
        with pytest.raises(DeviceError, match="lower the level in the rig file"):
            room.noise.open()
    room = Room(db_spl_at_0_dbfs=None)
    room.noise.close()
    room.noise.settings = room.noise.settings.model_copy(update={"level_dbfs": -29.0})
    with pytest.raises(DeviceError, match="at most -30 dBFS"):
        room.noise.open()


def test_whoever_polls_the_desk_feeds_the_devices():
    fed, shown = [], []

    class Desk:
        def poll(self):
            return "aside"

        def demand(self, prompt):
            shown.append(prompt)

        def answer(self):
            return True

        def tell(self, state):
            shown.append(state)

    desk = FedDesk(Desk(), lambda: fed.append(1))
    desk.demand(None)
    desk.tell({"a": 1})
    assert (desk.poll(), desk.answer(), fed, shown) == ("aside", True, [1], [None, {"a": 1}])
