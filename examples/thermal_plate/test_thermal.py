"""The plate without a plate: bytes on the line, the twin's warmth, the limits of the driver, and its contract."""

from math import exp, log, nan
from pathlib import Path
from types import SimpleNamespace

import pytest
from thermal.line import LENGTH, FrameError, frame, parse
from thermal.plate import KIND, Settings, make
from thermal.twin import LAG_S, SILENCE_S, Plant, TwinPort

from palpate.devices.contract import check_device
from palpate.devices.device import DeviceError, DeviceFault
from palpate.protocols.events import Aside, Fault, Part, Present, Reply
from palpate.protocols.study import Stimulus
from palpate.protocols.trial import Trial

DESK = SimpleNamespace(poll=lambda: None, demand=lambda _p: None, answer=lambda: True, tell=lambda _s: None)


class Clock:
    """A clock that a window moves by 10 ms a frame; `asides` come before the frame of that number."""

    def __init__(self, frame_s=0.01, asides=()):
        self.s, self.frame_s, self.asides, self.frames = 0.0, frame_s, dict(asides), 0

    def ns(self):
        return round(self.s * 1e9)

    def wait_for(self, _key, _desk, ready):
        while not ready():
            self.frames += 1
            assert self.s < 200, "it never ends"
            if aside := self.asides.pop(self.frames, None):
                if isinstance(aside, BaseException):
                    raise aside
                return Aside(aside)
            self.s += self.frame_s
        return None


def bench(clock=None, **settings):
    clock = clock or Clock()
    plate = make("plate", Settings(kind="thermal.plate", driver="twin", noise_degC=0, **settings), Path())
    plate.elapsed_s = lambda: clock.s
    plate.open()
    return plate, clock


def stimulus(target="40", **columns):
    return Stimulus(id="palm", columns={"target_degc": target, "seconds": "2", **columns})


def present(one=None, **part):
    trial = Trial(1, "main", False, one or stimulus(), None, False, False)
    return Present(trial, part=Part(1, 1, seconds=2.0, **part))


def target_of(plate):
    plate.port.pass_time()
    return plate.port.plant.target_degC


# --- the line ---


def test_frames_are_those_of_the_table_byte_for_byte():
    """CRC-16/XMODEM of 123456789 is 0x31C3 (catalogue of parametrised CRC algorithms, CRC-16/XMODEM)."""
    from binascii import crc_hqx

    assert crc_hqx(b"123456789", 0) == 0x31C3
    body = bytes([0xA5, ord("T"), 0x01, 0x90])  # 40.0 degC
    assert frame("T", 400) == body + crc_hqx(body, 0).to_bytes(2, "big") and len(frame("M")) == LENGTH
    assert parse(frame("M", -123)) == ("M", -123)


def test_every_damaged_bit_is_found():
    whole = frame("M", 3217)
    for bit in range(8 * LENGTH):
        data = bytearray(whole)
        data[bit // 8] ^= 1 << bit % 8
        with pytest.raises(FrameError, match="wrong checksum"):
            parse(bytes(data))


@pytest.mark.parametrize("length", range(LENGTH))
def test_half_a_frame_is_no_frame(length):
    with pytest.raises(FrameError, match=f"{length} of 6 bytes"):
        parse(frame("M", 3217)[:length])


class BadLine:
    """A line that damages the next so many answers of a twin."""

    def __init__(self, port, damage, times):
        self.port, self.damage, self.times, self.sent = port, damage, times, []

    def __getattr__(self, name):
        return getattr(self.port, name)

    def write(self, data):
        self.sent.append(data)
        return self.port.write(data)

    def read(self, size):
        data = self.port.read(size)
        if self.times > 0:
            self.times -= 1
            return self.damage(data)
        return data


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda data: data[:-1] + bytes([data[-1] ^ 1]), "wrong checksum"),
        (lambda data: data[:3], "3 of 6 bytes"),
        (lambda _data: b"", "0 of 6 bytes"),
        (lambda _data: frame("R", 1), "answers S 0 with R 1"),
    ],
)
def test_a_bad_answer_is_asked_for_again_and_a_line_that_stays_bad_is_a_fault(damage, message):
    plate, _ = bench()
    plate.port = BadLine(plate.port, damage, 2)
    assert plate.measure() == 32.0 and plate.port.sent.count(frame("S")) == 3
    plate.port.times = 99
    with pytest.raises(DeviceFault, match=message) as fault:
        plate.measure()
    assert fault.value.what == "silent"


def test_a_damaged_request_changes_nothing_at_the_plate():
    port = TwinPort(lambda: 0.0)
    port.write(frame("T", 400)[:-1] + b"\x00")
    assert port.plant.target_degC == 32.0 and port.read(LENGTH) == b""
    port.write(frame("T", 501))
    assert parse(port.read(LENGTH))[0] == "E" and port.plant.target_degC == 32.0


def test_a_port_that_is_not_there_is_named():
    plate = make("plate", Settings(kind="thermal.plate", driver="serial", port="/dev/no_such_port"), Path())
    with pytest.raises(DeviceError, match="plate: .*(no_such_port cannot be opened|serial)"):
        plate.open()
    with pytest.raises(ValueError, match="needs a port"):
        Settings(kind="thermal.plate", driver="serial")


# --- the twin ---


@pytest.mark.parametrize("steps", [1, 7, 400])
def test_the_twin_follows_the_closed_form_of_a_ramp_behind_a_lag(steps):
    """T' = (u - T) / lag with a ramp u: T = T0 + r (t - lag (1 - exp(-t / lag))); then an exponential to the target."""
    rate, seconds, ramped = 8.0, 1.5, 1.0
    plant = Plant(32, 32, 40, rate)
    for _ in range(steps):
        plant.advance(seconds / steps)
    at_end = 32 + rate * (ramped - LAG_S * (1 - exp(-ramped / LAG_S)))
    expected = 40 + (at_end - 40) * exp(-(seconds - ramped) / LAG_S)
    assert plant.degC == pytest.approx(expected, abs=1e-9)


def test_simulated_people_feel_what_the_skin_meets_which_a_short_stimulus_does_not_reach():
    plate, clock = bench()
    felt = plate.feels(stimulus(seconds="0.5"), 2.0)["target_degc"]
    # At 0.5 s the surface is d = r lag (1 - exp(-2)) behind its element, at 36 degC, and rises until the element has
    # come down to it: (d + r lag) exp(-t / lag) - r lag = 0.
    down_s = -LAG_S * log(8 * LAG_S / (8 * LAG_S + 8 * LAG_S * (1 - exp(-2))))
    assert felt == pytest.approx(36 - 8 * down_s, abs=1e-3)
    assert plate.feels(stimulus(), 2.0)["target_degc"] == pytest.approx(40, abs=0.1)
    reply = plate.perform(present(stimulus(seconds="0.5")), clock, DESK, clock.ns)
    assert reply.value["plate"]["highest_degc"] == pytest.approx(felt, abs=0.35)  # its end is noticed up to 0.05 s late


# --- what is presented ---


def test_a_presentation_is_a_ramp_from_neutral_and_its_temperature_is_in_the_reply():
    plate, clock = bench()
    reply = plate.perform(present(), clock, DESK, clock.ns)
    assert isinstance(reply, Reply) and reply.value["by"] == "twin"
    felt = reply.value["plate"]
    assert felt["target_degc"] == 40.0 and felt["highest_degc"] == pytest.approx(40, abs=0.15)
    [samples] = reply.samples
    assert samples.units == ("s", "degC") and samples.rate_hz == 0 and samples.count >= 2 / 0.06
    assert target_of(plate) == 32.0


def test_a_blank_interval_lasts_as_long_and_stays_neutral():
    plate, clock = bench()
    warm = plate.perform(present(), clock, DESK, clock.ns)
    clock.s += 5
    blank = plate.perform(present(blank=True), clock, DESK, clock.ns)
    assert blank.value["plate"]["highest_degc"] < 32.1 and blank.value["plate"]["blank"]
    assert blank.value["seconds"] == pytest.approx(warm.value["seconds"], abs=0.06)


def test_a_pause_sets_it_to_neutral_and_afterwards_the_stimulus_comes_again():
    plate, clock = bench(Clock(asides={60: {"do": "pause"}, 400: {"do": "go_on"}}))
    request = present()
    assert plate.perform(request, clock, DESK, clock.ns).value == {"do": "pause"}
    assert target_of(plate) == 32.0
    assert plate.perform(request, clock, DESK, clock.ns).value == {"do": "go_on"}
    reply = plate.perform(request, clock, DESK, clock.ns)
    assert reply.value["plate"]["highest_degc"] == pytest.approx(40, abs=0.15)


# --- attempts to get past the limits ---


@pytest.mark.parametrize(
    ("columns", "column"),
    [
        ({"target": "45.1"}, "target_degc"),
        ({"target": "9.9"}, "target_degc"),
        ({"target": "nan"}, "target_degc"),
        ({"target": "warm"}, "target_degc"),
        ({"target": ""}, "target_degc"),
        ({"ramp_degc_s": "20.1"}, "ramp_degc_s"),
        ({"ramp_degc_s": "0"}, "ramp_degc_s"),
        ({"seconds": "2.1"}, "seconds"),
        ({"seconds": "inf"}, "seconds"),
        ({"seconds": "-1"}, "seconds"),
    ],
)
def test_a_stimulus_beyond_a_limit_is_refused_before_anything_is_sent(columns, column):
    plate, clock = bench()
    with pytest.raises(DeviceError, match=rf"plate: stimulus 'palm': {column} is .* is allowed") as refused:
        plate.check(stimulus(**columns), 2.0)
    assert refused.value.column == column
    plate.port = BadLine(plate.port, None, 0)
    fault = plate.perform(present(stimulus(**columns)), clock, DESK, clock.ns)
    assert isinstance(fault, Fault) and fault.value["what"] == "refused"
    assert {parse(data) for data in plate.port.sent} == {("R", 200), ("T", 320)}


@pytest.mark.parametrize("degC", [45.1, 9.9, nan, float("inf"), -1e9])
def test_the_driver_called_directly_sends_no_target_beyond_a_limit(degC):
    plate, _ = bench()
    plate.warm(40, 8)
    plate.port = BadLine(plate.port, None, 0)
    with pytest.raises(DeviceFault, match="is allowed") as fault:
        plate.warm(degC, 8)
    assert fault.value.what == "limit" and plate.port.sent == [frame("R", 200), frame("T", 320)]
    with pytest.raises(DeviceFault, match="degC/s"):
        plate.warm(40, nan)


@pytest.mark.parametrize("limits", [{"highest_degC": 50.1}, {"lowest_degC": -0.1}, {"hot_s": 11}, {"ramp_degC_s": 51}])
def test_a_rig_file_cannot_widen_the_limits_of_the_code(limits):
    with pytest.raises(ValueError, match="less than or equal|greater than or equal"):
        Settings(kind="thermal.plate", driver="twin", limits=limits)


def test_heat_is_cut_off_after_its_time_also_if_the_target_is_sent_again_and_again():
    plate, clock = bench(limits={"highest_degC": 50, "hot_s": 3})
    began, hottest = None, 0.0
    with pytest.raises(DeviceFault, match="at most limits.hot_s = 3") as fault:
        for _ in range(1000):
            plate.warm(48, 20)
            clock.s += 0.1
            plate.measure()
            began = clock.s if began is None else began
            hottest = max(hottest, plate.degC)
    assert fault.value.what == "limit" and hottest == pytest.approx(48, abs=0.2)
    assert clock.s - began <= 3.2 and target_of(plate) == 32.0
    with pytest.raises(DeviceFault, match="limits.hot_s"):  # a short pause is no cooling
        clock.s += 0.2
        plate.warm(48, 20)
        for _ in range(10):
            clock.s += 0.1
            plate.measure()
    with pytest.raises(DeviceError, match=r"seconds is '3.5'; 0.05 to 3 is allowed"):
        plate.check(stimulus("46", seconds="3.5"), 4.0)


def test_heat_is_cut_off_where_nobody_measures():
    plate, clock = bench(limits={"highest_degC": 50, "hot_s": 3})
    with pytest.raises(DeviceFault, match="limits.hot_s"):
        for _ in range(100):
            plate.warm(48, 20)
            clock.s += 0.5
    assert clock.s < 4.1 and target_of(plate) == 32.0


def test_a_driver_that_hangs_is_cut_off_by_the_plate_after_a_second():
    plate, clock = bench()
    plate.warm(42, 20)
    clock.s += 10
    assert target_of(plate) == 32.0 and plate.port.plant.degC == pytest.approx(32, abs=0.01)
    with pytest.raises(DeviceFault, match="heard nothing for 1 s") as fault:
        plate.measure()
    assert fault.value.what == "heartbeat_lost"


def test_a_window_that_stands_still_makes_the_trial_a_fault_and_then_it_goes_on():
    plate, clock = bench()
    clock.frame_s = SILENCE_S + 0.2
    fault = plate.perform(present(), clock, DESK, clock.ns)
    assert fault.value["what"] == "heartbeat_lost" and target_of(plate) == 32.0
    clock.frame_s = 0.01
    assert isinstance(plate.perform(present(), clock, DESK, clock.ns), Reply)


def test_safe_is_fast_after_a_slow_ramp_and_may_be_called_twice():
    plate, clock = bench()
    plate.warm(34, 0.1)
    clock.s += 0.9
    plate.warm(40, 20)
    clock.s += 0.9
    plate.warm(41, 0.1)
    plate.safe()
    plate.safe()
    clock.s += 2
    plate.port.pass_time()
    assert plate.port.plant.degC == pytest.approx(32, abs=0.05)


def test_safe_sends_the_neutral_level_also_if_the_ramp_is_not_understood():
    plate, _ = bench()
    plate.warm(40, 8)
    plate.port = BadLine(plate.port, lambda _data: b"", 3)
    plate.safe()
    assert target_of(plate) == 32.0 and plate.port.sent[-1] == frame("T", 320)


def test_an_exception_of_the_session_sets_it_to_neutral():
    plate, clock = bench(Clock(asides={80: KeyboardInterrupt()}))
    with pytest.raises(KeyboardInterrupt):
        plate.perform(present(), clock, DESK, clock.ns)
    assert plate.port.plant.degC > 35 and target_of(plate) == 32.0


def test_a_plate_that_is_unplugged_is_a_fault_and_is_opened_again_once_somebody_has_confirmed():
    plate, clock = bench()
    KIND.unplug(plate)
    fault = plate.perform(present(), clock, DESK, clock.ns)
    assert fault.value["what"] == "link_lost" and plate.port is None
    plate.safe()
    plate.safe()
    assert isinstance(plate.perform(present(), clock, DESK, clock.ns), Reply)


@pytest.mark.parametrize(
    ("broken", "what"),
    [
        (lambda port: setattr(port, "status", 1), "firmware"),
        (lambda port: setattr(port.plant, "degC", 60.0), "limit"),
    ],
)
def test_a_broken_plate_is_named(broken, what):
    plate, clock = bench()
    broken(plate.port)
    event = plate.perform(present(), clock, DESK, clock.ns)
    assert event.value["what"] == what


def test_a_plate_that_never_comes_to_rest_is_stuck():
    plate, clock = bench()
    plate.port.plant.advance = lambda _seconds: setattr(plate.port.plant, "degC", 36.0)
    event = plate.perform(present(), clock, DESK, clock.ns)
    assert event.value["what"] == "stuck" and clock.s == pytest.approx(60, abs=0.2)


def test_it_keeps_the_contract_of_devices():
    verdicts = check_device("thermal.plate", KIND)
    assert len(verdicts) >= 9 and [str(one) for one in verdicts if not one.ok] == []
