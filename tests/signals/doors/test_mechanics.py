"""The door model: each term does what its name says, extremes stay finite, and a real door is within its reach."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.devices.door.recording import read_columns
from palpate.devices.door.stimuli import DOORS_FILE, MEASURED_FILE, find_door, read_catalogue
from palpate.signals.doors.features import landmarks, plateau_after_second_peak
from palpate.signals.doors.grid import POINTS, DoorDataError
from palpate.signals.doors.mechanics import (
    CHECK_RANGES,
    RANGES,
    CheckFeature,
    Door,
    check_torque,
    friction_torque,
    gravity_torque,
    hand_force,
    inertia_torque,
    seal_torque,
    simulate,
    stop_force,
)
from tests.examples import examples

K8 = read_catalogue()["K8"].door
FINE_DEG = np.linspace(0, 62, 62_001)


def numbers(ranges: dict[str, tuple[float, float]]) -> dict[str, st.SearchStrategy[float]]:
    return {name: st.floats(*limits) | st.sampled_from(limits) for name, limits in ranges.items()}


any_feature = st.builds(CheckFeature, **numbers(CHECK_RANGES))
any_door = st.builds(Door, **numbers(RANGES), check=st.lists(any_feature, max_size=6).map(tuple))


@pytest.mark.long
@given(any_door)
@settings(max_examples=examples(150), deadline=None)
def test_every_door_within_the_ranges_is_finite_and_bounded(door) -> None:
    force_N = simulate(door)
    assert force_N.shape == (POINTS,)
    assert np.isfinite(force_N).all()
    peak_energy = sum(
        abs(feature.energy_J) / np.radians(min(feature.width_before_deg, feature.width_after_deg))
        for feature in door.check
    )
    weight = door.mass_kg * 9.81 * door.centre_of_mass_m * np.sin(np.radians(door.hinge_tilt_deg))
    friction = max(door.coulomb_Nm, door.breakaway_Nm) + door.viscous_Nm_s_rad * np.pi + door.ripple_Nm
    inertia = door.mass_kg * (door.gyration_radius_m * np.radians(door.speed_deg_s)) ** 2 / np.radians(door.start_deg)
    bound = (peak_energy + weight + friction + inertia + door.seal_Nm) / door.handle_radius_m + door.pull_limit_N
    assert np.abs(force_N).max() <= bound * (1 + 1e-9)


@pytest.mark.parametrize("stiffness", [1e2, 1e4, 1e6, 1e8])
def test_a_stiff_end_stop_stays_below_the_pull_limit_and_rises_steadily(stiffness) -> None:
    door = replace(K8, stop_at_deg=50, stop_stiffness_Nm_rad=stiffness, pull_limit_N=80, opens_to_deg=90)
    force_N = stop_force(door, FINE_DEG)
    assert np.isfinite(force_N).all()
    assert (np.diff(force_N) >= 0).all()
    assert 0 <= force_N[0] < 1e-3
    assert force_N.max() <= 80


def test_the_stop_far_past_its_onset_is_a_spring_where_the_hand_is_strong() -> None:
    door = replace(K8, stop_at_deg=30, stop_stiffness_Nm_rad=100, stop_onset_deg=0.01, pull_limit_N=500)
    pressed_N = 100 * np.radians(1.0) / door.handle_radius_m
    assert stop_force(door, np.array([31.0]))[0] == pytest.approx(pressed_N, rel=5e-3)


def test_a_bare_door_without_friction_detents_or_tilt_needs_no_force_after_the_start() -> None:
    bare = replace(K8, coulomb_Nm=0, breakaway_Nm=0, viscous_Nm_s_rad=0, ripple_Nm=0, seal_Nm=0, hinge_tilt_deg=0)
    bare = replace(bare, check=(), stop_at_deg=90, stop_onset_deg=0.01)
    force_N = simulate(bare)
    assert force_N[int(bare.start_deg * 10) + 1 :] == pytest.approx(0, abs=1e-12)
    assert force_N[: int(bare.start_deg * 10)].max() > 1


def test_the_inertia_torque_does_the_work_of_the_kinetic_energy() -> None:
    work_J = np.trapezoid(inertia_torque(K8, FINE_DEG), np.radians(FINE_DEG))
    energy_J = 0.5 * K8.mass_kg * K8.gyration_radius_m**2 * np.radians(K8.speed_deg_s) ** 2
    assert work_J == pytest.approx(energy_J, rel=1e-6)


def test_the_check_link_gives_back_what_it_takes() -> None:
    crest = (CheckFeature(30, 1.5, 4.0, 2.0),)
    torque = check_torque(crest, FINE_DEG)
    middle = FINE_DEG <= 30
    assert np.trapezoid(torque[middle], np.radians(FINE_DEG[middle])) == pytest.approx(1.5, rel=1e-5)
    assert np.trapezoid(torque, np.radians(FINE_DEG)) == pytest.approx(0, abs=1e-6)


def test_a_detent_pulls_towards_its_angle() -> None:
    torque = check_torque((CheckFeature(30, -1.0, 2.0, 2.0),), np.array([28.0, 30.0, 32.0]))
    assert torque[0] < 0 == torque[1] < torque[2]


def test_gravity_resists_on_one_side_of_the_lowest_angle_only() -> None:
    door = replace(K8, hinge_tilt_deg=2, lowest_at_deg=20)
    before, lowest, after = gravity_torque(door, np.array([10.0, 20.0, 30.0]))
    assert before < 0 == lowest < after
    quarter = gravity_torque(door, np.array([110.0]))[0]
    assert quarter == pytest.approx(door.mass_kg * 9.80665 * door.centre_of_mass_m * np.sin(np.radians(2)))


def test_friction_falls_from_breakaway_to_coulomb_and_damping() -> None:
    friction = friction_torque(K8, FINE_DEG)
    assert friction[0] == K8.breakaway_Nm
    assert friction[-1] == pytest.approx(K8.coulomb_Nm + K8.viscous_Nm_s_rad * np.radians(K8.speed_deg_s), abs=0.02)


def test_the_seal_helps_and_is_gone_after_a_few_degrees() -> None:
    seal = seal_torque(K8, FINE_DEG)
    assert seal[0] == -K8.seal_Nm
    assert abs(seal[30_000]) < 1e-3


def test_a_door_that_opens_less_is_padded_and_the_reading_starts_at_zero() -> None:
    force_N = simulate(replace(K8, opens_to_deg=40.05))
    assert force_N[0] == pytest.approx(0, abs=1e-12)
    assert force_N[400] != 0
    assert not force_N[401:].any()


@pytest.mark.parametrize("name", [field.name for field in fields(Door) if field.name != "check"])
def test_each_parameter_outside_its_range_is_refused_by_name(name) -> None:
    low, high = RANGES[name]
    for value in (low - 1e6, high + 1e6, float("nan"), float("inf")):
        with pytest.raises(DoorDataError, match=f"K8: {name} is .* expected a number from"):
            simulate(replace(K8, **{name: value}), "K8")


def test_a_check_feature_outside_its_range_is_refused_with_its_number() -> None:
    bad = replace(K8, check=(*K8.check, CheckFeature(30, 1, 0.0, 2)))
    with pytest.raises(DoorDataError, match=r"door, check feature 5: width_before_deg is 0\.0"):
        simulate(bad)


@pytest.mark.parametrize("label", ["FORD", "G90", "K3", "K8", "MQ4"])
def test_the_five_doors_have_three_cycles_a_plateau_and_forces_like_the_measured_one(label) -> None:
    force_N = simulate(read_catalogue()[label].door, label)
    assert len(landmarks(force_N).peaks) == 3
    plateau_after_second_peak(force_N, label)
    assert -17 <= force_N.min() <= force_N.max() <= 45


def test_the_model_fitted_to_the_measured_door_is_within_0_7_newton_rms() -> None:
    fit = read_catalogue(DOORS_FILE.with_name("measured_fit.yaml"))["MEASURED_FIT"].door
    measured = read_columns(MEASURED_FILE, ("angle_deg", "force_N"))
    angle, force = np.array(measured["angle_deg"]), np.array(measured["force_N"])
    error = (hand_force(fit, angle) - force)[angle <= 62]
    assert np.sqrt(np.mean(error**2)) < 0.7
    assert np.abs(error).max() < 2.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("mass_kg: 36", "mass_lb: 36"), "FORD: unknown parameter mass_lb"),
        (("    mass_kg: 36\n", ""), "FORD: missing parameter mass_kg"),
        (("mass_kg: 36", "mass_kg: 3600"), "FORD: mass_kg is 3600, expected a number from 5 to 80"),
        (("mass_kg: 36", "mass_kg: heavy"), "FORD: mass_kg is 'heavy'"),
        (("[18.6, 2.0, 4.2, 4.2]", "[18.6, 2.0]"), "FORD: 'check' is a list of rows"),
        (("character: heavy", "kind: heavy"), "FORD: 'character' is missing"),
        (("doors:", "cars:"), "a mapping 'doors'"),
        (("doors:", "doors: ["), "not a YAML text file"),
    ],
)
def test_a_catalogue_with_a_mistake_is_refused_with_file_door_and_parameter(tmp_path, change, message) -> None:
    text = DOORS_FILE.read_text(encoding="utf-8")
    assert change[0] in text
    path = tmp_path / "own.yaml"
    path.write_text(text.replace(*change, 1), encoding="utf-8")
    with pytest.raises(DoorDataError, match=message) as refusal:
        read_catalogue(path)
    assert str(path) in str(refusal.value)


def test_an_unknown_door_is_answered_with_the_labels_there_are() -> None:
    with pytest.raises(DoorDataError, match=r"no simulated door 'BC3'; there are: FORD, G90, K3, K8, MQ4"):
        find_door(read_catalogue(), "BC3")
