"""The scene: one act seen by every sensor, in pieces that fit, the same again, at rest when it is over."""

from itertools import islice

import numpy as np
import pytest

from palpate.devices.surfaces.act import BATCH, KEPT
from palpate.devices.surfaces.contact import INTERNAL_HZ
from palpate.devices.surfaces.hand import REACH_MM, SteadyHand
from palpate.devices.surfaces.rates import at_rate
from palpate.devices.surfaces.relief import relief
from palpate.devices.surfaces.scene import SurfaceScene, first_rows
from palpate.devices.surfaces.table import SurfaceDataError, read_surfaces
from palpate.devices.surfaces.tool import LEAN, SENSOR_ABOVE_TIP_M, ground

TABLE = read_surfaces()
SENSORS = (("acceleration_m_s2", 3000.0), ("wrench", 8000.0), ("position_mm", 120.0))


@pytest.fixture(scope="module")
def under():
    surface = TABLE["T24"]
    return ground(relief(surface, pixels=392).height_um, surface.stiffness_N_mm)


def scene_of(under, seconds=4.0, *key, **more):
    return SurfaceScene(TABLE["T24"], seconds, *(key or ("scene",)), under=under, **more)


@pytest.mark.parametrize("rate_hz", [80.0, 120.0, 1000.0, 2999.85, 3000.0, 8000.0, 10_000.0])
def test_pieces_are_the_whole_cut_up(rate_hz):
    """However the signal comes in pieces, what is read at a rate is the same."""
    noise = np.random.default_rng(1).normal(size=(60_000, 2)).cumsum(axis=0)
    rows = int(5 * rate_hz)
    whole = first_rows(at_rate(iter([noise]), INTERNAL_HZ, rate_hz), rows)
    cuts = np.sort(np.random.default_rng(2).integers(1, len(noise), 40))
    parts = first_rows(at_rate(iter(np.split(noise, cuts)), INTERNAL_HZ, rate_hz), rows)
    assert np.abs(whole - parts).max() < 1e-9 * np.abs(noise).max()


@pytest.mark.parametrize(("rate_hz", "hertz"), [(120.0, 20.0), (1000.0, 300.0), (3000.0, 900.0), (8000.0, 1500.0)])
def test_a_tone_in_the_band_passes_and_one_above_it_does_not(rate_hz, hertz):
    t_s = np.arange(60_000) / INTERNAL_HZ
    rows, inside = int(4 * rate_hz), slice(int(rate_hz), None)
    passed = first_rows(at_rate(iter([np.sin(2 * np.pi * hertz * t_s)[:, None]]), INTERNAL_HZ, rate_hz), rows)[
        inside, 0
    ]
    truth = np.sin(2 * np.pi * hertz * np.arange(rows) / rate_hz)[inside]
    assert np.abs(passed - truth).max() < 3e-3
    above = min(0.7 * rate_hz, 3000.0)
    gone = first_rows(at_rate(iter([np.sin(2 * np.pi * above * t_s)[:, None]]), INTERNAL_HZ, rate_hz), rows)[inside]
    assert np.abs(gone).max() < 1e-3


def test_every_sensor_sees_the_same_act_again_and_another_key_another(under):
    scene, again, other = scene_of(under), scene_of(under), scene_of(under, 4.0, "other")
    for name, rate_hz in SENSORS:
        rows = int(4 * rate_hz)
        one, two, three = (first_rows(getattr(one_scene, name)(rate_hz), rows) for one_scene in (scene, again, other))
        assert (one == two).all() and not np.allclose(one, three)
        assert np.isfinite(one).all() and one.shape == (rows, 6 if name == "wrench" else 3)


def test_a_batch_that_was_dropped_is_computed_again_the_same(under):
    act = scene_of(under, 45.0)._act
    first = act.batch(0)
    act.batch(KEPT)
    assert 0 not in act.made and len(act.made) == KEPT
    again = act.batch(0)
    assert all((one == two).all() for one, two in zip(vars(first).values(), vars(again).values(), strict=True))


def test_no_click_where_batches_meet(under):
    """A scene's second batch begins where the first ended: across the seam nothing jumps more than elsewhere."""
    act = scene_of(under, 20.0)._act
    one, two = act.batch(0), act.batch(1)
    for name in ("acceleration", "force", "place"):
        joined = np.concatenate([getattr(one, name)[-5000:], getattr(two, name)[:5000]])
        jumps = np.abs(np.diff(joined, axis=0))
        assert (jumps[4999] <= jumps.max(axis=0)).all() and (jumps[4999] < 12 * np.median(jumps, axis=0) + 1e-9).all()


def test_the_sensors_agree_with_each_other(under):
    scene = scene_of(under, 8.0)
    wrench, place = first_rows(scene.wrench(1000.0), 8000), first_rows(scene.position_mm(120.0), 960)
    acceleration = first_rows(scene.acceleration_m_s2(1000.0), 8000)
    assert np.abs(place[:, :2]).max() < REACH_MM + 3
    velocity = np.gradient(place[:, :2], 1 / 120, axis=0)
    friction = wrench[(np.arange(960) * 1000 / 120).round().astype(int).clip(0, 7999), :2]
    moving = np.hypot(*velocity.T) > 20
    assert np.corrcoef(velocity[moving, 0], friction[moving, 0])[0, 1] < -0.5
    # The tip sinks into soft stuff under the force: deeper where it is pressed harder.
    assert np.corrcoef(place[moving, 2], wrench[(np.arange(960) * 1000 / 120).astype(int), 2][moving])[0, 1] < 0
    assert wrench[:, 3:] == pytest.approx(
        np.cross(-SENSOR_ABOVE_TIP_M * np.array(LEAN) * [-1, -1, 1], wrench[:, :3]), abs=1e-9
    )
    assert acceleration.mean(axis=0) == pytest.approx(9.80665 * np.array(LEAN), abs=0.6)


def test_rest_follows_the_act(under):
    scene = scene_of(under, 2.0)
    wrench, place = first_rows(scene.wrench(1000.0), 30_000)[2600:], first_rows(scene.position_mm(120.0), 3600)[320:]
    acceleration = first_rows(scene.acceleration_m_s2(1000.0), 30_000)[2600:]
    assert np.abs(wrench).max() < 1e-3 and np.ptp(place, axis=0).max() < 1e-3
    assert np.ptp(acceleration, axis=0).max() < 0.02
    assert np.linalg.norm(acceleration[-1]) == pytest.approx(9.80665, rel=0.1)


@pytest.mark.long
def test_memory_holds_three_batches_however_long_the_act_is(under):
    scene = scene_of(under, 100.0)
    for _ in islice(scene.position_mm(120.0), int(50 / 0.25)):
        pass
    held = scene._act.made
    assert len(held) == KEPT and sum(values.nbytes for batch in held.values() for values in vars(batch).values()) < 15e6
    assert all(len(batch.force) == BATCH for batch in held.values())


@pytest.mark.long
def test_one_sensor_may_run_ahead_of_another(under):
    scene = scene_of(under, 45.0)
    ahead = first_rows(scene.position_mm(120.0), 5400)
    assert 0 not in scene._act.made and len(ahead) == 5400
    assert len(first_rows(scene.wrench(100.0), 100)) == 100


@pytest.mark.parametrize("seconds", [0.0, 86_401.0, float("nan"), float("inf")])
def test_a_duration_out_of_range_is_refused(under, seconds):
    with pytest.raises(SurfaceDataError, match="from 0.1 to 86400 s"):
        scene_of(under, seconds)


@pytest.mark.parametrize("rate_hz", [0.0, float("nan"), 1e6])
def test_a_rate_out_of_range_is_refused(under, rate_hz):
    with pytest.raises(SurfaceDataError, match="samples a second"):
        scene_of(under).position_mm(rate_hz)


def test_a_steady_hand_keeps_its_speed_and_force(under):
    scene = scene_of(under, 4.0, hand=SteadyHand(80.0, 1.5))
    place, wrench = first_rows(scene.position_mm(120.0), 480), first_rows(scene.wrench(1000.0), 4000)
    assert np.hypot(*np.diff(place[60:420, :2], axis=0).T).mean() * 120 == pytest.approx(80, rel=0.02)
    assert wrench[500:3900, 2].mean() == pytest.approx(1.5, rel=0.03)
