"""The door machine under hands: what it renders, what it refuses, and how it stands still."""

import math
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from benchmarks.plant.playback import as_torque, play
from palpate.devices.door.firmware.sensor_check import Limits as FirmwareLimits
from palpate.devices.door.plant.hand import NOBODY, constant_velocity, human, impedance, push
from palpate.devices.door.plant.machine import Machine
from palpate.devices.door.plant.parameters import DEFAULT, Limits, Parameters, PlantError
from palpate.devices.door.plant.rendering import STEP_RAD, Rendered
from palpate.signals.doors.profile_file import read_profile

PROFILES = Path(__file__).parents[4] / "studies" / "door_ratings" / "profiles"
FLAT = [5.0] * 621
END = math.radians(62)


def door(label):
    return as_torque(read_profile(PROFILES / f"{label}_g0.csv"))


def playing(hand, profile=(FLAT, END), parameters=DEFAULT):
    machine = Machine(parameters, hand)
    machine.load(*profile)
    machine.mode = "play"
    return machine


def run(machine, seconds):
    return [machine.step() for _ in range(round(1000 * seconds))]


@pytest.mark.parametrize("label", ["BC3", "FORD", "G90", "K3", "K8", "MQ4"])
def test_a_person_feels_the_door_that_was_loaded(label):
    """The thesis' device reached r 0.96 and 0.25 N m."""
    torque, end_rad = door(label)
    felt = play(torque, end_rad)
    assert felt.r > 0.999
    assert felt.rmse_Nm <= 0.10
    assert max(felt.angle_rad) > 0.95 * end_rad


def test_at_constant_speed_the_door_moves_as_it_is_pulled():
    torque, end_rad = door("K8")
    pulled = play(torque, end_rad, constant_velocity(0.5, end_rad))
    assert pulled.rmse_Nm <= 0.10
    machine = playing(constant_velocity(0.5, end_rad), (torque, end_rad))
    speeds = [machine.dynamics.w for _ in run(machine, 2.0)][800:]
    assert all(0.3 < speed < 0.7 for speed in speeds)


def test_the_padding_of_a_door_that_opens_less_is_never_rendered():
    torque, end_rad = door("MQ4")
    rendered = Rendered(torque, end_rad, DEFAULT.control.end_stiffness_Nm_rad)
    last = torque[round(end_rad / STEP_RAD)]
    assert torque[-1] == 0 < last
    beyond = [rendered.at(end_rad + k * STEP_RAD / 3) for k in range(100)]
    assert beyond == sorted(beyond) and beyond[0] == pytest.approx(last)
    machine = playing(push(last + 15.0), (torque, end_rad))
    run(machine, 3.0)
    assert machine.dynamics.angle_rad == pytest.approx(end_rad + 0.01, abs=1e-3)


@pytest.mark.parametrize("mode", ["off", "hold"])
def test_off_and_hold_keep_the_arm_against_a_hand(mode):
    machine = Machine(hand=impedance(1.0, 25.0, 1.0))
    machine.mode = mode
    run(machine, 0.3)
    before = machine.dynamics.angle_rad
    ticks = run(machine, 2.0)
    assert machine.dynamics.angle_rad == before < 0.02
    assert max(abs(tick.velocity_rad_s) for tick in ticks) < 5e-3
    assert ticks[-1].brake_A == pytest.approx(DEFAULT.brake.current_limit_A)
    assert (max(abs(tick.motor_Nm) for tick in ticks) == 0.0) == (mode == "off")


def test_off_takes_motor_and_arm_to_rest_within_50_ms_of_a_fast_pull():
    machine = playing(constant_velocity(1.0, END, 0.0))
    run(machine, 0.5)
    machine.mode = "off"
    tick = run(machine, 0.05)[-1]
    assert abs(tick.motor_Nm) < 1e-12
    assert tick.brake_A > 0.95 * DEFAULT.brake.current_limit_A


def test_a_second_play_begins_with_the_hand_at_its_start():
    machine = playing(human(END, 1.0, 0.0, stay_s=0.2))
    run(machine, 2.6)
    assert abs(machine.dynamics.angle_rad) < 0.02
    for mode in ("hold", "play"):
        machine.mode = mode
        run(machine, 1.1)
    assert machine.dynamics.angle_rad > 0.9


@pytest.mark.parametrize("torque_Nm", [0.0, 5.0, -15.0, 20.0])
def test_an_arm_that_nobody_steadies_comes_to_rest_where_the_profile_balances(torque_Nm):
    machine = playing(push(torque_Nm), door("BC3"))
    run(machine, 5.0)
    speeds = [abs(machine.dynamics.w) for _ in run(machine, 0.5)]
    assert max(speeds) < 0.1


@pytest.mark.parametrize("damping", [70.0, 100.0, 200.0, 400.0])
def test_a_hand_damped_too_much_for_the_torque_loop_does_not_make_the_motor_buzz(damping):
    """With the whole torque loop the motor would go from limit to limit, 330 times a second and more."""
    torque, end_rad = door("BC3")
    machine = playing(human(end_rad, damping_Nm_s_rad=damping), (torque, end_rad))
    run(machine, 0.2)
    felt, motor, missed = [], [], []
    for _ in range(3000):
        motor.append(machine.step().motor_Nm)
        felt.append(machine.handle_Nm)
        if math.radians(0.05) < machine.dynamics.angle_rad < end_rad:
            missed.append(machine.handle_Nm - machine.rendered.at(machine.dynamics.angle_rad))
    assert max(abs(after - before) for before, after in pairwise(felt)) < 5.0
    assert max(map(abs, motor)) < 45.0
    assert math.sqrt(sum(one**2 for one in missed) / len(missed)) < 0.2


def test_a_door_under_a_pull_keeps_the_whole_torque_loop():
    torque, end_rad = door("FORD")
    machine = playing(human(end_rad), (torque, end_rad))
    run(machine, 3.3)
    assert machine.cascade.share == 1.0


def test_the_integral_does_not_wind_up_while_the_motor_is_at_its_limit():
    """Two seconds beyond what a weak motor can hold, then a door that it can: right again within 0.3 s."""
    weak = replace(DEFAULT, limits=Limits(torque_Nm=8.0))
    machine = playing(impedance(0.5, 100.0, 5.0), ([20.0] * 621, END), weak)
    ticks = run(machine, 2.0)
    assert abs(ticks[-1].motor_Nm) == pytest.approx(8.0, abs=0.01)
    machine.load(FLAT, END)
    machine.hand = impedance(machine.dynamics.angle_rad + 0.05, 100.0, 5.0)
    felt = [machine.handle_Nm for _ in run(machine, 0.3)]
    assert felt[-1] == pytest.approx(5.0, abs=0.6)
    assert max(felt) < 5.5


def test_the_same_seed_gives_the_same_bytes_and_the_clock_is_exact():
    one, other = playing(human(END)), playing(human(END))
    assert run(one, 1.0) == run(other, 1.0)
    assert [tick.t_us for tick in run(one, 2.0)] == list(range(1_001_000, 3_001_000, 1000))


def test_the_encoder_counts_and_the_torque_sensor_is_noisy():
    coarse = replace(DEFAULT, sensors=replace(DEFAULT.sensors, counts_per_turn=3600, torque_noise_Nm=0.1))
    machine = Machine(coarse, push(3.0))
    readings = [tick.torque_Nm for tick in run(machine, 2.0)]
    mean = sum(readings) / len(readings)
    assert mean == pytest.approx(3.0, abs=0.01)
    assert math.sqrt(sum((one - mean) ** 2 for one in readings) / len(readings)) == pytest.approx(0.1, rel=0.1)
    assert {round(one / 0.005, 9) % 1 for one in readings} == {0.0}
    assert abs(machine.sensing.angle_rad - machine.dynamics.angle_rad) < math.tau / 3600


def test_a_held_machine_stands_for_minutes_to_the_last_digit():
    """A minute of every part at 1 kHz, with sensor noise; hours of the plant alone stand in test_integrator."""
    machine = Machine(hand=push(10.0))
    machine.mode = "hold"
    run(machine, 0.5)
    before, motor_Nm = machine.dynamics.angle_rad, machine.step().motor_Nm
    last = run(machine, 60.0)[-1]
    assert machine.dynamics.angle_rad == before
    assert last.motor_Nm == pytest.approx(motor_Nm, abs=0.2)
    assert last.t_us == 60_501_000


@pytest.mark.parametrize(
    ("torque", "end", "message"),
    [(FLAT[:-1], END, "621"), ([*FLAT[:-1], math.nan], END, "620"), (FLAT, 0.0, "end"), (FLAT, 2.0, "end")],
)
def test_what_is_no_profile_is_refused_and_the_old_one_stays(torque, end, message):
    machine = Machine(hand=NOBODY)
    machine.load(FLAT, END)
    before = machine.rendered
    with pytest.raises(PlantError, match=message):
        machine.load(torque, end)
    assert machine.rendered is before


def test_the_machine_needs_neither_numpy_nor_what_measures_it():
    code = "import sys, palpate.devices.door.plant.machine as m; m.Machine().step(); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split()
    assert "palpate.devices.door.plant.machine" in loaded
    assert not {"numpy", "scipy", "palpate.devices.door.plant.measuring"} & set(loaded)


def test_the_machine_asks_for_no_speed_that_its_firmware_would_stop():
    assert DEFAULT.limits.speed_rad_s < math.radians(FirmwareLimits().speed_deg_s)


def test_every_parameter_with_a_unit_has_a_range():
    from dataclasses import fields

    from palpate.devices.door.plant.parameters import RANGES

    ranges = {name for name in RANGES if not name.startswith("detent.")}
    names = {f"{part.name}.{one.name}" for part in fields(Parameters) for one in fields(getattr(DEFAULT, part.name))}
    assert names - ranges == {"arm.detents", "sensors.seed"}
    assert ranges <= names


@pytest.mark.parametrize("pull_Nm", [0.0, 12.0, 30.0])
def test_playing_begins_without_a_jerk_wherever_the_arm_stands(pull_Nm):
    """As after a pause: the arm stands at 30 degrees, and a hand that does not give way pulls at it."""
    machine = playing(constant_velocity(0.4, math.radians(30)), door("BC3"))
    run(machine, 3.0)
    machine.mode, machine.hand = "off", push(pull_Nm)
    run(machine, 0.3)
    machine.mode = "hold"
    run(machine, 0.05)
    machine.mode = "play"
    assert math.degrees(max(abs(tick.velocity_rad_s) for tick in run(machine, 0.3))) < 80
