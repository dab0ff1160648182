"""Slides in the layout of the Cluster Haptic Texture Dataset."""

import numpy as np

from tests.modeling.textures.textures_for_tests import vibration

SECONDS = 1.5


def times(rate, seconds=SECONDS, seed=0):
    n = round(rate * seconds)
    return 0.001 + (np.arange(n) + np.random.default_rng(seed).uniform(-0.25, 0.25, n)) / rate


def write(path, header, *columns, form="%.9f"):
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="", fmt=form)


def slide(root, stem="0_135_40_500_0", speed=40.0, force=0.5, felt=None, rates=(6000.0, 6000.0, 100.0)):
    felt_s, pressed_s, placed_s = (times(rate) for rate in rates)
    resting = np.array([0.02, 0.05, -0.96])
    if felt is None:
        felt = 0.1 * np.stack([vibration(len(felt_s), seed) for seed in range(3)], axis=1) + resting
    write(root / "sensor_data" / "accel" / f"{stem}.csv", "time,X,Y,Z", felt_s, felt)
    write(root / "sensor_data" / "force" / f"{stem}.csv", "time,force", pressed_s, force + 0 * pressed_s)
    placed = np.maximum(placed_s - 0.2, 0.0) * speed
    write(root / "sensor_data" / "position" / f"{stem}.csv", "time,X,Y", placed_s, placed, 45.0 - 0 * placed_s)
    return felt
