"""The contact: exact laws at every step, bounded and passive whatever the stiffness, the same in blocks as in a row."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.devices.surfaces.contact import HELD, INTERNAL_HZ, Drive, at_rest, law, ride
from palpate.devices.surfaces.hand import FORCE_N, REACH_MM, SteadyHand, free_hand
from palpate.devices.surfaces.relief import relief
from palpate.devices.surfaces.table import SPANS, read_surfaces
from palpate.devices.surfaces.tool import ground

TABLE = read_surfaces()
STEP = 1 / INTERNAL_HZ


def drive_of(hand, field, steps):
    motion = hand.at(np.arange(steps) * STEP)
    height, right, up = field.at(*motion.place)
    slope, velocity = np.stack([right, up]), motion.velocity / 1000
    return Drive(height, (slope * velocity).sum(axis=0), motion.force, slope, velocity, motion.turn / 1000)


def flat(steps, force=0.0, speed=0.0):
    zero = np.zeros(steps)
    velocity = np.stack([np.full(steps, speed), zero])
    return Drive(zero, zero, np.full(steps, force), np.zeros((2, steps)), velocity, np.zeros((2, steps)))


@pytest.mark.parametrize("name", ["T19", "T38", "T48"])
def test_blocks_side_by_side_are_one_step_after_another(name):
    drive = drive_of(free_hand(60.0, "blocks"), ground(relief(TABLE[name], pixels=392).height_um, 100.0), 12_800)
    rule = law(TABLE[name])
    one, many = (ride(drive, at_rest(drive, rule), rule, blocks) for blocks in (1, 64))
    assert np.abs(one.states - many.states).max(axis=1) == pytest.approx(0, abs=1e-7)
    assert np.abs(one.normal - many.normal).max() < 1e-5 and np.abs(one.friction - many.friction).max() < 1e-4


STIFFNESSES = (SPANS["stiffness_N_mm"].low, 1.0, 100.0, SPANS["stiffness_N_mm"].high)
DAMPINGS = (SPANS["damping_ratio"].low, SPANS["damping_ratio"].high)


@pytest.mark.parametrize(
    ("stiffness", "damping", "body_N_mm"),
    [
        (stiffness, damping, (100.0, 1e6)[(place + strong) % 2])  # every two of the three values meet
        for place, stiffness in enumerate(STIFFNESSES)
        for strong, damping in enumerate(DAMPINGS)
    ],
)
def test_a_tip_that_falls_onto_a_plate_never_gains_energy(stiffness, damping, body_N_mm):
    surface = replace(TABLE["T01"], stiffness_N_mm=stiffness, damping_ratio=damping)
    tool = replace(HELD, body_N_mm=body_N_mm, grip_N_s_m=0.0, body_damping=0.0)
    rule, drive = law(surface, tool), flat(20_000, force=0.5)
    start = np.zeros(7)
    start[0] = 2e-3
    z, v = ride(drive, start, rule, 1).states[:2]
    energy = 0.5 * rule.mass * v**2 + 0.5 * z + 0.5 * rule.stiffness * np.minimum(z, 0) ** 2
    # A bounce that falls between two steps may show a little more; no bounce rises above the fall.
    assert energy.max() <= 0.5 * 2e-3 * 1.02
    assert z.max() <= 2e-3 and energy[-1] < energy[0]


def test_friction_holds_and_slides_by_its_law():
    surface = replace(TABLE["T01"], static_friction=0.6, kinetic_friction=0.4, stribeck_mm_s=5.0)
    rule, drive = law(surface), flat(10_000, force=1.0, speed=0.2)
    slid = ride(drive, at_rest(drive, rule), rule, 1)
    assert slid.friction[0, -1000:] == pytest.approx(-0.4, rel=1e-3) and slid.states[6, -1] == pytest.approx(
        0.2, rel=1e-3
    )
    drive = flat(10_000, force=1.0, speed=1e-4)
    held = ride(drive, at_rest(drive, rule), rule, 1)
    assert (held.states[6, 100:] == 0).all()
    assert np.abs(held.friction[0]).max() <= 0.6 + 1e-9


def test_it_sticks_and_slips_when_slow_and_slides_when_fast():
    surface = replace(TABLE["T39"], static_friction=1.2, kinetic_friction=0.6, stribeck_mm_s=15.0)
    rule = law(surface)
    stuck = []
    for speed in (0.004, 0.2):
        drive = flat(20_000, force=2.0, speed=speed)
        stuck.append((ride(drive, at_rest(drive, rule), rule, 1).states[6, 5000:] == 0).mean())
    assert 0.2 < stuck[0] < 1 and stuck[1] == 0


@pytest.mark.parametrize("extreme", ["low", "high"])
def test_the_extremes_of_the_table_stay_bounded(extreme):
    numbers = {name: getattr(span, extreme) for name, span in SPANS.items()}
    surface = replace(TABLE["T48"], **numbers)
    field = ground(relief(surface, pixels=392).height_um, surface.stiffness_N_mm)
    drive = drive_of(SteadyHand(300.0, 3.6), field, 64 * 400)
    ridden = ride(drive, at_rest(drive, law(surface)), law(surface), 64)
    assert all(np.isfinite(values).all() for values in vars(ridden).values())
    assert ridden.normal.min() >= 0 and ridden.normal.max() < 2000
    # At most what the force sinks in, and no higher than the highest point throws the tip.
    assert np.abs(ridden.states[0]).max() < 0.02 + 3.6 / law(surface).stiffness


def test_the_free_hand_stays_in_bounds_pauses_and_ends_at_rest():
    hand, t_s = free_hand(60.0, "bounds"), np.arange(0, 62, 1e-3)
    motion = hand.at(t_s)
    speed = np.hypot(*motion.velocity)
    assert np.abs(motion.place).max() <= REACH_MM and speed.max() < 300 and 40 < np.median(speed) < 150
    pauses = np.diff((speed[1000:59_000] < 0.5).astype(int)).clip(0).sum()
    assert 5 <= pauses <= 9
    down = motion.force[1000:59_000]
    assert down.min() >= FORCE_N[0] and down.max() <= FORCE_N[1] and np.ptp(down) > 1.5
    assert (motion.force[60_000:] == 0).all() and speed[60_000:].max() == 0
    assert np.gradient(motion.place[0], t_s)[1:-1] == pytest.approx(motion.velocity[0, 1:-1], abs=0.02)
    assert np.gradient(motion.velocity[0], t_s)[1:-1] == pytest.approx(motion.turn[0, 1:-1], abs=25)
