"""The arm between friction, brake and stops: bounded, passive, and where a converged solution has it."""

import math
from dataclasses import replace

import pytest

from benchmarks.plant.explicit import FIXED, solve_fixed
from benchmarks.plant.passivity import Throw, by_default, by_stepper, excess, grid
from benchmarks.plant.problems import largest_difference_rad, problems, solve, sticking
from benchmarks.plant.reference import solve_adaptive
from palpate.devices.door.plant import dynamics as dynamics_module
from palpate.devices.door.plant.dynamics import Dynamics
from palpate.devices.door.plant.hand import NOBODY, Hand, impedance, push
from palpate.devices.door.plant.parameters import Arm, Brake, Detent, Parameters, PlantError

FREE = Parameters(arm=Arm(viscous_Nm_s_rad=0.0, coulomb_Nm=0.0), brake=Brake(drag_Nm=0.0))


def free_arm(**arm):
    return replace(FREE, arm=replace(FREE.arm, **arm))


def test_no_stop_of_the_range_returns_more_than_it_took():
    rises = {throw: excess(throw, by_default(throw)) for throw in grid()}
    assert max(rises.values()) < 1e-9
    for throw in rises:
        if throw.damping == 0.0:
            continue
        arm = Dynamics(throw.parameters, throw.start_rad, throw.speed_rad_s)
        for tick in range(100):
            arm.advance(0.0, throw.brake_A(tick), push(throw.push_Nm))
        assert arm.ledger.stop_returned_J <= arm.ledger.stop_taken_J * (1 + 1e-9)


def test_explicit_methods_diverge_on_the_stop_that_the_default_holds():
    throw = Throw(1e8, 0.01, 0.2)
    assert excess(throw, by_default(throw)) < 1e-9
    for name in ("explicit Euler", "semi-implicit Euler", "RK4"):
        assert excess(throw, by_stepper(throw, FIXED[name])) > 1e3


@pytest.mark.parametrize("stiffness", [1e2, 1e5, 1e8])
@pytest.mark.parametrize("speed", [1e-4, 3.0])
def test_a_stop_without_damper_gives_back_all_and_no_more(stiffness, speed):
    """An elastic impact returns the speed with its sign turned, whatever the stiffness."""
    arm = Dynamics(free_arm(stop_stiffness_Nm_rad=stiffness, stop_damping=0.0), FREE.arm.high_stop_rad - 1e-9, speed)
    for _ in range(1000):
        arm.advance(0.0, 0.0, NOBODY)
        if arm.w < 0 and not arm.side:
            break
    assert arm.w == pytest.approx(-speed, rel=1e-12)
    assert arm.ledger.stop_returned_J == pytest.approx(arm.ledger.stop_taken_J, rel=1e-11)


@pytest.mark.parametrize("damping", [0.05, 0.2, 0.7])
def test_a_damped_stop_rebounds_as_the_closed_form_says(damping):
    """Kelvin and Voigt's stop that only pushes: exp(-z phi / sqrt(1 - z^2)) of the speed comes back.

    phi is the phase at which the push has fallen to zero: atan2(2 z sqrt(1 - z^2), 2 z^2 - 1).
    """
    root = math.sqrt(1 - damping**2)
    phase = math.atan2(2 * damping * root, 2 * damping**2 - 1)
    arm = Dynamics(free_arm(stop_stiffness_Nm_rad=1e8, stop_damping=damping), 1.15, 0.5)
    for _ in range(50):
        arm.advance(0.0, 0.0, NOBODY)
    assert arm.w == pytest.approx(-0.5 * math.exp(-damping * phase / root), rel=1e-4)


@pytest.mark.parametrize("problem", [problems()[1], sticking()], ids=lambda one: one.name)
def test_at_1_kHz_the_angle_is_where_a_converged_solution_has_it(problem):
    reference = solve_adaptive(problem, "Radau", 1e-10)
    assert largest_difference_rad(solve(problem, 1e-3), reference) < 1e-4


def test_every_method_agrees_where_nothing_is_stiff():
    """Five programs, one equation: at a fine step all come to the same angle, so none has another law of friction."""
    soft = replace(problems()[0], duration_s=0.4)
    reference = solve_adaptive(soft, "LSODA", 1e-9)
    assert largest_difference_rad(solve(soft, 1e-3), reference) < 1e-6
    for name, method in FIXED.items():
        assert largest_difference_rad(solve_fixed(soft, method, 1e-4), reference) < 5e-4, name


def test_energy_is_booked_to_the_last_digit():
    parameters = Parameters(arm=Arm(stop_stiffness_Nm_rad=1e6))
    arm = Dynamics(parameters, 0.2, 1.0)
    hand = Hand(lambda t: (0.6 + 0.7 * math.sin(7 * t), 4.9 * math.cos(7 * t)), 150.0, 2.0)
    for tick in range(3000):
        arm.advance(5 * math.sin(tick / 90), 0.1 + 0.1 * (tick // 400 % 2), hand, tick * 1e-3)
    kinetic = 0.5 * arm.inertia * arm.w**2 - 0.5 * arm.inertia
    assert arm.ledger.stop_taken_J > 1.0
    assert arm.ledger.kinetic_J() == pytest.approx(kinetic, abs=1e-9 * (arm.ledger.hand_J + arm.ledger.friction_J))


def test_dry_friction_holds_without_creep_and_breaks_away_at_stiction():
    parameters = Parameters(arm=Arm(coulomb_Nm=2.0, stiction=1.5), brake=Brake(drag_Nm=0.0))
    arm = Dynamics(parameters, 0.5)
    for tick in range(20_000):
        arm.advance(0.0, 0.0, push(2.999 * math.sin(tick / 50)), tick * 1e-3)
    assert (arm.angle_rad, arm.w) == (0.5, 0.0)
    arm.advance(0.0, 0.0, push(3.001))
    assert arm.w == pytest.approx(1e-3 * (3.001 - 2.0) / arm.inertia, rel=0.01)


def test_the_brake_lags_and_remembers_where_its_current_came_from():
    parameters = Parameters(brake=Brake(play_A=0.05, lag_s=0.01))
    arm = Dynamics(parameters, 0.5)

    def settled(current):
        for _ in range(300):
            arm.advance(0.0, current, NOBODY)
        return arm.drives.friction(0.0) - arm.drives.dry_Nm

    rising, _, falling = settled(0.5), settled(0.9), settled(0.5)
    assert (rising, falling) == pytest.approx((40 * 0.45, 40 * 0.55), rel=1e-6)
    settled(0.0)
    for _ in range(10):
        arm.advance(0.0, 0.5, NOBODY)
    assert arm.drives.coil_A == pytest.approx(0.5 * (1 - math.exp(-1)), rel=1e-6)


def test_an_arm_falls_into_a_detent_and_its_energy_is_the_detents():
    detent = Detent(angle_rad=0.6, energy_J=-0.5, width_rad=0.05)
    parameters = free_arm(detents=(detent,))
    arm = Dynamics(parameters, 0.68, 0.0)

    def stored_J(angle_rad):
        return detent.energy_J * math.exp(-0.5 * ((angle_rad - detent.angle_rad) / detent.width_rad) ** 2)

    start = stored_J(0.68)
    for _ in range(400):
        arm.advance(0.0, 0.0, NOBODY)
        total = 0.5 * arm.inertia * arm.w**2 + stored_J(arm.angle_rad)
        assert total == pytest.approx(start, abs=1e-5)
    damped = Dynamics(replace(parameters, arm=replace(parameters.arm, viscous_Nm_s_rad=2.0)), 0.68, 0.0)
    for _ in range(5000):
        damped.advance(0.0, 0.0, NOBODY)
    assert damped.angle_rad == pytest.approx(0.6, abs=1e-6)


def test_the_last_resort_ends_every_period_and_adds_no_energy(monkeypatch):
    """With one step allowed for each period nearly all is left to the implicit Euler step."""
    monkeypatch.setattr(dynamics_module, "MOST", 1)
    throw = Throw(1e8, 0.01, 0.2)
    assert excess(throw, by_default(throw)) < 1e-9


def test_a_hand_that_loses_its_grip_does_not_pull():
    gripping = replace(impedance(1.0, 500.0, 1.0), grip_Nm=100.0)
    arm = Dynamics(FREE, 0.0)
    arm.advance(0.0, 0.0, gripping)
    assert (arm.angle_rad, arm.ledger.hand_J) == (0.0, 0.0)


@pytest.mark.long
def test_two_hours_of_plant_time_do_not_drift():
    """A free swing on a spring for 2 h, and an arm held by its brake; at 20 ms a step, which the method allows.

    Two hours at 1 ms would be seven million steps and tell the same: errors here are by the step and by the sum.
    """
    arm, hand = Dynamics(FREE, 0.6), impedance(0.5, 0.25, 0.0)
    for step in range(2 * 3600 * 50):
        arm.advance(0.0, 0.0, hand, step * 0.02, 0.02)
    swing = 0.5 * arm.inertia * arm.w**2 + 0.5 * 0.25 * (arm.angle_rad - 0.5) ** 2
    assert swing == pytest.approx(0.5 * 0.25 * 0.1**2, rel=1e-9)
    assert arm.angle_rad == pytest.approx(0.5 + 0.1 * math.cos(7200.0), abs=1e-4)
    held = Dynamics(Parameters(), 0.5)
    held.advance(0.0, 1.0, NOBODY, 0.0, 0.5)
    for _ in range(2 * 3600 * 10):
        held.advance(0.0, 1.0, push(20.0), 0.0, 0.1)
    assert (held.angle_rad, held.w, held.ledger.kinetic_J()) == (0.5, 0.0, 0.0)


@pytest.mark.parametrize(
    ("name", "value"), [("inertia_kg_m2", 0.0), ("stop_stiffness_Nm_rad", 1e9), ("stiction", math.nan)]
)
def test_a_number_outside_its_range_is_refused_by_name(name, value):
    with pytest.raises(PlantError, match=name):
        Parameters(arm=replace(Arm(), **{name: value}))


@pytest.mark.parametrize(("name", "value"), [("width_rad", 0.0), ("energy_J", math.inf), ("angle_rad", math.nan)])
def test_a_detent_without_a_meaning_is_refused_by_name(name, value):
    with pytest.raises(PlantError, match=name):
        replace(Detent(angle_rad=0.5, energy_J=-0.1, width_rad=0.05), **{name: value})
